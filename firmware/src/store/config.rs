//! The machine's configuration: a log in two erase units, of which the newest whole record counts.
//!
//! ```text
//! record = number u32 · length u8 · version u8 · postcard · FF … · check u32        80 bytes
//! ```
//!
//! A record goes into the first place that is blank, with all behind it blank too; where there is none left, into the other
//! unit, erased first: it holds older records only. So a cut of power at any byte leaves the old configuration or the new
//! one, whole, and no word is programmed twice between erasures.
//!
//! A record of version 254 holds no configuration but a copy of the owner's key, beside the newest one: a key whose own unit is lost is
//! found here, and the controller does not stand open.
use super::{PublicKey, Store, StoredKey};
use embedded_storage::nor_flash::NorFlash;
use giotto_shared::wire::{Crc32, FlashFault, MachineConfig, take};

/// Length of a record.
pub(super) const CONFIG_BYTES: usize = 80;
/// Version of what a record holds.
const VERSION: u8 = 1;
/// That of a record which holds a key.
const KEY_VERSION: u8 = 254;
const HEAD: usize = 6;
const CHECK: usize = CONFIG_BYTES - 4;

type Record = [u8; CONFIG_BYTES];

fn check(record: &Record) -> [u8; 4] {
    let body = record.get(..CHECK).unwrap_or(&[]);
    Crc32::new()
        .with(b"giotto config")
        .with(body)
        .value()
        .to_le_bytes()
}

/// Number and content, if the record is whole and of this version.
fn read(record: &Record) -> Option<(u32, MachineConfig)> {
    let (number, rest) = record.split_first_chunk::<4>()?;
    let [length, VERSION, body @ ..] = rest else {
        return None;
    };
    if record.get(CHECK..)? != check(record) {
        return None;
    }
    let body = body.get(..usize::from(*length))?;
    match take::<MachineConfig>(body) {
        Some((config, [])) => Some((u32::from_le_bytes(*number), config)),
        _ => None,
    }
}

fn write(number: u32, config: &MachineConfig) -> Option<Record> {
    let mut record = [0xff; CONFIG_BYTES];
    let body = giotto_shared::wire::put(config, record.get_mut(HEAD..CHECK)?)?;
    finish(record, number, body as u8, VERSION)
}

/// A record with its body, and the rest around it.
fn finish(mut record: Record, number: u32, length: u8, version: u8) -> Option<Record> {
    *record.first_chunk_mut()? = number.to_le_bytes();
    *record.get_mut(4)? = length;
    *record.get_mut(5)? = version;
    let check = check(&record);
    record.get_mut(CHECK..)?.copy_from_slice(&check);
    Some(record)
}

/// The key of a record, if it is whole and holds one.
fn read_key(record: &Record) -> Option<PublicKey> {
    let [_, _, _, _, 32, KEY_VERSION, body @ ..] = record else {
        return None;
    };
    let whole = record.get(CHECK..)? == check(record);
    body.first_chunk().copied().filter(|_| whole)
}

fn write_key(key: &PublicKey) -> Option<Record> {
    let mut record = [0xff; CONFIG_BYTES];
    *record.get_mut(HEAD..)?.first_chunk_mut()? = *key;
    finish(record, 0, 32, KEY_VERSION)
}

/// What the two units hold.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    newest: Option<(u32, MachineConfig)>,
    /// Unit of the newest record.
    unit: usize,
    /// First place of each unit from which on all is blank.
    blank: [u32; 2],
    /// Copy of the key in each unit.
    keys: [Option<PublicKey>; 2],
}

impl Found {
    /// First byte, first blank place and copy of the key: of the unit of the newest record, then of the other one.
    const fn in_order(&self, [a, b]: [u32; 2]) -> [(u32, u32, Option<PublicKey>); 2] {
        let ([blank_a, blank_b], [key_a, key_b]) = (self.blank, self.keys);
        let (first, second) = ((a, blank_a, key_a), (b, blank_b, key_b));
        if self.unit == 0 {
            [first, second]
        } else {
            [second, first]
        }
    }
}

impl<F: NorFlash> Store<F> {
    fn places(&self) -> u32 {
        F::ERASE_SIZE as u32 / CONFIG_BYTES as u32
    }

    #[inline(never)]
    fn configs(&mut self, units: [u32; 2]) -> Result<Found, FlashFault> {
        let mut found = Found::default();
        for (unit, base) in units.into_iter().enumerate() {
            let mut blank = 0;
            for place in 0..self.places() {
                let mut record = [0; CONFIG_BYTES];
                let at = base + place * CONFIG_BYTES as u32;
                self.flash
                    .read(at, &mut record)
                    .map_err(|_| FlashFault::Read)?;
                if record == [0xff; CONFIG_BYTES] {
                    continue;
                }
                blank = place + 1;
                if let (Some(copy), Some(key)) = (found.keys.get_mut(unit), read_key(&record)) {
                    *copy = Some(key);
                }
                let newest = found.newest.map(|(number, _)| number);
                if let Some((number, config)) = read(&record)
                    && newest.is_none_or(|newest| number > newest)
                {
                    (found.newest, found.unit) = (Some((number, config)), unit);
                }
            }
            if let Some(place) = found.blank.get_mut(unit) {
                *place = blank;
            }
        }
        Ok(found)
    }

    /// The configuration that is stored, if there is one that this image reads.
    #[inline(never)]
    pub fn config(&mut self) -> Option<MachineConfig> {
        let units = self.layout.config?;
        self.configs(units).ok()?.newest.map(|(_, config)| config)
    }

    /// The copy of the key beside the configuration.
    ///
    /// # Errors
    /// [`FlashFault::Read`].
    pub(super) fn copied_key(&mut self) -> Result<Option<PublicKey>, FlashFault> {
        let Some(units) = self.layout.config else {
            return Ok(None);
        };
        let [(_, _, newest), (_, _, other)] = self.configs(units)?.in_order(units);
        Ok(newest.or(other))
    }

    /// Sees to it that there is a copy of the key in the unit of the newest configuration, or in the other one while the first is full.
    ///
    /// # Errors
    /// Those of the flash.
    pub(super) fn copy_key(&mut self, key: &PublicKey) -> Result<(), FlashFault> {
        let Some(units) = self.layout.config else {
            return Ok(());
        };
        let record = write_key(key).ok_or(FlashFault::Program)?;
        let [newest, other] = self.configs(units)?.in_order(units);
        for (base, blank, copy) in [newest, other] {
            if copy == Some(*key) {
                return Ok(());
            }
            if blank < self.places() {
                return self.append(base + blank * CONFIG_BYTES as u32, &record);
            }
        }
        // Both are full: the other one holds older records only.
        let (base, ..) = other;
        self.clear(base)?;
        self.append(base, &record)
    }

    /// Erases a unit.
    fn clear(&mut self, base: u32) -> Result<(), FlashFault> {
        self.flash
            .erase(base, base + F::ERASE_SIZE as u32)
            .map_err(|_| FlashFault::Erase)
    }

    /// Programs a record into a blank place and reads it back.
    fn append(&mut self, at: u32, record: &Record) -> Result<(), FlashFault> {
        self.flash
            .write(at, record)
            .map_err(|_| FlashFault::Program)?;
        let mut back = [0; CONFIG_BYTES];
        self.flash
            .read(at, &mut back)
            .map_err(|_| FlashFault::Read)?;
        match record.iter().zip(&back).position(|(a, b)| a != b) {
            None => Ok(()),
            Some(offset) => Err(FlashFault::ReadBack {
                offset: at + offset as u32,
            }),
        }
    }

    /// Whether there is a place for a configuration.
    pub const fn keeps_config(&self) -> bool {
        self.layout.config.is_some()
    }

    /// Stores a configuration; the one before stays until this one is whole.
    ///
    /// # Errors
    /// Those of the flash, among them that it does not read back.
    #[inline(never)]
    pub fn keep_config(&mut self, config: &MachineConfig) -> Result<(), FlashFault> {
        let units = self.layout.config.ok_or(FlashFault::Full)?;
        // Read before anything is erased.
        let key = self.key();
        let found = self.configs(units)?;
        let number = found.newest.map_or(0, |(number, _)| number.wrapping_add(1));
        let record = write(number, config).ok_or(FlashFault::Program)?;
        let mut unit = found.unit & 1;
        let mut place = found.blank[unit];
        if place >= self.places() {
            unit ^= 1;
            self.clear(units[unit])?;
            place = 0;
        }
        self.append(units[unit] + place * CONFIG_BYTES as u32, &record)?;
        if let StoredKey::Key(key) = key {
            // The configuration is kept; without a copy the key still is where it was.
            let _ = self.copy_key(&key);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::engine::Config;
    use crate::store::power_cut::{PowerCut, Tear};
    use crate::store::ram::RamFlash;
    use crate::store::{Layout, Store};
    use giotto_shared::table::MAX_IMAGE_BYTES;

    const LAYOUT: Layout = Layout::new([0, 2048], 2048).with_config([4096, 4608]);
    type Cells = RamFlash<5120, 512>;

    fn open(cells: Cells, after: Option<u32>, tear: Tear) -> Store<PowerCut<5120, 512>> {
        Store::open(
            PowerCut::new(cells, after, tear),
            LAYOUT,
            &mut [0; MAX_IMAGE_BYTES],
        )
    }

    fn config(feed_m_s: f32) -> MachineConfig {
        MachineConfig {
            feed_m_s,
            soft_nm: [[i32::MIN, i32::MAX]; 3],
            ..Config::robot(1000).said()
        }
    }

    /// Power fails at every byte and erasure of the next one, torn in every way, with any number stored before.
    #[test]
    fn a_cut_leaves_the_old_configuration_or_the_new_one() {
        for before in 0..16 {
            for tear in Tear::ALL {
                for after in 1..CONFIG_BYTES as u32 + 8 {
                    let mut store = open(Cells::new(), None, Tear::Untouched);
                    for n in 0..before {
                        store.keep_config(&config(n as f32 + 1.0)).unwrap();
                    }
                    let cells = store.into_flash().into_cells();
                    let mut store = open(cells, Some(after), tear);
                    let kept = store.keep_config(&config(100.0)).is_ok();
                    let mut store = open(store.into_flash().into_cells(), None, Tear::Untouched);
                    let old = (before > 0).then(|| config(before as f32));
                    let found = store.config();
                    assert!(
                        found == Some(config(100.0)) || (found == old && !kept),
                        "{before} {after} {tear:?}: {found:?}"
                    );
                    // And it can be stored again.
                    store.keep_config(&config(101.0)).unwrap();
                    assert_eq!(store.config(), Some(config(101.0)));
                }
            }
        }
    }

    #[test]
    fn a_bit_that_rots_costs_that_record_alone() {
        let mut store = open(Cells::new(), None, Tear::Untouched);
        store.keep_config(&config(1.0)).unwrap();
        store.keep_config(&config(2.0)).unwrap();
        let mut cells = store.into_flash().into_cells();
        cells.bytes_mut()[4096 + CONFIG_BYTES + 9] ^= 4;
        let mut store = open(cells, None, Tear::Untouched);
        assert_eq!(store.config(), Some(config(1.0)));
        store.keep_config(&config(3.0)).unwrap();
        assert_eq!(store.config(), Some(config(3.0)));
    }

    const WITH_KEY: Layout = LAYOUT.with_key(5120);

    fn keyed(cells: RamFlash<5632, 512>, after: Option<u32>) -> Store<PowerCut<5632, 512>> {
        let flash = PowerCut::new(cells, after, Tear::Untouched);
        Store::open(flash, WITH_KEY, &mut [0; MAX_IMAGE_BYTES])
    }

    /// The unit of the key is erased, or all of it rots: its copy is found, however many configurations were stored before and after, and
    /// wherever power failed meanwhile, once the controller has booted.
    #[test]
    fn a_key_whose_unit_is_lost_is_found_beside_the_configuration() {
        let key = [9; 32];
        for before in [0, 3, 5, 6, 7, 12] {
            for later in [0, 1, 5, 6, 7, 13] {
                for after in [None, Some(3), Some(83), Some(170), Some(500)] {
                    let mut store = keyed(RamFlash::new(), None);
                    for n in 0..before {
                        store.keep_config(&config(n as f32 + 1.0)).unwrap();
                    }
                    store.keep_key(&key).unwrap();
                    let mut store = keyed(store.into_flash().into_cells(), after);
                    for n in 0..later {
                        if store.keep_config(&config(n as f32 + 50.0)).is_err() {
                            break;
                        }
                    }
                    let what = std::format!("{before} {later} {after:?}");
                    store = keyed(store.into_flash().into_cells(), None);
                    assert_eq!(store.boot_key(), StoredKey::Key(key), "{what}");
                    for lost in [0xff, 0x00, 0x5a] {
                        let cells = store.into_flash().into_cells();
                        let mut gone = cells.clone();
                        gone.bytes_mut()[5120..].fill(lost);
                        let mut gone = keyed(gone, None);
                        assert_eq!(gone.key(), StoredKey::Key(key), "{what} {lost}");
                        // And it goes on being found.
                        for n in 0..20 {
                            gone.keep_config(&config(n as f32 + 70.0)).unwrap();
                            assert_eq!(gone.key(), StoredKey::Key(key), "{what} {lost} {n}");
                        }
                        store = keyed(cells, None);
                    }
                    assert_eq!(store.key(), StoredKey::Key(key), "{what}");
                }
            }
        }
    }
}
