//! CRC-32/ISO-HDLC, that of Ethernet and zip, of frames, tables and records in flash.
use crc::{CRC_32_ISO_HDLC, Crc, Digest};

const ALGORITHM: &Crc<u32> = &Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// A CRC being taken.
///
/// ```
/// use giotto_shared::encoding::{crc32, Crc32};
///
/// // The check value of the catalogue, whole and in parts.
/// assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
/// assert_eq!(Crc32::new().with(b"1234").with(b"56789").value(), 0xcbf4_3926);
/// ```
#[derive(Clone)]
#[allow(missing_debug_implementations, reason = "the crate's digest has none")]
pub struct Crc32(Digest<'static, u32>);

impl Crc32 {
    /// Of nothing yet.
    #[allow(clippy::new_without_default, reason = "a beginning, not a value")]
    pub const fn new() -> Self {
        Self(ALGORITHM.digest())
    }

    /// Of the bytes so far and these.
    #[must_use]
    pub fn with(mut self, bytes: &[u8]) -> Self {
        self.0.update(bytes);
        self
    }

    /// The CRC.
    pub fn value(self) -> u32 {
        self.0.finalize()
    }
}

/// CRC-32 of these bytes.
pub const fn crc32(bytes: &[u8]) -> u32 {
    ALGORITHM.checksum(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn check_value_of_the_catalogue() {
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
        assert_eq!(crc32(&[]), 0);
        let parts = Crc32::new().with(b"1234").with(b"").with(b"56789");
        assert_eq!(parts.value(), 0xcbf4_3926);
    }
}
