//! A circular test on the simulated machine: one lap in the steady state.
use super::axis::{self, Grid};
use super::command::{Command, Knots};
use super::geometry::{self, Place};
use super::machine::{AccDec, Machine};
use crate::campaign::{Run, Samples};
use giotto_shared::Direction;
use std::f64::consts::TAU;

/// Most samples a turn and the fastest rate of the simulated ballbar.
pub const SAMPLES_PER_TURN: usize = 1000;
/// Samples a second of the simulated ballbar at most, Hz.
pub const MAX_RATE_HZ: f64 = 1000.0;

/// Fewest steps a turn; the command is then met to (2π/360)⁴·R/384, 0.1 nm for R = 300 mm.
const MIN_STEPS_PER_TURN: usize = 360;
/// The run-in lasts so many of the slowest time constants; four equal poles are then down to 1e-9.
const RUN_IN_TIME_CONSTANTS: f64 = 32.0;
/// Chords whose sagitta is below this many metres are not told from the arc.
const NEGLIGIBLE_SAGITTA_M: f64 = 1e-9;
/// Bound on the work of one test.
const MAX_STEPS: f64 = 2e6;

/// A circle to be run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CircleTest {
    /// Programmed radius, m.
    pub radius_m: f64,
    /// Programmed feed, m/s.
    pub feed_m_s: f64,
    /// Direction of travel.
    pub direction: Direction,
    /// Polar angle of the command at the first sample, rad.
    pub start_angle_rad: f64,
    /// First sample in campaign time, s.
    pub started_s: f64,
    /// Centre in machine coordinates, m.
    pub centre_m: [f64; 2],
    /// Samples over the turn; `None`: those of a ballbar, at most 1000 a turn and 1000 a second.
    pub samples: Option<usize>,
}

impl CircleTest {
    /// A circle about the origin from angle 0 at campaign time 0.
    pub fn new(radius_m: f64, feed_m_s: f64, direction: Direction) -> Self {
        let (start_angle_rad, started_s) = (0.0, 0.0);
        Self { radius_m, feed_m_s, direction, start_angle_rad, started_s, centre_m: [0.0; 2], samples: None }
    }

    /// The test that a run records, sample for sample.
    pub fn of(run: &Run) -> Self {
        Self {
            radius_m: run.radius_m,
            feed_m_s: run.feed_m_s,
            direction: run.direction,
            start_angle_rad: run.start_angle_rad,
            started_s: run.started_s.unwrap_or(0.0),
            centre_m: run.centre_m.map_or([0.0; 2], |[x, y, _]| [x, y]),
            samples: Some(run.samples.deviation_m.len()),
        }
    }
}

/// One turn of the tool about the centre of the test.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Programmed radius, m.
    pub radius_m: f64,
    /// Duration of the turn, s; longer than programmed where the controller slows down.
    pub turn_s: f64,
    /// Angle of the command at each sample, rad, unwrapped: what a ballbar infers from time.
    pub angle_rad: Vec<f64>,
    /// Tool positions about the centre, m.
    pub position_m: Vec<[f64; 2]>,
    /// Distance from the centre minus programmed radius, m.
    pub deviation_m: Vec<f64>,
}

impl Trace {
    /// Trace of positions evenly spaced over one turn.
    pub(super) fn new(test: &CircleTest, turn_s: f64, position_m: Vec<[f64; 2]>) -> Self {
        let n = position_m.len() as f64;
        let step = f64::from(test.direction.sign()) * TAU / n;
        Self {
            radius_m: test.radius_m,
            turn_s,
            angle_rad: (0..position_m.len()).map(|i| test.start_angle_rad + step * i as f64).collect(),
            deviation_m: position_m.iter().map(|p| p[0].hypot(p[1]) - test.radius_m).collect(),
            position_m,
        }
    }

    /// What a perfect ballbar would have recorded.
    pub fn samples(&self) -> Samples {
        let step = self.turn_s / self.deviation_m.len() as f64;
        Samples {
            angle_rad: self.angle_rad.clone(),
            deviation_m: self.deviation_m.clone(),
            time_s: Some((0..self.deviation_m.len()).map(|i| step * i as f64).collect()),
            angle_inferred: true,
        }
    }

    /// Mean deviation, m.
    pub fn mean_deviation_m(&self) -> f64 {
        self.deviation_m.iter().sum::<f64>() / self.deviation_m.len() as f64
    }
}

/// Runs a circle until it repeats itself and returns one lap, free of noise.
///
/// The first sample is taken when the *command* passes the start angle, so the tool is behind it by the lag
/// and whatever the machine does in place appears turned by it, as in a real recording. Radius, feed and
/// the machine must be positive and finite ([`Machine::check`]); what is not comes back as NaN.
pub fn circle(machine: &Machine, test: &CircleTest) -> Trace {
    let feed = match machine.centripetal_limit_m_s2 {
        Some(limit) => test.feed_m_s.min((limit * test.radius_m).sqrt()),
        None => test.feed_m_s,
    };
    let turn_s = TAU * test.radius_m / feed;
    let samples = test.samples.unwrap_or_else(|| ballbar_samples(turn_s)).max(1);
    if !(turn_s.is_finite() && turn_s > 0.0 && test.radius_m > 0.0 && machine.check().is_ok()) {
        return Trace::new(test, turn_s, vec![[f64::NAN; 2]; samples]);
    }
    let omega = f64::from(test.direction.sign()) * feed / test.radius_m;
    let step_s = turn_s / (samples * MIN_STEPS_PER_TURN.div_ceil(samples)) as f64;
    let chord_s = machine
        .interpolation_s
        .filter(|dt| (feed * dt).powi(2) / (8.0 * test.radius_m) > NEGLIGIBLE_SAGITTA_M);
    let step_s = chord_s.map_or(step_s, |dt| dt / (dt / step_s).ceil());
    let times = |i: usize| turn_s * i as f64 / samples as f64;

    let axes: [Vec<_>; 2] = std::array::from_fn(|axis| {
        let back_s =
            machine.dead_time_s[axis] + RUN_IN_TIME_CONSTANTS * machine.settling_s(axis) + 0.75 * turn_s;
        let run_in = (back_s / step_s).min(MAX_STEPS).ceil();
        let grid = Grid {
            start_s: -run_in * step_s,
            step_s,
            steps: run_in as usize + (turn_s / step_s).min(MAX_STEPS).ceil() as usize,
        };
        let arc = Command::circle(axis, test.radius_m, omega, test.start_angle_rad);
        let command = match chord_s {
            Some(dt) => chords(&arc, dt, grid, machine),
            None => arc,
        };
        axis::motion(machine, axis, &command, grid, (0..samples).map(times))
    });
    let place = Place { centre_m: test.centre_m };
    let position_m = (0..samples)
        .map(|i| geometry::tool(machine, place, test.started_s + times(i), [axes[0][i], axes[1][i]]))
        .collect();
    Trace::new(test, turn_s, position_m)
}

/// Set-points of the interpolator, one of them at t = 0, joined by chords.
fn chords(arc: &Command, dt: f64, grid: Grid, machine: &Machine) -> Command {
    let window = if let AccDec::MovingAverage(t) = machine.acc_dec { t } else { 0.0 };
    let before = ((window - grid.start_s) / dt).ceil() + 1.0;
    let after = ((grid.start_s + grid.step_s * grid.steps as f64) / dt).ceil() + 1.0;
    let vertices = (0..=(before + after) as usize).map(|k| {
        let t = (k as f64 - before) * dt;
        arc.at(t, t)[0]
    });
    Command::Knots(Knots::chords(-before * dt, dt, vertices.collect()))
}

/// Samples that the simulated ballbar takes of a turn.
pub fn ballbar_samples(turn_s: f64) -> usize {
    // A turn of whole milliseconds must not lose its last sample to rounding.
    ((turn_s * MAX_RATE_HZ * (1.0 + 1e-12)) as usize).clamp(8, SAMPLES_PER_TURN)
}
