//! Serving a byte stream.
use super::{Buffers, Motion, Server};
use core::ops::DerefMut;
use embedded_io::{Read, ReadReady, Write};
use embedded_storage::nor_flash::NorFlash;

/// Bytes taken from the port at once.
const PIECE: usize = 32;
/// Pieces taken before the caller has its turn: whoever talks without a pause must not keep it from its other work, such as
/// the watchdog.
const PIECES: usize = 16;

/// As `write_all`, but a port that takes no byte loses the frame, as a line would, instead of a panic.
///
/// # Errors
/// Those of the port.
pub fn write_whole<L: Write>(port: &mut L, mut bytes: &[u8]) -> Result<(), L::Error> {
    while !bytes.is_empty() {
        match port.write(bytes)? {
            0 => break,
            count => bytes = bytes.get(count..).unwrap_or(&[]),
        }
    }
    Ok(())
}

impl<F: NorFlash, M: Motion, B: DerefMut<Target = Buffers>> Server<F, M, B> {
    /// Answers what has arrived, so many bytes at most, and sends the set-points that are due; to be called again and again.
    ///
    /// # Errors
    /// Those of the port; what was being sent is then lost, and asked for again by the host.
    pub fn serve<L: Read + ReadReady + Write>(&mut self, link: &mut L) -> Result<(), L::Error> {
        self.supervise();
        for _ in 0..PIECES {
            if !link.read_ready()? || self.reset_requested() {
                break;
            }
            let mut bytes = [0; PIECE];
            let count = link.read(&mut bytes)?;
            for &byte in bytes.iter().take(count) {
                if let Some(frame) = self.receive(byte) {
                    write_whole(link, frame)?;
                }
            }
            if count == 0 {
                break;
            }
        }
        if self.on_link {
            while let Some(frame) = self.set_points() {
                write_whole(link, frame)?;
            }
        }
        link.flush()
    }

    /// Sends the set-points that are due to the board's own port for them, unless the link has asked for them.
    ///
    /// # Errors
    /// Those of the port.
    pub fn stream<L: Write>(&mut self, port: &mut L) -> Result<(), L::Error> {
        if !self.on_link {
            while let Some(frame) = self.set_points() {
                write_whole(port, frame)?;
            }
        }
        port.flush()
    }
}
