//! A link longer than programmed: error `longer` along it; ovals and scale on a circle, which depend on the place.
//!
//! Counted from the place that the zone names: there nothing is moved.
use super::check::{Number, joint, magnitude};
use super::reach::number;
use super::{Extent, Kind, Reach, Term};
use crate::Actuator;
use crate::law::{Profile, Unmergeable, finite};
use num_traits::Float;

/// Shortest link that is reckoned with, m.
const LEAST_LINK_M: f64 = 0.3;
/// Largest error of a length, m.
const LONGER_MAX_M: f32 = 0.02;

#[derive(Clone, Copy)]
pub(super) struct LinkLength<T> {
    pub(super) actuator: Actuator,
    pub(super) longer_m: T,
}

impl<T: Float> Kind<T> for LinkLength<T> {
    fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        Term::LinkLength {
            actuator: self.actuator,
            longer_m: f(self.longer_m),
        }
    }

    fn validate(self) -> Result<(), super::Unfit> {
        joint(self.actuator)?;
        magnitude(Number::Length, self.longer_m, LONGER_MAX_M)
    }

    fn reach(self, extent: &Extent<T>) -> Reach<T> {
        // What changes over a circle is in proportion to its radius, and links are longer than radii.
        let offset = number::<T>(2.0) * self.longer_m * extent.radius_m / number::<T>(LEAST_LINK_M);
        Reach::of(offset, offset * extent.omega_rad_s)
    }

    fn add(self, profile: &mut Profile<T>) -> Result<(), Unmergeable> {
        let longer = finite(self.longer_m)?;
        if self.actuator.is_slide() {
            return Err(Unmergeable::Actuator);
        }
        let link = profile.arm.longer_m.get_mut(self.actuator.index());
        let link = link.ok_or(Unmergeable::Actuator)?;
        *link = *link + longer;
        Ok(())
    }
}
