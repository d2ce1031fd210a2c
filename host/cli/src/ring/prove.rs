//! Unseen circles through the controller into the machine, with and without correction.
use super::{DemoError, LEFT_M, REDUCTION_PERCENT, learn};
use giotto::analysis::{self, RunAnalysis};
use giotto::campaign::{Run, Samples};
use giotto::simulation::{CircleTest, Hold, Plan, SetPoints, drive};
use giotto_link::flash::{Flashed, Progress};
use giotto_link::{Controller, Recording, circle};
use giotto_shared::Direction;
use giotto_shared::table::Table;
use giotto_shared::wire::Command;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Radius, mm, and feed, mm/s, of the circles that prove the correction; each is run both ways. None of these
/// radii and none of these feeds is in the campaign; all lie within its ranges, where the table is valid.
pub const CIRCLES: [(f64, f64); 4] = [
    (110.0, 680.0),
    (130.0, 550.0),
    (190.0, 650.0),
    (250.0, 630.0),
];

/// Turns at constant rate: the machine settles in the first, the last is measured.
const LAPS: u32 = 2;
/// Set-points a second that are recorded, Hz.
const RATE_HZ: u32 = 1000;
/// A set-point belongs to the circle if it is so near, m, …
const ON_CIRCLE_M: f64 = 1e-7;
/// … and to the steady turns if its step is the programmed one within this share and the rounding to nanometres.
const STEADY: f64 = 1e-3;
const ROUNDING_M: f64 = 3e-9;
/// Streams of random draws, apart from those of the campaign (one for the order and one a run).
const STREAM: u64 = 1 << 32;

/// One circle, measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// What the ballbar read.
    pub samples: Samples,
    /// What it shows.
    pub analysis: RunAnalysis,
}

/// One circle without and with correction.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair {
    /// Correction off.
    pub before: Measured,
    /// Correction on.
    pub after: Measured,
}

/// Errors of several circles together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size {
    /// Root mean square of the radius size errors, m.
    pub radius_error_rms_m: f64,
    /// Root mean square of the out-of-roundness, m; includes the range of the sample noise.
    pub out_of_roundness_m: f64,
}

/// The circles before and after.
#[derive(Clone, Debug, PartialEq)]
pub struct Proof {
    /// The table on the controller.
    pub flashed: Flashed,
    /// Set-points whose offset or its rate the controller had to clamp.
    pub clamped: u32,
    /// The circles, each radius CCW and CW.
    pub circles: Vec<Pair>,
}

impl Proof {
    fn size(&self, of: fn(&Pair) -> &Measured) -> Size {
        let n = self.circles.len().max(1) as f64;
        let rms = |value: fn(&RunAnalysis) -> f64| {
            let squares: f64 = self
                .circles
                .iter()
                .map(|pair| value(&of(pair).analysis).powi(2))
                .sum();
            (squares / n).sqrt()
        };
        Size {
            radius_error_rms_m: rms(|a| a.radius_error_m),
            out_of_roundness_m: rms(|a| a.out_of_roundness_m),
        }
    }

    /// Without correction.
    pub fn before(&self) -> Size {
        self.size(|pair| &pair.before)
    }

    /// With correction.
    pub fn after(&self) -> Size {
        self.size(|pair| &pair.after)
    }

    /// By how much the radius size error fell, %.
    pub fn reduction_percent(&self) -> f64 {
        100.0 * (1.0 - self.after().radius_error_rms_m / self.before().radius_error_rms_m)
    }

    /// Whether the size error fell by [`REDUCTION_PERCENT`] or to [`LEFT_M`], and the out-of-roundness fell.
    pub fn holds(&self) -> bool {
        let (before, after) = (self.before(), self.after());
        let size =
            self.reduction_percent() >= REDUCTION_PERCENT || after.radius_error_rms_m <= LEFT_M;
        size && after.out_of_roundness_m < before.out_of_roundness_m
    }
}

/// Runs circles, radius in mm and feed in mm/s, both ways with the correction off, flashes the table, runs them again with the correction on.
///
/// # Errors
/// [`DemoError`]: mostly those of the controller.
pub fn prove(
    controller: &mut Controller,
    plan: &Plan,
    table: &Table,
    circles: &[(f64, f64)],
    seed: u64,
    progress: &mut dyn FnMut(&str),
) -> Result<Proof, DemoError> {
    let image = learn::image(table)?;
    let flashed = controller.flash(&image, &mut |step| {
        progress(match step {
            Progress::Sent(..) => "sending the table",
            Progress::Programmed => "table programmed",
            Progress::ReadBack => "table read back",
            Progress::Committed => "table committed",
            Progress::Confirmed => "table confirmed",
        });
    })?;
    let counters = controller.status()?.counters;
    let mut measure = |bypass: bool| -> Result<Vec<Measured>, DemoError> {
        controller.command(Command::Bypass { on: bypass })?;
        let mut done = Vec::new();
        for &(radius_mm, feed_mm_s) in circles {
            for direction in [Direction::Ccw, Direction::Cw] {
                let state = if bypass { "off" } else { "on" };
                progress(&format!(
                    "R {radius_mm} mm, {feed_mm_s} mm/s, correction {state}"
                ));
                let test = CircleTest::new(radius_mm * 1e-3, feed_mm_s * 1e-3, direction);
                let stream = STREAM + 2 * done.len() as u64 + u64::from(bypass);
                done.push(run(controller, plan, &test, seed, stream)?);
            }
        }
        Ok(done)
    };
    let (before, after) = (measure(true)?, measure(false)?);
    let since = controller.status()?.counters;
    Ok(Proof {
        flashed,
        clamped: since.offset_clamps.wrapping_sub(counters.offset_clamps)
            + since.slew_clamps.wrapping_sub(counters.slew_clamps),
        circles: before
            .into_iter()
            .zip(after)
            .map(|(before, after)| Pair { before, after })
            .collect(),
    })
}

/// One circle, measured and analysed.
fn run(
    controller: &mut Controller,
    plan: &Plan,
    test: &CircleTest,
    seed: u64,
    stream: u64,
) -> Result<Measured, DemoError> {
    let run = record(controller, plan, test, seed, stream)?;
    let analysis = analysis::of_run(&run, None)?;
    Ok(Measured {
        samples: run.samples,
        analysis,
    })
}

/// One circle: set-points from the controller, the machine moved by them, the last steady turn measured.
pub(crate) fn record(
    controller: &mut Controller,
    plan: &Plan,
    test: &CircleTest,
    seed: u64,
    stream: u64,
) -> Result<Run, DemoError> {
    let every = (controller.identity().tick_hz / RATE_HZ).clamp(1, u32::from(u16::MAX)) as u16;
    let recording = controller.run_circle(
        &circle(test.radius_m, test.feed_m_s, test.direction, LAPS),
        every,
    )?;
    let turn = last_turn(&recording, test).ok_or(DemoError::NoSteadyTurn {
        radius_mm: test.radius_m * 1e3,
        feed_mm_s: test.feed_m_s * 1e3,
    })?;
    let position_m: Vec<[f64; 3]> = recording.points.iter().map(|p| p.corrected_m).collect();
    let path = drive(
        &plan.machine,
        &SetPoints {
            dt_s: recording.dt_s,
            position_m: &position_m,
            centre_m: test.centre_m,
            frame: test.frame,
            started_s: 0.0,
            hold: Hold::Cubic,
        },
    );
    let test = CircleTest {
        start_angle_rad: turn.angle_rad,
        ..*test
    };
    let trace = path.lap(&test, turn.start_s, turn.turn_s);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream);
    Ok(Run {
        file: String::new(),
        radius_m: test.radius_m,
        feed_m_s: test.feed_m_s,
        direction: test.direction,
        start_angle_rad: test.start_angle_rad,
        started_s: None,
        temperature_c: None,
        centre_m: None,
        frame: test.frame,
        setup: None,
        samples: plan.instrument.record(&test, &trace, &mut rng),
    })
}

/// When the programmed point goes round at constant rate for the last time.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Turn {
    start_s: f64,
    turn_s: f64,
    angle_rad: f64,
}

/// The last whole turn of the *programmed* set-points at constant rate, from their positions alone.
fn last_turn(recording: &Recording, test: &CircleTest) -> Option<Turn> {
    let sign = f64::from(test.direction.sign());
    let rate = sign * test.feed_m_s / test.radius_m;
    let due = rate * recording.dt_s;
    let tolerance = STEADY * due.abs() + ROUNDING_M / test.radius_m;
    let polar: Vec<[f64; 2]> = recording
        .points
        .iter()
        .map(|p| {
            [
                p.programmed_m[0].hypot(p.programmed_m[1]),
                p.programmed_m[1].atan2(p.programmed_m[0]),
            ]
        })
        .collect();
    let steady = |i: usize| {
        let step = (polar[i][1] - polar[i - 1][1] - due + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
        let on = |p: [f64; 2]| (p[0] - test.radius_m).abs() < ON_CIRCLE_M;
        on(polar[i]) && on(polar[i - 1]) && step.abs() < tolerance
    };
    let last = (1..polar.len()).rev().find(|i| steady(*i))?;
    let first = (1..=last).rev().take_while(|i| steady(*i)).last()? - 1;
    // The turns are whole: the rate that was run follows from their number and the time they took.
    let span_s = (last - first) as f64 * recording.dt_s;
    let covered =
        (polar[last][1] - polar[first][1] - rate * span_s + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
    let real = rate + covered / span_s;
    let turn_s = TAU / real.abs();
    let start_s = last as f64 * recording.dt_s - turn_s;
    (span_s > turn_s).then_some(Turn {
        start_s,
        turn_s,
        angle_rad: polar[last][1],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use giotto_link::SetPointRecord;

    /// Set-points that gain speed over half a turn, hold it for two turns and lose it again, at 1 kHz.
    fn recording(radius_m: f64, feed_m_s: f64, sign: f64) -> Recording {
        let (dt_s, rate) = (1e-3, feed_m_s / radius_m);
        let (ramp_s, cruise_s) = (0.4, 2.0 * TAU / rate);
        let travelled = |t: f64| {
            let up = t.min(ramp_s).powi(2) / (2.0 * ramp_s);
            let cruise = (t - ramp_s).clamp(0.0, cruise_s);
            let down = (t - ramp_s - cruise_s).max(0.0);
            up + cruise + down - down.powi(2) / (2.0 * ramp_s)
        };
        let nm = |v: f64| (v * 1e9).round() * 1e-9;
        let point = |i: usize| {
            let angle = sign * rate * (travelled(i as f64 * dt_s) - 0.5 * ramp_s);
            let at = [nm(radius_m * angle.cos()), nm(radius_m * angle.sin()), 0.0];
            SetPointRecord {
                time_s: i as f64 * dt_s,
                programmed_m: at,
                corrected_m: at,
            }
        };
        Recording {
            stopped: false,
            dt_s,
            points: (0..((2.0 * ramp_s + cruise_s) / dt_s) as usize)
                .map(point)
                .collect(),
        }
    }

    #[test]
    fn last_steady_turn_is_found_in_the_set_points() {
        for direction in [Direction::Ccw, Direction::Cw] {
            let test = CircleTest::new(0.11, 0.68, direction);
            let sign = f64::from(direction.sign());
            let turn = last_turn(&recording(0.11, 0.68, sign), &test).unwrap();
            let whole_s = TAU * 0.11 / 0.68;
            assert!((turn.turn_s - whole_s).abs() < 1e-6, "{turn:?}");
            // It ends when the speed is taken away: at 0.4 s + two turns, where the angle is that of the start.
            assert!((turn.start_s - (0.4 + whole_s)).abs() < 5e-3, "{turn:?}");
            let since = turn.start_s - 0.4 - whole_s;
            let off = turn.angle_rad - sign * 0.68 / 0.11 * since;
            assert!((off / TAU - (off / TAU).round()).abs() < 1e-5, "{turn:?}");
        }
    }

    #[test]
    fn a_circle_that_never_runs_at_its_feed_has_no_steady_turn() {
        let slower = recording(0.11, 0.6, 1.0);
        assert_eq!(
            last_turn(&slower, &CircleTest::new(0.11, 0.68, Direction::Ccw)),
            None
        );
    }
}
