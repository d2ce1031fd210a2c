//! Constant radial error of circles, from the calibration of ball, bar or tool: `r = offset`.
//!
//! It acts in the plane of the arc, along the radius; on a line there is none.
use super::check::{Number, magnitude};
use super::{Extent, Kind, Reach, Term};
use crate::bounds::OFFSET_MAX_M;
use crate::law::{Profile, Unmergeable, finite};
use num_traits::Float;

#[derive(Clone, Copy)]
pub(super) struct RadiusOffset<T> {
    pub(super) offset_m: T,
}

impl<T: Float> Kind<T> for RadiusOffset<T> {
    fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        Term::RadiusOffset {
            offset_m: f(self.offset_m),
        }
    }

    fn validate(self) -> Result<(), super::Unfit> {
        magnitude(Number::Length, self.offset_m, OFFSET_MAX_M)
    }

    fn reach(self, extent: &Extent<T>) -> Reach<T> {
        Reach::of(self.offset_m, self.offset_m * extent.omega_rad_s)
    }

    fn add(self, profile: &mut Profile<T>) -> Result<(), Unmergeable> {
        profile.radius_offset_m = profile.radius_offset_m + finite(self.offset_m)?;
        Ok(())
    }
}
