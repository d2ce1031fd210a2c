//! Periodic error of a joint's gear: error `amplitude·sin(waves·q + phase)` of its angle q; a chirp on a circle, the same at all feeds.
use super::check::{Number, joint, magnitude, within};
use super::reach::number;
use super::{Extent, Kind, LEVER_M, Reach, Term};
use crate::Actuator;
use crate::law::{Gear, Profile, Unmergeable, finite, joint_errors, positive};
use num_traits::Float;

/// Largest amplitude, rad.
const AMPLITUDE_MAX_RAD: f32 = 0.02;
/// Fewest and most waves in a turn of the joint.
const WAVES: [f32; 2] = [0.5, 1000.0];
/// Largest |phase|, rad: one turn, rounded up.
const PHASE_MAX_RAD: f32 = 6.3;

#[derive(Clone, Copy)]
pub(super) struct JointCyclic<T> {
    pub(super) actuator: Actuator,
    pub(super) amplitude_rad: T,
    pub(super) waves: T,
    pub(super) phase_rad: T,
}

impl<T: Float> Kind<T> for JointCyclic<T> {
    fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        Term::JointCyclic {
            actuator: self.actuator,
            amplitude_rad: f(self.amplitude_rad),
            waves: f(self.waves),
            phase_rad: f(self.phase_rad),
        }
    }

    fn validate(self) -> Result<(), super::Unfit> {
        joint(self.actuator)?;
        magnitude(Number::Angle, self.amplitude_rad, AMPLITUDE_MAX_RAD)?;
        within(Number::Waves, self.waves, WAVES)?;
        magnitude(Number::Phase, self.phase_rad, PHASE_MAX_RAD)
    }

    fn reach(self, extent: &Extent<T>) -> Reach<T> {
        // A joint alone may move the tool twice as fast as the feed.
        let offset = self.amplitude_rad * number(LEVER_M);
        let rate = number::<T>(2.0) * self.waves * extent.feed_m_s / number(LEVER_M);
        Reach::of(offset, offset * rate)
    }

    fn add(self, profile: &mut Profile<T>) -> Result<(), Unmergeable> {
        let gear = Gear {
            amplitude_rad: finite(self.amplitude_rad)?,
            waves: positive(self.waves)?,
            phase_rad: finite(self.phase_rad)?,
        };
        let errors = joint_errors(profile, self.actuator)?;
        let free = errors
            .gear
            .iter_mut()
            .find(|g| g.amplitude_rad == T::zero());
        *free.ok_or(Unmergeable::TooMany)? = gear;
        Ok(())
    }
}
