//! The first slide of a plane lags more than the second: errors `−½Δτ·u̇` and `+½Δτ·v̇`, `r = d·½fΔτ·sin2θ` in that
//! plane, opposite for the two senses of travel.
use super::check::{Number, magnitude};
use super::reach::number;
use super::{Extent, Kind, Reach, Term};
use crate::Plane;
use crate::law::{Profile, Unmergeable, finite};
use num_traits::Float;

/// Largest difference of lags, s.
const DELTA_TAU_MAX_S: f32 = 2.0e-2;

#[derive(Clone, Copy)]
pub(super) struct ServoMismatch<T> {
    pub(super) plane: Plane,
    pub(super) delta_tau_s: T,
}

impl<T: Float> Kind<T> for ServoMismatch<T> {
    fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        Term::ServoMismatch {
            plane: self.plane,
            delta_tau_s: f(self.delta_tau_s),
        }
    }

    fn validate(self) -> Result<(), super::Unfit> {
        magnitude(Number::DeltaTau, self.delta_tau_s, DELTA_TAU_MAX_S)
    }

    fn reach(self, extent: &Extent<T>) -> Reach<T> {
        let offset = number::<T>(0.5) * self.delta_tau_s * extent.feed_m_s;
        Reach::of(offset, offset * extent.omega_rad_s)
    }

    fn add(self, profile: &mut Profile<T>) -> Result<(), Unmergeable> {
        let half = number::<T>(0.5) * finite(self.delta_tau_s)?;
        let [first, second] = self.plane.slides();
        profile.velocity_s[first] = profile.velocity_s[first] - half;
        profile.velocity_s[second] = profile.velocity_s[second] + half;
        Ok(())
    }
}
