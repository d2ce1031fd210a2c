//! One slide long: error `relative·u` along it, u its position from the reference point.
//!
//! In a plane that holds the slide, `r = R·relative·cos²(θ − θ₀)` with θ₀ the polar angle of the slide: half of it is a
//! scale error, half an oval.
use super::check::{Number, magnitude, slide};
use super::scale_error::RELATIVE_MAX;
use super::{Extent, Kind, Reach, Term};
use crate::Actuator;
use crate::law::{Profile, Unmergeable, finite, slide_index};
use num_traits::Float;

#[derive(Clone, Copy)]
pub(super) struct AxisScale<T> {
    pub(super) actuator: Actuator,
    pub(super) relative: T,
}

impl<T: Float> Kind<T> for AxisScale<T> {
    fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        Term::AxisScale {
            actuator: self.actuator,
            relative: f(self.relative),
        }
    }

    fn validate(self) -> Result<(), super::Unfit> {
        slide(self.actuator)?;
        magnitude(Number::Relative, self.relative, RELATIVE_MAX)
    }

    fn reach(self, extent: &Extent<T>) -> Reach<T> {
        Reach::of(
            self.relative * extent.radius_m,
            self.relative * extent.feed_m_s,
        )
    }

    fn add(self, profile: &mut Profile<T>) -> Result<(), Unmergeable> {
        let (slide, relative) = (slide_index(self.actuator)?, finite(self.relative)?);
        let at = &mut profile.position[slide][slide];
        *at = *at + relative;
        Ok(())
    }
}
