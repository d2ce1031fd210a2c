//! A confirmation: generation and check, eight bytes.
use giotto_shared::wire::Crc32;

/// Length of a confirmation.
pub(super) const RECORD_BYTES: usize = 8;

/// "The table with this CRC was confirmed as generation n."
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Record {
    pub(super) generation: u32,
    /// A key allowed it.
    pub(super) owned: bool,
}

fn check(generation: [u8; 4], table_crc: u32, owned: bool) -> [u8; 4] {
    Crc32::new()
        .with(&generation)
        .with(&table_crc.to_le_bytes())
        .with(if owned { b"owned" } else { b"" })
        .value()
        .to_le_bytes()
}

impl Record {
    pub(super) fn is_blank(bytes: [u8; RECORD_BYTES]) -> bool {
        bytes == [0xff; RECORD_BYTES]
    }

    /// The confirmation, if the bytes are one of the table with this CRC.
    pub(super) fn read(bytes: [u8; RECORD_BYTES], table_crc: u32) -> Option<Self> {
        let [a, b, c, d, rest @ ..] = bytes;
        let number = [a, b, c, d];
        let made = |owned| rest == check(number, table_crc, owned);
        let owned = made(true);
        (owned || made(false)).then(|| Self {
            generation: u32::from_le_bytes(number),
            owned,
        })
    }

    pub(super) fn write(self, table_crc: u32) -> [u8; RECORD_BYTES] {
        let generation = self.generation.to_le_bytes();
        let [a, b, c, d] = generation;
        let [e, f, g, h] = check(generation, table_crc, self.owned);
        [a, b, c, d, e, f, g, h]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_and_bound_to_its_table() {
        let (generation, owned) = (3, false);
        let record = Record { generation, owned };
        let bytes = record.write(0x1234_5678);
        assert_eq!(bytes[..4], [3, 0, 0, 0]);
        // zlib.crc32(bytes.fromhex("0300000078563412"))
        assert_eq!(
            u32::from_le_bytes([bytes[4], bytes[5], bytes[6], bytes[7]]),
            GOLDEN
        );
        assert_eq!(Record::read(bytes, 0x1234_5678), Some(record));
        assert_eq!(Record::read(bytes, 0x1234_5679), None);
        for bit in 0..64 {
            let mut torn = bytes;
            torn[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(Record::read(torn, 0x1234_5678), None);
        }
        let owned = Record {
            owned: true,
            ..record
        };
        assert_eq!(
            Record::read(owned.write(0x1234_5678), 0x1234_5678),
            Some(owned)
        );
    }

    const GOLDEN: u32 = 0x6584_8044;
}
