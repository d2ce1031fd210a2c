//! Elements of a servo chain: what each does to a circle.
use super::{Cumulants, LEAST_DAMPING_SQUARED, number};
use num_traits::Float;

/// One linear element, the same on both axes. A dead time is not among them: it turns the circle and leaves its radius.
///
/// ```
/// use giotto_shared::model::Element;
///
/// // At ω = kv a lag draws circles of 1/√2 of their radius.
/// let lag = Element::Lag { kv_per_s: 50.0_f64 };
/// assert!((lag.gain(50.0) - 0.5_f64.sqrt()).abs() < 1e-15);
/// // Without damping a second-order element makes small circles larger.
/// let ringing = Element::SecondOrder { omega_n_rad_s: 100.0, zeta: 0.1_f64 };
/// assert!(ringing.gain(50.0) > 1.3);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Element<T> {
    /// Position loop 1/(1 + s/kv) (first part of Eq. 12).
    Lag {
        /// kv, 1/s, > 0.
        kv_per_s: T,
    },
    /// Exponential acc/dec filter 1/(1 + Ts) (second part of Eq. 12).
    ExponentialFilter {
        /// T, s, ≥ 0.
        time_constant_s: T,
    },
    /// Position loop with velocity feed-forward, (1 + a·s/kv)/(1 + s/kv) (Eq. 13).
    FeedForwardLag {
        /// kv, 1/s, > 0.
        kv_per_s: T,
        /// a, 0…1.
        feed_forward: T,
    },
    /// Moving average (linear acc/dec).
    MovingAverage {
        /// T, s, ≥ 0.
        window_s: T,
    },
    /// ωn²/(s² + 2ζωn s + ωn²).
    SecondOrder {
        /// ωn, rad/s, > 0.
        omega_n_rad_s: T,
        /// ζ, > 0.
        zeta: T,
    },
    /// Set-points joined by chords; [`gain`](Self::gain) is that of the fundamental, which differs
    /// from the mean radius of the polygon at the order of ω⁶.
    Chord {
        /// Δt, s, ≥ 0.
        interval_s: T,
    },
}

/// sin(x)/x.
fn sinc<T: Float>(x: T) -> T {
    // Below this the quadratic term is under the last digit.
    if x.abs() < T::epsilon().sqrt() {
        T::one()
    } else {
        x.sin() / x
    }
}

impl<T: Float> Element<T> {
    /// κ2 and κ4.
    pub fn cumulants(&self) -> Cumulants<T> {
        let n = number::<T>;
        let (kappa2_s2, kappa4_s4) = match *self {
            Self::Lag { kv_per_s } => {
                let t2 = (kv_per_s * kv_per_s).recip();
                (t2, n(6.0) * t2 * t2)
            }
            Self::ExponentialFilter { time_constant_s } => {
                let t2 = time_constant_s * time_constant_s;
                (t2, n(6.0) * t2 * t2)
            }
            Self::FeedForwardLag {
                kv_per_s,
                feed_forward,
            } => {
                let t2 = (kv_per_s * kv_per_s).recip();
                let a2 = feed_forward * feed_forward;
                (
                    (T::one() - a2) * t2,
                    n(6.0) * (T::one() - a2 * a2) * t2 * t2,
                )
            }
            Self::MovingAverage { window_s } => {
                let t2 = window_s * window_s;
                (t2 / n(12.0), -t2 * t2 / n(120.0))
            }
            Self::SecondOrder {
                omega_n_rad_s,
                zeta,
            } => {
                let t2 = (omega_n_rad_s * omega_n_rad_s).recip();
                let z2 = zeta * zeta;
                (
                    -n(2.0) * (T::one() - n(2.0) * z2) * t2,
                    n(12.0) * (n(8.0) * z2 * z2 - n(8.0) * z2 + T::one()) * t2 * t2,
                )
            }
            Self::Chord { interval_s } => {
                let t2 = interval_s * interval_s;
                (t2 / n(6.0), -t2 * t2 / n(60.0))
            }
        };
        Cumulants {
            kappa2_s2,
            kappa4_s4,
        }
    }

    /// |G(jω)|, exact, for any ω in rad/s.
    pub fn gain(&self, omega_rad_s: T) -> T {
        let n = number::<T>;
        let w = omega_rad_s;
        match *self {
            Self::Lag { kv_per_s } => T::one().hypot(w / kv_per_s).recip(),
            Self::ExponentialFilter { time_constant_s } => {
                T::one().hypot(w * time_constant_s).recip()
            }
            Self::FeedForwardLag {
                kv_per_s,
                feed_forward,
            } => T::one().hypot(feed_forward * w / kv_per_s) / T::one().hypot(w / kv_per_s),
            Self::MovingAverage { window_s } => sinc(w * window_s / n(2.0)).abs(),
            Self::SecondOrder {
                omega_n_rad_s,
                zeta,
            } => {
                let v = w / omega_n_rad_s;
                ((T::one() - v) * (T::one() + v))
                    .hypot(n(2.0) * zeta * v)
                    .recip()
            }
            Self::Chord { interval_s } => {
                let s = sinc(w * interval_s / n(2.0));
                s * s
            }
        }
    }
}

impl<T: Float> Element<T> {
    /// Delay at low rates, s: the first cumulant.
    pub fn delay_s(&self) -> T {
        let half = number::<T>(0.5);
        match *self {
            Self::Lag { kv_per_s } => kv_per_s.recip(),
            Self::ExponentialFilter { time_constant_s } => time_constant_s,
            Self::FeedForwardLag {
                kv_per_s,
                feed_forward,
            } => (T::one() - feed_forward) / kv_per_s,
            Self::MovingAverage { window_s } => half * window_s,
            Self::SecondOrder {
                omega_n_rad_s,
                zeta,
            } => number::<T>(2.0) * zeta / omega_n_rad_s,
            // The chord to the next set-point is known when that is reached.
            Self::Chord { interval_s } => interval_s,
        }
    }

    /// A lag or a second-order element whose κ2 is larger by `more_s2`, with how much longer its delay is, s: of a lag
    /// the time constant changes, of a second-order element the damping (κ2 = (4ζ² − 2)/ωn²). `None` for other elements and where
    /// no lag is left.
    pub fn with_more_kappa2(&self, more_s2: T) -> Option<(Self, T)> {
        let n = number::<T>;
        match *self {
            Self::Lag { kv_per_s } => {
                let lag = kv_per_s.recip();
                let square = lag * lag + more_s2;
                let element = Self::Lag {
                    kv_per_s: square.powf(n(-0.5)),
                };
                (square > T::zero()).then(|| (element, square.sqrt() - lag))
            }
            Self::SecondOrder {
                omega_n_rad_s: omega_n,
                zeta: before,
            } => {
                let square = before * before + n(0.25) * more_s2 * omega_n * omega_n;
                let zeta = square.max(n(LEAST_DAMPING_SQUARED)).sqrt();
                let element = Self::SecondOrder {
                    omega_n_rad_s: omega_n,
                    zeta,
                };
                Some((element, n(2.0) * (zeta - before) / omega_n))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_kappa2_is_that_much_more() {
        for element in [
            Element::Lag { kv_per_s: 50.0 },
            Element::SecondOrder {
                omega_n_rad_s: 60.0,
                zeta: 0.8_f64,
            },
        ] {
            for more in [3e-5, -3e-5] {
                let (other, later) = element.with_more_kappa2(more).unwrap();
                let gained = other.cumulants().kappa2_s2 - element.cumulants().kappa2_s2;
                assert!((gained / more - 1.0).abs() < 1e-9, "{gained}");
                assert!((other.delay_s() - element.delay_s() - later).abs() < 1e-15);
            }
        }
        let lag = Element::Lag { kv_per_s: 50.0_f64 };
        assert_eq!(lag.with_more_kappa2(-5e-4), None);
    }

    const ELEMENTS: [Element<f64>; 6] = [
        Element::Lag { kv_per_s: 50.0 },
        Element::ExponentialFilter {
            time_constant_s: 0.03,
        },
        Element::FeedForwardLag {
            kv_per_s: 40.0,
            feed_forward: 0.7,
        },
        Element::MovingAverage { window_s: 0.04 },
        Element::SecondOrder {
            omega_n_rad_s: 38.0,
            zeta: 0.72,
        },
        Element::Chord { interval_s: 0.024 },
    ];

    #[test]
    fn cumulants_are_the_series_of_the_exact_gain() {
        for element in ELEMENTS {
            let k = element.cumulants();
            // ln|G| minus both terms is of sixth order: halving ω divides it by 64.
            let rest = |w: f64| element.gain(w).ln() - k.log_gain(w);
            let ratio = rest(4.0) / rest(2.0);
            assert!((ratio - 64.0).abs() < 4.0, "{element:?}: {ratio}");
        }
    }

    #[test]
    fn gain_of_a_cascade_is_that_of_the_sum() {
        let total: Cumulants<f64> = ELEMENTS.iter().map(Element::cumulants).sum();
        let exact: f64 = ELEMENTS.iter().map(|e| e.gain(1.0).ln()).sum();
        assert!((total.log_gain(1.0) / exact - 1.0).abs() < 1e-6);
    }

    #[test]
    fn ratios_are_those_of_their_kind() {
        let ratio = |e: Element<f64>| e.cumulants().ratio();
        assert!((ratio(ELEMENTS[0]) - 6.0).abs() < 1e-12);
        assert!((ratio(ELEMENTS[1]) - 6.0).abs() < 1e-12);
        assert!((ratio(ELEMENTS[2]) - 6.0 * 1.49 / 0.51).abs() < 1e-12);
        assert!((ratio(ELEMENTS[3]) + 1.2).abs() < 1e-12);
        assert!((ratio(ELEMENTS[5]) + 0.6).abs() < 1e-12);
    }

    #[test]
    fn the_chord_gain_is_the_mean_radius_of_the_polygon() {
        // Mean distance of the points of a chord from the centre, by Simpson's rule.
        let half = 0.5 * 0.024 * 10.0_f64;
        let (s, c) = half.sin_cos();
        let at = |i: usize| (s * i as f64 / 1000.0).hypot(c);
        let simpson: f64 = (0..500)
            .map(|i| at(2 * i) + 4.0 * at(2 * i + 1) + at(2 * i + 2))
            .sum::<f64>()
            / 3000.0;
        let gain = ELEMENTS[5].gain(10.0);
        assert!(
            (gain - simpson).abs() < 0.5 * half.powi(6),
            "{gain} {simpson}"
        );
    }
}
