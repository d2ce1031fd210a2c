//! LinuxCNC made to run a program, and what the component saw meanwhile: set-points and feedback, tick by tick.
use super::page::Page;
use crate::error::ControllerError;
use serde_json::Value;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::{Duration, Instant};

/// LinuxCNC's own interface, in Python.
const DRIVER: &str = concat!(include_str!("complaint.py"), include_str!("drive.py"));
/// Python's `complaint()`: what LinuxCNC has said of an error since the last call. For whoever else drives a LinuxCNC.
pub const COMPLAINT: &str = include_str!("complaint.py");
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
fn answer(out: &Output) -> Result<Value, ControllerError> {
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

/// Has LinuxCNC run a program, and gives what the component saw from before its start until after its end. `wish`: a person wants
/// it to stop.
///
/// Whichever way this ends, LinuxCNC has been told to end the program.
///
/// # Errors
/// [`ControllerError::NoComponent`]; [`ControllerError::NoProgram`]: LinuxCNC refuses it, or stops on its way;
/// [`ControllerError::Lost`]: this computer was too busy to read all samples; [`ControllerError::Stopped`].
pub fn run(
    program: &Path,
    within: Duration,
    wish: &AtomicBool,
) -> Result<Vec<Sample>, ControllerError> {
    let page = Page::watch()?;
    let mut recorder = Recorder::new(page)?;
    recorder.watch(MARGIN)?;
    let seconds = within.as_secs().to_string();
    let file = program.to_string_lossy();
    let mut driver = Driver::start(driver(&["run", &file, &seconds]))?;
    while driver.runs()? {
        if wish.load(Relaxed) {
            return Err(ControllerError::Stopped);
        }
        recorder.watch(LOOK)?;
    }
    answer(&driver.output()?)?;
    recorder.watch(MARGIN)?;
    Ok(recorder.samples)
}

/// A driver that runs. It ends the program when its input does: when this is dropped, or when this process is no more.
struct Driver(Option<Child>);

impl Driver {
    fn start(mut command: Command) -> Result<Self, ControllerError> {
        let child = command.stdin(Stdio::piped()).spawn().map_err(refused)?;
        Ok(Self(Some(child)))
    }

    fn runs(&mut self) -> Result<bool, ControllerError> {
        self.0.as_mut().map_or(Ok(false), |child| {
            let ended = child.try_wait().map_err(refused)?;
            Ok(ended.is_none())
        })
    }

    fn output(mut self) -> Result<Output, ControllerError> {
        let child = self.0.take().ok_or_else(|| refused("it is not there"))?;
        child.wait_with_output().map_err(refused)
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        if let Some(mut child) = self.0.take() {
            drop(child.stdin.take());
            // Whoever goes on finds a machine that has been told.
            let _ = child.wait();
        }
    }
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

#[cfg(all(test, unix))]
#[allow(clippy::unwrap_used, reason = "a test may fail where it stands")]
mod tests {
    use super::*;

    /// Stands where LinuxCNC's own module does: a machine that is ready, and a program that does not end. Writes down what it
    /// is told.
    const MOCK: &str = r#"
STATE_ON, INTERP_IDLE, MODE_AUTO, AUTO_RUN, NML_ERROR, OPERATOR_ERROR = 1, 2, 3, 4, 5, 6
told = open(__file__ + ".told", "a", buffering=1)
class command:
    def __getattr__(self, name):
        return lambda *words: print(name, file=told)
class stat:
    task_state, homed, joints, interp_state = STATE_ON, [True], 1, INTERP_IDLE
    def __init__(self):
        self.polls = 0
    def poll(self):
        self.polls += 1
        self.interp_state = INTERP_IDLE if self.polls < 2 else 0
class error_channel:
    def poll(self):
        return None
"#;

    fn told_after(ends: impl FnOnce(&mut Driver)) -> String {
        let folder = tempfile::tempdir().unwrap();
        let module = folder.path().join("linuxcnc.py");
        std::fs::write(&module, MOCK).unwrap();
        let mut command = driver(&["run", "part.ngc", "60"]);
        command.env("PYTHONPATH", folder.path());
        let mut running = Driver::start(command).unwrap();
        let words = folder.path().join("linuxcnc.py.told");
        let told = || std::fs::read_to_string(&words).unwrap_or_default();
        while !told().contains("auto") {
            assert!(running.runs().unwrap(), "it ended by itself: {}", told());
            std::thread::sleep(Duration::from_millis(5));
        }
        ends(&mut running);
        drop(running);
        told()
    }

    #[test]
    fn who_no_longer_waits_leaves_no_program_running() {
        if !Path::new(PYTHON).exists() {
            eprintln!("skipped: no {PYTHON}");
            return;
        }
        // An error on the way, Ctrl-C, or the end of this process: the input of the driver ends.
        assert!(told_after(|_| ()).ends_with("abort\n"));
        // Ctrl-C reaches the driver as well where it has the same terminal.
        let told = told_after(|running| {
            let id = running.0.as_ref().unwrap().id().to_string();
            let sent = Command::new("kill").args(["-INT", &id]).status().unwrap();
            assert!(sent.success());
            while running.runs().unwrap() {
                std::thread::sleep(Duration::from_millis(5));
            }
        });
        assert!(told.ends_with("abort\n"), "{told}");
    }
}
