//! Two slides that are not square: error `½ε·v` along the first and `½ε·u` along the second, `r = ½εR·sin2θ` in their
//! plane, the same both ways.
use super::check::{Number, magnitude};
use super::reach::number;
use super::{Extent, Kind, Reach, Term};
use crate::Plane;
use crate::law::{Profile, Unmergeable, finite};
use num_traits::Float;

/// Largest squareness error, rad: 1 % of the arm, as that of a length.
const SHEAR_MAX_RAD: f32 = 1.0e-2;

#[derive(Clone, Copy)]
pub(super) struct Squareness<T> {
    pub(super) plane: Plane,
    pub(super) shear_rad: T,
}

impl<T: Float> Kind<T> for Squareness<T> {
    fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        Term::Squareness {
            plane: self.plane,
            shear_rad: f(self.shear_rad),
        }
    }

    fn validate(self) -> Result<(), super::Unfit> {
        magnitude(Number::Shear, self.shear_rad, SHEAR_MAX_RAD)
    }

    fn reach(self, extent: &Extent<T>) -> Reach<T> {
        let half = number::<T>(0.5) * self.shear_rad;
        Reach::of(half * extent.radius_m, half * extent.feed_m_s)
    }

    fn add(self, profile: &mut Profile<T>) -> Result<(), Unmergeable> {
        let half = number::<T>(0.5) * finite(self.shear_rad)?;
        let [first, second] = self.plane.slides();
        profile.position[first][second] = profile.position[first][second] + half;
        profile.position[second][first] = profile.position[second][first] + half;
        Ok(())
    }
}
