//! `--port` and what goes with it, and a controller's errors in words.
use super::choice::whole;
use super::{Failure, Output, bounds_in_words};
use giotto_link::port::BAUD;
use giotto_link::{Controller, ControllerError, OpenOptions, Port, open};
use std::path::PathBuf;

/// Which controller.
#[derive(clap::Args, Debug)]
pub(super) struct PortArgs {
    /// Serial device, `sim` (virtual controller in this process), `qemu` (boots the firmware image) or `linuxcnc` (the
    /// component in a LinuxCNC that runs on this computer).
    #[arg(long, value_name = "PORT", value_parser = clap::builder::NonEmptyStringValueParser::new())]
    port: String,
    /// Firmware image for `qemu`, instead of the one of this workspace.
    #[arg(long, value_name = "PATH")]
    image: Option<PathBuf>,
    /// Baud rate of a serial device.
    #[arg(long, default_value_t = BAUD, value_name = "BAUD", value_parser = whole::<u32>)]
    baud: u32,
}

impl PortArgs {
    /// Opens the controller and its session.
    pub(super) fn open(&self, out: Output) -> Result<Controller, Failure> {
        Ok(self.connect(out)?)
    }

    /// What was named.
    pub(super) fn kind(&self) -> Port {
        let Ok(port) = self.port.parse::<Port>();
        port
    }

    /// Baud rate of a serial device.
    pub(super) const fn baud(&self) -> u32 {
        self.baud
    }

    /// As [`Self::open`], for those who look at the error.
    pub(super) fn connect(&self, out: Output) -> Result<Controller, ControllerError> {
        let port = self.kind();
        let options = OpenOptions {
            image: self.image.clone(),
            baud: self.baud,
        };
        open(&port, &options, &mut |note| out.note(note))
    }
}

impl From<ControllerError> for Failure {
    fn from(error: ControllerError) -> Self {
        let failure = match &error {
            // The table came from a file: that is where the fault is.
            ControllerError::Table(_) => Self::input(&error),
            _ => Self::controller(
                bounds_in_words::words(&error).unwrap_or_else(|| error.to_string()),
            ),
        };
        match error.help() {
            Some(help) => failure.help(help),
            None => failure,
        }
    }
}
