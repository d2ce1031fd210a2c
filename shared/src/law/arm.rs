//! What undoes the errors of an arm: each joint's error from its own motion, brought to the tool by the Jacobian.
//!
//! The common answer of the joints belongs to the angles, not to the place: `q + s·q̈ + t·q⃛ + u·q⁗` for each joint, where the
//! [`Operator`] alone would say `p + s·p̈ + u·p⁗`. The difference is what the curvature of the kinematics makes, the tilted ovals of
//! an arm without defect. The third derivative, which only delays a circle in space, delays the waves of an angle unequally. To it come the errors of single joints and links ([`JointErrors`]).
//!
//! The correction is linear in the error: what that leaves is of second order, half the square of the angle's error times the
//! lever, 0.1 µm at 0.5 mrad and 1 m.
use super::Operator;
use crate::kinematics::{Jet, Kinematics, ReachError, Real, Scalar};
use crate::model::Cumulants;
use num_traits::Float;

/// Periodic errors of one gear that can be undone at once.
pub const MAX_GEAR: usize = 2;

/// A periodic error of a joint's gear: `amplitude·sin(waves·q + phase)`.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Gear<T> {
    /// Amplitude, rad; 0: none.
    pub amplitude_rad: T,
    /// Waves in a turn of the joint.
    pub waves: T,
    /// Phase at angle 0, rad.
    pub phase_rad: T,
}

/// What is wrong with one joint.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct JointErrors<T> {
    /// Lag beyond that of the other joints, s: error `−lag·q̇`.
    pub lag_s: T,
    /// Half the second cumulant beyond that of the other joints, s²: error `+second·q̈`.
    pub second_s2: T,
    /// Offset of the zero, rad.
    pub zero_rad: T,
    /// Play of the gear, rad: error `−½play·sgn(q̇)`.
    pub play_rad: T,
    /// Height of the friction pulse after a reversal, rad: behind the motion.
    pub peak_rad: T,
    /// Time constant of its decay, s.
    pub decay_s: T,
    /// How long it takes to rise, s.
    pub rise_s: T,
    /// Travel over which the friction changes over, rad.
    pub presliding_rad: T,
    /// Time constant of the loop that what takes up play goes through, s; 0: none. Friction is behind the loop that all have in common.
    pub loop_s: T,
    /// Periodic errors.
    pub gear: [Gear<T>; MAX_GEAR],
}

impl<T: Float> JointErrors<T> {
    /// How long after the reversal the friction pulse is half up, s, where the joint turns round with an acceleration: the
    /// bristles bend over a travel, x = ½q̈t², and half of them have changed over after ln 2 of it.
    fn changes_over_s(&self, second: T) -> T {
        let twice_ln2 = number::<T>(2.0 * core::f64::consts::LN_2);
        let least = number::<T>(LEAST_SECOND);
        let bent_s = (twice_ln2 * self.presliding_rad / second.abs().max(least)).sqrt();
        bent_s.min(number(LONGEST_BEND_S)) + self.rise_s
    }
}

/// What is wrong with an arm.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct ArmErrors<T> {
    /// By joint.
    pub joint: [JointErrors<T>; 6],
    /// By the joint before the link: longer than programmed by so much, m.
    pub longer_m: [T; 6],
}

/// A change of side, made smoothly.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
struct Turn<T> {
    /// −1 to 1; 0 before the joint has moved.
    now: T,
    /// Where the turn under way began, and where it leads.
    from: T,
    heading: T,
    /// Share of the turn under way that is over.
    done: T,
    /// Changes in the last tick: of `now`, and of the share.
    changed: T,
    step: T,
}

/// One joint's turning back: which side of its play it stands on, and its friction pulse.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct JointSide<T> {
    play: Turn<T>,
    friction: Turn<T>,
    /// Friction pulse, rad, how much the turn under way adds to it, and its change in the last tick.
    pulse_rad: T,
    rise_rad: T,
    pulsed_rad: T,
}

/// Rate below which a joint's sense of travel is not known, rad/s: 10 µm/s at 1 m.
const LEAST_RATE: f64 = 1e-5;
/// Acceleration below which a joint does not turn round, rad/s², and longest time that its friction takes to change over, s.
const LEAST_SECOND: f64 = 1e-4;
const LONGEST_BEND_S: f64 = 0.1;

fn number<T: Float>(value: f64) -> T {
    T::from(value).unwrap_or_else(T::nan)
}

/// Smoothstep of degree 5, its argument within 0 and 1.
fn smooth<T: Float>(x: T) -> T {
    x * x * x * (x * (x * number(6.0) - number(15.0)) + number(10.0))
}

impl<T: Float> Turn<T> {
    /// One tick, `ahead` the rate that the joint will have in the middle of a turn that would begin now. Whether it turns back: with
    /// the first motion it only takes a side.
    fn tick(&mut self, ahead: T, turn_ticks: T) -> bool {
        let begun = self.heading != T::zero();
        let before = if begun { smooth(self.done) } else { T::zero() };
        let share = turn_ticks.recip();
        let mut reverses = false;
        self.step = T::zero();
        if begun && self.done < T::one() {
            self.done = (self.done + share).min(T::one());
            self.step = smooth(self.done) - before;
        } else if ahead.abs() > number(LEAST_RATE) && ahead.signum() != self.heading {
            reverses = begun;
            (self.from, self.heading) = (self.now, ahead.signum());
            self.done = share.min(T::one());
            self.step = smooth(self.done);
        }
        let last = self.now;
        if self.heading != T::zero() {
            self.now = self.from + (self.heading - self.from) * smooth(self.done);
        }
        self.changed = self.now - last;
        reverses
    }
}

impl<T: Float> JointSide<T> {
    /// One tick with the rates that the joint will have in the middle of a turn, for play and for friction.
    fn tick(&mut self, ahead: [T; 2], errors: &JointErrors<T>, fade: T, turn_ticks: T) {
        let [play, friction] = ahead;
        if errors.play_rad != T::zero() {
            self.play.tick(play, turn_ticks);
        }
        if errors.peak_rad == T::zero() {
            return;
        }
        let reverses = self.friction.tick(friction, turn_ticks);
        if reverses {
            self.rise_rad = errors.peak_rad * self.friction.heading - self.pulse_rad;
        }
        let pulse_rad = self.pulse_rad * fade + self.rise_rad * self.friction.step;
        self.pulsed_rad = pulse_rad - self.pulse_rad;
        self.pulse_rad = pulse_rad;
    }
}

/// State of the six joints between ticks.
pub type JointSides<T> = [JointSide<T>; 6];

/// What undoes the answer that all joints have in common.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Common<T> {
    /// Second and fourth derivative.
    pub operator: Operator<T>,
    /// κ3/6, s³: of the third derivative.
    pub third_s3: T,
}

impl<T: Float> Common<T> {
    /// Of a chain with these cumulants; the third is that of a lag and an average with the same second and fourth, if there are such
    /// ([`third_of_lag_and_average`](Cumulants::third_of_lag_and_average)).
    pub fn new(cumulants: &Cumulants<T>) -> Self {
        Self {
            operator: Operator::new(cumulants),
            third_s3: cumulants.third_of_lag_and_average() / number(6.0),
        }
    }

    fn offset(&self, [_, _, second, third, fourth]: [T; 5]) -> T {
        self.operator.offset(second, fourth) + self.third_s3 * third
    }
}

/// An arm's correction, ready for the tick.
///
/// ```
/// use giotto_shared::kinematics::{Elbow, Kinematics, Scara, path};
/// use giotto_shared::law::{ArmErrors, ArmLaw, Common, Pace};
///
/// let arm = Kinematics::Scara(Scara { l1_m: 0.4_f64, l2_m: 0.3, elbow: Elbow::Positive });
/// let mut errors = ArmErrors::default();
/// errors.joint[0].lag_s = 1e-3;
/// let pace = Pace { tick_s: 1e-3, turn_s: 8e-3 };
/// let law = ArmLaw::new(arm, Common::default(), errors, None, &pace)?;
/// // At 0.1 m/s along X at (0.3, 0.4): joint 1 lags by 1 ms, so the command goes ahead of it.
/// let still = [0.0; 3];
/// let along_x = path(&[[0.3, 0.4, 0.0], [0.1, 0.0, 0.0], still, still, still]);
/// let [x, y, _] = law.offset(&along_x, &mut Default::default())?;
/// assert!(x.hypot(y) > 20e-6);
/// # Ok::<(), giotto_shared::kinematics::ReachError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmLaw<T> {
    kinematics: Kinematics<T>,
    common: Common<T>,
    errors: ArmErrors<T>,
    /// What of a friction pulse a tick leaves, by joint.
    fade: [T; 6],
    turn_ticks: T,
    ticks_per_s: T,
    lead_s: T,
    /// Time constant of the loop that all joints have in common, s.
    loop_s: T,
    /// Offset of zeros and lengths where they are counted from, m.
    still_m: [T; 3],
    lengths: bool,
}

/// Times of a tick, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace<T> {
    /// From one tick to the next.
    pub tick_s: T,
    /// In which play is taken up.
    pub turn_s: T,
}

impl<T: Real> ArmLaw<T> {
    /// Where a place is given, zeros and lengths are counted from it: there they
    /// move nothing.
    ///
    /// # Errors
    /// The arm cannot stand at that place.
    pub fn new(
        kinematics: Kinematics<T>,
        common: Common<T>,
        errors: ArmErrors<T>,
        home_m: Option<[T; 3]>,
        pace: &Pace<T>,
    ) -> Result<Self, ReachError> {
        let half = number::<T>(0.5);
        let fade = errors.joint.map(|joint| {
            if joint.peak_rad == T::zero() {
                T::zero()
            } else {
                (-pace.tick_s / joint.decay_s).exp()
            }
        });
        let mut law = Self {
            kinematics,
            common,
            errors,
            fade,
            ticks_per_s: pace.tick_s.recip(),
            turn_ticks: (pace.turn_s / pace.tick_s).max(T::one()),
            // A reversal is noticed half a tick late on average, and the turn begins in that tick.
            lead_s: half * pace.turn_s,
            // κ3 of a lag is 2τ³.
            loop_s: (number::<T>(3.0) * common.third_s3).max(T::zero()).cbrt(),
            still_m: [T::zero(); 3],
            lengths: errors.longer_m.iter().any(|longer| *longer != T::zero()),
        };
        if let Some(home_m) = home_m {
            let q = kinematics.angles(home_m)?;
            law.still_m = law.still(&q, &kinematics.levers(&q));
        }
        Ok(law)
    }

    /// The kinematics it goes through.
    pub const fn kinematics(&self) -> &Kinematics<T> {
        &self.kinematics
    }

    /// What zeros and lengths do to the place, with the opposite sign, m.
    fn still(&self, q: &[T; 6], levers: &[[T; 3]; 6]) -> [T; 3] {
        let mut out = [T::zero(); 3];
        for (joint, lever) in self.errors.joint.iter().zip(levers) {
            add(&mut out, *lever, -joint.zero_rad);
        }
        if self.lengths {
            for (joint, longer) in self.errors.longer_m.iter().enumerate() {
                if let Some(along) = self.kinematics.along_link(joint, q) {
                    add(&mut out, along, -*longer);
                }
            }
        }
        out
    }

    /// One tick: what is to be added to the place on `path`, m, beside what the operator adds to a path that knows no joints.
    ///
    /// # Errors
    /// The arm cannot stand there; the state is as it was.
    pub fn offset(
        &self,
        path: &[Jet<T>; 3],
        sides: &mut JointSides<T>,
    ) -> Result<[T; 3], ReachError> {
        let q = self.kinematics.angles(*path)?;
        let angles = q.map(Scalar::value);
        let levers = self.kinematics.levers(&angles);
        let mut out = [T::zero(); 3];
        if self.still_m != out
            || self.lengths
            || self.errors.joint.iter().any(|j| j.zero_rad != T::zero())
        {
            out = self.still(&angles, &levers);
            for (out, still) in out.iter_mut().zip(self.still_m) {
                *out = *out - still;
            }
        }
        let half = number::<T>(0.5);
        let joints = q.iter().zip(levers).zip(&self.errors.joint);
        for (((q, lever), errors), (side, fade)) in joints.zip(sides.iter_mut().zip(self.fade)) {
            let along = q.derivatives();
            let [angle, rate, second, ..] = along;
            if errors.play_rad != T::zero() || errors.peak_rad != T::zero() {
                // The loop makes up for its own delay, and the joint turns that much later; friction changes over after that.
                let play_s = self.lead_s - errors.loop_s;
                let friction_s = self.lead_s - self.loop_s - errors.changes_over_s(second);
                let ahead = [play_s, friction_s].map(|ahead_s| rate + ahead_s * second);
                side.tick(ahead, errors, fade, self.turn_ticks);
            }
            // Through the lag of a loop a change has to come as itself and its rate.
            let of_play = errors.loop_s * self.ticks_per_s;
            let of_friction = self.loop_s * self.ticks_per_s;
            let mut wanted = self.common.offset(along) + errors.lag_s * rate
                - errors.second_s2 * second
                + half * errors.play_rad * (side.play.now + of_play * side.play.changed)
                + (side.pulse_rad + of_friction * side.pulsed_rad);
            for gear in &errors.gear {
                if gear.amplitude_rad != T::zero() {
                    let (sine, _) = (gear.waves * angle + gear.phase_rad).sine_cosine();
                    wanted = wanted - gear.amplitude_rad * sine;
                }
            }
            add(&mut out, lever, wanted);
        }
        for (out, place) in out.iter_mut().zip(path) {
            *out = *out - self.common.offset(place.derivatives());
        }
        Ok(out)
    }
}

/// Adds a vector times a number.
fn add<T: Float>(to: &mut [T; 3], vector: [T; 3], times: T) {
    for (to, along) in to.iter_mut().zip(vector) {
        *to = *to + along * times;
    }
}

#[cfg(test)]
mod tests;
