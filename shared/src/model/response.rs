//! The response that all axes share, by the square of what it does to a circle: (R/Rm)² = 1 + aω² + bω⁴.
//!
//! It is exact for one lag (a = 1/kv², b = 0) and for a second-order element (b = 1/ωn⁴), and linear in a and b, so that
//! circles of all sizes determine both at once. Every way from it to elements, to β and back is here.
use super::{Element, LEAST_DAMPING_SQUARED, RadiusModel, number};
use num_traits::Float;

/// (R/Rm)² = 1 + aω² + bω⁴.
///
/// ```
/// use giotto_shared::model::{Element, Response};
///
/// let servo = Element::SecondOrder { omega_n_rad_s: 80.0_f64, zeta: 0.7 };
/// let response = Response::of(&servo).unwrap();
/// assert!((response.gain(30.0) / servo.gain(30.0) - 1.0).abs() < 1e-12);
/// // And back: the element that has this response.
/// let Some(Element::SecondOrder { omega_n_rad_s, zeta }) = response.element() else { unreachable!() };
/// assert!((omega_n_rad_s - 80.0).abs() < 1e-9 && (zeta - 0.7).abs() < 1e-9);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Response<T> {
    /// a = κ2, s².
    pub a_s2: T,
    /// b, s⁴.
    pub b_s4: T,
}

impl<T: Float> Response<T> {
    /// Of an element that has such a response: a lag or a second-order element.
    pub fn of(element: &Element<T>) -> Option<Self> {
        match *element {
            Element::Lag { kv_per_s } => Some(Self {
                a_s2: kv_per_s.powi(-2),
                b_s4: T::zero(),
            }),
            Element::SecondOrder {
                omega_n_rad_s,
                zeta,
            } => {
                let two = number::<T>(2.0);
                Some(Self {
                    a_s2: -two * (T::one() - two * zeta * zeta) / omega_n_rad_s.powi(2),
                    b_s4: omega_n_rad_s.powi(-4),
                })
            }
            _ => None,
        }
    }

    /// The one element with this response: second order for b > 0, a lag for b = 0 and a > 0, a lag with feed-forward
    /// for b < 0 and a > 0, which has it to the order of ω⁴: (1 + ω²/kv²)/(1 + c²ω²) = 1 + aω² + bω⁴ + …, c its
    /// feed-forward time. `None` where there is none.
    pub fn element(&self) -> Option<Element<T>> {
        let (a, b) = (self.a_s2, self.b_s4);
        let root = number::<T>(-0.5);
        if b > T::zero() {
            let omega_n2 = b.powf(root);
            return Some(Element::SecondOrder {
                omega_n_rad_s: omega_n2.sqrt(),
                zeta: damping_squared(number::<T>(0.25) * a * omega_n2).sqrt(),
            });
        }
        if !(a > T::zero() && b <= T::zero()) {
            return None;
        }
        if b == T::zero() {
            return Some(Element::Lag {
                kv_per_s: a.powf(root),
            });
        }
        let c2 = -b / a;
        let lag2 = a + c2;
        Some(Element::FeedForwardLag {
            kv_per_s: lag2.powf(root),
            feed_forward: (c2 / lag2).sqrt(),
        })
    }

    /// Phase of the simplest chain with this gain, to third order in ω: φ = τω − τ₃ω³, (τ in s, τ₃ in s³). One lag for
    /// b ≤ 0, else a second-order element, φ = 2ζr + (2ζ − 8ζ³/3)r³, r = ω/ωn. Dead time is not in it: a radius does
    /// not show any.
    pub fn phase(&self) -> [T; 2] {
        let n = number::<T>;
        if self.b_s4 > T::zero() {
            let omega_n = self.b_s4.powf(n(-0.25));
            let zeta = damping_squared(n(0.25) * self.a_s2 * omega_n * omega_n).sqrt();
            let third = (n(8.0 / 3.0) * zeta.powi(3) - n(2.0) * zeta) / omega_n.powi(3);
            [n(2.0) * zeta / omega_n, third]
        } else {
            let lag = self.a_s2.max(T::zero()).sqrt();
            [lag, lag.powi(3) / n(3.0)]
        }
    }

    /// |G(jω)|. Where the square would be less than 0.001 the response means nothing any more, and 0.001 is taken.
    pub fn gain(&self, omega_rad_s: T) -> T {
        let w2 = omega_rad_s * omega_rad_s;
        (T::one() + self.a_s2 * w2 + self.b_s4 * w2 * w2)
            .max(number(1e-3))
            .sqrt()
            .recip()
    }

    /// κ4/κ2², by κ4 = 24β2 − 3κ2² and β2 = 3κ2²/8 − b/2.
    pub fn ratio(&self) -> T {
        let n = number::<T>;
        let (a, b) = (self.a_s2, self.b_s4);
        (n(6.0) * a * a - n(12.0) * b) / (a * a)
    }
}

/// ζ² = ½ + aωn²/4.
fn damping_squared<T: Float>(quarter_a_omega_n2: T) -> T {
    (number::<T>(0.5) + quarter_a_omega_n2).max(number(LEAST_DAMPING_SQUARED))
}

impl<T: Float> From<RadiusModel<T>> for Response<T> {
    /// The response with these β: a = −2β1, b = 2(3a²/8 − β2).
    fn from(beta: RadiusModel<T>) -> Self {
        let n = number::<T>;
        let a_s2 = -n(2.0) * beta.beta1_s2;
        Self {
            a_s2,
            b_s4: n(2.0) * (n(0.375) * a_s2 * a_s2 - beta.beta2_s4),
        }
    }
}

impl<T: Float> From<Response<T>> for RadiusModel<T> {
    /// Eq. 15 with the same κ2 and κ4.
    fn from(response: Response<T>) -> Self {
        let n = number::<T>;
        let (a, b) = (response.a_s2, response.b_s4);
        Self {
            beta1_s2: -n(0.5) * a,
            beta2_s4: n(0.375) * a * a - n(0.5) * b,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Cumulants;
    use super::*;

    #[test]
    fn element_and_response_are_each_others_inverse() {
        for element in [
            Element::Lag { kv_per_s: 50.0 },
            Element::SecondOrder {
                omega_n_rad_s: 38.0,
                zeta: 0.72,
            },
            Element::SecondOrder {
                omega_n_rad_s: 120.0,
                zeta: 0.3_f64,
            },
        ] {
            let response = Response::of(&element).unwrap();
            let back = Response::of(&response.element().unwrap()).unwrap();
            assert!((back.a_s2 - response.a_s2).abs() < 1e-12 * response.a_s2.abs());
            assert!((back.b_s4 - response.b_s4).abs() <= 1e-12 * response.b_s4);
            // The cumulants of the element are those of the response.
            let through = Cumulants::from(RadiusModel::from(response));
            let own = element.cumulants();
            assert!((through.kappa2_s2 / own.kappa2_s2 - 1.0).abs() < 1e-12);
            assert!((through.ratio() - own.ratio()).abs() < 1e-9 * own.ratio().abs());
            assert!((response.ratio() - own.ratio()).abs() < 1e-9 * own.ratio().abs());
        }
    }

    #[test]
    fn a_feed_forward_lag_has_the_response_to_fourth_order() {
        let response = Response {
            a_s2: 4e-4,
            b_s4: -6e-8_f64,
        };
        let element = response.element().unwrap();
        assert!(matches!(element, Element::FeedForwardLag { .. }));
        let off = |w: f64| (element.gain(w) / response.gain(w) - 1.0).abs();
        // Halving ω divides a remainder of sixth order by 64.
        let ratio = off(8.0) / off(4.0);
        assert!((ratio - 64.0).abs() < 4.0, "{ratio}");
    }

    #[test]
    fn what_no_element_has_gives_none() {
        for (a_s2, b_s4) in [(-1e-4, 0.0), (0.0, -1e-8), (f64::NAN, 0.0), (0.0, 0.0)] {
            assert_eq!(Response { a_s2, b_s4 }.element(), None, "{a_s2} {b_s4}");
        }
    }

    /// Phase of the exact element, against the series.
    #[test]
    fn phase_is_the_series_of_the_arc_tangent() {
        let (omega_n, zeta) = (38.0_f64, 0.72_f64);
        let response = Response::of(&Element::SecondOrder {
            omega_n_rad_s: omega_n,
            zeta,
        });
        let [tau, third] = response.unwrap().phase();
        let w = 0.5;
        let exact = libm::atan2(
            2.0 * zeta * w / omega_n,
            1.0 - (w / omega_n) * (w / omega_n),
        );
        assert!((tau * w - third * w * w * w - exact).abs() < 1e-9);
    }
}
