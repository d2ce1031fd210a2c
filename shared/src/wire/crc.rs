//! CRC-32/ISO-HDLC, that of Ethernet and zip: polynomial 04c11db7, reflected, from and over all ones.
//!
//! The two halves of a byte are looked up side by side: 128 bytes of table instead of the 1024 that whole bytes take in an
//! image, and neither waits for the other.

/// Remainders of the sixteen values of the low and of the high four bits of a byte.
const LOW: [u32; 16] = remainders(8);
const HIGH: [u32; 16] = remainders(4);

const fn remainders(bits: u32) -> [u32; 16] {
    let mut table = [0; 16];
    let mut value = 0;
    while value < 16 {
        let (mut remainder, mut bit) = (value, 0);
        while bit < bits {
            remainder = if remainder & 1 == 0 {
                remainder >> 1
            } else {
                (remainder >> 1) ^ 0xedb8_8320
            };
            bit += 1;
        }
        table[value as usize] = remainder;
        value += 1;
    }
    table
}

/// A CRC being taken.
#[derive(Clone, Copy, Debug)]
pub struct Crc32(u32);

impl Crc32 {
    /// Of nothing yet.
    #[allow(clippy::new_without_default, reason = "a beginning, not a value")]
    pub const fn new() -> Self {
        Self(u32::MAX)
    }

    /// Of the bytes so far and these.
    #[inline(never)]
    pub const fn with(self, bytes: &[u8]) -> Self {
        let (mut crc, mut rest) = (self.0, bytes);
        while let [byte, behind @ ..] = rest {
            crc ^= *byte as u32;
            crc = LOW[(crc & 15) as usize] ^ HIGH[(crc >> 4 & 15) as usize] ^ (crc >> 8);
            rest = behind;
        }
        Self(crc)
    }

    /// The CRC.
    pub const fn value(self) -> u32 {
        !self.0
    }
}

/// CRC-32 of these bytes.
pub const fn crc32(bytes: &[u8]) -> u32 {
    Crc32::new().with(bytes).value()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn check_value_of_the_catalogue() {
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
        assert_eq!(crc32(&[]), 0);
    }

    proptest! {
        #[test]
        fn it_is_that_of_the_crc_crate(bytes in proptest::collection::vec(any::<u8>(), 0..300), cut in 0usize..300) {
            let oracle = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&bytes);
            let (a, b) = bytes.split_at(cut.min(bytes.len()));
            prop_assert_eq!(crc32(&bytes), oracle);
            prop_assert_eq!(Crc32::new().with(a).with(b).value(), oracle);
        }
    }
}
