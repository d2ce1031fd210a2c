//! The program `giotto` itself against the running component, as a user types it.
use super::programs::{self, Circle};
use super::samples;
use super::session::{LinuxCncError, Session};
use giotto::campaign::{Direction, Plane};
use serde_json::Value;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// From its start on a motion runs so long before it is stopped.
const UNDER_WAY: Duration = Duration::from_secs(4);

/// The program, and what has been done with it.
#[derive(Clone, Debug)]
pub(super) struct Commands {
    giotto: PathBuf,
    pub(super) done: Vec<String>,
}

impl Commands {
    pub(super) fn new(giotto: &Path) -> Result<Self, LinuxCncError> {
        if giotto.is_file() {
            return Ok(Self {
                giotto: giotto.to_path_buf(),
                done: Vec::new(),
            });
        }
        Err(LinuxCncError::Skipped(format!(
            "no program at {} (cargo build --workspace)",
            giotto.display()
        )))
    }

    /// What it prints; it has to succeed.
    fn run(&mut self, words: &[&OsStr]) -> Result<String, LinuxCncError> {
        let out = Command::new(&self.giotto)
            .arg("--non-interactive")
            .args(words)
            .output()
            .map_err(LinuxCncError::failed)?;
        let said: Vec<_> = words.iter().map(|word| word.to_string_lossy()).collect();
        let said = format!("giotto {}", said.join(" "));
        if !out.status.success() {
            let errors = String::from_utf8_lossy(&out.stderr);
            return Err(LinuxCncError::Failed(format!(
                "{said}: {}\n{errors}",
                out.status
            )));
        }
        self.done.push(said);
        Ok(String::from_utf8_lossy(&out.stdout).into_owned())
    }

    /// A command to the component.
    fn ask(&mut self, words: &[&OsStr]) -> Result<Value, LinuxCncError> {
        let mut all = vec![OsStr::new("--json")];
        all.extend(words);
        all.extend([OsStr::new("--port"), OsStr::new("linuxcnc")]);
        let text = self.run(&all)?;
        // `monitor` and `log` print a document a line.
        let mut documents = serde_json::Deserializer::from_str(&text).into_iter::<Value>();
        documents
            .next()
            .unwrap_or(Ok(Value::Null))
            .map_err(LinuxCncError::failed)
    }

    /// CRC of the table in use.
    fn in_use(&mut self) -> Result<Value, LinuxCncError> {
        let status = self.ask(&["status".as_ref()])?;
        let slot = status["active_slot"].as_u64().unwrap_or(u64::MAX);
        let slot = usize::try_from(slot).unwrap_or(usize::MAX);
        match status["slots"].get(slot) {
            Some(slot) => Ok(slot["crc"].clone()),
            None => Err(LinuxCncError::Failed(format!("no table in use: {status}"))),
        }
    }

    /// Flashes a model, and finds it there.
    pub(super) fn flash(&mut self, model: &Path) -> Result<(), LinuxCncError> {
        let table = model.with_extension("bin");
        self.run(&[
            "table".as_ref(),
            model.as_os_str(),
            "-o".as_ref(),
            table.as_os_str(),
        ])?;
        self.ask(&["flash".as_ref(), model.as_os_str()])?;
        self.ask(&["verify".as_ref(), table.as_os_str()])?;
        Ok(())
    }

    /// Another table and back, the correction off and on: what the machine then does is measured by whoever calls.
    pub(super) fn there_and_back(&mut self, campaign: &Path) -> Result<(), LinuxCncError> {
        let first = self.in_use()?;
        let other = campaign.with_file_name("radius-alone.toml");
        self.run(&[
            "fit".as_ref(),
            campaign.as_os_str(),
            "-o".as_ref(),
            other.as_os_str(),
        ])?;
        self.flash(&other)?;
        let second = self.in_use()?;
        self.ask(&["rollback".as_ref()])?;
        let third = self.in_use()?;
        if first == second || first != third {
            return Err(LinuxCncError::Failed(format!(
                "tables in use: {first}, flashed {second}, rolled back {third}"
            )));
        }
        self.ask(&["monitor".as_ref(), "--count".as_ref(), "2".as_ref()])?;
        self.ask(&["log".as_ref(), "--once".as_ref()])?;
        Ok(())
    }

    /// Switches the correction off or on.
    pub(super) fn bypass(&mut self, on: bool) -> Result<(), LinuxCncError> {
        let word = if on { "on" } else { "off" };
        self.ask(&["bypass".as_ref(), word.as_ref()]).map(drop)
    }

    /// Stops a circle that LinuxCNC runs.
    pub(super) fn stop(&mut self, session: &mut Session) -> Result<(), LinuxCncError> {
        let slow = Circle {
            radius_mm: 100.0,
            feed_mm_s: 60.0,
            direction: Direction::Ccw,
            plane: Plane::Xy,
        };
        let program = programs::circles(&[slow]);
        let mut twin = self.clone();
        let stopper = std::thread::spawn(move || {
            std::thread::sleep(UNDER_WAY);
            twin.ask(&["stop".as_ref()]).map(|_| twin.done)
        });
        let recording = samples::run(session, "stopped", program.as_bytes(), 120)?;
        let gone = |_| LinuxCncError::failed("the thread that stops is gone");
        self.done = stopper.join().map_err(gone)??;
        let [x, y, _] = recording.rows.last().map_or([0.0; 3], |row| row.commanded);
        if (x * x + y * y).sqrt() < 90.0 || (x + 100.0).abs() < 1.0 {
            return Err(LinuxCncError::Failed(format!(
                "stopped on its way round, the machine should stand on the circle, not at {x:.2} {y:.2}"
            )));
        }
        Ok(())
    }
}
