//! The first slide of a plane longer than the second: errors `+½·relative·u` and `−½·relative·v`,
//! `r = ½R·relative·cos2θ` in that plane, the same both ways.
use super::check::{Number, magnitude};
use super::reach::number;
use super::scale_error::RELATIVE_MAX;
use super::{Extent, Kind, Reach, Term};
use crate::Plane;
use crate::law::{Profile, Unmergeable, finite};
use num_traits::Float;

#[derive(Clone, Copy)]
pub(super) struct ScaleMismatch<T> {
    pub(super) plane: Plane,
    pub(super) relative: T,
}

impl<T: Float> Kind<T> for ScaleMismatch<T> {
    fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        Term::ScaleMismatch {
            plane: self.plane,
            relative: f(self.relative),
        }
    }

    fn validate(self) -> Result<(), super::Unfit> {
        magnitude(Number::Relative, self.relative, RELATIVE_MAX)
    }

    fn reach(self, extent: &Extent<T>) -> Reach<T> {
        let half = number::<T>(0.5) * self.relative;
        Reach::of(half * extent.radius_m, half * extent.feed_m_s)
    }

    fn add(self, profile: &mut Profile<T>) -> Result<(), Unmergeable> {
        let half = number::<T>(0.5) * finite(self.relative)?;
        let [first, second] = self.plane.slides();
        profile.position[first][first] = profile.position[first][first] + half;
        profile.position[second][second] = profile.position[second][second] - half;
        Ok(())
    }
}
