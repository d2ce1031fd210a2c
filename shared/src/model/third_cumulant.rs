//! The third cumulant, which no circle shows.
use super::{Cumulants, number};
use num_traits::Float;

impl<T: Float> Cumulants<T> {
    /// κ3, s³, of the one chain of a lag τ and a moving average that has these κ2 and κ4; 0 where there is none
    /// (κ4/κ2² outside −1.2…6, or κ2 ≤ 0).
    ///
    /// At constant rate κ3 only delays, so that circles cannot give it; it moves the path off its course where the feed
    /// changes on a curve. This is an assumption, then: a position loop behind a linear acceleration filter. It is exact for
    /// either alone, and κ3 = 2τ³. With x = τ²/κ2: 6x² − 1.2(1 − x)² = κ4/κ2². Of several lags in series it finds a
    /// part (two equal ones: 86 %).
    pub fn third_of_lag_and_average(&self) -> T {
        let n = number::<T>;
        let (k2, ratio) = (self.kappa2_s2, self.ratio());
        // Rounding to f32 in a table may carry either end across its border.
        if !(k2 > T::zero() && ratio >= n(-1.201) && ratio <= n(6.001)) {
            return T::zero();
        }
        let root = (n(5.76) + n(19.2) * (n(1.2) + ratio)).max(T::zero()).sqrt();
        let lag_share = ((root - n(2.4)) / n(9.6)).max(T::zero()).min(T::one());
        let lag2 = lag_share * k2;
        n(2.0) * lag2 * lag2.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::super::Element;
    use super::*;

    #[test]
    fn a_lag_an_average_and_any_mixture_give_theirs() {
        for (lag, average) in [
            (0.02f64, 0.0),
            (0.02, 0.04),
            (0.01, 0.1),
            (0.0, 0.04),
            (0.003, 0.001),
        ] {
            let mut sum = Cumulants::default();
            if lag > 0.0 {
                sum += Element::Lag {
                    kv_per_s: 1.0 / lag,
                }
                .cumulants();
            }
            if average > 0.0 {
                sum += Element::MovingAverage { window_s: average }.cumulants();
            }
            // κ3 of a lag: ln(1 + τs) has τ³s³/3, and the cumulant generating function is its opposite at −s.
            let expected = 2.0 * lag.powi(3);
            let got = sum.third_of_lag_and_average();
            assert!(
                (got - expected).abs() < 1e-6 * expected + 1e-12,
                "{lag} {average}: {got} {expected}"
            );
        }
    }

    #[test]
    fn two_equal_lags_give_six_sevenths() {
        let lag = Element::Lag { kv_per_s: 50.0f64 }.cumulants();
        let got = (lag + lag).third_of_lag_and_average() / (4.0 * 0.02f64.powi(3));
        assert!((0.855..0.865).contains(&got), "{got}");
    }

    #[test]
    fn what_no_such_chain_has_gives_none() {
        for (kappa2_s2, kappa4_s4) in [
            (46.58e-6, -5.5e-6),
            (-1e-4, 1e-9),
            (1e-4, 7e-8),
            (f64::NAN, 0.0),
        ] {
            assert_eq!(
                Cumulants {
                    kappa2_s2,
                    kappa4_s4
                }
                .third_of_lag_and_average(),
                0.0
            );
        }
    }
}
