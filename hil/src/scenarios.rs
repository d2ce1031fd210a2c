//! What every controller has to stand: the image under QEMU, the virtual one, or a real one on its port.
//!
//! The machine moves: on a real port the scenarios run circles of up to 100 mm about the origin.
use crate::contour::Errors;
use crate::programs;
use crate::ticks::largest_table;
use giotto_link::flash::{Verdict, is_flash_fault};
use giotto_link::{Controller, ControllerError, circle};
use giotto_shared::Direction;
use giotto_shared::table::{self, MAX_IMAGE_BYTES, TableError};
use giotto_shared::wire::{
    Command, ExactCircle, MotionRefusal, MotionState, Pose, Refusal, Status,
};
use std::time::Duration;

/// How a scenario ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// As it should.
    Passed,
    /// The flash did not take the table; the controller refused it and went on as before.
    RefusedByFlash,
    /// Otherwise, and how.
    Failed(String),
}

/// A scenario.
pub type Scenario = (&'static str, fn(&mut Controller) -> Result<(), Trouble>);

/// Why a scenario did not end as it should.
#[derive(Debug)]
pub enum Trouble {
    /// The controller, or the way to it.
    Controller(ControllerError),
    /// Something was not as it should be.
    Wrong(String),
}

impl From<ControllerError> for Trouble {
    fn from(error: ControllerError) -> Self {
        Self::Controller(error)
    }
}

/// In the order they run in; the others are in [`streams`](crate::streams::ALL).
pub const ALL: [Scenario; 9] = [
    ("says who it is", identity),
    ("a circle bypassed is the programmed one", bypassed_circle),
    ("a stop command ends a run within the limits", stop),
    (
        "a silent host: the segment in hand finishes, nothing else starts",
        silent_host,
    ),
    ("runs out of bounds are refused", out_of_bounds),
    (
        "a silent host in a program: the segment in hand finishes, nothing else starts",
        programs::silent_host,
    ),
    (
        "a broken table is refused and changes nothing",
        broken_table,
    ),
    (
        "flash, verify, reset, verify; the circle is corrected",
        flash_and_run,
    ),
    (
        "a table that is not confirmed is gone after a reset",
        unconfirmed,
    ),
];

/// Runs one scenario.
pub fn run(scenario: &Scenario, controller: &mut Controller) -> Outcome {
    match scenario.1(controller) {
        Ok(()) => Outcome::Passed,
        Err(Trouble::Controller(error)) if is_flash_fault(&error).is_some() => {
            match after_flash_fault(controller) {
                Ok(()) => Outcome::RefusedByFlash,
                Err(trouble) => Outcome::Failed(trouble.to_string()),
            }
        }
        Err(trouble) => Outcome::Failed(trouble.to_string()),
    }
}

impl std::fmt::Display for Trouble {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Controller(error) => write!(f, "{error}"),
            Self::Wrong(what) => f.write_str(what),
        }
    }
}

pub(crate) fn ensure(holds: bool, what: impl Fn() -> String) -> Result<(), Trouble> {
    if holds {
        Ok(())
    } else {
        Err(Trouble::Wrong(what()))
    }
}

pub(crate) fn refused_as(
    result: Result<(), ControllerError>,
    wanted: impl Fn(&Refusal) -> bool,
) -> Result<(), Trouble> {
    match result {
        Err(ControllerError::Refused(refusal)) if wanted(&refusal) => Ok(()),
        other => Err(Trouble::Wrong(format!(
            "not refused as it should be: {other:?}"
        ))),
    }
}

/// What is left of a contour error is below a bar, and there was one; the figures on stderr.
pub(crate) fn holds(name: &str, errors: Errors, bar: f64) -> Result<(), Trouble> {
    let Errors {
        corrected,
        uncorrected,
    } = errors;
    let (corrected_um, uncorrected_um) = (corrected * 1e6, uncorrected * 1e6);
    let words = format!("{name}: {corrected_um:.2} of {uncorrected_um:.1} µm left");
    eprintln!("       {words}: {:.2} %", 100.0 * errors.left());
    ensure(uncorrected > 20e-6 && errors.left() <= bar, || {
        words.clone()
    })
}

/// A table that flash did not take is not committed, and the controller still runs.
fn after_flash_fault(controller: &mut Controller) -> Result<(), Trouble> {
    refused_as(controller.command(Command::Commit), |refusal| {
        *refusal == Refusal::NothingToCommit
    })?;
    let status = controller.status()?;
    ensure(status.bypass && status.active.is_none(), || {
        format!("corrects without a table: {status:?}")
    })?;
    bypassed_circle(controller)
}

pub(crate) fn at_rest(controller: &mut Controller) -> Result<Status, Trouble> {
    for _ in 0..100_000 {
        let status = controller.status()?;
        match status.motion {
            MotionState::Running | MotionState::Stopping | MotionState::Paused => {}
            MotionState::Idle => return Ok(status),
            MotionState::Fault => {
                return Err(Trouble::Wrong(format!("in fault: {:?}", status.fault)));
            }
        }
    }
    Err(Trouble::Wrong("never comes to rest".to_owned()))
}

fn far_from_circle(place: Pose, radius_m: f64) -> f64 {
    let [x, y, _] = place.map(|nm| f64::from(nm) * 1e-9);
    (x.hypot(y) - radius_m).abs()
}

fn identity(controller: &mut Controller) -> Result<(), Trouble> {
    let identity = controller.identity();
    ensure(
        !identity.board.is_empty() && !identity.build.is_empty(),
        || "no name or build".to_owned(),
    )?;
    let status = controller.status()?;
    ensure(status.motion == MotionState::Idle, || {
        format!("not idle: {status:?}")
    })?;
    ensure(status.counters.tick_overruns == 0, || {
        format!("ticks are late: {:?}", status.counters)
    })
}

fn bypassed_circle(controller: &mut Controller) -> Result<(), Trouble> {
    if controller.status()?.active.is_some() {
        controller.command(Command::Bypass { on: true })?;
    }
    let recording = controller.run_circle(&circle(0.1, 0.4, Direction::Ccw, 1), 4)?;
    let equal = recording
        .points
        .iter()
        .all(|point| point.programmed_m == point.corrected_m);
    // The run before may have left an offset that is still being taken out.
    let settled = controller.status()?;
    ensure(settled.raw_nm == settled.corrected_nm, || {
        "bypassed, yet not as programmed".to_owned()
    })?;
    ensure(equal || settled.active.is_some(), || {
        "a set-point is not the programmed one".to_owned()
    })?;
    ensure(settled.counters.tick_overruns == 0, || {
        format!("ticks are late: {:?}", settled.counters)
    })
}

fn stop(controller: &mut Controller) -> Result<(), Trouble> {
    let before = controller.status()?.counters;
    controller.start_circle(&circle(0.1, 0.2, Direction::Cw, 50))?;
    let busy = controller.start_circle(&circle(0.1, 0.2, Direction::Cw, 1));
    refused_as(busy, |refusal| {
        matches!(
            refusal,
            Refusal::Busy | Refusal::Motion(MotionRefusal::Busy)
        )
    })?;
    controller.command(Command::Stop)?;
    let after = at_rest(controller)?.counters;
    ensure(after.stops == before.stops + 1, || {
        format!("stops: {} and {}", before.stops, after.stops)
    })
}

fn silent_host(controller: &mut Controller) -> Result<(), Trouble> {
    // Far from the circle, so that its approach takes longer than the silence.
    controller.run_circle(&circle(0.01, 0.05, Direction::Ccw, 1), 10)?;
    let before = controller.status()?.counters;
    controller.supervise(Some(Duration::from_millis(50)))?;
    controller.start_circle(&circle(0.1, 0.2, Direction::Ccw, 100))?;
    controller.stay_silent(Duration::from_millis(1500))?;
    controller.supervise(None)?;
    let status = at_rest(controller)?;
    let after = status.counters;
    ensure(after.link_losses == before.link_losses + 1, || {
        format!("not noticed: {after:?}")
    })?;
    ensure(
        after.dropped_segments == before.dropped_segments + 1,
        || format!("the circle began: {after:?}"),
    )?;
    let off = far_from_circle(status.raw_nm, 0.1);
    ensure(off < 1e-8, || {
        format!("the approach did not finish: {off} m from its end")
    })
}

fn out_of_bounds(controller: &mut Controller) -> Result<(), Trouble> {
    let good = circle(0.1, 0.2, Direction::Ccw, 1)
        .exact()
        .map_err(ControllerError::from)?;
    let bad = [
        ExactCircle {
            radius_half_nm: i32::MAX,
            ..good
        },
        ExactCircle {
            radius_half_nm: -good.radius_half_nm,
            ..good
        },
        ExactCircle {
            feed_m_s: f32::NAN,
            ..good
        },
        ExactCircle { laps: 0, ..good },
        ExactCircle {
            feed_m_s: 1e9,
            ..good
        },
    ];
    for run in bad {
        let refused = |refusal: &Refusal| {
            matches!(refusal, Refusal::Motion(MotionRefusal::OutOfBounds { .. }))
        };
        refused_as(controller.command(Command::RunCircle(run)), refused)?;
    }
    ensure(controller.status()?.motion == MotionState::Idle, || {
        "something moves".to_owned()
    })
}

/// The largest table, with this name.
fn table_named(name: &str) -> Vec<u8> {
    let image = largest_table();
    let Ok(mut table) = table::decode(&image) else {
        return image;
    };
    table.machine = name.chars().take(32).collect();
    let mut bytes = vec![0; MAX_IMAGE_BYTES];
    let length = table::encode(&table, &mut bytes).unwrap_or(0);
    bytes.truncate(length);
    bytes
}

fn broken_table(controller: &mut Controller) -> Result<(), Trouble> {
    let before = controller.status()?.slots;
    let mut broken = table_named("broken");
    broken[40] ^= 1;
    let crc = |refusal: &Refusal| matches!(refusal, Refusal::Table(TableError::BadCrc { .. }));
    refused_as(controller.write(&broken, &mut |_| {}).map(drop), crc)?;
    let after = controller.status()?.slots;
    ensure(before == after, || {
        format!("a slot has changed: {before:?}, {after:?}")
    })
}

fn verified(controller: &mut Controller, image: &[u8]) -> Result<(), Trouble> {
    let verdict = controller.verify(image)?;
    ensure(matches!(verdict, Verdict::Same { .. }), || {
        format!("another table is in use: {verdict:?}")
    })
}

fn flash_and_run(controller: &mut Controller) -> Result<(), Trouble> {
    let image = table_named("first");
    controller.flash(&image, &mut |_| {})?;
    verified(controller, &image)?;
    controller.reset()?;
    verified(controller, &image)?;
    let recording = controller.run_circle(&circle(0.1, 0.5, Direction::Ccw, 1), 4)?;
    let corrected = recording
        .points
        .iter()
        .any(|point| point.programmed_m != point.corrected_m);
    ensure(corrected, || "the circle is not corrected".to_owned())?;
    ensure(controller.status()?.counters.tick_overruns == 0, || {
        "ticks are late".to_owned()
    })
}

fn unconfirmed(controller: &mut Controller) -> Result<(), Trouble> {
    let image = table_named("second");
    controller.flash(&image, &mut |_| {})?;
    let other = table_named("other");
    controller.write(&other, &mut |_| {})?;
    controller.command(Command::Commit)?;
    verified(controller, &other)?;
    controller.reset()?;
    verified(controller, &image)
}
