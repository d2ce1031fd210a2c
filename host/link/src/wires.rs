//! The two directions between a server in this process and its client.
use std::collections::VecDeque;
use std::convert::Infallible;

/// The port of a controller in this process: bytes for it, bytes from it.
#[derive(Debug, Default)]
pub(crate) struct Wires {
    pub(crate) to_controller: VecDeque<u8>,
    pub(crate) to_host: VecDeque<u8>,
}

impl embedded_io::ErrorType for Wires {
    type Error = Infallible;
}

impl embedded_io::Read for Wires {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        let count = buffer.len().min(self.to_controller.len());
        for (to, from) in buffer.iter_mut().zip(self.to_controller.drain(..count)) {
            *to = from;
        }
        Ok(count)
    }
}

impl embedded_io::ReadReady for Wires {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(!self.to_controller.is_empty())
    }
}

impl embedded_io::Write for Wires {
    fn write(&mut self, buffer: &[u8]) -> Result<usize, Infallible> {
        self.to_host.extend(buffer);
        Ok(buffer.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl Wires {
    /// Bytes for the host.
    pub(crate) fn take(&mut self, buffer: &mut [u8]) -> usize {
        let count = buffer.len().min(self.to_host.len());
        for (to, from) in buffer.iter_mut().zip(self.to_host.drain(..count)) {
            *to = from;
        }
        count
    }
}
