//! Bowed guide: travel along an actuator shifts another by `c·u²`, u measured from the centre of the circle.
//!
//! Travel along the first slide of a plane leaves `r = cR²·cos²θ·sinθ = (cR²/4)(sinθ + sin3θ)`, along the second
//! `r = cR²·sin²θ·cosθ = (cR²/4)(cosθ − cos3θ)`.
use super::check::{self, Number, magnitude};
use super::reach::number;
use super::{Extent, Kind, Reach, Term};
use crate::bounds::{OFFSET_MAX_M, RADIUS_MAX_M};
use crate::law::{Profile, Unmergeable, finite, slide_index};
use crate::{Actuator, Plane};
use num_traits::Float;

/// Largest bow of a guide, 1/m: the largest offset over the square of the largest radius.
const CURVATURE_MAX_PER_M: f32 = OFFSET_MAX_M / (RADIUS_MAX_M * RADIUS_MAX_M);

#[derive(Clone, Copy)]
pub(super) struct Straightness<T> {
    pub(super) actuator: Actuator,
    pub(super) across: Actuator,
    pub(super) curvature_per_m: T,
}

impl<T: Float> Kind<T> for Straightness<T> {
    fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        Term::Straightness {
            actuator: self.actuator,
            across: self.across,
            curvature_per_m: f(self.curvature_per_m),
        }
    }

    fn validate(self) -> Result<(), super::Unfit> {
        check::across(self.actuator, self.across)?;
        magnitude(Number::Curvature, self.curvature_per_m, CURVATURE_MAX_PER_M)
    }

    fn reach(self, extent: &Extent<T>) -> Reach<T> {
        let share = self.curvature_per_m * extent.radius_m;
        Reach::of(
            share * extent.radius_m,
            number::<T>(2.0) * share * extent.feed_m_s,
        )
    }

    fn add(self, profile: &mut Profile<T>) -> Result<(), Unmergeable> {
        Plane::of(self.actuator, self.across).ok_or(Unmergeable::Actuator)?;
        let (along, across) = (slide_index(self.actuator)?, slide_index(self.across)?);
        let at = &mut profile.bow_per_m[along][across];
        *at = *at + finite(self.curvature_per_m)?;
        Ok(())
    }
}
