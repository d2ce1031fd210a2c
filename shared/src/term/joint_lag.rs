//! A joint that lags and smooths more than the others: error `−Δτ·q̇ + ½Δκ2·q̈` of its angle.
//!
//! On a circle `r = n̂ᵀJe·δq`: of Δτ a mean that grows with the feed and an oval that flips with the direction, of Δκ2 ovals and a
//! mean that grow with its square.
use super::check::{Number, joint, magnitude};
use super::reach::number;
use super::{Extent, Kind, Reach, Term};
use crate::Actuator;
use crate::law::{Profile, Unmergeable, finite, joint_errors};
use num_traits::Float;

/// Largest lag beyond that of the others, s.
const DELTA_TAU_MAX_S: f32 = 2.0e-2;
/// Largest second cumulant beyond that of the others, s².
const DELTA_KAPPA2_MAX_S2: f32 = 1.0e-2;

#[derive(Clone, Copy)]
pub(super) struct JointLag<T> {
    pub(super) actuator: Actuator,
    pub(super) delta_tau_s: T,
    pub(super) delta_kappa2_s2: T,
}

impl<T: Float> Kind<T> for JointLag<T> {
    fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        Term::JointLag {
            actuator: self.actuator,
            delta_tau_s: f(self.delta_tau_s),
            delta_kappa2_s2: f(self.delta_kappa2_s2),
        }
    }

    fn validate(self) -> Result<(), super::Unfit> {
        joint(self.actuator)?;
        magnitude(Number::DeltaTau, self.delta_tau_s, DELTA_TAU_MAX_S)?;
        magnitude(
            Number::DeltaKappa2,
            self.delta_kappa2_s2,
            DELTA_KAPPA2_MAX_S2,
        )
    }

    fn reach(self, extent: &Extent<T>) -> Reach<T> {
        // A joint alone may move the tool faster than the feed: what the others take back.
        let two = number::<T>(2.0);
        let offset = two * self.delta_tau_s.abs() * extent.feed_m_s
            + self.delta_kappa2_s2.abs() * extent.feed_m_s * extent.omega_rad_s;
        Reach::of(offset, offset * extent.omega_rad_s)
    }

    fn add(self, profile: &mut Profile<T>) -> Result<(), Unmergeable> {
        let half = number::<T>(0.5);
        let (lag, second) = (finite(self.delta_tau_s)?, finite(self.delta_kappa2_s2)?);
        let errors = joint_errors(profile, self.actuator)?;
        errors.lag_s = errors.lag_s + lag;
        errors.second_s2 = errors.second_s2 + half * second;
        Ok(())
    }
}
