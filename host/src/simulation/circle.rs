//! A circular test on the simulated machine: one lap in the steady state.
use super::arm;
use super::axis::{self, AxisPoint, Grid};
use super::chain::{Chain, Discrete};
use super::command::Knots;
use super::geometry::{self, Place};
use super::hysteresis::Hysteresis;
use super::machine::{AccDec, Machine};
use super::steady_circle::{self, PIECE, Round};
use super::wave::Turns;
use crate::campaign::{Run, Samples};
use giotto_shared::{Direction, Frame};
use std::f64::consts::TAU;

/// Most samples a turn and the fastest rate of the simulated ballbar.
pub const SAMPLES_PER_TURN: usize = 1000;
/// Samples a second of the simulated ballbar at most, Hz.
pub const MAX_RATE_HZ: f64 = 1000.0;

/// Fewest steps a turn; the command is then met to (2π/360)⁴·R/384, 0.1 nm for R = 300 mm.
const MIN_STEPS_PER_TURN: usize = 360;
/// A run-in from rest lasts so many of the slowest time constants; four equal poles are then down to 1e-9.
pub(super) const RUN_IN_TIME_CONSTANTS: f64 = 32.0;
/// Share of a turn that holds a reversal of each axis, whatever the phase.
pub(super) const ONE_REVERSAL_TURNS: f64 = 0.75;
/// Chords whose sagitta is below this many metres are not told from the arc.
const NEGLIGIBLE_SAGITTA_M: f64 = 1e-9;
/// Bound on the work before and during the lap.
pub(super) const MAX_STEPS: f64 = 2e6;

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
    pub centre_m: [f64; 3],
    /// How the circle lies in the machine.
    pub frame: Frame,
    /// Samples over the turn; `None`: those of a ballbar, at most 1000 a turn and 1000 a second.
    pub samples: Option<usize>,
}

impl CircleTest {
    /// A circle about the origin from angle 0 at campaign time 0.
    pub fn new(radius_m: f64, feed_m_s: f64, direction: Direction) -> Self {
        let (start_angle_rad, started_s) = (0.0, 0.0);
        Self {
            radius_m,
            feed_m_s,
            direction,
            start_angle_rad,
            started_s,
            centre_m: [0.0; 3],
            frame: Frame::default(),
            samples: None,
        }
    }

    /// The test that a run records, sample for sample.
    pub fn of(run: &Run) -> Self {
        Self {
            radius_m: run.radius_m,
            feed_m_s: run.feed_m_s,
            direction: run.direction,
            start_angle_rad: run.start_angle_rad,
            started_s: run.started_s.unwrap_or(0.0),
            centre_m: run.centre_m.unwrap_or_default(),
            frame: run.frame,
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
    /// Tool positions about the centre along the directions of the frame, m.
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
            angle_rad: (0..position_m.len())
                .map(|i| test.start_angle_rad + step * i as f64)
                .collect(),
            // Lengths of machines neither overflow nor vanish when squared: no need of hypot.
            deviation_m: position_m
                .iter()
                .map(|[x, y]| (x * x + y * y).sqrt() - test.radius_m)
                .collect(),
            position_m,
        }
    }

    /// What a perfect ballbar would have recorded.
    pub fn samples(&self) -> Samples {
        let step = self.turn_s / self.deviation_m.len() as f64;
        Samples {
            angle_rad: self.angle_rad.clone(),
            deviation_m: self.deviation_m.clone(),
            time_s: Some(
                (0..self.deviation_m.len())
                    .map(|i| step * i as f64)
                    .collect(),
            ),
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
///
/// ```
/// use giotto::campaign::Direction;
/// use giotto::simulation::machine::PositionLoop;
/// use giotto::simulation::{CircleTest, Machine, circle};
///
/// let lag = PositionLoop { kv_per_s: 50.0, feed_forward: 0.0 };
/// let machine = Machine { servo: [lag; 3], ..Machine::default() };
/// let trace = circle(&machine, &CircleTest::new(0.1, 0.5, Direction::Ccw));
/// // R/√(1 + (ω/kv)²) − R with ω = 5 rad/s.
/// let expected_m = 0.1 * (1.0 / 1.01_f64.sqrt() - 1.0);
/// assert!((trace.mean_deviation_m() - expected_m).abs() < 1e-9);
/// ```
pub fn circle(machine: &Machine, test: &CircleTest) -> Trace {
    let feed = match machine.centripetal_limit_m_s2 {
        Some(limit) => test.feed_m_s.min((limit * test.radius_m).sqrt()),
        None => test.feed_m_s,
    };
    let turn_s = TAU * test.radius_m / feed;
    let samples = test
        .samples
        .unwrap_or_else(|| ballbar_samples(turn_s))
        .max(1);
    if !(turn_s.is_finite() && turn_s > 0.0 && test.radius_m > 0.0 && machine.check().is_ok()) {
        return Trace::new(test, turn_s, vec![[f64::NAN; 2]; samples]);
    }
    let omega = f64::from(test.direction.sign()) * feed / test.radius_m;
    if let Some(arm) = &machine.arm {
        let lap = arm::lap(machine, arm, test, omega, samples);
        return Trace::new(
            test,
            turn_s,
            lap.unwrap_or_else(|| vec![[f64::NAN; 2]; samples]),
        );
    }
    let lap = Lap {
        machine,
        test,
        omega_rad_s: omega,
        turn_s,
        samples,
    };
    let chord_s = machine
        .interpolation_s
        .filter(|dt| (feed * dt).powi(2) / (8.0 * test.radius_m) > NEGLIGIBLE_SAGITTA_M);
    Trace::new(
        test,
        turn_s,
        chord_s.map_or_else(|| lap.along_arc(), |dt| lap.along_chords(dt)),
    )
}

/// One turn of the tool.
struct Lap<'a> {
    machine: &'a Machine,
    test: &'a CircleTest,
    omega_rad_s: f64,
    turn_s: f64,
    samples: usize,
}

impl Lap<'_> {
    fn seconds(&self, sample: usize) -> f64 {
        self.turn_s * sample as f64 / self.samples as f64
    }

    /// Share of the circle's two directions that an axis has.
    fn shares(&self, axis: usize) -> [f64; 2] {
        self.test.frame.shares(axis)
    }

    fn tool(&self, sample: usize, axes: [AxisPoint; 3]) -> [f64; 2] {
        let place = Place {
            centre_m: self.test.centre_m,
            frame: self.test.frame,
        };
        geometry::in_plane(
            self.machine,
            place,
            self.test.started_s + self.seconds(sample),
            axes,
        )
    }

    /// Steps from sample to sample.
    fn every(&self) -> usize {
        MIN_STEPS_PER_TURN.div_ceil(self.samples)
    }

    fn step_s(&self) -> f64 {
        self.turn_s / (self.samples * self.every()) as f64
    }

    /// The controller commands the arc itself. The axes go piece by piece, so that what lies between is never far.
    fn along_arc(&self) -> Vec<[f64; 2]> {
        let (machine, samples, every, step_s) =
            (self.machine, self.samples, self.every(), self.step_s());
        let step_rad = TAU.copysign(self.omega_rad_s) / (samples * every) as f64;
        let turns = Turns::new(self.test.start_angle_rad, step_rad);
        let (radius_m, omega_rad_s) = (self.test.radius_m, self.omega_rad_s);
        let round = Round {
            machine,
            turns: &turns,
            radius_m,
            omega_rad_s,
            step_s,
        };
        let mut known: Vec<Discrete> = Vec::with_capacity(3);
        let mut axes = [0, 1, 2].map(|axis| {
            let shares = self.shares(axis);
            // An axis across the circle stands still.
            (shares != [0.0; 2]).then(|| {
                let chain = Chain::new(machine, axis);
                let at = known.iter().position(|k| *k.chain() == chain);
                let at = at.unwrap_or_else(|| {
                    known.push(Discrete::new(chain, step_s));
                    known.len() - 1
                });
                steady_circle::axis(round, axis, shares, &known[at])
            })
        });
        let piece = samples.min((PIECE / every).max(1));
        let mut waves = vec![[0.0; 2]; piece * every];
        let mut points = [0; 3].map(|_| vec![AxisPoint::default(); piece]);
        let mut position_m = Vec::with_capacity(samples);
        for first in (0..samples).step_by(piece) {
            let waves = &mut waves[..piece.min(samples - first) * every];
            turns.fill((first * every) as f64, waves);
            for (axis, points) in axes.iter_mut().zip(&mut points) {
                if let Some(axis) = axis {
                    points.clear();
                    axis.follow(waves, every, points);
                }
            }
            let count = waves.len() / every;
            let at = |i: usize| [0, 1, 2].map(|axis| points[axis][i]);
            position_m.extend((0..count).map(|i| self.tool(first + i, at(i))));
        }
        position_m
    }

    /// The controller issues a set-point every `dt` and joins them by chords.
    fn along_chords(&self, dt: f64) -> Vec<[f64; 2]> {
        let step_s = dt / (dt / self.step_s()).ceil();
        let axes = [0, 1, 2].map(|axis| {
            if self.shares(axis) == [0.0; 2] {
                return vec![AxisPoint::default(); self.samples];
            }
            let grid = self.grid(axis, step_s);
            let knots = self.chords(axis, dt, grid);
            axis::motion(
                self.machine,
                axis,
                &knots,
                grid,
                (0..self.samples).map(|i| self.seconds(i)),
            )
        });
        let at = |i: usize| [0, 1, 2].map(|axis| axes[axis][i]);
        (0..self.samples).map(|i| self.tool(i, at(i))).collect()
    }

    /// Steps from rest, until nothing is left of the start and what remembers reversals has seen one, then the lap.
    fn grid(&self, axis: usize, step_s: f64) -> Grid {
        let machine = self.machine;
        let reversal_s = if Hysteresis::needed(machine, axis) {
            ONE_REVERSAL_TURNS * self.turn_s
        } else {
            0.0
        };
        let settling_s = RUN_IN_TIME_CONSTANTS * machine.settling_s(axis);
        let before = ((machine.dead_time_s[axis] + settling_s + reversal_s) / step_s)
            .min(MAX_STEPS)
            .ceil();
        let lap = (self.turn_s / step_s).min(MAX_STEPS).ceil();
        Grid {
            start_s: -before * step_s,
            step_s,
            steps: before as usize + lap as usize,
        }
    }

    /// Set-points of the interpolator, one of them at t = 0, joined by chords.
    fn chords(&self, axis: usize, dt: f64, grid: Grid) -> Knots {
        let window = if let AccDec::MovingAverage(t) = self.machine.acc_dec {
            t
        } else {
            0.0
        };
        let before = ((window - grid.start_s) / dt).ceil() + 1.0;
        let after = ((grid.start_s + grid.step_s * grid.steps as f64) / dt).ceil() + 1.0;
        let turns = Turns::new(self.test.start_angle_rad, self.omega_rad_s * dt);
        let mut waves = vec![[0.0; 2]; (before + after) as usize + 1];
        turns.fill(-before, &mut waves);
        let [u, v] = self.shares(axis);
        let vertices = waves
            .iter()
            .map(|[cos, sin]| self.test.radius_m * (u * cos + v * sin));
        Knots::chords(-before * dt, dt, vertices.collect())
    }
}

/// Samples that the simulated ballbar takes of a turn.
pub fn ballbar_samples(turn_s: f64) -> usize {
    // A turn of whole milliseconds must not lose its last sample to rounding.
    ((turn_s * MAX_RATE_HZ * (1.0 + 1e-12)) as usize).clamp(8, SAMPLES_PER_TURN)
}
