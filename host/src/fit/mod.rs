//! Fits of measured circles: least squares, stepwise selection, the radius model of the paper.
//!
//! | file | holds |
//! |---|---|
//! | `least_squares` | [`Triangle`], [`LeastSquares`]: Householder QR on centred, scaled columns (Eq. 2–3) |
//! | `by_radius` | runs by radius, each radius reduced once: fits on any of them are made of that |
//! | `reduced` | tall matrices to a triangle, block by block, without allocation |
//! | `stepwise` | [`stepwise`](stepwise()): enter and remove by partial F (Eq. 4–11, 17–19) |
//! | `quantile` | critical values of F and t |
//! | `circle` | the geometric circle fit on all cores |
//! | `simd_sums` | sums over points with the vectors that this processor has |
//! | `radius` | [`RadiusFit`]: β1, β2 with intervals (Eq. 15–16, 20–21), offsets, prediction of radii not used |
//! | `heldout` | how well circles that were not fitted are predicted |
//!
//! The run is the unit of replication here: each run gives one radius error, and the spread between runs is what
//! the intervals are made of.
mod by_radius;
mod circle;
mod heldout;
mod least_squares;
mod quantile;
mod radius;
mod reduced;
pub(crate) mod simd_sums;
mod stepwise;
#[cfg(test)]
#[allow(
    clippy::excessive_precision,
    reason = "reference numbers are quoted as published"
)]
mod tests;

pub use circle::{Parallel, fit_circle};
pub use heldout::Heldout;
pub use least_squares::{LeastSquares, Triangle};
pub use quantile::{critical_f, critical_t};
pub use radius::{Observation, Offset, Options, Part, Point, RadiusFit, TERMS};
pub use stepwise::{Action, PartialF, Selection, Step, StepwiseOptions, stepwise};

/// Why a fit is not possible.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// Fewer observations than the model has parameters, or none left to judge the scatter by.
    #[error("{observations} runs cannot determine {parameters} parameters and their scatter")]
    TooFew {
        /// Observations given.
        observations: usize,
        /// Parameters asked for.
        parameters: usize,
    },
    /// A column is zero or a combination of those before it.
    #[error("the runs cannot tell {column} from the other terms")]
    Collinear {
        /// Which one.
        column: String,
    },
    /// An observation is NaN or infinite.
    #[error("observation {index} of {column} is not a finite number")]
    NonFinite {
        /// Which column.
        column: String,
        /// Position, from 0.
        index: usize,
    },
    /// Columns of different length.
    #[error("{column} has {found} values where {expected} were expected")]
    Length {
        /// Which column.
        column: String,
        /// Length of the observations.
        expected: usize,
        /// Its own length.
        found: usize,
    },
    /// Significance outside (0, 1), or no degree of freedom.
    #[error("no critical value for significance {alpha} with {dof:?} degrees of freedom")]
    Quantile {
        /// α.
        alpha: f64,
        /// Degrees of freedom of numerator and denominator.
        dof: (usize, usize),
    },
    /// The radius to train on is not in the campaign.
    #[error(
        "no run has a radius of {wanted_mm} mm; the campaign has {} mm",
        listed(present_mm)
    )]
    NoSuchRadius {
        /// Asked for, mm.
        wanted_mm: f64,
        /// There, mm.
        present_mm: Vec<f64>,
    },
}

/// `50, 100, 150`.
fn listed(values: &[f64]) -> String {
    let all: Vec<String> = values.iter().map(f64::to_string).collect();
    all.join(", ")
}
