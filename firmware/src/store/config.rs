//! The machine's configuration: a log in two erase units, of which the newest whole record counts.
//!
//! ```text
//! record = number u32 · length u8 · version u8 · postcard · FF … · check u32        160 bytes, two places
//! version 1 (before firmware 0.2), and the owner's key (see `key`):                  80 bytes, one place
//! ```
//!
//! A record goes into the first places that are blank, with all behind them blank too; where there are none left, into the other
//! unit, erased first: it holds older records only. So a cut of power at any byte leaves the old configuration or the new
//! one, whole, and no word is programmed twice between erasures.
//!
//! Beside the newest configuration there is a copy of the owner's key and serial: where their own unit is lost they are found here, and
//! the controller does not stand open.
use super::key::{Owner, PublicKey};
use super::{Layout, RECORDS, Slot, Store, StoredKey};
use crate::engine::Config;
use embedded_storage::nor_flash::NorFlash;
use giotto_shared::wire::{Crc32, FlashFault, MachineConfig, SlotState, take};
use serde::Deserialize;

/// Length of a place.
pub(super) const CONFIG_BYTES: usize = 80;
/// Places of a configuration.
const LONG: u32 = 2;
const LONG_BYTES: usize = LONG as usize * CONFIG_BYTES;
/// Version of what a record holds.
const VERSION: u8 = 2;
/// That of a configuration in one place.
const FIRST_VERSION: u8 = 1;
/// That of a record which holds a key alone, of before keys were counted.
const KEY_VERSION: u8 = 254;
/// That of a record which holds an owner.
const OWNER_VERSION: u8 = 253;
const HEAD: usize = 6;

type Record = [u8; CONFIG_BYTES];
/// A place in which there is nothing.
pub(super) const BLANK: Record = [0xff; CONFIG_BYTES];

/// A configuration as version 1 had it.
#[derive(Deserialize)]
struct First {
    feed_m_s: f32,
    acceleration_m_s2: f32,
    jerk_m_s3: f32,
    positioning_m_s: f32,
    offset_m: f32,
    slew_m_s: f32,
    stream_window_s: f32,
    soft_nm: [[i32; 2]; 3],
    internal_clock: bool,
}

impl First {
    /// One rate of the offset for all axes; ticks and steps are the board's own.
    const fn now(&self, own: &MachineConfig) -> MachineConfig {
        MachineConfig {
            feed_m_s: self.feed_m_s,
            acceleration_m_s2: self.acceleration_m_s2,
            jerk_m_s3: self.jerk_m_s3,
            positioning_m_s: self.positioning_m_s,
            offset_m: self.offset_m,
            slew_m_s: [self.slew_m_s; 3],
            stream_window_s: self.stream_window_s,
            soft_nm: self.soft_nm,
            internal_clock: self.internal_clock,
            tick_hz: own.tick_hz,
            step: own.step,
        }
    }
}

fn check(body: &[u8]) -> [u8; 4] {
    Crc32::new()
        .with(b"giotto config")
        .with(body)
        .value()
        .to_le_bytes()
}

/// Number, version and content of a record that is whole.
fn open(record: &[u8]) -> Option<(u32, u8, &[u8])> {
    let (body, sum) = record.split_last_chunk::<4>()?;
    if *sum != check(body) {
        return None;
    }
    let (number, rest) = body.split_first_chunk::<4>()?;
    let [length, version, content @ ..] = rest else {
        return None;
    };
    let content = content.get(..usize::from(*length))?;
    Some((u32::from_le_bytes(*number), *version, content))
}

/// Number and configuration, if the record is whole and of a version that is known.
fn read(record: &[u8], own: &MachineConfig) -> Option<(u32, MachineConfig)> {
    match open(record)? {
        (number, VERSION, body) => match take(body) {
            Some((config, [])) => Some((number, config)),
            _ => None,
        },
        (number, FIRST_VERSION, body) => match take::<First>(body) {
            Some((first, [])) => Some((number, first.now(own))),
            _ => None,
        },
        _ => None,
    }
}

fn write(number: u32, config: &MachineConfig) -> Option<[u8; LONG_BYTES]> {
    let mut record = [0xff; LONG_BYTES];
    let body = giotto_shared::wire::put(config, record.get_mut(HEAD..LONG_BYTES - 4)?)?;
    finish(&mut record, number, body as u8, VERSION)?;
    Some(record)
}

/// Puts head and check around the body of a record.
fn finish(record: &mut [u8], number: u32, length: u8, version: u8) -> Option<()> {
    *record.first_chunk_mut()? = number.to_le_bytes();
    *record.get_mut(4)? = length;
    *record.get_mut(5)? = version;
    let (body, sum) = record.split_last_chunk_mut::<4>()?;
    *sum = check(body);
    Some(())
}

/// The owner in a record, if it is whole and holds one.
pub(super) fn read_owner(record: &Record) -> Option<Owner> {
    match open(record)? {
        (epoch, OWNER_VERSION, body) => {
            let (key, serial) = body.split_first_chunk()?;
            Some(Owner {
                epoch,
                serial: u32::from_le_bytes(*serial.first_chunk()?),
                key: *key,
            })
        }
        (_, KEY_VERSION, body) => Some(Owner {
            epoch: 0,
            serial: 0,
            key: *body.first_chunk::<{ size_of::<PublicKey>() }>()?,
        }),
        _ => None,
    }
}

pub(super) fn write_owner(owner: &Owner) -> Option<Record> {
    let mut record = BLANK;
    let (key, rest) = record.get_mut(HEAD..)?.split_first_chunk_mut()?;
    *key = owner.key;
    *rest.first_chunk_mut()? = owner.serial.to_le_bytes();
    finish(&mut record, owner.epoch, 36, OWNER_VERSION)?;
    Some(record)
}

/// What the two units hold.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    newest: Option<(u32, MachineConfig)>,
    /// Unit of the newest record.
    unit: usize,
    /// First place of each unit from which on all is blank.
    blank: [u32; 2],
    /// Newest copy of the owner in each unit.
    owners: [Option<Owner>; 2],
}

impl Found {
    /// First byte, first blank place and copy of the owner: of the unit of the newest record, then of the other one.
    const fn in_order(&self, [a, b]: [u32; 2]) -> [(u32, u32, Option<Owner>); 2] {
        let ([blank_a, blank_b], [owner_a, owner_b]) = (self.blank, self.owners);
        let (first, second) = ((a, blank_a, owner_a), (b, blank_b, owner_b));
        if self.unit == 0 {
            [first, second]
        } else {
            [second, first]
        }
    }
}

/// The configuration that a flash holds, before there is a store; where it says nothing of them, with ticks and steps of `own`.
pub fn stored_config<F: NorFlash>(
    flash: F,
    layout: Layout,
    own: &MachineConfig,
) -> (F, Option<MachineConfig>) {
    let unread = Slot {
        state: SlotState::Invalid,
        next_record: RECORDS,
        owned: false,
    };
    let mut store = Store {
        flash,
        layout,
        slots: [unread; 2],
    };
    let config = store.config(own);
    (store.flash, config)
}

impl<F: NorFlash> Store<F> {
    const fn places() -> u32 {
        F::ERASE_SIZE as u32 / CONFIG_BYTES as u32
    }

    /// A place, as it is.
    pub(super) fn record(&mut self, at: u32) -> Result<Record, FlashFault> {
        let mut record = BLANK;
        self.flash
            .read(at, &mut record)
            .map_err(|_| FlashFault::Read)?;
        Ok(record)
    }

    #[inline(never)]
    fn configs(&mut self, units: [u32; 2], own: &MachineConfig) -> Result<Found, FlashFault> {
        let mut found = Found::default();
        for (unit, base) in units.into_iter().enumerate() {
            let (mut blank, mut owner) = (0, None);
            for place in 0..Self::places() {
                // Two places; the last one stands alone.
                let mut record = [0xff; LONG_BYTES];
                let long = place + LONG <= Self::places();
                let length = if long { LONG_BYTES } else { CONFIG_BYTES };
                let bytes = record.get_mut(..length).ok_or(FlashFault::Read)?;
                self.flash
                    .read(base + place * CONFIG_BYTES as u32, bytes)
                    .map_err(|_| FlashFault::Read)?;
                let Some(one) = record.first_chunk::<CONFIG_BYTES>() else {
                    continue;
                };
                if *one == BLANK {
                    continue;
                }
                blank = place + 1;
                owner = Owner::newer(owner, read_owner(one));
                let newest = found.newest.map(|(number, _)| number);
                if let Some((number, config)) = read(&record, own).or_else(|| read(one, own))
                    && newest.is_none_or(|newest| number > newest)
                {
                    (found.newest, found.unit) = (Some((number, config)), unit);
                }
            }
            if let (Some(to), Some(copy)) = (found.blank.get_mut(unit), found.owners.get_mut(unit))
            {
                (*to, *copy) = (blank, owner);
            }
        }
        Ok(found)
    }

    /// The configuration that is stored, if there is one that this image reads; where it says nothing of them, with ticks and steps
    /// of `own`.
    #[inline(never)]
    pub fn config(&mut self, own: &MachineConfig) -> Option<MachineConfig> {
        let units = self.layout.config?;
        let found = self.configs(units, own).ok()?;
        found.newest.map(|(_, config)| config)
    }

    /// What the units hold, for those who do not ask for the configuration.
    fn units(&mut self, units: [u32; 2]) -> Result<Found, FlashFault> {
        self.configs(units, &Config::robot(0).said())
    }

    /// The copy of the owner beside the configuration.
    ///
    /// # Errors
    /// [`FlashFault::Read`].
    pub(super) fn copied_owner(&mut self) -> Result<Option<Owner>, FlashFault> {
        let Some(units) = self.layout.config else {
            return Ok(None);
        };
        let [one, other] = self.units(units)?.owners;
        Ok(Owner::newer(one, other))
    }

    /// Sees to it that there is a copy of the owner in the unit of the newest configuration, or in the other one while the first is
    /// full.
    ///
    /// # Errors
    /// Those of the flash.
    pub(super) fn copy_owner(&mut self, owner: &Owner) -> Result<(), FlashFault> {
        let Some(units) = self.layout.config else {
            return Ok(());
        };
        let record = write_owner(owner).ok_or(FlashFault::Program)?;
        let [newest, other] = self.units(units)?.in_order(units);
        for (base, blank, copy) in [newest, other] {
            if copy == Some(*owner) {
                return Ok(());
            }
            if blank < Self::places() {
                return self.append(base + blank * CONFIG_BYTES as u32, &record);
            }
        }
        // Both are full: the other one holds older records only.
        let (base, ..) = other;
        self.clear(base)?;
        self.append(base, &record)
    }

    /// Erases a unit.
    pub(super) fn clear(&mut self, base: u32) -> Result<(), FlashFault> {
        self.flash
            .erase(base, base + F::ERASE_SIZE as u32)
            .map_err(|_| FlashFault::Erase)
    }

    /// Programs a record into blank places and reads it back.
    pub(super) fn append(&mut self, at: u32, record: &[u8]) -> Result<(), FlashFault> {
        self.flash
            .write(at, record)
            .map_err(|_| FlashFault::Program)?;
        for (offset, piece) in (0u32..)
            .step_by(CONFIG_BYTES)
            .zip(record.chunks(CONFIG_BYTES))
        {
            let back = self.record(at + offset)?;
            if let Some(differs) = piece.iter().zip(&back).position(|(a, b)| a != b) {
                return Err(FlashFault::ReadBack {
                    offset: at + offset + differs as u32,
                });
            }
        }
        Ok(())
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
        let owner = match self.key() {
            StoredKey::Key(owner) => Some(owner),
            StoredKey::None | StoredKey::Lost => None,
        };
        let found = self.units(units)?;
        let number = found.newest.map_or(0, |(number, _)| number.wrapping_add(1));
        let record = write(number, config).ok_or(FlashFault::Program)?;
        let mut unit = found.unit & 1;
        let mut place = found.blank[unit];
        if place + LONG > Self::places() {
            unit ^= 1;
            self.clear(units[unit])?;
            place = 0;
        }
        self.append(units[unit] + place * CONFIG_BYTES as u32, &record)?;
        if let Some(owner) = &owner {
            // The configuration is kept; without a copy the key still is where it was.
            let _ = self.copy_owner(owner);
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

    /// What the image brings along.
    fn own() -> MachineConfig {
        Config::robot(1000).said()
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
        for before in 0..9 {
            for tear in Tear::ALL {
                for after in 1..LONG_BYTES as u32 + 8 {
                    let mut store = open(Cells::new(), None, Tear::Untouched);
                    for n in 0..before {
                        store.keep_config(&config(n as f32 + 1.0)).unwrap();
                    }
                    let cells = store.into_flash().into_cells();
                    let mut store = open(cells, Some(after), tear);
                    let kept = store.keep_config(&config(100.0)).is_ok();
                    let mut store = open(store.into_flash().into_cells(), None, Tear::Untouched);
                    let old = (before > 0).then(|| config(before as f32));
                    let found = store.config(&own());
                    assert!(
                        found == Some(config(100.0)) || (found == old && !kept),
                        "{before} {after} {tear:?}: {found:?}"
                    );
                    // And it can be stored again.
                    store.keep_config(&config(101.0)).unwrap();
                    assert_eq!(store.config(&own()), Some(config(101.0)));
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
        cells.bytes_mut()[4096 + LONG_BYTES + 9] ^= 4;
        let mut store = open(cells, None, Tear::Untouched);
        assert_eq!(store.config(&own()), Some(config(1.0)));
        store.keep_config(&config(3.0)).unwrap();
        assert_eq!(store.config(&own()), Some(config(3.0)));
    }

    /// Bytes that the firmware before wrote (its record of 80 bytes, number 3): limits of 0.5 m/s, 2 m/s², 40 m/s³, 0.25 m/s, 5 mm,
    /// 0.1 m/s, 20 ms, soft limits of 100 mm, on the internal clock.
    #[test]
    fn a_configuration_of_the_version_before_is_read() {
        #[derive(serde::Serialize)]
        struct Before([f32; 7], [[i32; 2]; 3], bool);
        let soft_nm = [[-100_000_000, 100_000_000]; 3];
        let said = Before([0.5, 2.0, 40.0, 0.25, 0.005, 0.1, 0.02], soft_nm, true);
        let mut record = BLANK;
        let body = postcard::to_slice(&said, &mut record[HEAD..])
            .unwrap()
            .len();
        finish(&mut record, 3, body as u8, 1).unwrap();
        // zlib.crc32 of "giotto config" and these bytes, packed in Python.
        assert_eq!(record[CONFIG_BYTES - 4..], 0x5f29a9f9_u32.to_le_bytes());
        let mut cells = Cells::new();
        cells.bytes_mut()[4096..4096 + CONFIG_BYTES].copy_from_slice(&record);
        let mut store = open(cells, None, Tear::Untouched);
        let read = MachineConfig {
            feed_m_s: 0.5,
            acceleration_m_s2: 2.0,
            jerk_m_s3: 40.0,
            positioning_m_s: 0.25,
            offset_m: 0.005,
            slew_m_s: [0.1; 3],
            stream_window_s: 0.02,
            soft_nm,
            internal_clock: true,
            ..own()
        };
        assert_eq!(store.config(&own()), Some(read));
        // The next one is newer, whatever follows.
        for n in 0..9 {
            store.keep_config(&config(n as f32)).unwrap();
            assert_eq!(store.config(&own()), Some(config(n as f32)));
        }
    }
}
