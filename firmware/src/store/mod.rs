//! Two slots of NOR flash, one table each, and never half a one.
//!
//! ```text
//! config = two erase units, if the board has them (see `config`)
//! key  = one erase unit, if the board has one for it: the owner's key and serial (see `key`)
//! slot = one or more erase units
//!   0                the image of the table, padded with FF to the write size
//!   size - 128       16 confirmations of 8 bytes: generation u32, check u32 (little endian)
//! ```
//!
//! A *confirmation* is what makes a table the one that boots: the slot with the highest generation among
//! whole tables wins. Its check is the CRC-32 of generation and the table's own CRC, so that a torn one, or one
//! left over from another table, does not count; behind them `owned` where a key allowed it, so that a key that is gone is missed. Three rules follow, and with them any cut of power leaves the
//! old or the new table whole:
//!
//! - The slot in use is never erased. The other one has a lower generation, so whatever an interrupted
//!   erase leaves of it cannot win.
//! - Programming a table confirms nothing. A reset before the confirmation boots the old one: that is
//!   the probation.
//! - Rolling back confirms the other table anew, with the next generation. Nothing is marked bad, so no
//!   mark can be lost.
//!
//! No word is programmed twice between erasures (parts with ECC forbid it): the image goes once into a
//! slot just erased, each confirmation into a place still blank. `sequential-storage` was considered; its map
//! moves items between pages and erases on its own accord, and costs four times the text for two items.
#[cfg(test)]
mod bit_rot;
mod config;
mod key;
mod record;

pub mod power_cut;
pub mod ram;

use config::CONFIG_BYTES;
use embedded_storage::nor_flash::NorFlash;
use giotto_shared::table::{Header, MAX_IMAGE_BYTES, reads};
use giotto_shared::wire::{FlashFault, SlotState, TableInfo};
use record::{RECORD_BYTES, Record};

pub use config::stored_config;
pub use key::{Owner, PublicKey};

/// What is known of the owner's key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoredKey {
    /// None was provisioned.
    None,
    /// This one.
    Key(Owner),
    /// One was, and the flash does not say which: no table can be trusted.
    Lost,
}

/// Places for confirmations in a slot.
pub const RECORDS: usize = 16;
/// Bytes at the end of a slot that hold them.
const RECORDS_BYTES: u32 = (RECORDS * RECORD_BYTES) as u32;
/// Largest write size of a flash this store fits; also the piece in which it reads and writes.
const PIECE: usize = 64;

/// Buffer for a whole image.
pub type ImageBuffer = [u8; MAX_IMAGE_BYTES];

/// Where the slots are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// First byte of each slot.
    pub base: [u32; 2],
    /// Bytes of each slot.
    pub size: u32,
    /// First byte of the erase unit that keeps the key; `None`: no key can be provisioned.
    pub key: Option<u32>,
    /// First byte of each of the two erase units that keep the configuration; `None`: none can be stored.
    pub config: Option<[u32; 2]>,
}

impl Layout {
    /// Slots of `size` bytes at `base`.
    ///
    /// # Panics
    /// At compile time, if used for a constant: slots that overlap or are too short for any table.
    pub const fn new(base: [u32; 2], size: u32) -> Self {
        assert!(
            size >= MAX_IMAGE_BYTES as u32 + RECORDS_BYTES,
            "slot too short"
        );
        assert!(base[0] + size <= base[1], "slots overlap");
        Self {
            base,
            size,
            key: None,
            config: None,
        }
    }

    /// With a place for a key at `at`, in an erase unit of its own.
    ///
    /// # Panics
    /// At compile time, if used for a constant: a place inside a slot.
    pub const fn with_key(self, at: u32) -> Self {
        assert!(
            at < self.base[0] || at >= self.base[1] + self.size,
            "key inside a slot"
        );
        Self {
            key: Some(at),
            ..self
        }
    }

    /// With two erase units of their own for the configuration.
    pub const fn with_config(self, at: [u32; 2]) -> Self {
        Self {
            config: Some(at),
            ..self
        }
    }
}

/// What is known of a slot.
#[derive(Clone, Copy, Debug)]
struct Slot {
    state: SlotState,
    /// First place for a confirmation that is blank, and so are all after it.
    next_record: usize,
    /// One of its confirmations was made under a key.
    owned: bool,
}

/// The two slots.
#[derive(Debug)]
pub struct Store<F> {
    flash: F,
    layout: Layout,
    slots: [Slot; 2],
}

impl<F: NorFlash> Store<F> {
    const FITS: () = assert!(
        RECORD_BYTES.is_multiple_of(F::WRITE_SIZE)
            && CONFIG_BYTES.is_multiple_of(F::WRITE_SIZE)
            && PIECE.is_multiple_of(F::WRITE_SIZE)
            && F::READ_SIZE == 1,
        "flash geometry not supported"
    );

    /// Looks at both slots. A flash that cannot be read shows as two invalid slots.
    pub fn open(flash: F, layout: Layout, buffer: &mut ImageBuffer) -> Self {
        let () = Self::FITS;
        let unknown = Slot {
            state: SlotState::Invalid,
            next_record: RECORDS,
            owned: false,
        };
        let mut store = Self {
            flash,
            layout,
            slots: [unknown; 2],
        };
        store.scan(0, buffer);
        store.scan(1, buffer);
        store
    }

    /// The flash itself.
    pub fn flash_mut(&mut self) -> &mut F {
        &mut self.flash
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.flash
    }

    /// What slot 0 or 1 holds; any other number: invalid.
    pub fn state(&self, slot: u8) -> SlotState {
        self.slots
            .get(usize::from(slot))
            .map_or(SlotState::Invalid, |slot| slot.state)
    }

    /// The table in a slot, if it holds one.
    pub fn table(&self, slot: u8) -> Option<TableInfo> {
        match self.state(slot) {
            SlotState::Table(info) => Some(info),
            _ => None,
        }
    }

    /// Slots with confirmed tables, the one to boot first.
    pub fn confirmed(&self) -> [Option<u8>; 2] {
        let generation = |slot| self.table(slot).and_then(|info| info.generation);
        match (generation(0), generation(1)) {
            (Some(a), Some(b)) if a > b => [Some(0), Some(1)],
            (Some(_), Some(_)) => [Some(1), Some(0)],
            (Some(_), None) => [Some(0), None],
            (None, Some(_)) => [Some(1), None],
            (None, None) => [None, None],
        }
    }

    fn base(&self, slot: u8) -> u32 {
        let [first, second] = self.layout.base;
        if slot == 0 { first } else { second }
    }

    fn record_at(&self, slot: u8, index: usize) -> u32 {
        self.base(slot) + self.layout.size - RECORDS_BYTES + (index * RECORD_BYTES) as u32
    }

    /// Bytes of a slot.
    ///
    /// # Errors
    /// [`FlashFault::Read`], also for bytes beyond the slot.
    pub fn read(&mut self, slot: u8, offset: u32, out: &mut [u8]) -> Result<(), FlashFault> {
        if u64::from(offset) + out.len() as u64 > u64::from(self.layout.size) {
            return Err(FlashFault::Read);
        }
        let at = self.base(slot) + offset;
        self.flash.read(at, out).map_err(|_| FlashFault::Read)
    }

    /// Reads the image in a slot that holds a whole table.
    ///
    /// # Errors
    /// [`FlashFault::Read`] if there is none.
    pub fn load<'a>(
        &mut self,
        slot: u8,
        buffer: &'a mut ImageBuffer,
    ) -> Result<&'a [u8], FlashFault> {
        let length = usize::from(self.table(slot).ok_or(FlashFault::Read)?.length);
        let image = buffer.get_mut(..length).ok_or(FlashFault::Read)?;
        self.read(slot, 0, image)?;
        Ok(image)
    }

    /// Looks at a slot anew.
    fn scan(&mut self, slot: u8, buffer: &mut ImageBuffer) {
        let found = self.look(slot, buffer).unwrap_or(Slot {
            state: SlotState::Invalid,
            next_record: RECORDS,
            owned: false,
        });
        if let Some(known) = self.slots.get_mut(usize::from(slot)) {
            *known = found;
        }
    }

    fn look(&mut self, slot: u8, buffer: &mut ImageBuffer) -> Result<Slot, FlashFault> {
        self.read(slot, 0, buffer)?;
        let header = Header::check(buffer);
        let blank = buffer.iter().all(|&byte| byte == 0xff);
        let mut generation = None;
        let (mut next_record, mut owned) = (0, false);
        for index in 0..RECORDS {
            let mut bytes = [0; RECORD_BYTES];
            let at = self.record_at(slot, index);
            self.flash
                .read(at, &mut bytes)
                .map_err(|_| FlashFault::Read)?;
            if Record::is_blank(bytes) {
                continue;
            }
            next_record = index + 1;
            let crc = header.map_or(0, |header| header.crc);
            if let Some(found) = Record::read(bytes, crc) {
                generation = generation.max(Some(found.generation));
                owned |= found.owned;
            }
        }
        let state = match header {
            Err(_) if blank => SlotState::Empty,
            Err(_) => SlotState::Invalid,
            Ok(header) if !reads(header.version) => SlotState::OtherFormat {
                version: header.version,
            },
            Ok(header) => SlotState::Table(TableInfo {
                length: header.length as u16,
                crc: header.crc,
                generation,
            }),
        };
        Ok(Slot {
            state,
            next_record,
            owned,
        })
    }

    /// Puts the image in the first `length` bytes of `buffer` into a slot and compares what reads back. The
    /// table is then there, unconfirmed; the buffer holds what the slot does.
    ///
    /// # Errors
    /// Any [`FlashFault`]; the slot is then invalid and the other one untouched.
    pub fn write(
        &mut self,
        slot: u8,
        length: usize,
        buffer: &mut ImageBuffer,
    ) -> Result<(), FlashFault> {
        let written = buffer
            .get(..length)
            .map_or(Err(FlashFault::Program), |image| {
                self.erase_and_program(slot, image)
            });
        self.scan(slot, buffer);
        written
    }

    fn erase_and_program(&mut self, slot: u8, image: &[u8]) -> Result<(), FlashFault> {
        let base = self.base(slot);
        // Erased even if it reads blank: an erasure cut short leaves cells that read FF today only.
        self.flash
            .erase(base, base + self.layout.size)
            .map_err(|_| FlashFault::Erase)?;
        for (index, piece) in image.chunks(PIECE).enumerate() {
            let at = base + (index * PIECE) as u32;
            let mut padded = [0xff; PIECE];
            for (to, from) in padded.iter_mut().zip(piece) {
                *to = *from;
            }
            let length = piece.len().next_multiple_of(F::WRITE_SIZE);
            let padded = padded.get(..length).ok_or(FlashFault::Program)?;
            self.flash
                .write(at, padded)
                .map_err(|_| FlashFault::Program)?;
        }
        self.compare(slot, image)
    }

    fn compare(&mut self, slot: u8, image: &[u8]) -> Result<(), FlashFault> {
        for (index, piece) in image.chunks(PIECE).enumerate() {
            let offset = (index * PIECE) as u32;
            let mut back = [0; PIECE];
            let back = back.get_mut(..piece.len()).ok_or(FlashFault::Read)?;
            self.read(slot, offset, back)?;
            if let Some(at) = back
                .iter()
                .zip(piece)
                .position(|(back, wanted)| back != wanted)
            {
                return Err(FlashFault::ReadBack {
                    offset: offset + at as u32,
                });
            }
        }
        Ok(())
    }

    /// Whether a table in this slot was confirmed while a key was there.
    pub fn owned(&self, slot: u8) -> bool {
        self.slots
            .get(usize::from(slot))
            .is_some_and(|slot| slot.owned)
    }

    /// Makes the table in `slot` the one that boots; returns its new generation. `owned`: it was allowed to by a key, which is
    /// missed if it is lost.
    ///
    /// # Errors
    /// [`FlashFault::Read`] if the slot holds no table, [`FlashFault::Full`] after [`RECORDS`] confirmations,
    /// [`FlashFault::Program`], [`FlashFault::ReadBack`].
    pub fn confirm(
        &mut self,
        slot: u8,
        owned: bool,
        buffer: &mut ImageBuffer,
    ) -> Result<u32, FlashFault> {
        let info = self.table(slot).ok_or(FlashFault::Read)?;
        let known = self.slots.get(usize::from(slot)).ok_or(FlashFault::Read)?;
        let index = known.next_record;
        if index >= RECORDS {
            return Err(FlashFault::Full);
        }
        let generation = self.newest_generation().wrapping_add(1);
        let bytes = Record { generation, owned }.write(info.crc);
        let at = self.record_at(slot, index);
        let programmed = self
            .flash
            .write(at, &bytes)
            .map_err(|_| FlashFault::Program);
        self.scan(slot, buffer);
        programmed?;
        match self.table(slot).and_then(|info| info.generation) {
            Some(found) if found == generation => Ok(generation),
            _ => Err(FlashFault::ReadBack {
                offset: at - self.base(slot),
            }),
        }
    }

    fn newest_generation(&self) -> u32 {
        let generation = |slot| {
            self.table(slot)
                .and_then(|info| info.generation)
                .unwrap_or(0)
        };
        generation(0).max(generation(1))
    }
}
