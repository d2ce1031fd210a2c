//! The owner: key, which one in a row it is, highest serial confirmed. Kept three times, twice in a unit of its own and once beside
//! the configuration, as records of its kind (see `config`).
//!
//! ```text
//! unit = 4 places of 40 bytes (before firmware 0.2: key, its check, FF), then records of 80 bytes
//! record = epoch u32 · 36 u8 · 253 u8 · key [u8; 32] · serial u32 · FF … · check u32
//! ```
//!
//! Of all whole records the one of the highest epoch, then serial, counts. Each change appends two; once the unit is full it is
//! erased, with the copy beside the configuration made before. So neither a cut of power at any byte, nor a bit that rots, nor the
//! loss of one erase unit brings an older key back, or an older serial, or opens the controller.
use super::config::{self, CONFIG_BYTES};
use super::{Store, StoredKey};
use embedded_storage::nor_flash::NorFlash;
use giotto_shared::wire::{Crc32, FlashFault};

/// An Ed25519 public key.
pub type PublicKey = [u8; 32];

/// Length of a place of the old kind, and how many there are.
const OLD_BYTES: usize = 40;
const OLD_PLACES: u32 = 4;
/// Bytes before the first record.
const HEAD_BYTES: u32 = OLD_PLACES * OLD_BYTES as u32;
/// Records of the owner in the unit.
const COPIES: u32 = 2;

/// Whose tables are taken, and which are behind us.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Owner {
    /// Which key in a row this is, from 1; 0: one of before keys were counted.
    pub epoch: u32,
    /// Highest serial of a table confirmed.
    pub serial: u32,
    /// The key.
    pub key: PublicKey,
}

impl Owner {
    /// What makes one record newer than another.
    const fn rank(&self) -> (u32, u32) {
        (self.epoch, self.serial)
    }

    /// The newer one of two.
    pub(super) fn newer(one: Option<Self>, other: Option<Self>) -> Option<Self> {
        match (one, other) {
            (Some(a), Some(b)) if b.rank() > a.rank() => Some(b),
            (None, other) => other,
            (one, _) => one,
        }
    }
}

fn old_check(key: &PublicKey) -> [u8; 4] {
    Crc32::new()
        .with(b"giotto key")
        .with(key)
        .value()
        .to_le_bytes()
}

/// A key in a place of the old kind.
fn read_old(bytes: &[u8; OLD_BYTES]) -> Option<Owner> {
    let (key, rest) = bytes.split_first_chunk()?;
    let (epoch, serial, key) = (0, 0, *key);
    rest.starts_with(&old_check(&key))
        .then_some(Owner { epoch, serial, key })
}

/// What the unit of the owner holds.
#[derive(Clone, Copy, Debug, Default)]
struct Unit {
    newest: Option<Owner>,
    /// Records that are the newest.
    copies: u32,
    /// First place for a record from which on all is blank.
    blank: u32,
}

impl<F: NorFlash> Store<F> {
    /// Places for records in the unit of the owner.
    const fn owner_places() -> u32 {
        (F::ERASE_SIZE as u32).saturating_sub(HEAD_BYTES) / CONFIG_BYTES as u32
    }

    #[inline(never)]
    fn owner_unit(&mut self, base: u32) -> Result<Unit, FlashFault> {
        let mut unit = Unit::default();
        for place in 0..OLD_PLACES {
            let mut bytes = [0; OLD_BYTES];
            let at = base + place * OLD_BYTES as u32;
            self.flash
                .read(at, &mut bytes)
                .map_err(|_| FlashFault::Read)?;
            unit.newest = Owner::newer(unit.newest, read_old(&bytes));
        }
        for place in 0..Self::owner_places() {
            let record = self.record(base + HEAD_BYTES + place * CONFIG_BYTES as u32)?;
            if record == config::BLANK {
                continue;
            }
            unit.blank = place + 1;
            let found = config::read_owner(&record);
            if found.is_some() && found == unit.newest {
                unit.copies += 1;
            } else if let (newer, Some(_)) = (Owner::newer(unit.newest, found), found)
                && newer != unit.newest
            {
                (unit.newest, unit.copies) = (newer, 1);
            }
        }
        Ok(unit)
    }

    /// The newest of what is kept in both places.
    fn newest_owner(&mut self) -> Result<Option<Owner>, FlashFault> {
        let own = match self.layout.key {
            None => return Ok(None),
            Some(base) => self.owner_unit(base)?.newest,
        };
        Ok(Owner::newer(own, self.copied_owner()?))
    }

    /// The key that tables have to be signed with. One that cannot be read is not one that is not there; nor is one of which only a
    /// confirmation made under it is left.
    pub fn key(&mut self) -> StoredKey {
        match self.newest_owner() {
            Err(_) => StoredKey::Lost,
            Ok(Some(owner)) => StoredKey::Key(owner),
            Ok(None) if self.slots.iter().any(|slot| slot.owned) => StoredKey::Lost,
            Ok(None) => StoredKey::None,
        }
    }

    /// The key at boot: copies that a cut of power or rot has taken are made again.
    pub fn boot_key(&mut self) -> StoredKey {
        let key = self.key();
        if let StoredKey::Key(owner) = key {
            // Without them the key still is where it was found.
            let _ = self.keep_owner(&owner);
        }
        key
    }

    /// Keeps an owner: beside the configuration first, if there is a place for one, then in the unit of its own.
    ///
    /// # Errors
    /// [`FlashFault::Full`] if there is no place, and those of the flash. The owner before or this one then is kept, whole.
    #[inline(never)]
    pub fn keep_owner(&mut self, owner: &Owner) -> Result<(), FlashFault> {
        self.copy_owner(owner)?;
        self.keep_owner_in_unit(owner)
    }

    /// Sees to the copies in the unit of the owner.
    fn keep_owner_in_unit(&mut self, owner: &Owner) -> Result<(), FlashFault> {
        let base = self.layout.key.ok_or(FlashFault::Full)?;
        let record = config::write_owner(owner).ok_or(FlashFault::Program)?;
        let unit = self.owner_unit(base)?;
        let kept = if unit.newest == Some(*owner) {
            unit.copies.min(COPIES)
        } else {
            0
        };
        let (mut missing, mut place) = (COPIES - kept, unit.blank);
        if missing > Self::owner_places().saturating_sub(place) {
            // Nothing is erased of which there is no copy elsewhere.
            if self.copied_owner()? != Some(*owner) {
                return Err(FlashFault::Full);
            }
            self.clear(base)?;
            (missing, place) = (COPIES, 0);
        }
        (place..place + missing).try_for_each(|place| {
            let at = base + HEAD_BYTES + place * CONFIG_BYTES as u32;
            self.append(at, &record)
        })
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::engine::Config;
    use crate::store::Layout;
    use crate::store::power_cut::{PowerCut, Tear};
    use crate::store::ram::RamFlash;
    use giotto_shared::table::MAX_IMAGE_BYTES;
    use proptest::prelude::*;
    use std::format;

    const BASE: u32 = 4096;
    const LAYOUT: Layout = Layout::new([0, 2048], 2048)
        .with_key(BASE)
        .with_config([4608, 5120]);
    const SIZE: usize = 5632;
    type Cells = RamFlash<SIZE, 512>;

    fn open(cells: Cells, after: Option<u32>, tear: Tear) -> Store<PowerCut<SIZE, 512>> {
        Store::open(
            PowerCut::new(cells, after, tear),
            LAYOUT,
            &mut [0; MAX_IMAGE_BYTES],
        )
    }

    fn whole(cells: Cells) -> Store<PowerCut<SIZE, 512>> {
        open(cells, None, Tear::Untouched)
    }

    const fn owner(epoch: u32, serial: u32) -> Owner {
        let key = [epoch as u8; 32];
        Owner { epoch, serial, key }
    }

    /// Power fails in every byte and erasure of each step of a life of keys and serials, torn in every way, long enough for each
    /// unit to be erased: the owner before or the new one, and after the boot both are kept three times again.
    #[test]
    fn a_cut_leaves_the_owner_before_or_the_new_one() {
        let life =
            [(1, 0), (1, 1), (1, 2), (1, 7), (2, 7), (2, 8), (3, 8)].map(|(e, s)| owner(e, s));
        let mut erased = 0;
        for tear in Tear::ALL {
            let mut cells = Cells::new();
            let mut before = StoredKey::None;
            for next in &life {
                let mut counted = whole(cells.clone());
                counted.keep_owner(next).unwrap();
                let steps = counted.flash_mut().steps();
                erased += u32::from(!steps.is_multiple_of(4));
                for after in 1..=steps {
                    let mut store = open(cells.clone(), Some(after), tear);
                    let kept = store.keep_owner(next).is_ok();
                    let mut store = whole(store.into_flash().into_cells());
                    let found = store.boot_key();
                    let what = format!("{next:?} {after} {tear:?}");
                    assert!(
                        found == StoredKey::Key(*next) || found == before && !kept,
                        "{what}: {found:?}"
                    );
                    if let StoredKey::Key(_) = found {
                        lose_each_unit(&mut store, found, &what);
                    }
                    store.keep_owner(next).unwrap();
                    assert_eq!(store.key(), StoredKey::Key(*next), "{what}");
                }
                (cells, before) = (counted.into_flash().into_cells(), StoredKey::Key(*next));
            }
        }
        assert!(erased > 4, "the units were never erased");
    }

    /// Any one of the three units is lost.
    fn lose_each_unit(store: &mut Store<PowerCut<SIZE, 512>>, expected: StoredKey, what: &str) {
        let cells = store.flash_mut().clone().into_cells();
        for unit in [4096, 4608, 5120] {
            for lost in [0xff, 0x00, 0x5a] {
                let mut gone = cells.clone();
                gone.bytes_mut()[unit..unit + 512].fill(lost);
                assert_eq!(whole(gone).key(), expected, "{what}: {unit} {lost:x}");
            }
        }
    }

    /// Configurations are stored between, as many as erase their units again and again.
    #[test]
    fn configurations_do_not_cost_the_owner() {
        let mut store = whole(Cells::new());
        for n in 0..40 {
            let now = owner(1 + n / 10, n);
            store.keep_owner(&now).unwrap();
            for _ in 0..n % 5 {
                let stored = Config::robot(1000).said();
                store.keep_config(&stored).unwrap();
                lose_each_unit(&mut store, StoredKey::Key(now), &format!("{n}"));
            }
        }
    }

    /// The unit of the owner goes while the controller runs: configurations do not erase the copy that is left.
    #[test]
    fn the_last_copy_is_not_erased() {
        let mut store = whole(Cells::new());
        store.keep_owner(&owner(1, 4)).unwrap();
        let mut cells = store.into_flash().into_cells();
        cells.bytes_mut()[BASE as usize..BASE as usize + 512].fill(0xff);
        let mut store = whole(cells);
        for n in 0..20 {
            let stored = Config::robot(1000).said();
            store.keep_config(&stored).unwrap();
            let steps = store.flash_mut().steps();
            assert_eq!(store.key(), StoredKey::Key(owner(1, 4)), "{n} {steps}");
        }
        // Nor by a cut in the middle of one of them.
        let cells = store.into_flash().into_cells();
        for after in 1..600 {
            let mut gone = cells.clone();
            gone.bytes_mut()[BASE as usize..BASE as usize + 512].fill(0xff);
            let mut cut = open(gone, Some(after), Tear::Partly);
            while cut.keep_config(&Config::robot(1000).said()).is_ok() {}
            let mut store = whole(cut.into_flash().into_cells());
            assert_eq!(store.key(), StoredKey::Key(owner(1, 4)), "{after}");
        }
    }

    /// Any bit of any cell rots, one at a time: nothing is lost, neither key nor serial.
    #[test]
    fn a_bit_that_rots_costs_nothing() {
        let mut store = whole(Cells::new());
        for next in [owner(1, 0), owner(1, 5), owner(2, 5), owner(2, 6)] {
            store.keep_owner(&next).unwrap();
        }
        let cells = store.into_flash().into_cells();
        for bit in BASE as usize * 8..SIZE * 8 {
            let mut rotten = cells.clone();
            rotten.bytes_mut()[bit / 8] ^= 1 << (bit % 8);
            let mut store = whole(rotten);
            assert_eq!(store.boot_key(), StoredKey::Key(owner(2, 6)), "{bit}");
        }
    }

    /// A key as the firmware before kept it, twice or once, is found, and ranks below all that come later.
    #[test]
    fn a_key_of_the_old_kind_is_read() {
        let mut bytes = [0xff; OLD_BYTES];
        bytes[..32].fill(7);
        bytes[32..36].copy_from_slice(&old_check(&[7; 32]));
        for place in 0..OLD_PLACES as usize {
            let mut cells = Cells::new();
            let at = BASE as usize + place * OLD_BYTES;
            cells.bytes_mut()[at..at + OLD_BYTES].copy_from_slice(&bytes);
            let mut store = whole(cells);
            let key = [7; 32];
            let (epoch, serial) = (0, 0);
            let found = Owner { epoch, serial, key };
            assert_eq!(store.boot_key(), StoredKey::Key(found));
            lose_each_unit(&mut store, StoredKey::Key(found), "old");
            store.keep_owner(&owner(1, 3)).unwrap();
            assert_eq!(store.key(), StoredKey::Key(owner(1, 3)));
        }
    }

    #[test]
    fn a_flash_without_power_trusts_nobody() {
        let mut off = open(Cells::new(), Some(0), Tear::Untouched);
        assert_eq!(off.key(), StoredKey::Lost);
        assert_eq!(off.keep_owner(&owner(1, 0)), Err(FlashFault::Read));
    }

    #[derive(Clone, Debug)]
    enum Act {
        Serial,
        Replace,
        Configure,
        Cut(u32),
        Rot(usize),
    }

    fn act() -> impl Strategy<Value = Act> {
        prop_oneof![
            4 => Just(Act::Serial),
            1 => Just(Act::Replace),
            3 => Just(Act::Configure),
            3 => (1..400u32).prop_map(Act::Cut),
            2 => (BASE as usize * 8..SIZE * 8).prop_map(Act::Rot),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

        /// Serials, keys and configurations in any order, a cut in any of them, a bit that rots between two boots: neither epoch nor
        /// serial ever falls below what was promised.
        #[test]
        fn what_was_promised_never_falls(acts in proptest::collection::vec(act(), 1..60)) {
            let mut store = whole(Cells::new());
            let mut promised = owner(1, 0);
            store.keep_owner(&promised).unwrap();
            let (mut after, mut rot) = (None, None);
            for act in acts {
                let mut next = promised;
                match act {
                    Act::Cut(steps) => { after = Some(steps); continue }
                    Act::Rot(bit) => { rot = Some(bit); continue }
                    Act::Serial => next.serial += 1,
                    Act::Replace => next = owner(promised.epoch + 1, promised.serial),
                    Act::Configure => {}
                }
                let mut cells = store.into_flash().into_cells();
                if let Some(bit) = rot.take() {
                    cells.bytes_mut()[bit / 8] ^= 1 << (bit % 8);
                }
                // A boot mends what has rotted.
                let mut booted = whole(cells);
                prop_assert_eq!(booted.boot_key(), StoredKey::Key(promised));
                let mut cut = open(booted.into_flash().into_cells(), after.take(), Tear::Partly);
                let done = match act {
                    Act::Configure => cut.keep_config(&Config::robot(1000).said()),
                    _ => cut.keep_owner(&next),
                };
                store = whole(cut.into_flash().into_cells());
                let found = store.boot_key();
                if done.is_ok() {
                    prop_assert_eq!(found, StoredKey::Key(next));
                }
                prop_assert!(found == StoredKey::Key(next) || found == StoredKey::Key(promised));
                if found == StoredKey::Key(next) {
                    promised = next;
                }
            }
        }
    }
}
