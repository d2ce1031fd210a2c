//! The radius model: from servo dynamics to the size of a circle and back.
//!
//! On a circle at constant rate ω = f/R a linear chain, the same on both axes, only scales: Rm = R·|G(jω)|, and
//! ln|G(jω)| = −κ2 ω²/2 + κ4 ω⁴/24 − …, κ the cumulants of its impulse response, which add over a cascade.
//!
//! Every conversion between elements, cumulants, β and responses is in this folder and nowhere else.
//!
//! | file | holds |
//! |---|---|
//! | here | [`RadiusModel`] (β of Eq. 15), [`Cumulants`], each from the other; prediction |
//! | `element` | [`Element`]: lag, filter, feed-forward, moving average, second order, chords; exact gain and cumulants |
//! | `inverse` | what to program so that the wanted circle comes out |
//! | `response` | [`Response`]: 1 + aω² + bω⁴, the form that a lag and a second order share; to elements and back |
//! | `class` | which elements a ratio κ4/κ2² allows |
//! | `equivalent` | the second-order or feed-forward element with given cumulants |
//! | `third_cumulant` | the third cumulant that a lag and an average with given cumulants have |
mod class;
mod element;
mod equivalent;
mod inverse;
mod response;
mod third_cumulant;

pub use class::{Class, Classes};
pub use element::Element;
pub use equivalent::Equivalent;
pub use inverse::{InverseError, Programmed};
pub use response::Response;

use core::ops::{Add, AddAssign, Neg};
use num_traits::Float;
use serde::{Deserialize, Serialize};

/// Coefficients of the paper's empirical model, Eq. 15: ΔR = β1 f²/R + β2 f⁴/R³ (SI: m, m/s).
///
/// ```
/// use giotto_shared::model::RadiusModel;
///
/// // The paper's robot on a circle of 100 mm at 0.7 m/s: 169 µm too small.
/// let robot = RadiusModel { beta1_s2: -23.29e-6, beta2_s4: -0.23e-6 };
/// let error_m = robot.radius_error_m(0.1, 0.7);
/// assert!((error_m + 169.3e-6_f64).abs() < 0.1e-6);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct RadiusModel<T> {
    /// β1, s².
    pub beta1_s2: T,
    /// β2, s⁴.
    pub beta2_s4: T,
}

/// Second and fourth cumulant of the impulse response of the axis-matched chain; they add over a cascade.
/// ln(1 + ΔR/R) = −κ2 ω²/2 + κ4 ω⁴/24.
///
/// ```
/// use giotto_shared::model::{Cumulants, Element, RadiusModel};
///
/// // A position loop of kv = 50/s behind a linear acceleration filter of 40 ms: cumulants add.
/// let chain: Cumulants<f64> = [
///     Element::Lag { kv_per_s: 50.0 },
///     Element::MovingAverage { window_s: 0.04 },
/// ]
/// .iter()
/// .map(Element::cumulants)
/// .sum();
/// assert!((chain.kappa2_s2 - (0.02 * 0.02 + 0.04 * 0.04 / 12.0)).abs() < 1e-18);
/// // The same chain in the coefficients of the paper's model, and back.
/// let beta = RadiusModel::from(chain);
/// assert_eq!(beta.beta1_s2, -chain.kappa2_s2 / 2.0);
/// assert!((Cumulants::from(beta).kappa4_s4 / chain.kappa4_s4 - 1.0).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Cumulants<T> {
    /// κ2, s².
    pub kappa2_s2: T,
    /// κ4, s⁴.
    pub kappa4_s4: T,
}

/// Least ζ² of an element that is made to measure: what is fitted to noise may ask for less than no damping.
const LEAST_DAMPING_SQUARED: f64 = 1e-4;

/// A small whole number as a float.
pub(crate) fn number<T: Float>(value: f64) -> T {
    // Every float type of num-traits takes any f64; the fallback is never reached.
    T::from(value).unwrap_or_else(T::nan)
}

impl<T: Float> RadiusModel<T> {
    /// Radius error ΔR = Rm − R of a circle programmed with radius `radius_m` (> 0) and feed `feed_m_s`, m (Eq. 15).
    pub fn radius_error_m(&self, radius_m: T, feed_m_s: T) -> T {
        radius_m * self.relative_error(feed_m_s / radius_m)
    }

    /// ΔR/R at angular rate ω, rad/s: β1ω² + β2ω⁴.
    pub fn relative_error(&self, omega_rad_s: T) -> T {
        let w2 = omega_rad_s * omega_rad_s;
        w2 * (self.beta1_s2 + w2 * self.beta2_s4)
    }
}

impl<T: Float> Cumulants<T> {
    /// Radius error of a circle, m; agrees with [`RadiusModel::radius_error_m`] to the order of ω⁶.
    pub fn radius_error_m(&self, radius_m: T, feed_m_s: T) -> T {
        radius_m * self.log_gain(feed_m_s / radius_m).exp_m1()
    }

    /// ln(Rm/R) at angular rate ω, rad/s.
    pub fn log_gain(&self, omega_rad_s: T) -> T {
        let w2 = omega_rad_s * omega_rad_s;
        w2 * (w2 * self.kappa4_s4 / number(24.0) - self.kappa2_s2 / number(2.0))
    }

    /// κ4/κ2²: the only trace that the kind of element leaves in radial data. NaN or infinite for κ2 = 0.
    pub fn ratio(&self) -> T {
        self.kappa4_s4 / (self.kappa2_s2 * self.kappa2_s2)
    }
}

impl<T: Float> From<Cumulants<T>> for RadiusModel<T> {
    /// β1 = −κ2/2, β2 = κ2²/8 + κ4/24.
    fn from(k: Cumulants<T>) -> Self {
        let (k2, k4) = (k.kappa2_s2, k.kappa4_s4);
        Self {
            beta1_s2: -k2 / number(2.0),
            beta2_s4: k2 * k2 / number(8.0) + k4 / number(24.0),
        }
    }
}

impl<T: Float> From<RadiusModel<T>> for Cumulants<T> {
    /// κ2 = −2β1, κ4 = 24β2 − 12β1².
    fn from(b: RadiusModel<T>) -> Self {
        let (b1, b2) = (b.beta1_s2, b.beta2_s4);
        Self {
            kappa2_s2: -number::<T>(2.0) * b1,
            kappa4_s4: number::<T>(24.0) * b2 - number::<T>(12.0) * b1 * b1,
        }
    }
}

impl<T: Float> Add for Cumulants<T> {
    type Output = Self;

    /// The cumulants of one element after the other.
    fn add(self, other: Self) -> Self {
        Self {
            kappa2_s2: self.kappa2_s2 + other.kappa2_s2,
            kappa4_s4: self.kappa4_s4 + other.kappa4_s4,
        }
    }
}

impl<T: Float> AddAssign for Cumulants<T> {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<T: Float> Neg for Cumulants<T> {
    type Output = Self;

    /// The cumulants of the inverse chain.
    fn neg(self) -> Self {
        Self {
            kappa2_s2: -self.kappa2_s2,
            kappa4_s4: -self.kappa4_s4,
        }
    }
}

impl<T: Float> core::iter::Sum for Cumulants<T> {
    fn sum<I: Iterator<Item = Self>>(elements: I) -> Self {
        elements.fold(
            Self {
                kappa2_s2: T::zero(),
                kappa4_s4: T::zero(),
            },
            Add::add,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conversions_undo_each_other() {
        let beta = RadiusModel {
            beta1_s2: -23.29e-6,
            beta2_s4: -0.23e-6,
        };
        let back = RadiusModel::from(Cumulants::from(beta));
        assert!((back.beta1_s2 / beta.beta1_s2 - 1.0_f64).abs() < 1e-15);
        assert!((back.beta2_s4 / beta.beta2_s4 - 1.0_f64).abs() < 1e-13);
    }

    #[test]
    fn the_papers_robot_needs_a_ratio_no_lag_can_give() {
        let k = Cumulants::from(RadiusModel {
            beta1_s2: -23.29e-6_f64,
            beta2_s4: -0.23e-6,
        });
        assert!((k.ratio() + 2547.0).abs() < 1.0, "{}", k.ratio());
    }

    #[test]
    fn both_predictions_agree_to_sixth_order() {
        let k = Cumulants {
            kappa2_s2: 4e-4_f64,
            kappa4_s4: 9.6e-7,
        };
        let beta = RadiusModel::from(k);
        let difference = |w: f64| k.log_gain(w).exp_m1() - beta.relative_error(w);
        // Halving ω divides a sixth-order remainder by 64.
        let ratio = difference(8.0) / difference(4.0);
        assert!((ratio - 64.0).abs() < 2.0, "{ratio}");
    }
}
