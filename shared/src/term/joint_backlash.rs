//! Play of a joint's gear: error `−½play·sgn(q̇)` of its angle, a step on a circle where the joint turns back.
use super::check::{Number, joint, magnitude};
use super::reach::number;
use super::{Extent, Kind, LEVER_M, Reach, Term};
use crate::Actuator;
use crate::law::{Profile, Unmergeable, finite, joint_errors};
use num_traits::Float;

/// Largest play, rad: more is a broken gear.
const PLAY_MAX_RAD: f32 = 0.02;

#[derive(Clone, Copy)]
pub(super) struct JointBacklash<T> {
    pub(super) actuator: Actuator,
    pub(super) play_rad: T,
}

impl<T: Float> Kind<T> for JointBacklash<T> {
    fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        Term::JointBacklash {
            actuator: self.actuator,
            play_rad: f(self.play_rad),
        }
    }

    fn validate(self) -> Result<(), super::Unfit> {
        joint(self.actuator)?;
        magnitude(Number::Angle, self.play_rad, PLAY_MAX_RAD)
    }

    fn reach(self, _extent: &Extent<T>) -> Reach<T> {
        Reach::of_step(self.play_rad * number(LEVER_M))
    }

    fn add(self, profile: &mut Profile<T>) -> Result<(), Unmergeable> {
        let play = finite(self.play_rad)?;
        let errors = joint_errors(profile, self.actuator)?;
        errors.play_rad = errors.play_rad + play;
        Ok(())
    }
}
