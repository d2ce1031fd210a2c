//! The feed ramp: v(t) = v0 + Δv·S(t/T), S the smoothstep of degree 9.
//!
//! The compensator needs p″ and p⁗. A step in p⁗ would be a step of the commanded position, a kink in it a step of
//! the commanded velocity, so v needs four continuous derivatives: S is the least polynomial that has them
//! (S′ = 630 q⁴ with q = u(1 − u)).
use num_traits::Float;

/// S and its derivatives S′, S″, S‴ with respect to u, and ∫₀ᵘ S, at u in 0…1.
///
/// With q = u(1 − u), r = 1 − 2u: S′ = 630 q⁴, S″ = 2520 q³ r, S‴ = 2520 q² (3 − 14 q).
pub fn smoothstep<T: Float>(u: T) -> Smoothstep<T> {
    let n = |value: f64| T::from(value).unwrap_or_else(T::nan);
    let u = u.max(T::zero()).min(T::one());
    let q = u * (T::one() - u);
    let r = T::one() - u - u;
    let (q2, u2) = (q * q, u * u);
    let u5 = u2 * u2 * u;
    Smoothstep {
        integral: u5 * u * (n(21.0) + u * (n(-60.0) + u * (n(67.5) + u * (n(-35.0) + u * n(7.0))))),
        value: u5 * (n(126.0) + u * (n(-420.0) + u * (n(540.0) + u * (n(-315.0) + u * n(70.0))))),
        first: n(630.0) * q2 * q2,
        second: n(2520.0) * q2 * q * r,
        third: n(2520.0) * q2 * (n(3.0) - n(14.0) * q),
    }
}

/// The smoothstep at one u.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothstep<T> {
    /// ∫₀ᵘ S; ½ at u = 1.
    pub integral: T,
    /// S.
    pub value: T,
    /// S′; largest 315/128 at u = ½.
    pub first: T,
    /// S″; largest 9.372 at u = (1 − 1/√7)/2.
    pub second: T,
    /// S‴; between −78.75 and 52.5.
    pub third: T,
}

/// What the machine may be asked for along a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionLimits {
    /// Feed, m/s.
    pub feed_m_s: f64,
    /// Acceleration along the path, m/s².
    pub acceleration_m_s2: f64,
    /// Jerk along the path, m/s³.
    pub jerk_m_s3: f64,
}

/// A change of feed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeedRamp<T> {
    /// Feed before, m/s.
    pub from_m_s: T,
    /// Feed after, m/s.
    pub to_m_s: T,
    /// Duration, s.
    pub duration_s: T,
}

/// Largest S′ and S″: 630/4⁴, and 2520 q³r at r² = 1/7.
pub const STEEPEST: [f64; 2] = [
    315.0 / 128.0,
    2520.0 * 27.0 / 2744.0 / 2.645_751_311_064_590_6,
];

impl FeedRamp<f64> {
    /// The quickest ramp within the limits.
    pub fn within(from_m_s: f64, to_m_s: f64, limits: &MotionLimits) -> Self {
        let by_acceleration = STEEPEST[0] / limits.acceleration_m_s2;
        let by_jerk = STEEPEST[1] / limits.jerk_m_s3;
        let change = libm::fabs(to_m_s - from_m_s);
        let duration_s = (change * by_acceleration).max(libm::sqrt(change * by_jerk));
        Self {
            from_m_s,
            to_m_s,
            duration_s,
        }
    }
}

impl<T: Float> FeedRamp<T> {
    /// (distance, feed, acceleration, jerk, snap) at `time_s` after its start; before and after it, the feed is constant.
    pub fn at(&self, time_s: T) -> [T; 5] {
        let change = self.to_m_s - self.from_m_s;
        let (zero, t) = (T::zero(), self.duration_s);
        if time_s <= zero || t <= zero {
            return [self.from_m_s * time_s, self.from_m_s, zero, zero, zero];
        }
        let after = (time_s - t).max(zero);
        let s = smoothstep(time_s / t);
        [
            self.from_m_s * time_s + change * (t * s.integral + after),
            self.from_m_s + change * s.value,
            change * s.first / t,
            change * s.second / (t * t),
            change * s.third / (t * t * t),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each formula against the derivative of the one before it, by central differences.
    #[test]
    fn each_is_the_derivative_of_the_one_before() {
        let h = 1e-4;
        for i in 1..100 {
            let u = f64::from(i) / 100.0;
            let parts = |u: f64| {
                let s = smoothstep(u);
                [s.integral, s.value, s.first, s.second, s.third]
            };
            let (before, here, after) = (parts(u - h), parts(u), parts(u + h));
            for k in 0..4 {
                let slope = (after[k] - before[k]) / (2.0 * h);
                assert!(
                    (slope - here[k + 1]).abs() < 1e-3,
                    "derivative {k} at {u}: {slope} {}",
                    here[k + 1]
                );
            }
        }
        assert_eq!(
            smoothstep(1.0),
            Smoothstep {
                integral: 0.5,
                value: 1.0,
                first: 0.0,
                second: 0.0,
                third: 0.0
            }
        );
    }

    #[test]
    fn the_quickest_ramp_touches_a_limit_and_passes_none() {
        for (acceleration_m_s2, jerk_m_s3) in [(5.0, 1e9), (1e9, 200.0), (5.0, 200.0)] {
            let limits = MotionLimits {
                feed_m_s: 1.0,
                acceleration_m_s2,
                jerk_m_s3,
            };
            let ramp = FeedRamp::within(0.1, 0.8, &limits);
            let worst = (0..=10_000)
                .map(|i| ramp.at(ramp.duration_s * f64::from(i) / 10_000.0))
                .map(|[_, _, a, j, _]| (a.abs() / acceleration_m_s2).max(j.abs() / jerk_m_s3))
                .fold(0.0, f64::max);
            assert!((0.9999..=1.0 + 1e-12).contains(&worst), "{worst}");
        }
    }
}
