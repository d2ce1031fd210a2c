//! The first slide of a plane has the larger second cumulant: errors `+¼Δκ2·ü` and `−¼Δκ2·v̈`,
//! `r = −(Δκ2/4)(f²/R)·cos2θ` in that plane, the same both ways.
use super::check::{Number, magnitude};
use super::reach::number;
use super::{Extent, Kind, Reach, Term};
use crate::Plane;
use crate::bounds::KAPPA2_MAX_S2;
use crate::law::{Profile, Unmergeable, finite};
use num_traits::Float;

#[derive(Clone, Copy)]
pub(super) struct BandwidthMismatch<T> {
    pub(super) plane: Plane,
    pub(super) delta_kappa2_s2: T,
}

impl<T: Float> Kind<T> for BandwidthMismatch<T> {
    fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        Term::BandwidthMismatch {
            plane: self.plane,
            delta_kappa2_s2: f(self.delta_kappa2_s2),
        }
    }

    fn validate(self) -> Result<(), super::Unfit> {
        magnitude(Number::DeltaKappa2, self.delta_kappa2_s2, KAPPA2_MAX_S2)
    }

    fn reach(self, extent: &Extent<T>) -> Reach<T> {
        let offset =
            number::<T>(0.25) * self.delta_kappa2_s2 * extent.feed_m_s * extent.omega_rad_s;
        Reach::of(offset, offset * extent.omega_rad_s)
    }

    fn add(self, profile: &mut Profile<T>) -> Result<(), Unmergeable> {
        let quarter = number::<T>(0.25) * finite(self.delta_kappa2_s2)?;
        let [first, second] = self.plane.slides();
        profile.acceleration_s2[first] = profile.acceleration_s2[first] + quarter;
        profile.acceleration_s2[second] = profile.acceleration_s2[second] - quarter;
        Ok(())
    }
}
