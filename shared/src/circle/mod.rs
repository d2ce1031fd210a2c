//! Circles through measured points.
//!
//! [`fit`] is what most callers want: one pass of [`Moments`], the algebraic [`hyper`] circle as the start,
//! then Newton steps on the geometric distances. Everything is centred on the data, so a 100 mm circle
//! 100 m from the origin is fitted as well as one at the origin.
//!
//! | file | holds |
//! |---|---|
//! | `points` | [`Points`]: what can be walked again and again, in blocks |
//! | `lanes` | sums over points, four at a time; [`Lanes`]: what a processor has for that |
//! | `moments` | [`Moments`]: centred, mergeable, one pass |
//! | `algebraic` | [`kasa`] and [`hyper`]: closed circles from moments |
//! | `geometric` | [`refine`]: least squares of the distances, with a report |
//! | `scatter` | [`Scatter`]: moments of points in space, mergeable, one pass |
//! | `plane` | [`Plane`] of 3-D points, projection, tilt, flatness |
mod algebraic;
mod geometric;
mod lanes;
mod moments;
mod plane;
mod points;
mod scatter;
#[cfg(test)]
mod tests;

pub use algebraic::{hyper, kasa};
use geometric::refine_walk;
pub use geometric::{CircleFit, Stop, refine};
pub use lanes::{Four, Lanes, Portable};
pub use moments::Moments;
pub use plane::Plane;
pub use points::{BLOCK, Merge, Part, Points, Sampled, Walk, Xy, sum_blocks};
pub use scatter::Scatter;

use core::fmt;

/// A circle in the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle {
    /// Centre, m (or whatever unit the points have).
    pub centre: [f64; 2],
    /// Radius, same unit.
    pub radius: f64,
}

/// Why no circle (or plane) can be fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CircleError {
    /// Fewer than three points.
    TooFew {
        /// Number of points given.
        points: usize,
    },
    /// All points are one point, as far as their digits tell.
    Coincident,
    /// The points lie on a line, or their arc is too flat to tell from one.
    Collinear,
    /// A coordinate is NaN, infinite, or so large that its fourth power overflows (beyond about 1e75).
    NonFinite,
    /// x and y differ in length.
    Lengths {
        /// Number of x.
        x: usize,
        /// Number of y.
        y: usize,
    },
}

impl fmt::Display for CircleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFew { points } => write!(f, "a circle needs at least 3 points, got {points}"),
            Self::Coincident => f.write_str("all points coincide"),
            Self::Collinear => f.write_str("the points lie on a line"),
            Self::NonFinite => f.write_str("a coordinate is not a finite number of sensible size"),
            Self::Lengths { x, y } => write!(f, "{x} x coordinates but {y} y coordinates"),
        }
    }
}

impl core::error::Error for CircleError {}

/// Points that are enough for a start: at a noise of 1e-5 of the radius one Newton step from their circle is the end.
const FEW: usize = 131_072;
/// The few are taken in runs of this length: memory comes in lines and pages, while the form of a circle wants many runs.
const RUN: usize = 64;
/// From this many points on a fit starts from some [`FEW`] of them instead of the algebraic circle of all: two passes
/// over all points are saved out of three.
const MANY: usize = 6 * FEW;

/// Least-squares circle: minimises the sum of squared distances between points and circle.
///
/// # Errors
/// [`CircleError`] for fewer than three points, coincident or collinear points, or a coordinate that is not finite.
///
/// ```
/// use giotto_shared::circle::{fit, CircleError};
///
/// // Four points of the circle of radius 5 about (1, 2).
/// let fitted = fit([[6.0, 2.0], [1.0, 7.0], [-4.0, 2.0], [4.0, 6.0]].as_slice())?;
/// assert!((fitted.circle.radius - 5.0).abs() < 1e-12);
/// assert!((fitted.circle.centre[1] - 2.0).abs() < 1e-12);
/// // Points on a line have no circle, and the error says so.
/// let line = fit([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]].as_slice());
/// assert_eq!(line, Err(CircleError::Collinear));
/// # Ok::<(), CircleError>(())
/// ```
pub fn fit(points: &(impl Points + ?Sized)) -> Result<CircleFit, CircleError> {
    if points.count() >= MANY {
        let few = Walk::some(RUN, points.count() / (FEW / RUN));
        let moments = Moments::of_walk(few, points);
        // Whatever is odd about the few is left to all of them to show.
        if let Ok(start) =
            hyper(&moments).and_then(|start| refine_walk(few, points, &moments, start))
            && let Ok(fit) = refine(points, &moments, start.circle)
        {
            return Ok(fit);
        }
    }
    fit_all(points)
}

/// As [`fit`], from the algebraic circle of all points.
fn fit_all(points: &(impl Points + ?Sized)) -> Result<CircleFit, CircleError> {
    let moments = Moments::of(points);
    let start = hyper(&moments)?;
    refine(points, &moments, start)
}
