//! A serial arm on a circle: command → inverse → each joint's chain, play, friction and gear → forward → instrument.
//!
//! On a circle at a constant rate every joint's command repeats itself, so what is linear answers wave by wave, exactly; what
//! remembers reversals follows the joint's own motion in time, from a turn before the lap on. The interpolator's chords
//! ([`Machine::interpolation_s`]) are not simulated on an arm.
use super::axis::AxisPoint;
use super::circle::CircleTest;
use super::geometry::{self, Place};
use super::hysteresis::{Hysteresis, turning_point};
use super::machine::{AccDec, Friction, Machine};
use crate::kinematics::{Angles, Kinematics, WAVES, short_way, waves};
use giotto_shared::Direction;
use rustfft::num_complex::Complex;
use std::f64::consts::TAU;

/// An arm: how its controller computes, and what it and its joints do otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    /// As the controller has it.
    pub kinematics: Kinematics,
    /// The joints.
    pub joints: [Joint; 6],
    /// By how much the link behind each joint is longer than the controller has it, m.
    pub longer_m: [f64; 6],
}

/// What one joint does beyond the response that all have in common.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Joint {
    /// Further lag of its position loop, s.
    pub lag_s: f64,
    /// Further dead time, s.
    pub dead_time_s: f64,
    /// Further second cumulant of its response, without a delay, s².
    pub kappa2_s2: f64,
    /// Play of its gear, rad.
    pub backlash_rad: f64,
    /// Time constant with which the joint's loop smooths what play and friction add, s; 0: they act behind it. The smoothed
    /// error is as much earlier, as that of a loop whose lag it is.
    pub smoothed_s: f64,
    /// Friction; lengths are angles here (rad for m).
    pub friction: Option<Friction>,
    /// Periodic error of its gear.
    pub gear: Option<Gear>,
    /// Real angle where the controller reads zero, rad.
    pub zero_rad: f64,
}

/// `amplitude·sin(waves·q + phase)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gear {
    /// Amplitude, rad.
    pub amplitude_rad: f64,
    /// Waves to a turn of the joint.
    pub waves: f64,
    /// Phase at angle 0, rad.
    pub phase_rad: f64,
}

/// Fewest steps a turn where reversals have to be followed.
const STEPS: usize = 1440;

impl Arm {
    /// An arm without any error.
    pub fn sound(kinematics: Kinematics) -> Self {
        Self {
            kinematics,
            joints: [Joint::default(); 6],
            longer_m: [0.0; 6],
        }
    }

    /// Name and value of the first number that is not finite or out of its range.
    pub(super) fn fault(&self) -> Option<(&'static str, f64)> {
        let lengths = self.longer_m.iter().map(|m| ("arm.longer_m", *m));
        let joints = self.joints.iter().flat_map(|joint| {
            let friction = joint.friction.unwrap_or_default();
            let gear = joint
                .gear
                .map_or([0.0; 3], |g| [g.amplitude_rad, g.waves, g.phase_rad]);
            [
                ("joint.lag_s", joint.lag_s),
                ("joint.dead_time_s", joint.dead_time_s),
                ("joint.kappa2_s2", joint.kappa2_s2),
                ("joint.backlash_rad", joint.backlash_rad),
                ("joint.smoothed_s", joint.smoothed_s),
                ("joint.zero_rad", joint.zero_rad),
                ("joint.friction", friction.peak_m),
                ("joint.friction", friction.rise_s),
                ("joint.friction", friction.presliding_m),
                ("joint.gear", gear[0]),
                ("joint.gear", gear[1]),
                ("joint.gear", gear[2]),
                // Finite where it is positive.
                ("joint.friction", friction.decay_s.ln()),
            ]
        });
        lengths.chain(joints).find(|(_, value)| !value.is_finite())
    }
}

/// One turn of the tool about the centre, along the directions of the frame, m; `None` where the arm cannot stand.
pub(super) fn lap(
    machine: &Machine,
    arm: &Arm,
    test: &CircleTest,
    omega_rad_s: f64,
    samples: usize,
) -> Option<Vec<[f64; 2]>> {
    let turning = arm.kinematics.turning().max(3);
    let remembers = arm.joints.iter().any(remembers);
    let every = if remembers {
        STEPS.div_ceil(samples)
    } else {
        1
    };
    let steps = (samples * every).max(4 * WAVES);
    // Few samples and nothing to remember: waves are still taken from enough places.
    let every = if remembers {
        every
    } else {
        steps.div_ceil(samples)
    };
    let steps = samples * every;
    let rate = omega_rad_s.abs();
    let step_s = TAU / rate / steps as f64;
    let path = commands(&arm.kinematics, test, steps)?;
    let joints: Vec<Vec<f64>> = (0..turning)
        .map(|joint| {
            follow(
                machine,
                &arm.joints[joint],
                &path,
                joint,
                rate,
                step_s,
                every,
            )
        })
        .collect();
    let real = arm.kinematics.with_links(&arm.longer_m);
    let place = Place {
        centre_m: test.centre_m,
        frame: test.frame,
    };
    let tool = |sample: usize| {
        let mut q = path[sample * every];
        for (q, joint) in q.iter_mut().zip(&joints) {
            *q = joint[sample];
        }
        let at = real.place(&q);
        let axes = [0, 1, 2].map(|k| AxisPoint {
            drive_m: at[k] - test.centre_m[k],
            ..AxisPoint::default()
        });
        let t = test.started_s + step_s * (sample * every) as f64;
        geometry::in_plane(machine, place, t, axes)
    };
    Some((0..samples).map(tool).collect())
}

fn remembers(joint: &Joint) -> bool {
    joint.backlash_rad != 0.0 || joint.friction.is_some()
}

/// Commanded angles at the steps of the turn, in the order of time, continuous.
fn commands(kinematics: &Kinematics, test: &CircleTest, steps: usize) -> Option<Vec<Angles>> {
    let sense = match test.direction {
        Direction::Ccw => 1.0,
        Direction::Cw => -1.0,
    };
    let (first, second) = (test.frame.first(), test.frame.second());
    let mut path: Vec<Angles> = Vec::with_capacity(steps);
    for step in 0..steps {
        let angle = test.start_angle_rad + sense * TAU * step as f64 / steps as f64;
        let (sin, cos) = angle.sin_cos();
        let place = [0, 1, 2]
            .map(|k| test.centre_m[k] + test.radius_m * (cos * first[k] + sin * second[k]));
        let mut q = kinematics.angles(place).ok()?;
        if let Some(before) = path.last() {
            for joint in 0..kinematics.turning() {
                q[joint] = before[joint] + short_way(before[joint], q[joint]);
            }
        }
        path.push(q);
    }
    Some(path)
}

/// Where a joint is at the samples, rad.
fn follow(
    machine: &Machine,
    joint: &Joint,
    path: &[Angles],
    index: usize,
    rate_rad_s: f64,
    step_s: f64,
    every: usize,
) -> Vec<f64> {
    let steps = path.len();
    let waves = waves(path, index);
    let answers: [Complex<f64>; WAVES] =
        std::array::from_fn(|n| answer(machine, joint, n as f64 * rate_rad_s));
    // What is left of the command, and its velocity, by Horner's scheme.
    let sum = |parts: &[Complex<f64>; WAVES], step: usize| {
        let turn = Complex::cis(TAU * step as f64 / steps as f64);
        let zero = Complex::new(0.0, 0.0);
        parts
            .iter()
            .rev()
            .fold(zero, |sum, part| sum * turn + part)
            .re
    };
    let lagged: [Complex<f64>; WAVES] = std::array::from_fn(|n| waves[n] * (answers[n] - 1.0));
    let linear = |step: usize| path[step][index] + sum(&lagged, step);
    let mut out: Vec<f64> = if remembers(joint) {
        let moving: [Complex<f64>; WAVES] = std::array::from_fn(|n| {
            waves[n] * answers[n] * Complex::new(0.0, n as f64 * rate_rad_s)
        });
        remembered(joint, steps, every, step_s, |step| {
            [linear(step), sum(&moving, step)]
        })
    } else {
        (0..steps).step_by(every).map(linear).collect()
    };
    for q in &mut out {
        let periodic = joint.gear.map_or(0.0, |gear| {
            gear.amplitude_rad * (gear.waves * *q + gear.phase_rad).sin()
        });
        *q += joint.zero_rad + periodic;
    }
    out
}

/// The joint's angle at the samples with what it remembers of its reversals; the turn before the lap is followed, too.
fn remembered(
    joint: &Joint,
    steps: usize,
    every: usize,
    step_s: f64,
    motion: impl Fn(usize) -> [f64; 2],
) -> Vec<f64> {
    let own = Machine {
        backlash_m: [joint.backlash_rad, 0.0, 0.0],
        friction: [joint.friction, None, None],
        ..Machine::default()
    };
    let turn: Vec<[f64; 2]> = (0..steps).map(motion).collect();
    let Some(mut memory) = Hysteresis::new(&own, 0, turn[0], step_s) else {
        return turn.iter().step_by(every).map(|m| m[0]).collect();
    };
    let mut errors = Vec::with_capacity(steps);
    for step in 0..2 * steps {
        let (here, next) = (turn[step % steps], turn[(step + 1) % steps]);
        if step >= steps {
            errors.push(memory.error_m(here[0], here[1]));
        }
        let y = [here[0], here[1], next[0], next[1]];
        let mut turns = turning_point(y, step_s);
        memory.follow(y, [0.0, 1.0], &mut turns);
    }
    if joint.smoothed_s > 0.0 {
        errors = smoothed(&errors, joint.smoothed_s, step_s);
    }
    let at = |step: usize| turn[step][0] + errors[step];
    (0..steps).step_by(every).map(at).collect()
}

/// A periodic error behind a lag, seen as much earlier as the lag is long.
fn smoothed(errors: &[f64], lag_s: f64, step_s: f64) -> Vec<f64> {
    let steps = errors.len();
    let keep = (-step_s / lag_s).exp();
    let mut out = vec![0.0; steps];
    let mut state = errors[steps - 1];
    // Once round to forget the start.
    for step in 0..2 * steps {
        state = keep * state + (1.0 - keep) * errors[step % steps];
        out[step % steps] = state;
    }
    let ahead = (lag_s / step_s).round() as usize;
    (0..steps).map(|step| out[(step + ahead) % steps]).collect()
}

/// Answer of a joint to a wave of its command.
fn answer(machine: &Machine, joint: &Joint, omega_rad_s: f64) -> Complex<f64> {
    let s = Complex::new(0.0, omega_rad_s);
    let one = Complex::new(1.0, 0.0);
    let servo = machine.servo[0];
    let mut out = one;
    if servo.kv_per_s.is_finite() {
        let lag = s / servo.kv_per_s;
        out *= (one + lag * servo.feed_forward) / (one + lag);
    }
    // In series with the loop so that its own lag grows: 1/(1 + s(T + δ)).
    out /= one + s * joint.lag_s * out;
    if let Some(m) = machine.mechanics[0] {
        let r = s / m.omega_n_rad_s;
        out /= one + r * (2.0 * m.zeta) + r * r;
    }
    match machine.acc_dec {
        AccDec::None => {}
        AccDec::Exponential(t) => out /= one + s * t,
        AccDec::MovingAverage(t) => {
            let half = 0.5 * omega_rad_s * t;
            let sinc = if half.abs() < 1e-9 {
                1.0
            } else {
                half.sin() / half
            };
            out *= Complex::cis(-half) * sinc;
        }
    }
    let dead_s = machine.dead_time_s[0] + joint.dead_time_s;
    let shrunk = (-0.5 * joint.kappa2_s2 * omega_rad_s * omega_rad_s).exp();
    out * Complex::cis(-omega_rad_s * dead_s) * shrunk
}
