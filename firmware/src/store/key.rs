//! The provisioned public key: 32 bytes, their check, and FF up to 40.
use giotto_shared::wire::Crc32;

/// An Ed25519 public key.
pub type PublicKey = [u8; 32];

/// Length of a place.
pub(super) const KEY_BYTES: usize = 40;
/// Places: one more for each cut of power during provisioning.
pub(super) const KEYS: usize = 4;
/// Places that a key takes.
pub(super) const KEY_COPIES: usize = 2;

/// What the place of the key holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoredKey {
    /// None was provisioned.
    None,
    /// This one.
    Key(PublicKey),
    /// The flash does not say: no table can be trusted.
    Unreadable,
}

fn check(key: &PublicKey) -> [u8; 4] {
    Crc32::new()
        .with(b"giotto key")
        .with(key)
        .value()
        .to_le_bytes()
}

pub(super) fn read(bytes: &[u8; KEY_BYTES]) -> Option<PublicKey> {
    let (key, rest) = bytes.split_first_chunk()?;
    rest.starts_with(&check(key)).then_some(*key)
}

pub(super) fn write(key: &PublicKey) -> [u8; KEY_BYTES] {
    let mut bytes = [0xff; KEY_BYTES];
    let parts = key
        .iter()
        .chain(&check(key))
        .copied()
        .enumerate()
        .collect::<heapless::Vec<_, 36>>();
    for (at, byte) in parts {
        if let Some(place) = bytes.get_mut(at) {
            *place = byte;
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::power_cut::{PowerCut, Tear};
    use crate::store::ram::RamFlash;
    use crate::store::{Layout, Store};
    use giotto_shared::table::MAX_IMAGE_BYTES;
    use giotto_shared::wire::FlashFault;

    const LAYOUT: Layout = Layout::new([0, 2048], 2048).with_key(4096);
    type Cells = RamFlash<4608, 512>;

    fn open(cells: Cells, after: Option<u32>, tear: Tear) -> Store<PowerCut<4608, 512>> {
        Store::open(
            PowerCut::new(cells, after, tear),
            LAYOUT,
            &mut [0; MAX_IMAGE_BYTES],
        )
    }

    /// Power fails in every byte, torn in every way: the key is there or it is not, and it can be given again.
    #[test]
    fn a_cut_leaves_the_key_or_none() {
        let wanted = core::array::from_fn(|at| at as u8);
        for tear in Tear::ALL {
            for after in 1..=KEY_BYTES as u32 + 1 {
                let mut store = open(Cells::new(), Some(after), tear);
                let kept = store.keep_key(&wanted).is_ok();
                let mut store = open(store.into_flash().into_cells(), None, Tear::Untouched);
                let found = store.key();
                assert!(
                    found == StoredKey::Key(wanted) || found == StoredKey::None && !kept,
                    "{after} {tear:?}"
                );
                if found == StoredKey::None {
                    store.keep_key(&wanted).unwrap();
                    assert_eq!(store.key(), StoredKey::Key(wanted));
                }
            }
        }
    }

    /// Any bit of one of its places rots.
    #[test]
    fn a_bit_that_rots_does_not_open_the_controller() {
        for bit in 0..2 * KEY_BYTES * 8 {
            let mut store = open(Cells::new(), None, Tear::Untouched);
            store.keep_key(&[7; 32]).unwrap();
            let mut cells = store.into_flash().into_cells();
            cells.bytes_mut()[4096 + bit / 8] ^= 1 << (bit % 8);
            let mut store = open(cells, None, Tear::Untouched);
            assert_eq!(store.key(), StoredKey::Key([7; 32]), "{bit}");
        }
    }

    #[test]
    fn the_first_key_stays_and_a_flash_without_power_trusts_nobody() {
        let mut store = open(Cells::new(), None, Tear::Untouched);
        store.keep_key(&[7; 32]).unwrap();
        store.keep_key(&[8; 32]).unwrap_err();
        assert_eq!(store.key(), StoredKey::Key([7; 32]));
        let mut off = open(store.into_flash().into_cells(), Some(0), Tear::Untouched);
        assert_eq!(off.key(), StoredKey::Unreadable);
        assert_eq!(off.keep_key(&[7; 32]), Err(FlashFault::Read));
    }
}
