//! LinuxCNC started as an ordinary user, driven over a socket.
use super::machine::{self, Play};
use serde_json::{Value, json};
use std::ffi::OsStr;
use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::fs::{PermissionsExt, chown};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// What the scenario cannot do without, or what went wrong in it.
#[derive(Debug, thiserror::Error)]
pub enum LinuxCncError {
    /// It is not possible here: not a failure of what is tested.
    #[error("skipped: {0}")]
    Skipped(String),
    /// LinuxCNC, or its driver, says no.
    #[error("{0}")]
    Failed(String),
}

impl LinuxCncError {
    pub(super) fn failed(what: impl std::fmt::Display) -> Self {
        Self::Failed(what.to_string())
    }
}

/// Where LinuxCNC looks for components.
const MODULES: &str = "/usr/lib/linuxcnc/modules";
/// The account of those who have none.
const NOBODY: u32 = 65534;
const START_WITHIN: Duration = Duration::from_secs(40);
/// A program of the first campaign takes five minutes.
const ANSWER_WITHIN: Duration = Duration::from_secs(900);
const END_WITHIN: Duration = Duration::from_secs(20);

/// A LinuxCNC that runs; it ends with this.
pub(super) struct Session {
    child: Child,
    lines: Option<BufReader<TcpStream>>,
    pub(super) folder: PathBuf,
    /// Goes with the session, unless somebody wants to keep its files.
    _temporary: Option<tempfile::TempDir>,
}

fn found(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| folder.join(program).is_file())
}

fn is_root() -> bool {
    // The owner of what a process shows of itself is who runs it.
    std::fs::metadata("/proc/self").is_ok_and(|of| std::os::unix::fs::MetadataExt::uid(&of) == 0)
}

/// Puts the component where LinuxCNC looks for it.
fn install(component: &Path) -> Result<(), LinuxCncError> {
    let skipped = |what: String| Err(LinuxCncError::Skipped(what));
    for program in ["linuxcnc", "halcmd", "halsampler", "python3"] {
        if !found(program) {
            return skipped(format!(
                "no {program} here (Debian: apt-get install linuxcnc-uspace)"
            ));
        }
    }
    if !component.is_file() {
        return skipped(format!(
            "no component at {} (cargo build -p giotto-linuxcnc)",
            component.display()
        ));
    }
    let target = Path::new(MODULES).join("giotto.so");
    let same = std::fs::read(component).ok() == std::fs::read(&target).ok();
    if !same && let Err(error) = std::fs::copy(component, &target) {
        return skipped(format!("{}: {error}", target.display()));
    }
    if is_root() && !found("setpriv") {
        return skipped("LinuxCNC refuses to run as root, and there is no setpriv".to_owned());
    }
    Ok(())
}

fn driver() -> String {
    let parts = [
        "#!/usr/bin/env python3\n",
        giotto_link::linuxcnc::drive::COMPLAINT,
        include_str!("driver.py"),
    ];
    parts.concat()
}

impl Session {
    /// Starts the machine.
    pub(super) fn start(
        component: &Path,
        play: Play,
        acceleration: f64,
        keep: Option<&Path>,
    ) -> Result<Self, LinuxCncError> {
        install(component)?;
        let failed = |e: std::io::Error| LinuxCncError::failed(e);
        let temporary = match keep {
            Some(_) => None,
            None => Some(tempfile::tempdir().map_err(failed)?),
        };
        let folder = match (keep, &temporary) {
            (Some(keep), _) => {
                std::fs::create_dir_all(keep).map_err(failed)?;
                keep.canonicalize().map_err(failed)?
            }
            (None, temporary) => temporary
                .as_ref()
                .map(|folder| folder.path().to_path_buf())
                .unwrap_or_default(),
        };
        let files = [
            ("machine.ini", machine::ini(acceleration)),
            ("machine.hal", machine::hal(play)),
            ("driver.py", driver()),
        ];
        let mut places: Vec<PathBuf> = vec![folder.clone()];
        for (name, text) in files {
            let place = folder.join(name);
            std::fs::write(&place, text).map_err(failed)?;
            places.push(place);
        }
        for place in &places {
            std::fs::set_permissions(place, std::fs::Permissions::from_mode(0o755))
                .map_err(failed)?;
            if is_root() {
                chown(place, Some(NOBODY), Some(NOBODY)).map_err(failed)?;
            }
        }
        let listener = TcpListener::bind("127.0.0.1:0").map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?.to_string();
        let mut command = if is_root() {
            let mut command = Command::new("setpriv");
            command.args([
                "--reuid=65534",
                "--regid=65534",
                "--clear-groups",
                "linuxcnc",
            ]);
            command
        } else {
            Command::new("linuxcnc")
        };
        let log = std::fs::File::create(folder.join("linuxcnc.log")).map_err(failed)?;
        let child = command
            .arg("machine.ini")
            .current_dir(&folder)
            .env("HOME", &folder)
            .env("GIOTTO_DRIVER", &address)
            .stdin(Stdio::null())
            .stdout(log.try_clone().map_err(failed)?)
            .stderr(log)
            .spawn()
            .map_err(failed)?;
        let mut session = Self {
            child,
            lines: None,
            folder,
            _temporary: temporary,
        };
        session.lines = Some(session.accept(&listener)?);
        Ok(session)
    }

    /// Waits for the driver.
    fn accept(&mut self, listener: &TcpListener) -> Result<BufReader<TcpStream>, LinuxCncError> {
        let begun = Instant::now();
        loop {
            if let Ok((stream, _)) = listener.accept() {
                let set = stream.set_nonblocking(false);
                set.and_then(|()| stream.set_read_timeout(Some(ANSWER_WITHIN)))
                    .map_err(LinuxCncError::failed)?;
                return Ok(BufReader::new(stream));
            }
            let ended = self.child.try_wait().map_err(LinuxCncError::failed)?;
            if ended.is_some() || begun.elapsed() > START_WITHIN {
                return Err(LinuxCncError::Failed(format!(
                    "LinuxCNC did not start:\n{}",
                    self.log()
                )));
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// What LinuxCNC has said; it writes some of that into its user's home.
    fn log(&self) -> String {
        let read = |name: &str| std::fs::read_to_string(self.folder.join(name));
        ["linuxcnc.log", "linuxcnc_print.txt", "linuxcnc_debug.txt"]
            .into_iter()
            .filter_map(|name| read(name).ok())
            .collect()
    }

    /// One order to the driver.
    pub(super) fn order(&mut self, order: &Value) -> Result<Value, LinuxCncError> {
        let lines = self
            .lines
            .as_mut()
            .ok_or_else(|| LinuxCncError::failed("no driver"))?;
        let mut line = format!("{order}\n");
        let lost = |e: std::io::Error| LinuxCncError::Failed(format!("the driver is gone: {e}"));
        lines.get_mut().write_all(line.as_bytes()).map_err(lost)?;
        line.clear();
        lines.read_line(&mut line).map_err(lost)?;
        let mut answer: Value = serde_json::from_str(&line)
            .map_err(|_| LinuxCncError::Failed(format!("LinuxCNC ended:\n{}", self.log())))?;
        match answer.get("error").and_then(Value::as_str) {
            Some(error) => Err(LinuxCncError::Failed(format!("{order}: {error}"))),
            None => Ok(answer["ok"].take()),
        }
    }

    /// Sets a pin or a parameter.
    pub(super) fn set(&mut self, name: &str, value: &str) -> Result<(), LinuxCncError> {
        let order = json!({ "do": "set", "name": name, "value": value });
        self.order(&order).map(drop)
    }

    /// Reads a pin or a parameter.
    pub(super) fn get(&mut self, name: &str) -> Result<String, LinuxCncError> {
        let answer = self.order(&json!({ "do": "get", "name": name }))?;
        Ok(answer["value"].as_str().unwrap_or_default().to_owned())
    }

    /// A file in the machine's folder.
    pub(super) fn place(&self, name: impl AsRef<OsStr>) -> PathBuf {
        self.folder.join(name.as_ref())
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        // Without a line the driver ends, and LinuxCNC with it, cleaning up after itself.
        self.lines = None;
        let begun = Instant::now();
        while begun.elapsed() < END_WITHIN {
            match self.child.try_wait() {
                Ok(None) => std::thread::sleep(Duration::from_millis(50)),
                _ => return,
            }
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
