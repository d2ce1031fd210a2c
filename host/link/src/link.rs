//! A byte stream with a clock of its own, so that the client runs the same in real and in simulated time.
use std::io;
use std::time::Duration;

/// Where requests go and replies come from.
pub trait Link: Send {
    /// Sends all bytes.
    ///
    /// # Errors
    /// Those of the device; the peer may have got some of the bytes.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Waits until the link's clock shows `until` for at least one byte; 0: none came.
    ///
    /// # Errors
    /// Those of the device.
    fn receive(&mut self, buffer: &mut [u8], until: Duration) -> io::Result<usize>;

    /// The link's clock: time since it was opened.
    fn now(&self) -> Duration;
}
