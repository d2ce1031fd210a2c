//! The operator on a vector path and, as a complex gain, on a circle.
use crate::model::Cumulants;
use num_traits::Float;

/// p_cmd = p + `second`·p″ + `fourth`·p⁗.
///
/// ```
/// use giotto_shared::law::{AngularMotion, Operator};
/// use giotto_shared::model::{Cumulants, Element};
///
/// // A lag of 20 ms shrinks a circle at 5 rad/s by 0.5 %: the operator programs it larger by as much.
/// let lag = Element::Lag { kv_per_s: 50.0_f64 };
/// let steady = AngularMotion { rate: 5.0, ..AngularMotion::default() };
/// let gain = Operator::new(&lag.cumulants()).gain(&steady);
/// assert!(gain.radial > 0.004);
/// assert!(((1.0 + gain.radial) * lag.gain(5.0) - 1.0).abs() < 1e-6);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Operator<T> {
    /// −κ2/2, s².
    pub second_s2: T,
    /// κ2²/8 − κ4/24, s⁴.
    pub fourth_s4: T,
}

/// How the polar angle moves at one instant: ω and its derivatives, SI.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct AngularMotion<T> {
    /// ω, rad/s.
    pub rate: T,
    /// ω′, rad/s².
    pub acceleration: T,
    /// ω″, rad/s³.
    pub jerk: T,
    /// ω‴, rad/s⁴.
    pub snap: T,
}

/// Complex gain 1 + `radial` + i·`tangential` by which the operator multiplies p − centre = R·e^{iθ}.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Gain<T> {
    /// Real part less one: outward, share of the radius.
    pub radial: T,
    /// Imaginary part: ahead in the sense of growing θ, share of the radius.
    pub tangential: T,
}

impl<T: Float> Operator<T> {
    /// The operator that undoes a chain with these cumulants.
    pub fn new(cumulants: &Cumulants<T>) -> Self {
        let two = T::one() + T::one();
        let eight = two * two * two;
        let (k2, k4) = (cumulants.kappa2_s2, cumulants.kappa4_s4);
        Self {
            second_s2: -k2 / two,
            fourth_s4: k2 * k2 / eight - k4 / (eight + eight + eight),
        }
    }

    /// p_cmd − p from the second and fourth derivative of p.
    pub fn offset(&self, second: T, fourth: T) -> T {
        self.second_s2 * second + self.fourth_s4 * fourth
    }

    /// The gain on a circle. With p = R·e^{iθ}: p″ = (iα − ω²) p and, by the fourth complete Bell polynomial of
    /// (iω, iα, ij, is), p⁗ = (ω⁴ − 6iω²α − 4ωj − 3α² + is) p.
    pub fn gain(&self, m: &AngularMotion<T>) -> Gain<T> {
        let [two, three] = [T::one() + T::one(), T::one() + T::one() + T::one()];
        let squared = m.rate * m.rate;
        Gain {
            radial: -self.second_s2 * squared
                + self.fourth_s4
                    * (squared * squared
                        - two * two * m.rate * m.jerk
                        - three * m.acceleration * m.acceleration),
            tangential: self.second_s2 * m.acceleration
                + self.fourth_s4 * (m.snap - two * three * squared * m.acceleration),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The gain against derivatives of R·e^{iθ(t)} taken by Taylor arithmetic: θ(t) = Σ aₖ tᵏ, so that
    /// q = e^{iθ} obeys q′ = iθ′q, which gives its Taylor coefficients one after the other.
    #[test]
    fn gain_is_the_operator_on_a_circle_with_moving_rate() {
        let m = AngularMotion {
            rate: 5.0,
            acceleration: -31.0,
            jerk: 410.0,
            snap: -7300.0,
        };
        // Taylor coefficients of θ′.
        let rate = [m.rate, m.acceleration, m.jerk / 2.0, m.snap / 6.0];
        let mut q = [(0.0f64, 0.0f64); 5];
        q[0] = (1.0, 0.0);
        for n in 0..4 {
            let mut sum = (0.0, 0.0);
            for k in 0..=n {
                sum.0 -= rate[k] * q[n - k].1;
                sum.1 += rate[k] * q[n - k].0;
            }
            q[n + 1] = (sum.0 / (n + 1) as f64, sum.1 / (n + 1) as f64);
        }
        let operator = Operator::new(&Cumulants {
            kappa2_s2: 5.3e-4,
            kappa4_s4: 9.4e-7,
        });
        let gain = operator.gain(&m);
        let radial = operator.offset(2.0 * q[2].0, 24.0 * q[4].0);
        let tangential = operator.offset(2.0 * q[2].1, 24.0 * q[4].1);
        assert!(
            (gain.radial - radial).abs() < 1e-15 && radial.abs() > 1e-3,
            "{gain:?} {radial}"
        );
        assert!(
            (gain.tangential - tangential).abs() < 1e-15 && tangential.abs() > 1e-3,
            "{tangential}"
        );
    }

    #[test]
    fn steady_gain_undoes_the_radius_model_to_fourth_order() {
        // β of the source paper's robot; κ from β: β1 = −κ2/2, β2 = κ2²/8 + κ4/24.
        let (beta1, beta2): (f64, f64) = (-23.29e-6, -0.23e-6);
        let kappa2_s2 = -2.0 * beta1;
        let cumulants = Cumulants {
            kappa2_s2,
            kappa4_s4: 24.0 * (beta2 - kappa2_s2 * kappa2_s2 / 8.0),
        };
        let operator = Operator::new(&cumulants);
        let loop_error = |w: f64| {
            let gain = operator.gain(&AngularMotion {
                rate: w,
                ..Default::default()
            });
            ((1.0 + gain.radial) * (1.0 + beta1 * w * w + beta2 * w.powi(4)) - 1.0).abs()
        };
        // What is left is of order ω⁶: halving ω divides it by 64.
        assert!(loop_error(7.0) < 2e-6);
        let ratio = loop_error(4.0) / loop_error(2.0);
        assert!((60.0..80.0).contains(&ratio), "{ratio}");
    }
}
