//! All slides long by the same share: error `relative·u` along each, `r = R·relative` in every plane.
use super::check::{Number, magnitude};
use super::{Extent, Kind, Reach, Term};
use crate::law::{Profile, Unmergeable, finite};
use num_traits::Float;

/// Largest relative length error or mismatch, m/m: 1 %.
pub(super) const RELATIVE_MAX: f32 = 1.0e-2;

#[derive(Clone, Copy)]
pub(super) struct ScaleError<T> {
    pub(super) relative: T,
}

impl<T: Float> Kind<T> for ScaleError<T> {
    fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        Term::ScaleError {
            relative: f(self.relative),
        }
    }

    fn validate(self) -> Result<(), super::Unfit> {
        magnitude(Number::Relative, self.relative, RELATIVE_MAX)
    }

    fn reach(self, extent: &Extent<T>) -> Reach<T> {
        Reach::of(
            self.relative * extent.radius_m,
            self.relative * extent.feed_m_s,
        )
    }

    fn add(self, profile: &mut Profile<T>) -> Result<(), Unmergeable> {
        let relative = finite(self.relative)?;
        for slide in 0..3 {
            let at = &mut profile.position[slide][slide];
            *at = *at + relative;
        }
        Ok(())
    }
}
