//! Effects to hide: what they do to a machine, what they are called, how large they truly are.
mod case;
mod hidden;
mod keep;
mod laws;
mod listed;
mod strength;
mod unlisted;

pub use case::{Case, Kind, Null, Truth};
pub use hidden::{Hidden, left_um};
pub use keep::Keep;
pub use laws::{OTHER_LAWS, other_law};
pub use listed::{LISTED, listed, listed_on};
pub use strength::{misfit_m, scaled};
pub use unlisted::{UNLISTED, unlisted};

use crate::machine::{Machine, Plan};

/// The slides that an effect may sit on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slides {
    /// Two of a plane, in the order of its angle: what belongs to a pair belongs to these.
    pub pair: [usize; 2],
    /// The one that an effect of one slide sits on; `None`: drawn from the pair.
    pub axis: Option<usize>,
}

impl Slides {
    /// X and Y.
    pub const XY: Self = Self {
        pair: [0, 1],
        axis: None,
    };
}

/// Puts an effect of a given size into a machine.
type Apply = Box<dyn Fn(&mut Machine, f64) + Send + Sync>;
/// True value in the contract's unit: of the finished machine, on this plan, for two slides.
type Value = Box<dyn Fn(&Machine, &Plan, [usize; 2]) -> f64 + Send + Sync>;

/// What an effect belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seat {
    /// The machine as a whole.
    Whole,
    /// One slide: 0 X, 1 Y, 2 Z.
    Slide(usize),
    /// Two slides.
    Pair([usize; 2]),
    /// One joint, from 0.
    Joint(usize),
}

/// One error that can be hidden. Its size is a positive number that the misfit grows with; what the size
/// means is known to `apply` alone.
pub struct Effect {
    /// Name of the case.
    pub name: &'static str,
    /// Causes that count as right; with `~`: physically there too; empty: outside the list.
    pub accept: Vec<&'static str>,
    /// What it belongs to.
    pub seat: Seat,
    /// Unit of the true value.
    pub unit: &'static str,
    /// Puts it into a machine.
    pub apply: Apply,
    /// True value.
    pub value: Value,
    /// A size to begin the search with.
    pub first: f64,
}
