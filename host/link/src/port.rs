//! What `--port` may name, and opening it.
use super::client::Controller;
use super::emulator::{Emulator, Pace};
use super::error::ControllerError;
use super::image::Board;
use super::linuxcnc::LinuxCncLink;
use super::serial::SerialLink;
use super::virtual_controller::VirtualLink;
use giotto_shared::wire::{Command, PositionState};
use std::path::PathBuf;
use std::str::FromStr;
use std::time::{SystemTime, UNIX_EPOCH};

/// Baud rate of a serial device unless told otherwise; set-points at 1 kHz need some 30 kB/s.
pub const BAUD: u32 = 460_800;

/// Where a controller is.
///
/// ```
/// use giotto_link::Port;
///
/// assert_eq!("sim".parse(), Ok(Port::Sim));
/// assert_eq!("/dev/ttyUSB0".parse(), Ok(Port::Device("/dev/ttyUSB0".into())));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Port {
    /// The firmware's library in this process, in simulated time.
    Sim,
    /// The firmware image for QEMU's mps2-an386, started for this call.
    Qemu,
    /// The image of another board in QEMU.
    QemuBoard(Board),
    /// The component in a LinuxCNC that runs on this computer.
    LinuxCnc,
    /// A serial device.
    Device(String),
}

impl FromStr for Port {
    type Err = std::convert::Infallible;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Ok(match name {
            "sim" => Self::Sim,
            "qemu" => Self::Qemu,
            "linuxcnc" => Self::LinuxCnc,
            device => match device.strip_prefix("qemu:").and_then(Board::named) {
                Some(board) => Self::QemuBoard(board),
                None => Self::Device(device.to_owned()),
            },
        })
    }
}

/// How to open it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OpenOptions {
    /// Firmware image for QEMU; `None`: the one of this workspace, built if it is missing.
    pub image: Option<PathBuf>,
    /// Baud rate of a serial device.
    pub baud: u32,
}

impl Default for OpenOptions {
    fn default() -> Self {
        Self {
            image: None,
            baud: BAUD,
        }
    }
}

/// Opens a controller and its session. `note` is told of what takes long (building an image).
///
/// # Errors
/// Any [`ControllerError`] but a refusal.
pub fn open(
    port: &Port,
    options: &OpenOptions,
    note: &mut dyn FnMut(&str),
) -> Result<Controller, ControllerError> {
    match port {
        Port::Sim => Controller::connect(Box::new(VirtualLink::new()), "sim", 1),
        Port::Qemu | Port::QemuBoard(_) => {
            let board = if let Port::QemuBoard(board) = port {
                *board
            } else {
                Board::Mps2An386
            };
            let image = options.image.as_deref();
            let pace = if image.is_none() || board.always_steps() {
                Pace::Stepped
            } else {
                Pace::Free
            };
            let emulator = Emulator::start_board(board, image, pace, note)?;
            let mut controller = Controller::connect(Box::new(emulator.into_link()?), "qemu", 1)?;
            if controller.status()?.position == PositionState::Unknown {
                // Nothing hangs on an emulated board: it stands where we say.
                controller.command(Command::Declare { place_nm: [0; 3] })?;
            }
            if pace == Pace::Free {
                // Its time does not wait for ours: a second of silence there may be a moment here.
                controller.supervise(None)?;
            }
            Ok(controller)
        }
        Port::LinuxCnc => {
            Controller::connect(Box::new(LinuxCncLink::open()?), "linuxcnc", session())
        }
        Port::Device(path) => {
            let link = SerialLink::open(path, options.baud)?;
            Controller::connect(Box::new(link), path, session())
        }
    }
}

/// A session number that another client is unlikely to have: no two opened within 65 s of a process id.
fn session() -> u16 {
    let now = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    let number = (now.as_millis() as u16) ^ (std::process::id() as u16).rotate_left(8);
    // 0 is that of a word from outside.
    number.max(1)
}
