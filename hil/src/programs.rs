//! Scenarios of programs: segments sent ahead of the machine, and the contour that comes of them.
use crate::contour::{self, Errors};
use crate::scenarios::{Trouble, at_rest, ensure, holds, refused_as};
use giotto_link::{Controller, ControllerError, ProgramError, Recording, Segment, Step};
use giotto_shared::wire::{Command, MotionRefusal, Refusal};
use std::f64::consts::PI;
use std::time::Duration;

impl From<ProgramError> for Trouble {
    fn from(error: ProgramError) -> Self {
        Self::Controller(error.error)
    }
}

const FEED_M_S: f64 = 0.2;
/// The bar on what is left of the contour error of arcs with joints.
const BAR: f64 = 0.05;

fn line(x: f64, y: f64) -> Segment {
    Segment::Line {
        to_m: [x, y, 0.0],
        feed_m_s: FEED_M_S,
    }
}

fn quarter(x: f64, y: f64) -> Segment {
    let (normal, sweep_rad) = ([0.0, 0.0, 1.0], PI / 2.0);
    Segment::Arc {
        centre_m: [x, y, 0.0],
        normal,
        sweep_rad,
        rise_m: 0.0,
        feed_m_s: FEED_M_S,
    }
}

fn steps(segments: &[Segment]) -> Vec<Step> {
    segments
        .iter()
        .map(|&segment| Step {
            segment,
            tolerance_m: 0.0,
        })
        .collect()
}

/// Where segments lead from a place, nm.
fn end_nm(from_nm: [i32; 3], segments: &[Segment]) -> Result<[i32; 3], Trouble> {
    segments.iter().try_fold(from_nm, |at, segment| {
        let exact = segment.exact(at).map_err(ControllerError::from)?;
        Ok(exact.end_nm(at))
    })
}

/// Runs a program from a place and records every set-point.
pub(crate) fn recorded(
    controller: &mut Controller,
    start_nm: [i32; 3],
    segments: &[Segment],
) -> Result<Recording, Trouble> {
    controller.move_to(start_nm, FEED_M_S)?;
    let before = controller.status()?.counters.segments;
    let recording = controller.run_program(&steps(segments), 1)?;
    let done = controller.status()?.counters.segments.wrapping_sub(before);
    ensure(done as usize == segments.len(), || {
        format!("{done} segments done")
    })?;
    Ok(recording)
}

/// Lines, a helix of more than a turn, a tilted arc, dwells: more than the queue holds.
pub fn ends_exactly(controller: &mut Controller) -> Result<(), Trouble> {
    let helix = |sweep_rad, rise_m| Segment::Arc {
        centre_m: [0.02, 0.03, 0.0],
        normal: [0.0, 0.0, 1.0],
        sweep_rad,
        rise_m,
        feed_m_s: 0.15,
    };
    let tilted = Segment::Arc {
        centre_m: [0.0, 0.03, 0.01],
        normal: [0.3, -0.2, 1.0],
        sweep_rad: -2.0,
        rise_m: 0.0,
        feed_m_s: 0.1,
    };
    let wait = Segment::Dwell { time_s: 0.02 };
    let segments = [
        line(0.05, 0.0),
        helix(2.5 * PI, 0.01),
        wait,
        line(0.01, 0.04),
        helix(-0.7, -0.004),
        tilted,
        line(0.0, 0.001),
        wait,
        line(0.0, 0.0),
        helix(1.0, 0.0),
    ];
    let start_nm = controller.status()?.raw_nm;
    let expected = end_nm(start_nm, &segments)?;
    let recording = recorded(controller, start_nm, &segments)?;
    let after = controller.status()?;
    ensure(after.raw_nm == expected, || {
        format!("ends at {:?}, not at {expected:?}", after.raw_nm)
    })?;
    // No step in velocity: never more than the acceleration of one tick.
    let dt = recording.dt_s;
    let mut worst = 0.0_f64;
    for triple in recording.points.windows(3) {
        let [a, b, c] = [
            triple[0].corrected_m,
            triple[1].corrected_m,
            triple[2].corrected_m,
        ];
        let size: f64 = (0..3).map(|i| (c[i] - 2.0 * b[i] + a[i]).powi(2)).sum();
        worst = worst.max(size.sqrt() / (dt * dt));
    }
    ensure(worst < 5.1, || format!("{worst} m/s² commanded"))?;
    ensure(after.counters.tick_overruns == 0, || {
        "ticks are late".to_owned()
    })
}

/// The host dies with segments in the queue.
pub fn silent_host(controller: &mut Controller) -> Result<(), Trouble> {
    controller.run_program(&steps(&[line(0.0, 0.0)]), 10)?;
    let before = controller.status()?;
    let mut at = before.raw_nm;
    let mut first = at;
    controller.command(Command::Begin)?;
    for (n, x) in [0.08, 0.02, 0.06].into_iter().enumerate() {
        let segment = line(x, 0.0).exact(at).map_err(ControllerError::from)?;
        controller.command(Command::Append {
            segment,
            tolerance_nm: 0,
        })?;
        at = segment.end_nm(at);
        if n == 0 {
            first = at;
        }
    }
    controller.supervise(Some(Duration::from_millis(50)))?;
    controller.stay_silent(Duration::from_millis(2500))?;
    controller.supervise(None)?;
    let after = at_rest(controller)?;
    ensure(after.raw_nm == first, || {
        format!("stands at {:?}, not at {first:?}", after.raw_nm)
    })?;
    let (was, is) = (before.counters, after.counters);
    ensure(is.link_losses == was.link_losses + 1, || {
        format!("not noticed: {is:?}")
    })?;
    ensure(is.dropped_segments == was.dropped_segments + 2, || {
        format!("dropped: {is:?}")
    })?;
    refused_as(controller.command(Command::End), |refusal| {
        *refusal == Refusal::Motion(MotionRefusal::NoProgram)
    })
}

/// Runs a program from rest at its start.
fn contour_of(
    controller: &mut Controller,
    start_m: [f64; 2],
    segments: &[Segment],
    distance: &dyn Fn([f64; 2]) -> f64,
) -> Result<Errors, Trouble> {
    let [x_nm, y_nm] = start_m.map(|m| (m * 1e9).round() as i32);
    Ok(contour::errors(
        &recorded(controller, [x_nm, y_nm, 0], segments)?,
        distance,
    ))
}

/// Line, arc, line; and a rounded rectangle: set-points from the controller, the machine behind them simulated.
pub fn contour(controller: &mut Controller) -> Result<(), Trouble> {
    controller.flash(&contour::table(), &mut |_| {})?;
    let arc_between_lines = |[x, y]: [f64; 2]| {
        if x <= 0.05 {
            y
        } else if y >= 0.03 {
            x - 0.08
        } else {
            (x - 0.05).hypot(y - 0.03) - 0.03
        }
    };
    let segments = [line(0.05, 0.0), quarter(0.05, 0.03), line(0.08, 0.08)];
    let errors = contour_of(controller, [0.0, 0.0], &segments, &arc_between_lines)?;
    holds("arc between lines", errors, BAR)?;

    let (w, h, r) = (0.08, 0.06, 0.015);
    let rectangle = [
        line(w - r, 0.0),
        quarter(w - r, r),
        line(w, h - r),
        quarter(w - r, h - r),
        line(r, h),
        quarter(r, h - r),
        line(0.0, r),
        quarter(r, r),
    ];
    let rounded = |[x, y]: [f64; 2]| {
        let (dx, dy) = (
            (x - w / 2.0).abs() - (w / 2.0 - r),
            (y - h / 2.0).abs() - (h / 2.0 - r),
        );
        if dx > 0.0 && dy > 0.0 {
            dx.hypot(dy) - r
        } else {
            dx.max(dy) - r
        }
    };
    let errors = contour_of(controller, [r, 0.0], &rectangle, &rounded)?;
    holds("rounded rectangle", errors, BAR)?;
    controller.run_program(&steps(&[line(0.0, 0.0)]), 100)?;
    Ok(())
}
