//! Sideways shift with the sense in which an actuator travels.
//!
//! If the two are the first and second slide of a plane, the error along the second is `+½L·sgn(u̇)` and a circle shows
//! `r = −d(L/2)|sinθ|`; if they are the second and first, the error along the first is `−½L·sgn(v̇)` and a circle shows
//! `r = −d(L/2)|cosθ|`. So a positive L makes counter-clockwise circles smaller either way: the mean moves by −dL/π.
use super::check::{self, Number, magnitude};
use super::{Extent, Kind, Reach, Term};
use crate::bounds::OFFSET_MAX_M;
use crate::law::{Profile, Unmergeable, finite, slide_index};
use crate::{Actuator, Plane};
use num_traits::Float;

#[derive(Clone, Copy)]
pub(super) struct LateralPlay<T> {
    pub(super) actuator: Actuator,
    pub(super) across: Actuator,
    pub(super) shift_m: T,
}

impl<T: Float> Kind<T> for LateralPlay<T> {
    fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        Term::LateralPlay {
            actuator: self.actuator,
            across: self.across,
            shift_m: f(self.shift_m),
        }
    }

    fn validate(self) -> Result<(), super::Unfit> {
        check::across(self.actuator, self.across)?;
        magnitude(Number::Length, self.shift_m, OFFSET_MAX_M)
    }

    fn reach(self, _extent: &Extent<T>) -> Reach<T> {
        Reach::of_step(self.shift_m)
    }

    fn add(self, profile: &mut Profile<T>) -> Result<(), Unmergeable> {
        let plane = Plane::of(self.actuator, self.across).ok_or(Unmergeable::Actuator)?;
        let (along, across) = (slide_index(self.actuator)?, slide_index(self.across)?);
        let shift_m = finite(self.shift_m)?;
        let [first, _] = plane.axes();
        let at = &mut profile.play_m[along][across];
        // Play counts against the sense of travel.
        *at = if self.actuator == first {
            *at - shift_m
        } else {
            *at + shift_m
        };
        Ok(())
    }
}
