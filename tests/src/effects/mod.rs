//! Effects to hide: what they do to a machine, what they are called, how large they truly are.
mod case;
mod listed;
mod strength;
mod unlisted;

pub use case::{Case, Keep, Kind, Null, Truth};
pub use listed::{LISTED, listed};
pub use strength::{misfit_m, scaled};
pub use unlisted::{UNLISTED, unlisted};

use crate::machine::{Machine, Plan};

/// Puts an effect of a given size into a machine.
type Apply = Box<dyn Fn(&mut Machine, f64) + Send + Sync>;
/// True value in the contract's unit: of the finished machine, on this plan.
type Value = Box<dyn Fn(&Machine, &Plan) -> f64 + Send + Sync>;

/// One error that can be hidden. Its size is a positive number that the misfit grows with; what the size
/// means is known to `apply` alone.
pub struct Effect {
    /// Name of the case.
    pub name: &'static str,
    /// Causes that count as right; with `~`: physically there too; empty: outside the list.
    pub accept: Vec<&'static str>,
    /// Axis it belongs to: 0 X, 1 Y.
    pub axis: Option<usize>,
    /// Unit of the true value.
    pub unit: &'static str,
    /// Puts it into a machine.
    pub apply: Apply,
    /// True value.
    pub value: Value,
    /// A size to begin the search with.
    pub first: f64,
}
