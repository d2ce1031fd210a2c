//! Least squares of the distances between points and circle.
//!
//! The best radius for a given centre is the mean distance, so only the centre is searched: Newton's method
//! on f(c) = ½Σ(d − d̄)², with the exact Hessian (quadratic convergence whatever the noise), made positive by a
//! Levenberg–Marquardt shift where it is not. With e = d − d̄ and n the unit vector from centre to point:
//!
//! ∇f = −Σ e n,  ∇²f = N·1 − d̄ Σ(1/d)(1 − nnᵀ) − (Σn)(Σn)ᵀ/N.
use super::algebraic::hyper;
use super::lanes::{Four, Lanes, Terms, sums};
use super::moments::Moments;
use super::points::{Merge, Part, Points, Walk};
use super::{Circle, CircleError};
use num_traits::Float;

/// Most passes over the points.
const MAX_PASSES: usize = 100;
/// Steps shorter than this share of the radius are below what anything can measure.
const TINY_STEP: f64 = 1e-13;
/// A radius this many times the spread of the points is a line.
const LINE: f64 = 1e8;

/// Why a geometric fit stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stop {
    /// The last step, or the bound on the next one by the law of quadratic convergence, is below 1e-13 of the radius.
    Converged,
    /// No step lowers the sum of squares further: the limit of the digits (or a saddle of it).
    NoImprovement,
    /// 100 passes were not enough; the circle is the best one seen.
    PassLimit,
}

/// A fitted circle and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CircleFit {
    /// The circle.
    pub circle: Circle,
    /// Covariance of (centre x, centre y, radius) from the scatter of the points, for independent errors;
    /// `None` with three points. By the observed information (full Hessian), which differs from the
    /// Jacobian's JᵀJ by the order of rms/radius. It says nothing of the spread between runs.
    pub covariance: Option<[[f64; 3]; 3]>,
    /// Sum of squared distances between points and circle.
    pub rss: f64,
    /// Root of `rss` over the number of points.
    pub rms: f64,
    /// Number of points.
    pub points: usize,
    /// Passes over all points.
    pub passes: usize,
    /// Why it stopped.
    pub stopped: Stop,
}

impl CircleFit {
    /// Standard error of the radius, `None` with three points.
    pub fn radius_se(&self) -> Option<f64> {
        self.covariance.map(|c| Float::sqrt(c[2][2]))
    }
}

/// Sums of one pass: e = d − r, n = (p, q), w = 1/d.
#[derive(Clone, Copy, Default)]
struct Sums {
    count: usize,
    of: [f64; 9],
}

impl Merge for Sums {
    fn merge(&mut self, other: &Self) {
        self.count += other.count;
        for (a, b) in self.of.iter_mut().zip(&other.of) {
            *a += b;
        }
    }
}

/// A pass about a circle whose centre is given from `origin`.
struct About {
    origin: [f64; 2],
    centre: [f64; 2],
    radius: f64,
}

impl Part for About {
    type Sum = Sums;

    #[inline(always)]
    fn of<L: Lanes>(&self, lanes: L, x: &[f64], y: &[f64]) -> Sums {
        Sums {
            count: x.len(),
            of: sums(lanes, x, y, self),
        }
    }
}

impl Terms<9> for About {
    #[inline(always)]
    fn of<L: Lanes>(&self, lanes: L, x: L::Four, y: L::Four) -> [L::Four; 9] {
        let u = (x - lanes.splat(self.origin[0])) - lanes.splat(self.centre[0]);
        let v = (y - lanes.splat(self.origin[1])) - lanes.splat(self.centre[1]);
        let d = (u * u + v * v).sqrt();
        // A point on the centre has no direction; keep its 1/d finite.
        let w = lanes.splat(1.0) / d.max(lanes.splat(1e-9 * self.radius));
        let (p, q, e) = (u * w, v * w, d - lanes.splat(self.radius));
        let wp = w * p;
        [e, e * e, p, q, e * p, e * q, w, wp * p, wp * q]
    }
}

/// A step of the centre.
struct Step {
    by: [f64; 2],
    length: f64,
    /// Neither shortened nor bent: quadratic convergence holds.
    newton: bool,
}

/// What one pass tells about f at a centre.
#[derive(Clone, Copy)]
struct Surface {
    count: usize,
    /// Best radius, d̄.
    radius: f64,
    /// Σ(d − d̄)².
    rss: f64,
    /// Mean unit vector.
    mean_normal: [f64; 2],
    gradient: [f64; 2],
    /// xx, xy, yy.
    hessian: [f64; 3],
}

impl Surface {
    fn at(points: &(impl Points + ?Sized), walk: Walk, about: &About) -> Self {
        let Sums {
            count,
            of: [e, ee, p, q, ep, eq, w, wpp, wpq],
        } = points.sum(walk, about);
        let n = count as f64;
        let mean_e = e / n;
        let best = about.radius + mean_e;
        Self {
            count,
            radius: best,
            rss: (ee - mean_e * e).max(0.0),
            mean_normal: [p / n, q / n],
            gradient: [mean_e * p - ep, mean_e * q - eq],
            hessian: [
                n - best * (w - wpp) - p * p / n,
                best * wpq - p * q / n,
                n - best * wpp - q * q / n,
            ],
        }
    }

    /// Number of points as a number.
    fn n(&self) -> f64 {
        self.count as f64
    }

    /// Eigenvalues of the Hessian, the smaller first.
    fn curvatures(&self) -> [f64; 2] {
        let [xx, xy, yy] = self.hessian;
        let (half_sum, half_difference) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        let spread = Float::sqrt(half_difference * half_difference + xy * xy);
        [half_sum - spread, half_sum + spread]
    }

    /// Step that minimises the quadratic model, its Hessian raised by `shift`·N and by what makes it positive.
    fn step(&self, shift: f64) -> Step {
        let [smallest, largest] = self.curvatures();
        let floor = 1e-14 * self.n();
        let convex = smallest > floor;
        let positive = Float::abs(smallest) + 0.05 * (largest - smallest) - smallest + floor;
        let raise = shift * self.n() + if convex { 0.0 } else { positive };
        let [xx, xy, yy] = self.hessian;
        let (xx, yy) = (xx + raise, yy + raise);
        let determinant = xx * yy - xy * xy;
        let [gx, gy] = self.gradient;
        let by = [
            (xy * gy - yy * gx) / determinant,
            (xy * gx - xx * gy) / determinant,
        ];
        let length = Float::hypot(by[0], by[1]);
        // A flat model reaches for the horizon; half a radius keeps to the valley that the start is in.
        let cut = 0.5 * self.radius / length;
        if cut < 1.0 {
            return Step {
                by: by.map(|s| s * cut),
                length: length * cut,
                newton: false,
            };
        }
        Step {
            by,
            length,
            newton: convex && shift == 0.0,
        }
    }

    /// Bound on the next Newton step after one of `length`: |f‴| ≤ 3N/d of each point, so the gradient left is below
    /// 3N·length²/2r, here with room for points at half the radius and twice as much again.
    fn next_step(&self, length: f64) -> f64 {
        6.0 * self.n() * length * length / (self.radius * self.curvatures()[0])
    }

    fn covariance(&self, rss: f64) -> Option<[[f64; 3]; 3]> {
        let free = self.n() - 3.0;
        if free < 0.5 {
            return None;
        }
        let variance = rss / free;
        let [xx, xy, yy] = self.hessian;
        let determinant = xx * yy - xy * xy;
        let inverse = [
            [yy / determinant, -xy / determinant],
            [-xy / determinant, xx / determinant],
        ];
        let m = self.mean_normal;
        let cross: [f64; 2] =
            core::array::from_fn(|i| -(inverse[i][0] * m[0] + inverse[i][1] * m[1]));
        let radius = 1.0 / self.n() - (cross[0] * m[0] + cross[1] * m[1]);
        Some([
            [
                variance * inverse[0][0],
                variance * inverse[0][1],
                variance * cross[0],
            ],
            [
                variance * inverse[1][0],
                variance * inverse[1][1],
                variance * cross[1],
            ],
            [variance * cross[0], variance * cross[1], variance * radius],
        ])
    }

    /// The fit that ends here, of this `[radius, rss]`.
    fn report(
        &self,
        centre: [f64; 2],
        [radius, rss]: [f64; 2],
        passes: usize,
        stopped: Stop,
    ) -> CircleFit {
        CircleFit {
            circle: Circle { centre, radius },
            covariance: self.covariance(rss),
            rss,
            rms: Float::sqrt(rss / self.n()),
            points: self.count,
            passes,
            stopped,
        }
    }
}

/// Refines a circle to the least-squares one. `moments` are those of `points`, or of a fair sample of them: they give the
/// origin, the scale, and whether the points are degenerate. `start` is any circle near them, for instance [`hyper`]'s.
///
/// # Errors
/// [`CircleError`] for fewer than three points, points that coincide or are not finite, and points for which
/// the best circle is a line.
pub fn refine(
    points: &(impl Points + ?Sized),
    moments: &Moments,
    start: Circle,
) -> Result<CircleFit, CircleError> {
    refine_walk(Walk::ALL, points, moments, start)
}

/// [`refine`] by some of the points.
pub(super) fn refine_walk(
    walk: Walk,
    points: &(impl Points + ?Sized),
    moments: &Moments,
    start: Circle,
) -> Result<CircleFit, CircleError> {
    // Tells degenerate sets by their own error, whatever the start.
    hyper(moments)?;
    let origin = moments.mean;
    let spread = Float::sqrt((moments.xx + moments.yy) / moments.count as f64);
    let surface = |centre: [f64; 2], radius: f64| {
        Surface::at(
            points,
            walk,
            &About {
                origin,
                centre,
                radius,
            },
        )
    };
    let mut centre = [start.centre[0] - origin[0], start.centre[1] - origin[1]];
    let mut here = surface(centre, start.radius);
    let (mut passes, mut shift) = (1, 0.0);
    let report = |centre: [f64; 2], at: &Surface, size: [f64; 2], passes, stopped| {
        let centre = [origin[0] + centre[0], origin[1] + centre[1]];
        at.report(centre, size, passes, stopped)
    };
    loop {
        if !here.rss.is_finite() || !here.radius.is_finite() {
            return Err(CircleError::NonFinite);
        }
        if here.radius >= LINE * spread {
            return Err(CircleError::Collinear);
        }
        let Step {
            by: step,
            length,
            newton,
        } = here.step(shift);
        let to = [centre[0] + step[0], centre[1] + step[1]];
        let next = length.min(here.next_step(length));
        if newton && length <= 1e-6 * here.radius && next <= TINY_STEP * here.radius {
            // The quadratic model is exact here to the cube of the step, below the digits: no further pass.
            let radius =
                here.radius - (here.mean_normal[0] * step[0] + here.mean_normal[1] * step[1]);
            let rss = (here.rss + here.gradient[0] * step[0] + here.gradient[1] * step[1]).max(0.0);
            return Ok(report(to, &here, [radius, rss], passes, Stop::Converged));
        }
        if passes >= MAX_PASSES {
            let size = [here.radius, here.rss];
            return Ok(report(centre, &here, size, passes, Stop::PassLimit));
        }
        let there = surface(to, here.radius);
        passes += 1;
        if there.rss <= here.rss {
            (centre, here) = (to, there);
            shift = if shift < 1e-6 { 0.0 } else { shift * 0.1 };
        } else if length <= 1e-7 * here.radius || shift > 1e12 {
            // Rounding of the sums, not shape, decides which is lower.
            let size = [here.radius, here.rss];
            return Ok(report(centre, &here, size, passes, Stop::NoImprovement));
        } else {
            shift = (shift * 10.0).max(1e-4);
        }
    }
}
