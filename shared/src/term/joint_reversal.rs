//! Friction pulse of a joint after it has turned back: error `−peak·sgn(q̇)·exp(−t/decay)` of its angle, half up when the friction has
//! changed over (a travel of the joint) and the loop has answered (a rise).
use super::check::{Number, joint, magnitude, within};
use super::reach::{number, rise, through_loop};
use super::{Extent, Kind, LEVER_M, LOOP_S, Reach, Term};
use crate::Actuator;
use crate::law::{Profile, Unmergeable, finite, joint_errors, positive};
use num_traits::Float;

/// Largest pulse, rad.
const PEAK_MAX_RAD: f32 = 0.02;
/// Time constant of the loop that limits are made for, s.
const LOOP_REACH_S: f64 = 0.02;
/// Shortest and longest decay, s.
const DECAY_S: [f32; 2] = [1.0e-3, 10.0];

#[derive(Clone, Copy)]
pub(super) struct JointReversal<T> {
    pub(super) actuator: Actuator,
    pub(super) peak_rad: T,
    pub(super) decay_s: T,
    pub(super) rise_s: T,
    pub(super) presliding_rad: T,
}

impl<T: Float> Kind<T> for JointReversal<T> {
    fn map<U>(self, f: impl Fn(T) -> U) -> Term<U> {
        Term::JointReversal {
            actuator: self.actuator,
            peak_rad: f(self.peak_rad),
            decay_s: f(self.decay_s),
            rise_s: f(self.rise_s),
            presliding_rad: f(self.presliding_rad),
        }
    }

    fn validate(self) -> Result<(), super::Unfit> {
        joint(self.actuator)?;
        magnitude(Number::Angle, self.peak_rad, PEAK_MAX_RAD)?;
        within(Number::Decay, self.decay_s, DECAY_S)?;
        within(Number::Rise, self.rise_s, LOOP_S)?;
        within(Number::Angle, self.presliding_rad, [0.0, PEAK_MAX_RAD])
    }

    fn reach(self, _extent: &Extent<T>) -> Reach<T> {
        let peak_m = self.peak_rad * number(LEVER_M);
        through_loop(
            Reach::of(peak_m, rise(peak_m + peak_m)),
            number(LOOP_REACH_S),
        )
    }

    fn add(self, profile: &mut Profile<T>) -> Result<(), Unmergeable> {
        let (peak, decay) = (finite(self.peak_rad)?, positive(self.decay_s)?);
        let (rise, presliding) = (finite(self.rise_s)?, finite(self.presliding_rad)?);
        let errors = joint_errors(profile, self.actuator)?;
        if errors.peak_rad != T::zero() && errors.decay_s != decay {
            return Err(Unmergeable::TooMany);
        }
        errors.peak_rad = errors.peak_rad + peak;
        errors.decay_s = decay;
        (errors.rise_s, errors.presliding_rad) = (rise, presliding);
        Ok(())
    }
}
