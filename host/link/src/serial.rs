//! A serial device, or the near end of a pty.
use super::error::ControllerError;
use super::link::Link;
use serialport::{ErrorKind, SerialPort};
use std::io::{self, Read, Write};
use std::time::{Duration, Instant};

/// A serial device that is open.
pub struct SerialLink {
    port: Box<dyn SerialPort>,
    opened: Instant,
}

impl SerialLink {
    /// Opens a device by its path, for this program alone but for a word from [outside](super::outside).
    ///
    /// # Errors
    /// [`ControllerError::NoPort`], [`ControllerError::InUse`], [`ControllerError::CannotOpen`].
    pub fn open(path: &str, baud: u32) -> Result<Self, ControllerError> {
        let port = path.to_owned();
        match open(path, baud) {
            Ok(port) => Ok(Self {
                port,
                opened: Instant::now(),
            }),
            Err(error) => Err(match error.kind {
                ErrorKind::Io(io::ErrorKind::NotFound) => ControllerError::NoPort { port },
                ErrorKind::NoDevice | ErrorKind::Io(io::ErrorKind::WouldBlock) => {
                    ControllerError::InUse { port }
                }
                _ => ControllerError::CannotOpen {
                    port,
                    reason: error.description,
                },
            }),
        }
    }
}

/// A device that is only listened to, such as a log port.
///
/// # Errors
/// It cannot be opened.
pub fn listen(path: &str, baud: u32) -> io::Result<Box<dyn Read>> {
    let port = serialport::new(path, baud)
        .timeout(Duration::from_secs(1))
        .open()?;
    Ok(Box::new(port))
}

/// Nobody else has it; from then on a lock keeps out those who want it alone, and lets in a word from outside.
#[cfg(unix)]
fn open(path: &str, baud: u32) -> serialport::Result<Box<dyn SerialPort>> {
    let mut port = serialport::new(path, baud)
        .timeout(Duration::from_millis(100))
        .open_native()?;
    port.set_exclusive(false)?;
    Ok(Box::new(port))
}

#[cfg(not(unix))]
fn open(path: &str, baud: u32) -> serialport::Result<Box<dyn SerialPort>> {
    serialport::new(path, baud)
        .timeout(Duration::from_millis(100))
        .open()
}

impl Link for SerialLink {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.port.write_all(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], until: Duration) -> io::Result<usize> {
        let left = until
            .saturating_sub(self.now())
            .max(Duration::from_millis(1));
        self.port.set_timeout(left).map_err(io::Error::from)?;
        match self.port.read(buffer) {
            Err(error)
                if matches!(
                    error.kind(),
                    io::ErrorKind::TimedOut | io::ErrorKind::Interrupted
                ) =>
            {
                Ok(0)
            }
            // A pty whose other end is gone reads as an empty stream.
            Ok(0) => Err(io::Error::new(
                io::ErrorKind::BrokenPipe,
                "the other end has closed the port",
            )),
            result => result,
        }
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }
}
