//! Derivatives of closed forms along a path, by Taylor arithmetic: exact, without differences, bounded in time.
use super::{Real, Scalar};
use core::array;
use core::ops::{Add, Div, Mul, Neg, Sub};
use num_traits::Float;

/// A quantity along a path, up to its fourth derivative: Taylor coefficients `f⁽ⁿ⁾/n!`.
///
/// ```
/// use giotto_shared::kinematics::{Jet, Scalar};
///
/// // sin(ωt) at t = 0 with ω = 3: derivatives 0, 3, 0, −27, 0.
/// let (sine, _) = Jet::new([0.0_f64, 3.0, 0.0, 0.0, 0.0]).sine_cosine();
/// assert_eq!(sine.derivatives(), [0.0, 3.0, 0.0, -27.0, 0.0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet<T>([T; 5]);

/// A small whole number.
fn whole<T: Float>(n: u8) -> T {
    (0..n).fold(T::zero(), |sum, _| sum + T::one())
}

impl<T: Float> Jet<T> {
    /// From the value and its first to fourth derivative.
    pub fn new([f, d1, d2, d3, d4]: [T; 5]) -> Self {
        Self([f, d1, d2 / whole(2), d3 / whole(6), d4 / whole(24)])
    }

    /// The value and its first to fourth derivative.
    pub fn derivatives(self) -> [T; 5] {
        let [a0, a1, a2, a3, a4] = self.0;
        [a0, a1, a2 * whole(2), a3 * whole(6), a4 * whole(24)]
    }
}

impl<T: Float> Add for Jet<T> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let ([a0, a1, a2, a3, a4], [b0, b1, b2, b3, b4]) = (self.0, other.0);
        Self([a0 + b0, a1 + b1, a2 + b2, a3 + b3, a4 + b4])
    }
}

impl<T: Float> Neg for Jet<T> {
    type Output = Self;
    fn neg(self) -> Self {
        Self(self.0.map(Neg::neg))
    }
}

impl<T: Float> Sub for Jet<T> {
    type Output = Self;
    #[allow(clippy::suspicious_arithmetic_impl, reason = "a − b = a + (−b)")]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl<T: Float> Mul for Jet<T> {
    type Output = Self;
    /// Leibniz' rule.
    fn mul(self, other: Self) -> Self {
        let ([a0, a1, a2, a3, a4], [b0, b1, b2, b3, b4]) = (self.0, other.0);
        Self([
            a0 * b0,
            a0 * b1 + a1 * b0,
            a0 * b2 + a1 * b1 + a2 * b0,
            a0 * b3 + a1 * b2 + a2 * b1 + a3 * b0,
            a0 * b4 + a1 * b3 + a2 * b2 + a3 * b1 + a4 * b0,
        ])
    }
}

impl<T: Float> Div for Jet<T> {
    type Output = Self;
    /// c with c·b = a, one coefficient after the other.
    fn div(self, other: Self) -> Self {
        let ([a0, a1, a2, a3, a4], [b0, b1, b2, b3, b4]) = (self.0, other.0);
        let of_b0 = b0.recip();
        let c0 = a0 * of_b0;
        let c1 = (a1 - b1 * c0) * of_b0;
        let c2 = (a2 - b1 * c1 - b2 * c0) * of_b0;
        let c3 = (a3 - b1 * c2 - b2 * c1 - b3 * c0) * of_b0;
        let c4 = (a4 - b1 * c3 - b2 * c2 - b3 * c1 - b4 * c0) * of_b0;
        Self([c0, c1, c2, c3, c4])
    }
}

impl<T: Real> Scalar for Jet<T> {
    type Base = T;

    fn constant(value: T) -> Self {
        let zero = T::zero();
        Self([value, zero, zero, zero, zero])
    }

    fn value(self) -> T {
        let [value, ..] = self.0;
        value
    }

    /// c with c² = a.
    fn root(self) -> Self {
        let [a0, a1, a2, a3, a4] = self.0;
        let c0 = a0.sqrt();
        let half = (c0 + c0).recip();
        let c1 = a1 * half;
        let c2 = (a2 - c1 * c1) * half;
        let c3 = (a3 - c1 * c2 - c2 * c1) * half;
        let c4 = (a4 - c1 * c3 - c2 * c2 - c3 * c1) * half;
        Self([c0, c1, c2, c3, c4])
    }

    /// s′ = c·a′, c′ = −s·a′.
    fn sine_cosine(self) -> (Self, Self) {
        let [a0, a1, a2, a3, a4] = self.0;
        let (d1, d2, d3) = (a2 * whole(2), a3 * whole(3), a4 * whole(4));
        let (s0, c0) = a0.sine_cosine();
        let (s1, c1) = (c0 * a1, -(s0 * a1));
        let half = whole::<T>(2).recip();
        let (s2, c2) = ((c1 * a1 + c0 * d1) * half, -(s1 * a1 + s0 * d1) * half);
        let third = whole::<T>(3).recip();
        let (s3, c3) = (
            (c2 * a1 + c1 * d1 + c0 * d2) * third,
            -(s2 * a1 + s1 * d1 + s0 * d2) * third,
        );
        let quarter = half * half;
        let (s4, c4) = (
            (c3 * a1 + c2 * d1 + c1 * d2 + c0 * d3) * quarter,
            -(s3 * a1 + s2 * d1 + s1 * d2 + s0 * d3) * quarter,
        );
        (Self([s0, s1, s2, s3, s4]), Self([c0, c1, c2, c3, c4]))
    }

    /// φ′ = (x·y′ − y·x′)/(x² + y²).
    fn angle(self, y: Self) -> Self {
        let rate = (self * y.rate() - y * self.rate()) / (self * self + y * y);
        let [r0, r1, r2, r3, _] = rate.0;
        Self([
            y.value().atan2(self.value()),
            r0,
            r1 / whole(2),
            r2 / whole(3),
            r3 / whole(4),
        ])
    }
}

impl<T: Float> Jet<T> {
    /// The derivative, whose own fourth is not known: 0.
    fn rate(self) -> Self {
        let [_, a1, a2, a3, a4] = self.0;
        Self([a1, a2 * whole(2), a3 * whole(3), a4 * whole(4), T::zero()])
    }
}

/// Three coordinates along a path, from their values and derivatives by order.
pub fn path<T: Float>(derivatives: &[[T; 3]; 5]) -> [Jet<T>; 3] {
    let [p, v, a, j, s] = derivatives;
    array::from_fn(|axis| {
        let of = |d: &[T; 3]| d.get(axis).copied().unwrap_or_else(T::zero);
        Jet::new([of(p), of(v), of(a), of(j), of(s)])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every operation against series that are known: e^{at} has the coefficients aⁿ/n!.
    #[test]
    fn operations_are_those_of_taylor_series() {
        let exp = |a: f64| Jet::new([1.0, a, a * a, a.powi(3), a.powi(4)]);
        let near = |a: Jet<f64>, b: Jet<f64>| {
            for (a, b) in a.0.into_iter().zip(b.0) {
                assert!((a - b).abs() < 1e-12, "{a} {b}");
            }
        };
        near(exp(2.0) * exp(-0.7), exp(1.3));
        near(exp(2.0) / exp(-0.7), exp(2.7));
        near(exp(1.4).root(), exp(0.7));
        near(exp(0.4) - exp(0.4), Jet::constant(0.0));
        // The angle of r·(cos φ, sin φ), whatever r does.
        let angle = Jet::new([0.7, 1.1, -2.0, 3.0, 5.0]);
        let (sine, cosine) = angle.sine_cosine();
        near(sine * sine + cosine * cosine, Jet::constant(1.0));
        near((exp(0.3) * cosine).angle(exp(0.3) * sine), angle);
    }
}
