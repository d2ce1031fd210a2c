//! What to program so that the wanted circle comes out.
use super::{RadiusModel, number};
use core::fmt;
use num_traits::Float;

/// A circle to program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Programmed<T> {
    /// Radius to program, m.
    pub radius_m: T,
    /// Feed to program, m/s.
    pub feed_m_s: T,
    /// Steps that the solution took; 0 for the closed form.
    pub iterations: u32,
}

/// Why a circle cannot be programmed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InverseError {
    /// Radius not positive and finite.
    Radius,
    /// Feed negative or not finite.
    Feed,
    /// A coefficient is NaN or infinite.
    Coefficient,
    /// No programmed circle gives the wanted one at this ω or feed: the model's circle shrinks to nothing (ω kept)
    /// or its smallest possible size is larger than the one wanted (feed kept).
    OutOfReach,
}

impl fmt::Display for InverseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Radius => "the radius must be positive and finite",
            Self::Feed => "the feed must be finite and not negative",
            Self::Coefficient => "a coefficient of the model is not finite",
            Self::OutOfReach => "no programmed circle gives the wanted one at this feed",
        })
    }
}

impl core::error::Error for InverseError {}

/// Most steps of the solution with the feed kept. Bisection alone needs fewer in f64 for brackets below 2⁴⁰.
const MAX_ITERATIONS: u32 = 100;

impl<T: Float> RadiusModel<T> {
    /// Keeps ω = f/R: Rp = R/(1 + β1ω² + β2ω⁴), fp = ω·Rp. Closed form; the wanted circle then also takes the wanted time.
    ///
    /// # Errors
    /// [`InverseError`]; out of reach where the gain 1 + β1ω² + β2ω⁴ is not positive.
    ///
    /// ```
    /// use giotto_shared::model::{InverseError, RadiusModel};
    ///
    /// // What to program so that a machine that shrinks circles draws 100 mm at 0.7 m/s.
    /// let machine = RadiusModel { beta1_s2: -23.29e-6, beta2_s4: 0.0 };
    /// let programmed = machine.inverse_keeping_omega(0.1, 0.7)?;
    /// let drawn = programmed.radius_m + machine.radius_error_m(programmed.radius_m, programmed.feed_m_s);
    /// assert!(programmed.radius_m > 0.1);
    /// assert!((drawn - 0.1_f64).abs() < 1e-15);
    /// # Ok::<(), InverseError>(())
    /// ```
    pub fn inverse_keeping_omega(
        &self,
        radius_m: T,
        feed_m_s: T,
    ) -> Result<Programmed<T>, InverseError> {
        self.check(radius_m, feed_m_s)?;
        let omega = feed_m_s / radius_m;
        let gain = T::one() + self.relative_error(omega);
        let radius = radius_m / gain;
        if gain <= T::zero() || !radius.is_finite() || radius <= T::zero() {
            return Err(InverseError::OutOfReach);
        }
        Ok(Programmed {
            radius_m: radius,
            feed_m_s: omega * radius,
            iterations: 0,
        })
    }

    /// Keeps the feed: solves Rp + β1f²/Rp + β2f⁴/Rp³ = R.
    ///
    /// In x = Rp/R, a = β1ω², b = β2ω⁴: h(x) = x + a/x + b/x³ = 1. Above x*, the largest root of h′, h only rises,
    /// so the root there is unique, and it is the one that x = 1 moves to as the feed grows from 0. It exists
    /// exactly when h(x*) ≤ 1. Newton's method inside a bracket that halves at worst finds it.
    ///
    /// # Errors
    /// [`InverseError`]; out of reach exactly where h(x*) > 1.
    pub fn inverse_keeping_feed(
        &self,
        radius_m: T,
        feed_m_s: T,
    ) -> Result<Programmed<T>, InverseError> {
        self.check(radius_m, feed_m_s)?;
        let n = number::<T>;
        let w2 = (feed_m_s / radius_m) * (feed_m_s / radius_m);
        let (a, b) = (self.beta1_s2 * w2, self.beta2_s4 * w2 * w2);
        if !a.is_finite() || !b.is_finite() {
            return Err(InverseError::OutOfReach);
        }
        // Residual and slope of h(x) − 1, times x³ and x⁴: the sign is kept and nothing overflows near 0.
        let residual = |x: T| ((x - T::one()) * x * x + a * x) * x + b;
        let slope = |x: T| (x * x - a) * x * x - n(3.0) * b;
        let discriminant = a * a + n(12.0) * b;
        let turning2 = if discriminant >= T::zero() {
            (a + discriminant.sqrt()) / n(2.0)
        } else {
            T::zero()
        };
        let mut low = turning2.max(T::zero()).sqrt();
        if low > T::zero() && residual(low) > T::zero() {
            return Err(InverseError::OutOfReach);
        }
        // For x ≥ 1: h(x) ≥ x − |a| − |b|.
        let mut high = T::one() + a.abs() + b.abs();
        let mut x = T::one().max(low).min(high);
        let mut iterations = 0;
        loop {
            let value = residual(x);
            if value > T::zero() {
                high = x;
            } else {
                low = x;
            }
            iterations += 1;
            // h/h′ = x·(h x³)/(h′ x⁴)
            let newton = x - x * value / slope(x);
            let digits = n(2.0) * T::epsilon() * x;
            if (newton - x).abs() <= digits || high - low <= digits || iterations >= MAX_ITERATIONS
            {
                break;
            }
            x = if newton > low && newton < high {
                newton
            } else {
                (low + high) / n(2.0)
            };
        }
        let radius = x * radius_m;
        if !radius.is_finite() || radius <= T::zero() {
            return Err(InverseError::OutOfReach);
        }
        Ok(Programmed {
            radius_m: radius,
            feed_m_s,
            iterations,
        })
    }

    fn check(&self, radius_m: T, feed_m_s: T) -> Result<(), InverseError> {
        if !(radius_m.is_finite() && radius_m > T::zero()) {
            return Err(InverseError::Radius);
        }
        if !(feed_m_s.is_finite() && feed_m_s >= T::zero()) {
            return Err(InverseError::Feed);
        }
        if !(self.beta1_s2.is_finite() && self.beta2_s4.is_finite()) {
            return Err(InverseError::Coefficient);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const PAPER: RadiusModel<f64> = RadiusModel {
        beta1_s2: -23.29e-6,
        beta2_s4: -0.23e-6,
    };

    #[test]
    fn the_papers_circle_comes_out_as_wanted_both_ways() {
        for (radius, feed) in [(0.1, 0.7), (0.15, 0.4), (0.3, 0.02), (0.3, 0.7)] {
            let same_omega = PAPER.inverse_keeping_omega(radius, feed).unwrap();
            let same_feed = PAPER.inverse_keeping_feed(radius, feed).unwrap();
            for p in [same_omega, same_feed] {
                let out = p.radius_m + PAPER.radius_error_m(p.radius_m, p.feed_m_s);
                assert!((out / radius - 1.0).abs() < 2e-15, "{radius} {feed}: {out}");
            }
            assert!(
                (same_omega.feed_m_s / same_omega.radius_m - feed / radius).abs()
                    < 1e-14 * feed / radius
            );
            assert_eq!(same_feed.feed_m_s, feed);
        }
    }

    /// (a, b) = (β1ω², β2ω⁴) over the whole plane, each sign, up to 10⁴: R = 1, f = 1.
    fn any_size() -> impl Strategy<Value = f64> {
        (prop::bool::ANY, -12.0..4.0)
            .prop_map(|(sign, e): (bool, f64)| if sign { e.exp2() } else { -e.exp2() })
    }

    /// Smallest value of h over x ≥ x* by brute force along the branch from x = 1, or None if the branch folds.
    fn by_continuation(a: f64, b: f64) -> Option<f64> {
        // Follows dx/ds of h(x; s·a, s²·b) = 1, s = ω² share, in small Runge–Kutta steps; a fold shows as slope ≤ 0.
        let rate = |s: f64, x: f64| {
            -(a / x + 2.0 * s * b / x.powi(3))
                / (1.0 - s * a / (x * x) - 3.0 * s * s * b / x.powi(4))
        };
        let steps = 4000;
        let (mut x, ds) = (1.0, 1.0 / f64::from(steps));
        for i in 0..steps {
            let s = f64::from(i) * ds;
            let k1 = rate(s, x);
            let k2 = rate(s + 0.5 * ds, x + 0.5 * ds * k1);
            let k3 = rate(s + 0.5 * ds, x + 0.5 * ds * k2);
            let k4 = rate(s + ds, x + ds * k3);
            x += ds / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
            let slope = 1.0 - (s + ds) * a / (x * x) - 3.0 * ((s + ds) * x.powi(-2)).powi(2) * b;
            if !(slope > 0.02 && x > 0.0) {
                return None;
            }
        }
        // A step that leaps over a fold lands where no solution is.
        let met = (x + a / x + b / x.powi(3) - 1.0).abs() < 1e-7;
        met.then_some(x)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]

        #[test]
        fn feed_kept_converges_over_the_whole_plane(a in any_size(), b in any_size()) {
            let model = RadiusModel { beta1_s2: a, beta2_s4: b };
            match model.inverse_keeping_feed(1.0, 1.0) {
                Ok(p) => {
                    let x = p.radius_m;
                    let size = x + (a / x).abs() + (b / x.powi(3)).abs();
                    prop_assert!((x + a / x + b / x.powi(3) - 1.0).abs() <= 1e-14 * size, "x {}", x);
                    // On the rising branch.
                    prop_assert!(1.0 - a / (x * x) - 3.0 * b / x.powi(4) >= -1e-6);
                    prop_assert!(p.iterations <= 60, "{} iterations", p.iterations);
                }
                Err(error) => {
                    prop_assert_eq!(error, InverseError::OutOfReach);
                    // Nothing on the rising branch reaches down to 1.
                    let turning = ((a + (a * a + 12.0 * b).sqrt()) / 2.0).sqrt();
                    for k in 0..4000 {
                        let x = turning + 1e-3 * f64::from(k);
                        prop_assert!(x + a / x + b / x.powi(3) > 1.0 - 1e-12);
                    }
                }
            }
        }

        #[test]
        fn feed_kept_is_the_branch_that_grows_out_of_rest(a in -3.0..0.24, b in -3.0..0.1) {
            if let Some(x) = by_continuation(a, b) {
                let p = RadiusModel { beta1_s2: a, beta2_s4: b }.inverse_keeping_feed(1.0, 1.0).unwrap();
                prop_assert!((p.radius_m - x).abs() < 1e-6, "{} against {}", p.radius_m, x);
            }
        }

        #[test]
        fn omega_kept_is_exact(radius in 0.001..10.0, feed in 0.0..2.0) {
            let gain = 1.0 + PAPER.relative_error(feed / radius);
            match PAPER.inverse_keeping_omega(radius, feed) {
                Ok(p) => {
                    let out = p.radius_m + PAPER.radius_error_m(p.radius_m, p.feed_m_s);
                    prop_assert!((out - radius).abs() <= 1e-13 * p.radius_m);
                }
                Err(error) => prop_assert!(error == InverseError::OutOfReach && gain <= 0.0),
            }
        }

        #[test]
        fn single_precision_is_good_to_its_digits(radius in 0.02..1.0, feed in 0.0..0.7) {
            let single = RadiusModel { beta1_s2: -23.29e-6_f32, beta2_s4: -0.23e-6 };
            if feed / radius < 20.0 {
                let wide = PAPER.inverse_keeping_feed(radius, feed).unwrap().radius_m;
                let narrow = single.inverse_keeping_feed(radius as f32, feed as f32).unwrap();
                prop_assert!((f64::from(narrow.radius_m) / wide - 1.0).abs() < 1e-6);
                prop_assert!(narrow.iterations <= 40);
            }
        }
    }

    #[test]
    fn the_fold_is_where_theory_puts_it() {
        // b = 0: x² − x + a = 0 has real roots up to a = 1/4.
        let at = |a: f64| {
            RadiusModel {
                beta1_s2: a,
                beta2_s4: 0.0,
            }
            .inverse_keeping_feed(1.0, 1.0)
        };
        assert!((at(0.2499).unwrap().radius_m - 0.51).abs() < 1e-12);
        assert_eq!(at(0.2501).unwrap_err(), InverseError::OutOfReach);
    }

    #[test]
    fn bad_arguments_have_their_own_error() {
        assert_eq!(
            PAPER.inverse_keeping_feed(0.0, 0.1).unwrap_err(),
            InverseError::Radius
        );
        assert_eq!(
            PAPER.inverse_keeping_feed(f64::NAN, 0.1).unwrap_err(),
            InverseError::Radius
        );
        assert_eq!(
            PAPER.inverse_keeping_omega(0.1, -0.1).unwrap_err(),
            InverseError::Feed
        );
        let bad = RadiusModel {
            beta1_s2: f64::NAN,
            beta2_s4: 0.0,
        };
        assert_eq!(
            bad.inverse_keeping_omega(0.1, 0.1).unwrap_err(),
            InverseError::Coefficient
        );
    }
}
