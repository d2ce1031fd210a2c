//! Serving a byte stream.
use super::{Motion, Server};
use embedded_io::{Read, ReadReady, Write};
use embedded_storage::nor_flash::NorFlash;

/// Bytes taken from the port at once.
const PIECE: usize = 32;

impl<F: NorFlash, M: Motion> Server<F, M> {
    /// Answers what has arrived and sends the set-points that are due. Returns when nothing is left to do;
    /// to be called again and again.
    ///
    /// # Errors
    /// Those of the port; what was being sent is then lost, and asked for again by the host.
    pub fn serve<L: Read + ReadReady + Write>(&mut self, link: &mut L) -> Result<(), L::Error> {
        while link.read_ready()? && !self.reset_requested() {
            let mut bytes = [0; PIECE];
            let count = link.read(&mut bytes)?;
            for &byte in bytes.iter().take(count) {
                if let Some(frame) = self.receive(byte) {
                    link.write_all(frame)?;
                }
            }
            if count == 0 {
                break;
            }
        }
        while let Some(frame) = self.set_points() {
            link.write_all(frame)?;
        }
        link.flush()
    }
}
