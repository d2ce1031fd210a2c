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
            let omega_n2 = (n(12.0) / gap).sqrt();
            let zeta2 = n(0.5) + k2 * omega_n2 / n(4.0);
            let element = Element::SecondOrder {
                omega_n_rad_s: omega_n2.sqrt(),
                zeta: zeta2.sqrt(),
            };
            return (zeta2 > T::zero() && omega_n2.is_finite() && zeta2.is_finite())
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
        let ratio = self.ratio();
        let a2 = (ratio - n(6.0)) / (ratio + n(6.0));
        Some(Element::FeedForwardLag {
            kv_per_s: ((T::one() - a2) / k2).sqrt(),
            feed_forward: a2.sqrt(),
        })
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
