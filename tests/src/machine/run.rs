//! One circular test, step by step.
use super::command::{Command, Interpolator};
use super::friction::{FrictionState, StickState};
use super::hysteresis::{Play, Sense};
use super::linear::{Average, Lag, SecondOrder, line_loss};
use super::pattern::Here;
use super::two_mass::TwoMassState;
use super::{AxisChain, Machine, Test};
use std::f64::consts::PI;

/// Largest step where every element is linear, s.
const LINEAR_STEP_S: f64 = 2e-3;
/// Largest step where chords, friction or teeth have to be followed, s.
const FINE_STEP_S: f64 = 0.5e-3;
/// Acceleration of the start, m/s².
const START_M_S2: f64 = 4.0;

/// What the machine did on one lap: samples at even spacing, without instrument.
#[derive(Clone, Debug)]
pub struct Lap {
    /// Place in the machine's axes, seen from the programmed centre, m.
    pub position_m: Vec<[f64; 3]>,
    /// Duration of the turn, s.
    pub turn_s: f64,
    /// Commanded polar angle of each sample where they are more than one turn at a constant rate, rad.
    pub angle_rad: Option<Vec<f64>>,
}

/// The elements of one axis or joint, at rest.
pub(crate) struct Chain {
    average: Option<Average>,
    exponential: Option<Lag>,
    lag: Option<Lag>,
    mechanics: Option<SecondOrder>,
    friction: Option<FrictionState>,
    two_mass: Option<TwoMassState>,
    stick: Option<StickState>,
    play: Option<Play>,
    over_m: f64,
    over: Sense,
    last_m: f64,
}

impl Chain {
    pub(crate) fn new(a: &AxisChain, step_s: f64, at: f64) -> Self {
        Self {
            average: (a.average_s > 0.0).then(|| Average::new(a.average_s, step_s, at)),
            exponential: (a.exponential_s > 0.0)
                .then(|| Lag::new(a.exponential_s, 0.0, step_s, at)),
            lag: (a.lag_s > 0.0).then(|| Lag::new(a.lag_s, a.feed_forward, step_s, at)),
            mechanics: a.mechanics.map(|[w, z]| SecondOrder::new(w, z, step_s, at)),
            friction: a.friction.as_ref().map(|f| FrictionState::new(f, step_s)),
            two_mass: a.two_mass.as_ref().map(|f| TwoMassState::new(f, step_s)),
            stick: a.stick_slip.as_ref().map(|s| StickState::new(s, step_s)),
            play: (a.backlash_m > 0.0).then(|| Play::new(a.backlash_m, at)),
            over_m: a.backlash_m.min(0.0),
            over: Sense::new(2.0 * a.backlash_m.abs().max(1e-7)),
            last_m: at,
        }
    }

    /// Number of elements that see their input as straight pieces.
    fn lines(a: &AxisChain) -> i32 {
        [
            a.average_s > 0.0,
            a.exponential_s > 0.0,
            a.lag_s > 0.0,
            a.mechanics.is_some(),
        ]
        .iter()
        .map(|on| i32::from(*on))
        .sum()
    }

    pub(crate) fn step(&mut self, command: f64, step_s: f64) -> f64 {
        let mut x = command;
        if let Some(e) = &mut self.average {
            x = e.step(x);
        }
        if let Some(e) = &mut self.exponential {
            x = e.step(x);
        }
        if let Some(e) = &mut self.lag {
            x = e.step(x);
        }
        if let Some(e) = &mut self.mechanics {
            x = e.step(x);
        }
        let travel = x - self.last_m;
        self.last_m = x;
        if let Some(f) = &mut self.friction {
            x += f.step(travel);
        }
        if let Some(f) = &mut self.two_mass {
            x += f.step(travel);
        }
        if let Some(s) = &mut self.stick {
            x += s.step(travel, step_s);
        }
        if let Some(p) = &mut self.play {
            x = p.step(x);
        }
        if self.over_m < 0.0 {
            x -= 0.5 * self.over_m * self.over.step(travel);
        }
        x
    }
}

/// Feed the controller really drives, m/s.
pub fn real_feed(machine: &Machine, test: &Test) -> f64 {
    (machine.override_share * test.feed_m_s)
        .min((machine.centripetal_limit_m_s2 * test.radius_m).sqrt())
}

/// Drives `machine` through `test`; `campaign_s` is the length of the campaign, `vibration_rad` the phase
/// of the vibration when the lap begins.
pub fn simulate(machine: &Machine, test: &Test, campaign_s: f64, vibration_rad: f64) -> Lap {
    let feed = real_feed(machine, test);
    let rate = test.sign() * feed / test.radius_m;
    let turn_s = 2.0 * PI / rate.abs();
    let n = test.samples;
    let spacing_s = turn_s / n as f64;
    let nonlinear = machine.interpolation_s > 0.0
        || machine
            .axes
            .iter()
            .any(|a| a.friction.is_some() || a.two_mass.is_some() || a.stick_slip.is_some());
    let largest = if nonlinear {
        FINE_STEP_S
    } else {
        LINEAR_STEP_S
    };
    let per_sample = (spacing_s / largest).ceil().max(1.0) as usize;
    let step_s = spacing_s / per_sample as f64;

    let slow = machine.axes.iter().map(slowest_s).fold(0.0, f64::max);
    let settle_s = (25.0 * slow).max(0.3);
    let ramp_s = (feed / START_M_S2).max(0.05);
    let command = if test.from_rest {
        // One turn from rest to rest: half a ramp's way is lost at either end.
        let start_rad = test.start_angle_rad + 0.5 * rate * ramp_s;
        Command::new(test.radius_m, rate, start_rad, ramp_s, 0.0).stopping(turn_s - ramp_s)
    } else {
        // On the grid of steps, so that the lap begins on a step.
        let settle_s = (settle_s / step_s).ceil() * step_s;
        Command::new(test.radius_m, rate, test.start_angle_rad, ramp_s, settle_s)
    };
    // One an axis: each follows the chords by a delay of its own.
    let mut interpolators = (machine.interpolation_s > 0.0)
        .then(|| [0, 1, 2].map(|_| Interpolator::new(command, machine.interpolation_s)));
    let plane = test.plane;
    let moving = [0, 1, 2].map(|i| plane.moves(i));
    let along = |i: usize, p: [f64; 2]| plane.u[i] * p[0] + plane.v[i] * p[1];
    let begin = command.position_m(command.begin_s());
    let rest = [0, 1, 2].map(|i| along(i, begin));
    let loss = line_loss(rate, step_s);
    let gain = [0, 1, 2].map(|i| {
        if machine.interpolation_s > 0.0 {
            1.0
        } else {
            loss.powi(-Chain::lines(&machine.axes[i]))
        }
    });
    let mut chains = [0, 1, 2].map(|i| Chain::new(&machine.axes[i], step_s, gain[i] * rest[i]));
    let mut senses = [Sense::new(machine.lateral_travel_m); 3];
    let dead = [0, 1, 2].map(|i| machine.axes[i].dead_time_s);
    let together = dead[0] == dead[1] && dead[1] == dead[2];

    let mut position_m = Vec::with_capacity(n);
    let mut last = rest;
    let first = (command.begin_s() / step_s).floor() as i64;
    let end = if test.from_rest {
        (command.end_s() / step_s) as i64
    } else {
        ((n - 1) * per_sample) as i64
    };
    let mut angle_rad = test.from_rest.then(Vec::new);
    for k in first..=end {
        let t = k as f64 * step_s;
        let common = (together && interpolators.is_none()).then(|| command.position_m(t - dead[0]));
        let mut p = [0.0; 3];
        // A slide across the plane stands still.
        for i in (0..3).filter(|i| moving[*i]) {
            let wanted = match (&mut interpolators, common) {
                (Some(each), _) => each[i].position_m(t - dead[i]),
                (None, Some(common)) => common,
                (None, None) => command.position_m(t - dead[i]),
            };
            p[i] = chains[i].step(gain[i] * along(i, wanted), step_s);
        }
        let sense = [0, 1, 2].map(|i| senses[i].step(p[i] - last[i]));
        last = p;
        let before = k < 0 && !test.from_rest;
        if before || k.rem_euclid(per_sample as i64) != 0 {
            continue;
        }
        if let Some(angles) = &mut angle_rad {
            angles.push(command.angle_rad(t));
        }
        let read = p;
        p = machine.geometry.from_centre(test.centre_m, p);
        for i in 0..3 {
            p[i] += machine.geometry.sense_scale[i] * sense[i] * read[i];
        }
        for (mover, sense) in sense.iter().enumerate() {
            // To the left of the travel in the plane from the mover to the next slide, to the right in the other.
            p[(mover + 1) % 3] += 0.5 * machine.lateral_play_m[mover][(mover + 1) % 3] * sense;
            p[(mover + 2) % 3] -= 0.5 * machine.lateral_play_m[mover][(mover + 2) % 3] * sense;
        }
        position_m.push(outside(
            machine,
            test,
            p,
            t,
            turn_s,
            campaign_s,
            vibration_rad,
            command.angle_rad(t),
        ));
    }
    Lap {
        position_m,
        turn_s,
        angle_rad,
    }
}

/// Longest time constant of a chain, s.
pub(crate) fn slowest_s(a: &AxisChain) -> f64 {
    let mechanics = a.mechanics.map_or(0.0, |[w, z]| 1.0 / (w * z.min(1.0 / z)));
    let friction = a.friction.map_or(0.0, |f| f.decay_s);
    let two_mass = a.two_mass.map_or(0.0, |f| f.decay_s);
    [
        a.average_s / 10.0,
        a.exponential_s,
        a.lag_s,
        mechanics,
        friction,
        two_mass,
    ]
    .into_iter()
    .fold(0.0, f64::max)
}

/// What acts on the finished motion: vibration, heat, ball size and patterns.
#[allow(
    clippy::too_many_arguments,
    reason = "one sample of everything that is known"
)]
fn outside(
    machine: &Machine,
    test: &Test,
    p: [f64; 3],
    t: f64,
    turn_s: f64,
    campaign_s: f64,
    vibration_rad: f64,
    angle_rad: f64,
) -> [f64; 3] {
    let mut p = p;
    let share = (test.started_s + t) / campaign_s;
    let mut radial = machine.radius_offset_m;
    if let Some(thermal) = &machine.thermal {
        let grown = 1.0 + thermal.growth(share);
        p = p.map(|x| x * grown);
    }
    if let Some(v) = &machine.vibration {
        let shake = v.amplitude_m * (2.0 * PI * v.frequency_hz * t + vibration_rad).sin();
        match v.axis {
            Some(axis) => p[axis] += shake,
            None => radial += shake,
        }
    }
    let here = Here {
        angle_rad,
        radius_m: test.radius_m,
        feed_m_s: 2.0 * PI * test.radius_m / turn_s,
        sign: test.sign(),
        time_s: t,
        share,
    };
    radial += machine
        .patterns
        .iter()
        .map(|q| q.radial_m(&here))
        .sum::<f64>();
    let longer = 1.0 + radial / p[0].hypot(p[1]).hypot(p[2]);
    p.map(|x| x * longer)
}
