//! Whose tables a controller takes, and how the owner hands it on.
use crate::table::image::MachineId;
use serde::{Deserialize, Serialize};

/// What a controller knows of its owner's key.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum KeyState {
    /// None was ever given: tables need no signature.
    None,
    /// It is there.
    Kept,
    /// One was there and cannot be read: no table is trusted.
    Lost,
}

/// What a controller says of its owner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct KeyInfo {
    /// What is known of the key.
    pub state: KeyState,
    /// Its public half; zeros if it is not there.
    pub key: [u8; 32],
    /// Which key in a row it is, from 1; 0: none.
    pub epoch: u32,
    /// Highest serial of a signed table confirmed so far: another one needs a higher one.
    pub serial: u32,
}

/// Bytes of a [`replacement`].
pub const REPLACEMENT_BYTES: usize = 18 + 12 + 4 + 32;

/// What the owner of key number `epoch` of a machine signs to hand it to `key`: good for this machine and this once.
///
/// ```text
/// "giotto key replace" · machine [u8; 12] · epoch u32 little endian · key [u8; 32]
/// ```
pub fn replacement(machine: &MachineId, epoch: u32, key: &[u8; 32]) -> [u8; REPLACEMENT_BYTES] {
    let mut bytes = [0; REPLACEMENT_BYTES];
    let epoch = epoch.to_le_bytes();
    let parts = b"giotto key replace"
        .iter()
        .chain(machine)
        .chain(&epoch)
        .chain(key);
    for (to, from) in bytes.iter_mut().zip(parts) {
        *to = *from;
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each byte of machine, epoch and key counts, and the last of them is the last byte.
    #[test]
    fn a_replacement_says_all_it_is_for() {
        let bytes = replacement(b"twelve bytes", 0x0403_0201, &[9; 32]);
        assert_eq!(&bytes[..30], b"giotto key replacetwelve bytes");
        assert_eq!(bytes[30..34], [1, 2, 3, 4]);
        assert_eq!(bytes[34..], [9; 32]);
    }
}
