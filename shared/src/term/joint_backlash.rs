//! Play of a joint's gear: error `−½play·sgn(q̇)` of its angle, a step on a circle where the joint turns back.
use super::check::{Number, joint, magnitude, within};
use super::reach::{number, through_loop};
use super::{Extent, Kind, LEVER_M, LOOP_S, Reach, Term};
use crate::Actuator;
use crate::law::{Profile, Unmergeable, finite, joint_errors};
use num_traits::Float;

/// Largest play, rad: more is a broken gear.
const PLAY_MAX_RAD: f32 = 0.02;

#[derive(Clone, Copy)]
pub(super) struct JointBacklash<T> {
    pub(super) actuator: Actuator,
    pub(super) play_rad: T,
    pub(super) loop_s: T,
}

impl<T: Float> Kind<T> for JointBacklash<T> {
    fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        Term::JointBacklash {
            actuator: self.actuator,
            play_rad: f(self.play_rad),
            loop_s: f(self.loop_s),
        }
    }

    fn validate(self) -> Result<(), super::Unfit> {
        joint(self.actuator)?;
        magnitude(Number::Angle, self.play_rad, PLAY_MAX_RAD)?;
        within(Number::Loop, self.loop_s, LOOP_S)
    }

    fn reach(self, _extent: &Extent<T>) -> Reach<T> {
        let step = Reach::of_step(self.play_rad * number(LEVER_M));
        through_loop(step, self.loop_s)
    }

    fn add(self, profile: &mut Profile<T>) -> Result<(), Unmergeable> {
        let (play, loop_s) = (finite(self.play_rad)?, finite(self.loop_s)?);
        let errors = joint_errors(profile, self.actuator)?;
        errors.play_rad = errors.play_rad + play;
        errors.loop_s = errors.loop_s.max(loop_s);
        Ok(())
    }
}
