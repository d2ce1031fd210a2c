//! The element that has given cumulants.
use super::{Cumulants, Element, number};
use num_traits::Float;

/// A two-parameter element that shares κ2 and κ4 with a fitted chain. It is an equivalent, not an identification.
pub type Equivalent<T> = Element<T>;

impl<T: Float> Cumulants<T> {
    /// The second-order element (κ4 < 6κ2²) or the lag with feed-forward (κ4 > 6κ2²) with these cumulants, or the
    /// single lag on the border: ωn⁴ = 12/(6κ2² − κ4), 1 − 2ζ² = −κ2ωn²/2; a² = (ρ − 6)/(ρ + 6), kv² = (1 − a²)/κ2.
    ///
    /// `None` where no such element exists: κ2 ≤ 0 on or above the border, more resonance than any ζ > 0 gives, or not finite.
    ///
    /// ```
    /// use giotto_shared::model::{Cumulants, Element};
    ///
    /// let wanted = Cumulants { kappa2_s2: 4e-4, kappa4_s4: 3e-7 };
    /// let element: Element<f64> = wanted.equivalent().unwrap();
    /// let has = element.cumulants();
    /// assert!((has.kappa2_s2 / wanted.kappa2_s2 - 1.0).abs() < 1e-12);
    /// assert!((has.kappa4_s4 / wanted.kappa4_s4 - 1.0).abs() < 1e-12);
    /// ```
    pub fn equivalent(&self) -> Option<Equivalent<T>> {
        let n = number::<T>;
        let (k2, k4) = (self.kappa2_s2, self.kappa4_s4);
        let gap = n(6.0) * k2 * k2 - k4;
        if gap > T::zero() {
            let element = self.second_order();
            let Element::SecondOrder {
                omega_n_rad_s,
                zeta,
            } = element
            else {
                return None;
            };
            // Less damping than none is NaN here.
            return (zeta > T::zero() && omega_n_rad_s.is_finite() && zeta.is_finite())
                .then_some(element);
        }
        if k2 <= T::zero() || !gap.is_finite() || !k2.is_finite() {
            return None;
        }
        if gap == T::zero() {
            return Some(Element::Lag {
                kv_per_s: k2.sqrt().recip(),
            });
        }
        Some(self.feed_forward_lag())
    }
}

/// Above this κ4/κ2² the feed-forward lag that has it (a² = ½ at 18) is too slow to be a likely machine.
const FEED_FORWARD_MAX_RATIO: f64 = 18.0;
/// Below this, κ4/κ2² is 6 within the rounding of a file: one plain lag.
const LAG_RATIO_TOLERANCE: f64 = 1e-9;

impl<T: Float> Cumulants<T> {
    /// The simplest stable chain with these cumulants:
    ///
    /// | κ | chain |
    /// |---|---|
    /// | both 0 | ideal: no element |
    /// | κ4 < 6κ2² (and < 3κ2² if κ2 < 0) | second order, as [`Self::equivalent`] |
    /// | κ2 > 0, κ4/κ2² = 6 | lag |
    /// | κ2 > 0, 6 < κ4/κ2² ≤ 18 | lag with feed-forward, as [`Self::equivalent`] |
    /// | else | lag 1/kv² = p and a second-order element with what remains, p = (κ2 + √(2κ4 − 2κ2²))/3 |
    ///
    /// Elements whose cumulants are not finite come back as they are computed, for the caller to refuse.
    pub fn chain(&self) -> [Option<Element<T>>; 2] {
        let n = number::<T>;
        let (k2, k4) = (self.kappa2_s2, self.kappa4_s4);
        if k2 == T::zero() && k4 == T::zero() {
            return [None, None];
        }
        let lag = |kappa2: T| Element::Lag {
            kv_per_s: kappa2.powf(n(-0.5)),
        };
        let ratio = self.ratio();
        let bound = if k2 < T::zero() { n(3.0) } else { n(6.0) };
        if k2 > T::zero() && (ratio - n(6.0)).abs() < n(LAG_RATIO_TOLERANCE) {
            [Some(lag(k2)), None]
        } else if k4 < bound * k2 * k2 {
            [None, Some(self.second_order())]
        } else if k2 > T::zero() && ratio <= n(FEED_FORWARD_MAX_RATIO) {
            [Some(self.feed_forward_lag()), None]
        } else {
            // With p from 3(κ2 − p)² + 6p² = 2κ4 the rest has ζ² > 0 with room to spare.
            let p = (k2 + (n(2.0) * k4 - n(2.0) * k2 * k2).sqrt()) / n(3.0);
            let rest = Self {
                kappa2_s2: k2 - p,
                kappa4_s4: k4 - n(6.0) * p * p,
            };
            [Some(lag(p)), Some(rest.second_order())]
        }
    }

    /// ωn⁴ = 12/(6κ2² − κ4), 1 − 2ζ² = −κ2ωn²/2; NaN where there is no such element.
    fn second_order(&self) -> Element<T> {
        let n = number::<T>;
        let (k2, k4) = (self.kappa2_s2, self.kappa4_s4);
        let omega_n2 = (n(12.0) / (n(6.0) * k2 * k2 - k4)).sqrt();
        Element::SecondOrder {
            omega_n_rad_s: omega_n2.sqrt(),
            zeta: (n(0.5) + k2 * omega_n2 / n(4.0)).sqrt(),
        }
    }

    /// a² = (ρ − 6)/(ρ + 6), kv² = (1 − a²)/κ2.
    fn feed_forward_lag(&self) -> Element<T> {
        let n = number::<T>;
        let ratio = self.ratio();
        let a2 = (ratio - n(6.0)) / (ratio + n(6.0));
        Element::FeedForwardLag {
            kv_per_s: ((T::one() - a2) / self.kappa2_s2).sqrt(),
            feed_forward: a2.sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::RadiusModel;
    use super::*;

    #[test]
    fn an_equivalent_has_the_cumulants_it_was_made_from() {
        for k2 in [-1e-4_f64, 2e-5, 46.58e-6, 1e-3] {
            for ratio in [-3000.0, -4.0, -1.2, 0.0, 3.0, 5.9, 6.1, 9.0, 100.0] {
                let k = Cumulants {
                    kappa2_s2: k2,
                    kappa4_s4: ratio * k2 * k2,
                };
                match k.equivalent() {
                    Some(element) => {
                        let back = element.cumulants();
                        assert!(
                            (back.kappa2_s2 / k2 - 1.0).abs() < 1e-9,
                            "{k:?} {element:?}"
                        );
                        assert!(
                            (back.kappa4_s4 - k.kappa4_s4).abs()
                                < 1e-9 * (k2 * k2 + k.kappa4_s4.abs())
                        );
                    }
                    // A swing-out: a second order has it only with more ringing than κ4 tells here.
                    None => assert!(k2 < 0.0 && ratio > -6.0, "{k:?}"),
                }
            }
        }
    }

    #[test]
    fn the_papers_robot_is_a_second_order_of_38_rad_s() {
        let beta = RadiusModel {
            beta1_s2: -23.29e-6_f64,
            beta2_s4: -0.23e-6,
        };
        let Some(Element::SecondOrder {
            omega_n_rad_s,
            zeta,
        }) = Cumulants::from(beta).equivalent()
        else {
            panic!("not second order");
        };
        assert!(
            (omega_n_rad_s - 38.4).abs() < 0.1 && (zeta - 0.72).abs() < 0.005,
            "{omega_n_rad_s} {zeta}"
        );
    }
}
