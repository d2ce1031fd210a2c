//! LinuxCNC made to run a program, and what the component saw meanwhile: set-points and feedback, tick by tick.
use super::page::Page;
use crate::error::ControllerError;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// LinuxCNC's own interface.
const DRIVER: &str = include_str!("drive.py");
/// The machine is watched for so long before and after a program.
const MARGIN: Duration = Duration::from_millis(500);
/// How often the page is read: it keeps some seconds.
const LOOK: Duration = Duration::from_millis(50);

/// What LinuxCNC lets the first two slides do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveLimits {
    /// From the origin to the nearest soft limit, mm.
    pub room_mm: f64,
    /// Highest feed, mm/s.
    pub feed_mm_s: f64,
    /// Highest acceleration, mm/s².
    pub acceleration_mm_s2: f64,
}

/// One tick, by slide, machine coordinates, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The planner's set-point.
    pub commanded_mm: [f64; 3],
    /// The machine's feedback.
    pub measured_mm: [f64; 3],
}

fn refused(reason: impl std::fmt::Display) -> ControllerError {
    ControllerError::NoProgram {
        reason: reason.to_string(),
    }
}

/// LinuxCNC's interface belongs to the system's Python, which need not be the first of the path.
const PYTHON: &str = "/usr/bin/python3";

fn driver(words: &[&str]) -> Command {
    let python = if Path::new(PYTHON).exists() {
        PYTHON
    } else {
        "python3"
    };
    let mut command = Command::new(python);
    command
        .args(["-c", DRIVER])
        .args(words)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// What the driver says.
fn answer(out: &std::process::Output) -> Result<Value, ControllerError> {
    let value: Value = serde_json::from_slice(&out.stdout).map_err(|_| {
        let errors = String::from_utf8_lossy(&out.stderr);
        refused(errors.lines().last().unwrap_or("it says nothing"))
    })?;
    match value.get("error").and_then(Value::as_str) {
        Some(error) => Err(refused(error)),
        None => Ok(value),
    }
}

/// What a LinuxCNC that is switched on and homed lets its slides do.
///
/// # Errors
/// [`ControllerError::NoProgram`]: it is off, not homed, or runs something.
pub fn limits() -> Result<DriveLimits, ControllerError> {
    let value = answer(&driver(&["limits"]).output().map_err(refused)?)?;
    let number = |name: &str| {
        let number = value.get(name).and_then(Value::as_f64);
        number.ok_or_else(|| refused(format!("no {name} in its answer")))
    };
    Ok(DriveLimits {
        room_mm: number("room_mm")?,
        feed_mm_s: number("feed_mm_s")?,
        acceleration_mm_s2: number("acceleration_mm_s2")?,
    })
}

/// Time between two samples, s.
///
/// # Errors
/// [`ControllerError::NoComponent`].
pub fn period_s() -> Result<f64, ControllerError> {
    Ok(f64::from(Page::watch()?.period_ns()?) * 1e-9)
}

/// Has LinuxCNC run a program, and gives what the component saw from before its start until after its end.
///
/// # Errors
/// [`ControllerError::NoComponent`]; [`ControllerError::NoProgram`]: LinuxCNC refuses it, or stops on its way;
/// [`ControllerError::Lost`]: this computer was too busy to read all samples.
pub fn run(program: &Path, within: Duration) -> Result<Vec<Sample>, ControllerError> {
    let page = Page::watch()?;
    let mut recorder = Recorder::new(page)?;
    recorder.watch(MARGIN)?;
    let seconds = within.as_secs().to_string();
    let file = program.to_string_lossy();
    let mut child = driver(&["run", &file, &seconds]).spawn().map_err(refused)?;
    while child.try_wait().map_err(refused)?.is_none() {
        recorder.watch(LOOK)?;
    }
    answer(&child.wait_with_output().map_err(refused)?)?;
    recorder.watch(MARGIN)?;
    Ok(recorder.samples)
}

/// Reads what the component writes.
struct Recorder {
    page: Page,
    /// The next tick to read.
    next: u32,
    samples: Vec<Sample>,
}

impl Recorder {
    fn new(page: Page) -> Result<Self, ControllerError> {
        let next = page
            .words()
            .map_err(|error| super::page::gone(&error))?
            .tick;
        Ok(Self {
            page,
            next,
            samples: Vec::new(),
        })
    }

    fn watch(&mut self, so_long: Duration) -> Result<(), ControllerError> {
        let begun = Instant::now();
        loop {
            let lost = |error: std::io::Error| super::page::gone(&error);
            let seen = self.page.seen(self.next).map_err(lost)?;
            self.next = self.next.wrapping_add(seen.len() as u32);
            let mm = |nm: [i32; 3]| nm.map(|nm| f64::from(nm) * 1e-6);
            self.samples
                .extend(seen.into_iter().map(|[commanded, measured]| Sample {
                    commanded_mm: mm(commanded),
                    measured_mm: mm(measured),
                }));
            if begun.elapsed() >= so_long {
                return Ok(());
            }
            std::thread::sleep(LOOK.min(so_long));
        }
    }
}
