//! A controller of this process, or one in the emulator, on a pty and by the clock.
use super::error::ControllerError;
use super::link::Link;
use std::convert::Infallible;
use std::io::{self, Read, Write};
use std::time::{Duration, Instant};

/// Time that this computer was too busy to keep up with is made up for so far; beyond that the controller's time has simply
/// stood still, so that no client misses more of it than its requests last.
const CATCH_UP: Duration = Duration::from_millis(20);

/// Serves the controller behind `link` on a pty, its time that of the clock, until the process or the link ends. `ready` is
/// told the path once it can be opened.
///
/// # Errors
/// Those of the pty and of the link.
pub fn serve(
    mut link: impl Link,
    ready: &mut dyn FnMut(&str),
) -> Result<Infallible, ControllerError> {
    use serialport::{SerialPort, TTYPort};
    let cannot = |reason: String| ControllerError::CannotOpen {
        port: "pty".to_owned(),
        reason,
    };
    let (mut near, far) = TTYPort::pair().map_err(|error| cannot(error.description))?;
    let path = far
        .name()
        .ok_or_else(|| cannot("it has no name".to_owned()))?;
    // Closed, because it is locked: a client could not open it. Until one does, the near end reads as hung up.
    drop(far);
    near.set_timeout(Duration::from_millis(1))
        .map_err(|error| cannot(error.description))?;
    ready(&path);
    let lost = |error: io::Error| ControllerError::Lost {
        port: path.clone(),
        reason: error.to_string(),
    };
    let (started, begun) = (Instant::now(), link.now());
    let mut stood_still = Duration::ZERO;
    let mut buffer = [0; 4096];
    loop {
        match near.read(&mut buffer) {
            Ok(count) => link.send(&buffer[..count]).map_err(lost)?,
            Err(error)
                if matches!(
                    error.kind(),
                    io::ErrorKind::TimedOut | io::ErrorKind::Interrupted
                ) => {}
            // No client: nothing to do but to let time pass.
            Err(_) => std::thread::sleep(Duration::from_millis(5)),
        }
        let mut due = begun + started.elapsed().saturating_sub(stood_still);
        let behind = due.saturating_sub(link.now());
        if behind > CATCH_UP {
            stood_still += behind - CATCH_UP;
            due -= behind - CATCH_UP;
        }
        while link.now() < due {
            let count = link.receive(&mut buffer, due).map_err(lost)?;
            // A client that went away, or does not read, loses what it does not take; it will ask again.
            let _ = near.write_all(&buffer[..count]);
        }
    }
}
