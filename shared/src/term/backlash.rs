//! Motion lost at each reversal of an actuator: error `−½B·sgn(u̇)` along it, half the step on either side.
//!
//! A positive step is outward after the reversal. On a circle the first slide of its plane leaves
//! `r = d(B/2)·sgn(sinθ)·cosθ`, the second `r = −d(B/2)·sgn(cosθ)·sinθ`.
use super::check::{Number, magnitude, slide};
use super::{Extent, Kind, Reach, Term};
use crate::Actuator;
use crate::bounds::OFFSET_MAX_M;
use crate::law::{Profile, Unmergeable, finite, slide_index};
use num_traits::Float;

#[derive(Clone, Copy)]
pub(super) struct Backlash<T> {
    pub(super) actuator: Actuator,
    pub(super) step_m: T,
}

impl<T: Float> Kind<T> for Backlash<T> {
    fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        Term::Backlash {
            actuator: self.actuator,
            step_m: f(self.step_m),
        }
    }

    fn validate(self) -> Result<(), super::Unfit> {
        slide(self.actuator)?;
        magnitude(Number::Length, self.step_m, OFFSET_MAX_M)
    }

    fn reach(self, _extent: &Extent<T>) -> Reach<T> {
        Reach::of_step(self.step_m)
    }

    fn add(self, profile: &mut Profile<T>) -> Result<(), Unmergeable> {
        let (slide, step_m) = (slide_index(self.actuator)?, finite(self.step_m)?);
        let at = &mut profile.play_m[slide][slide];
        *at = *at + step_m;
        Ok(())
    }
}
