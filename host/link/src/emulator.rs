//! The firmware image in QEMU: the link on a pty, as a serial device would be, other ports on sockets.
use super::error::ControllerError;
use super::image::{self, Board, SerialPort};
use super::link::Link;
use super::serial::SerialLink;
use super::stepped::SteppedLink;
use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::time::Duration;
use tempfile::TempDir;

/// Name of the emulator's program; `GIOTTO_QEMU` names another.
pub const PROGRAM: &str = "qemu-system-arm";
/// How long it may take to say where its pty is.
const START_TIME: Duration = Duration::from_secs(10);

/// Ticks of the boards' images, those of the feature `fast` apart.
const TICK: Duration = Duration::from_millis(1);

/// Runs the emulator until its own input ends, which it does however this process ends.
const KEEPER: &str = r#"exec 3<&0; "$@" </dev/null 3<&- & emulator=$!
exec >/dev/null 2>&1; cat <&3; kill $emulator; wait $emulator"#;

/// How fast time goes in the emulator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// By itself: it counts instructions and skips over waiting, faster than a host that is busy elsewhere can follow. For what
    /// only counts instructions, and for images that know nothing of grants.
    Free,
    /// As the host grants it, tick by tick: see [`stepped`](super::stepped).
    Stepped,
}

/// An emulator that runs an image; dropped, it is ended.
#[derive(Debug)]
pub struct Emulator {
    process: Child,
    pty: String,
    pace: Pace,
    folder: TempDir,
}

/// In which circumstances an emulator starts.
#[derive(Clone, Copy, Debug, Default)]
pub struct Setup<'a> {
    /// Bytes in its memory, each block from an address on: they are there again after each reset.
    pub memory: &'a [(u32, &'a [u8])],
    /// It waits for [`Emulator::go`]: who listens at its ports before that misses nothing.
    pub held: bool,
}

/// The socket through which a held one is let go.
fn qmp(folder: &TempDir) -> PathBuf {
    folder.path().join("qmp")
}

/// The emulator to run.
pub fn program() -> String {
    std::env::var("GIOTTO_QEMU").unwrap_or_else(|_| PROGRAM.to_owned())
}

impl Emulator {
    /// Starts the image at `image`, or the workspace's for QEMU's mps2-an386.
    ///
    /// # Errors
    /// [`ControllerError::NoEmulator`], [`ControllerError::NoImage`], [`ControllerError::Emulator`].
    pub fn start(
        image: Option<&Path>,
        pace: Pace,
        note: &mut dyn FnMut(&str),
    ) -> Result<Self, ControllerError> {
        Self::start_board(Board::Mps2An386, image, pace, note)
    }

    /// As [`Emulator::start`], for any board.
    ///
    /// # Errors
    /// As there.
    pub fn start_board(
        board: Board,
        image: Option<&Path>,
        pace: Pace,
        note: &mut dyn FnMut(&str),
    ) -> Result<Self, ControllerError> {
        Self::start_with(&Setup::default(), board, image, pace, note)
    }

    /// The same, in circumstances.
    ///
    /// # Errors
    /// As there.
    pub fn start_with(
        setup: &Setup<'_>,
        board: Board,
        image: Option<&Path>,
        pace: Pace,
        note: &mut dyn FnMut(&str),
    ) -> Result<Self, ControllerError> {
        let program = program();
        let found = Command::new(&program)
            .arg("--version")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        if found.is_err() {
            return Err(ControllerError::NoEmulator { program });
        }
        let image = match image {
            Some(path) if path.is_file() => path.to_owned(),
            Some(path) => {
                let reason = "no such file".to_owned();
                return Err(ControllerError::NoImage {
                    path: path.to_owned(),
                    reason,
                });
            }
            None => image::ensure_with(board, board.features(pace == Pace::Stepped), note)?,
        };
        let folder = tempfile::Builder::new()
            .prefix("giotto-qemu-")
            .tempdir()
            .map_err(|e| failed(&e))?;
        let mut command = Command::new("sh");
        command.args(["-c", KEEPER, "sh", &program]);
        command
            .args([
                "-machine",
                board.machine(),
                "-nographic",
                "-monitor",
                "none",
                "-kernel",
            ])
            .arg(&image);
        for (address, bytes) in setup.memory {
            let file = folder.path().join(format!("{address:08x}"));
            std::fs::write(&file, bytes).map_err(|e| failed(&e))?;
            let block = format!("loader,file={},addr={address},force-raw=on", file.display());
            command.args(["-device", &block]);
        }
        serial_ports(&mut command, board, folder.path());
        if setup.held {
            let socket = format!("unix:{},server=on,wait=off", qmp(&folder).display());
            command.args(["-S", "-qmp", &socket]);
        }
        // Time counts instructions, so that a busy host delays the controller but never makes a tick late.
        let shift = board.instruction_shift();
        command
            .arg("-icount")
            .arg(format!("shift={shift},sleep=off,align=off"));
        command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let mut process = command.spawn().map_err(|error| failed(&error))?;
        match find_pty(&mut process) {
            Ok(pty) => Ok(Self {
                process,
                pty,
                pace,
                folder,
            }),
            Err(error) => {
                end(&mut process);
                Err(error)
            }
        }
    }

    /// Lets an emulator that is [held](Setup::held) run.
    ///
    /// # Errors
    /// Those of the socket through which it is asked to; [`io::ErrorKind::UnexpectedEof`] if it does not answer.
    pub fn go(&self) -> io::Result<()> {
        let mut ask = UnixStream::connect(qmp(&self.folder))?;
        let mut answers = BufReader::new(ask.try_clone()?);
        let mut line = String::new();
        // A greeting, and an answer to each of two requests; events may come between.
        for request in ["", "qmp_capabilities", "cont"] {
            if !request.is_empty() {
                writeln!(ask, "{{\"execute\":\"{request}\"}}")?;
            }
            let wanted = if request.is_empty() { "QMP" } else { "return" };
            loop {
                line.clear();
                if answers.read_line(&mut line)? == 0 {
                    return Err(io::ErrorKind::UnexpectedEof.into());
                }
                if line.contains(wanted) {
                    break;
                }
            }
        }
        Ok(())
    }

    /// Path of the pty that is the link.
    pub fn pty(&self) -> &str {
        &self.pty
    }

    /// Path of the socket where set-points stream, if the board has a port for them.
    pub fn stream_path(&self) -> PathBuf {
        self.folder.path().join("stream")
    }

    /// Connects to the port for set-points, which on the mps2-an386 is the stop switch as well.
    ///
    /// # Errors
    /// Those of the socket.
    pub fn stream(&self) -> io::Result<UnixStream> {
        UnixStream::connect(self.stream_path())
    }

    /// Path of the socket where the log goes in defmt's encoding.
    pub fn log_path(&self) -> PathBuf {
        self.folder.path().join("log")
    }

    /// Connects to it.
    ///
    /// # Errors
    /// Those of the socket.
    pub fn log(&self) -> io::Result<UnixStream> {
        UnixStream::connect(self.log_path())
    }

    /// Opens the link; the emulator ends with it.
    ///
    /// # Errors
    /// Those of [`SerialLink::open`].
    pub fn into_link(self) -> Result<EmulatorLink, ControllerError> {
        let link = self.open()?;
        Ok(EmulatorLink {
            link,
            _emulator: self,
        })
    }

    /// Opens the pty of the link with a serial port's means, in the emulator's time.
    ///
    /// # Errors
    /// Those of [`SerialLink::open`]; [`ControllerError::Emulator`] if the image knows nothing of grants.
    pub fn open(&self) -> Result<Box<dyn Link>, ControllerError> {
        let serial = SerialLink::open(&self.pty, super::port::BAUD)?;
        match self.pace {
            Pace::Free => Ok(Box::new(serial)),
            Pace::Stepped => {
                let link = SteppedLink::begin(serial, TICK).map_err(|error| failed(&error))?;
                Ok(Box::new(link))
            }
        }
    }
}

fn end(process: &mut Child) {
    // Its keeper sees the end of its input; both are gone when it is waited for.
    drop(process.stdin.take());
    let _ = process.wait();
}

impl Drop for Emulator {
    fn drop(&mut self) {
        end(&mut self.process);
    }
}

fn failed(error: &io::Error) -> ControllerError {
    ControllerError::Emulator {
        reason: error.to_string(),
    }
}

/// The ports of a board: its link as a terminal, the others as sockets in a folder.
fn serial_ports(command: &mut Command, board: Board, folder: &Path) {
    for port in board.serial_ports() {
        match port {
            SerialPort::Link => command.args(["-serial", "pty"]),
            SerialPort::Nowhere => command.args(["-serial", "null"]),
            SerialPort::Socket(name) => {
                let path = folder.join(name);
                let socket = format!(
                    "socket,id={name},path={},server=on,wait=off",
                    path.display()
                );
                command.args(["-chardev", &socket, "-serial", &format!("chardev:{name}")])
            }
        };
    }
}

/// Reads "char device redirected to PATH (label serial0)".
fn find_pty(process: &mut Child) -> Result<String, ControllerError> {
    let (sender, lines) = mpsc::channel();
    let readers: [Option<Box<dyn io::Read + Send>>; 2] = [
        process.stdout.take().map(|pipe| Box::new(pipe) as _),
        process.stderr.take().map(|pipe| Box::new(pipe) as _),
    ];
    for reader in readers.into_iter().flatten() {
        let sender = sender.clone();
        std::thread::spawn(move || {
            // Read to the end, so that the emulator never waits for a full pipe.
            for line in BufReader::new(reader).lines().map_while(Result::ok) {
                let _ = sender.send(line);
            }
        });
    }
    drop(sender);
    let mut words = Vec::new();
    while let Ok(line) = lines.recv_timeout(START_TIME) {
        let path = line
            .strip_prefix("char device redirected to ")
            .and_then(|rest| rest.split(' ').next());
        if let Some(path) = path {
            return Ok(path.to_owned());
        }
        words.push(line);
    }
    let reason = if words.is_empty() {
        "it says nothing".to_owned()
    } else {
        words.join("; ")
    };
    Err(ControllerError::Emulator { reason })
}

/// The link of an emulator, which lives as long as this.
pub struct EmulatorLink {
    link: Box<dyn Link>,
    _emulator: Emulator,
}

impl Link for EmulatorLink {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.link.send(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], until: Duration) -> io::Result<usize> {
        self.link.receive(buffer, until)
    }

    fn now(&self) -> Duration {
        self.link.now()
    }
}
