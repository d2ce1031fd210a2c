//! A word from outside: the port is another program's, and the person at this one wants its run stopped, held or slowed down.
use super::error::ControllerError;
use giotto_shared::wire::{self, Command, MAX_FRAME, Request};
use std::io::Write;
use std::time::Duration;

/// The request is said so often, since its answer is the other program's to read: a disturbed line may lose one.
const TIMES: u16 = 3;
/// From one to the next.
const APART: Duration = Duration::from_millis(40);
/// No client draws it: those from outside alone carry it.
const SESSION: u16 = 0;

/// Says [`Command::Stop`], [`Command::Pause`], [`Command::Resume`] or [`Command::Override`] to the controller on a serial device,
/// without reading what comes back, which is the other program's: a controller obeys these whoever has the session.
///
/// # Errors
/// [`ControllerError::CannotOpen`], [`ControllerError::Lost`].
pub fn say(path: &str, baud: u32, command: &Command) -> Result<(), ControllerError> {
    let mut port = serialport::new(path, baud)
        .exclusive(false)
        .timeout(Duration::from_millis(100))
        .open()
        .map_err(|error| ControllerError::CannotOpen {
            port: path.to_owned(),
            reason: error.description,
        })?;
    for seq in 0..TIMES {
        let request = Request {
            session: SESSION,
            seq,
            command: command.clone(),
        };
        let mut buffer = [0; MAX_FRAME];
        let frame = wire::encode(&request, &mut buffer).map_err(|_| ControllerError::WrongReply)?;
        // A zero first: it closes what the other program has left half said.
        port.write_all(&[0])
            .and_then(|()| port.write_all(frame))
            .map_err(|error| ControllerError::Lost {
                port: path.to_owned(),
                reason: error.to_string(),
            })?;
        std::thread::sleep(APART);
    }
    Ok(())
}
