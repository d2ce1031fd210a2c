//! Offset of a joint's zero: error `+offset` of its angle, the same at all places; an oval on a circle, which depends on the place.
//!
//! Counted from the place that the zone names: there nothing is moved.
use super::check::{Number, joint, magnitude};
use super::{Extent, Kind, Reach, Term};
use crate::Actuator;
use crate::law::{Profile, Unmergeable, finite, joint_errors};
use num_traits::Float;

/// Largest offset, rad: three degrees.
const OFFSET_MAX_RAD: f32 = 0.05;

#[derive(Clone, Copy)]
pub(super) struct JointZero<T> {
    pub(super) actuator: Actuator,
    pub(super) offset_rad: T,
}

impl<T: Float> Kind<T> for JointZero<T> {
    fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        Term::JointZero {
            actuator: self.actuator,
            offset_rad: f(self.offset_rad),
        }
    }

    fn validate(self) -> Result<(), super::Unfit> {
        joint(self.actuator)?;
        magnitude(Number::Angle, self.offset_rad, OFFSET_MAX_RAD)
    }

    fn reach(self, extent: &Extent<T>) -> Reach<T> {
        // What changes over a circle is in proportion to its radius.
        let offset = self.offset_rad * extent.radius_m;
        Reach::of(offset, offset * extent.omega_rad_s)
    }

    fn add(self, profile: &mut Profile<T>) -> Result<(), Unmergeable> {
        let offset = finite(self.offset_rad)?;
        let errors = joint_errors(profile, self.actuator)?;
        errors.zero_rad = errors.zero_rad + offset;
        Ok(())
    }
}
