//! Circles in closed form from moments.
//!
//! An algebraic circle A·z + B·x + C·y + D = 0 (z = x² + y²) minimises θᵀMθ, M the moment matrix, under a
//! constraint θᵀNθ = 1. [`kasa`] fixes A = 1: fastest, but it shrinks arcs. [`hyper`] uses the constraint of
//! Al-Sharadqah and Chernov (doi 10.1214/09-EJS419), which has no essential bias on arcs of any length.
use super::moments::Moments;
use super::{Circle, CircleError};
use num_traits::Float;

/// Below this ratio of the spreads across and along, points are a line: smaller ratios are lost in the
/// rounding of the moments (√ε ≈ 1.5e-8).
const FLAT: f64 = 1e-7;

/// Moments per point, scaled so that x̄² + ȳ² spread is 1.
struct Scaled {
    unit: f64,
    xx: f64,
    xy: f64,
    yy: f64,
    xz: f64,
    yz: f64,
    zz: f64,
}

impl Scaled {
    fn new(m: &Moments) -> Result<Self, CircleError> {
        if m.count < 3 {
            return Err(CircleError::TooFew { points: m.count });
        }
        if ![m.xx, m.xy, m.yy, m.xz, m.yz, m.zz, m.mean[0], m.mean[1]]
            .iter()
            .all(|v| v.is_finite())
        {
            return Err(CircleError::NonFinite);
        }
        let n = m.count as f64;
        let unit = Float::sqrt((m.xx + m.yy) / n);
        let digits = 4.0 * f64::EPSILON * Float::abs(m.mean[0]).max(Float::abs(m.mean[1]));
        if unit <= digits.max(f64::MIN_POSITIVE) {
            return Err(CircleError::Coincident);
        }
        let (second, third) = (1.0 / (unit * unit) / n, 1.0 / (unit * unit * unit) / n);
        if !second.is_finite() || !third.is_finite() {
            return Err(CircleError::Coincident);
        }
        let scaled = Self {
            unit,
            xx: m.xx * second,
            xy: m.xy * second,
            yy: m.yy * second,
            xz: m.xz * third,
            yz: m.yz * third,
            zz: m.zz * third / unit,
        };
        // The eigenvalues of the scatter add up to 1: the smaller one is about its determinant.
        if scaled.determinant() <= FLAT * FLAT {
            return Err(CircleError::Collinear);
        }
        Ok(scaled)
    }

    fn determinant(&self) -> f64 {
        self.xx * self.yy - self.xy * self.xy
    }

    /// Circle from its centre about the mean, in scaled units.
    fn circle(
        &self,
        m: &Moments,
        centre: [f64; 2],
        radius_squared: f64,
    ) -> Result<Circle, CircleError> {
        let radius = self.unit * Float::sqrt(radius_squared);
        let centre = [
            m.mean[0] + self.unit * centre[0],
            m.mean[1] + self.unit * centre[1],
        ];
        if radius.is_finite() {
            Ok(Circle { centre, radius })
        } else {
            Err(CircleError::Collinear)
        }
    }
}

/// Kåsa's circle: least squares of z − 2ax − 2by − c. Biased towards small circles on noisy arcs; kept as the
/// reference that everybody else computes.
///
/// # Errors
/// As [`fit`](super::fit).
pub fn kasa(m: &Moments) -> Result<Circle, CircleError> {
    let s = Scaled::new(m)?;
    let twice = 2.0 * s.determinant();
    let centre = [
        (s.yy * s.xz - s.xy * s.yz) / twice,
        (s.xx * s.yz - s.xy * s.xz) / twice,
    ];
    s.circle(
        m,
        centre,
        centre[0] * centre[0] + centre[1] * centre[1] + 1.0,
    )
}

/// The hyper-accurate algebraic circle.
///
/// About the mean the smallest non-negative root η of det(M − ηN) is a root of a quartic whose shape lets
/// Newton's method from 0 go to it from below; η is of the order of the noise variance, so 0 is close.
///
/// # Errors
/// As [`fit`](super::fit).
pub fn hyper(m: &Moments) -> Result<Circle, CircleError> {
    let s = Scaled::new(m)?;
    let determinant = s.determinant();
    let variance = s.zz - 1.0;
    let cross = s.xz * (s.xz * s.yy - s.yz * s.xy) + s.yz * (s.yz * s.xx - s.xz * s.xy);
    let c0 = cross - variance * determinant;
    let c1 = variance + 4.0 * determinant - s.xz * s.xz - s.yz * s.yz;
    let c2 = 4.0 * determinant - 3.0 - s.zz;
    let mut eta = 0.0;
    let mut value: f64 = c0;
    for _ in 0..40 {
        let slope = c1 + eta * (2.0 * c2 + 16.0 * eta * eta);
        let next = eta - value / slope;
        if !next.is_finite() || next == eta {
            break;
        }
        let next_value = c0 + next * (c1 + next * (c2 + 4.0 * next * next));
        if next_value.abs() >= value.abs() {
            break;
        }
        (eta, value) = (next, next_value);
    }
    let twice = 2.0 * (eta * eta - eta + determinant);
    let centre = [
        (s.xz * (s.yy - eta) - s.yz * s.xy) / twice,
        (s.yz * (s.xx - eta) - s.xz * s.xy) / twice,
    ];
    s.circle(
        m,
        centre,
        centre[0] * centre[0] + centre[1] * centre[1] + 1.0 - 2.0 * eta,
    )
}
