//! The flash controller of the STM32F4 (RM0090 3), over any block of registers: the part's own, or one that a test has made up.
//!
//! Five units of 16 KiB: sectors 1, 2 and 3, and the beginnings of sectors 10 and 11, which are 128 KiB long. A sector of
//! 16 KiB is erased in a quarter to half a second, one of 128 KiB in one to two (datasheet, table 39); the part has one bank,
//! so that a core that fetches from it stands still meanwhile. Only the configuration is in the long ones, where one in two
//! hundred changes erases.
//!
//! Whatever is erased or programmed is read back at once, past the data cache, which does not notice either. A controller
//! that says "done" is not believed, and what it reports of one operation is cleared before the next.
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read,
    check_write,
};

/// Bytes of a unit.
pub const UNIT: u32 = 16 * 1024;
/// Units.
pub const UNITS: usize = 5;
/// Sector and first address of each unit.
const SECTORS: [(u32, u32); UNITS] = [
    (1, 0x0800_4000),
    (2, 0x0800_8000),
    (3, 0x0800_c000),
    (10, 0x080c_0000),
    (11, 0x080e_0000),
];

const KEYS: [u32; 2] = [0x4567_0123, 0xcdef_89ab];
const BUSY: u32 = 1 << 16;
/// Operation, write protection, alignment, parallelism, sequence; each is cleared by writing it.
const ERRORS: u32 = 0b1111_0010;
const PROGRAM: u32 = 1;
const ERASE: u32 = 1 << 1;
const START: u32 = 1 << 16;
const LOCK: u32 = 1 << 31;
/// Words of 32 bits, which 2.7 to 3.6 V allow.
const BY_WORDS: u32 = 0b10 << 8;
const DATA_CACHE: u32 = 1 << 10;
const DATA_CACHE_RESET: u32 = 1 << 12;
/// How often the controller is asked whether it is done; the core stands still during most of it.
const PATIENCE: u32 = 10_000_000;
const WORD: usize = 4;

/// Registers of the flash interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Register {
    /// Access control: wait states and caches.
    Access,
    /// Keys.
    Key,
    /// Status.
    Status,
    /// Control.
    Control,
}

/// The part.
pub trait Part {
    /// A register's value.
    fn get(&self, register: Register) -> u32;
    /// Sets all of a register.
    fn set(&mut self, register: Register, value: u32);
    /// A word of the flash.
    fn word(&self, address: u32) -> u32;
    /// Writes one, which starts the controller if it is set to programming.
    fn write(&mut self, address: u32, word: u32);
}

/// Ticks that fall due in so many cycles of the core, the first of them `into` cycles after the last tick.
pub const fn ticks_due(cycles: u32, into: u32, period: u32) -> u32 {
    // Both are below 2³², and so is the quotient.
    match (cycles as u64 + into as u64).checked_div(period as u64) {
        Some(ticks) => ticks as u32,
        None => 0,
    }
}

/// Why a flash operation failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashError {
    /// Place or alignment.
    Range(NorFlashErrorKind),
    /// The flash controller reports an error or does not answer.
    Controller,
    /// What was erased or programmed does not read back so.
    ReadBack,
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Range(kind) => *kind,
            Self::Controller | Self::ReadBack => NorFlashErrorKind::Other,
        }
    }
}

/// The five units.
#[derive(Debug)]
pub struct Units<P> {
    part: P,
}

impl<P: Part> Units<P> {
    /// Of this part; nothing else may use them.
    pub const fn new(part: P) -> Self {
        Self { part }
    }

    fn address(at: usize) -> u32 {
        let (unit, within) = (at / UNIT as usize, at % UNIT as usize);
        let base = SECTORS.get(unit).map_or(0, |(_, base)| *base);
        base + within as u32
    }

    fn idle(&self) -> Result<(), FlashError> {
        let idle = (0..PATIENCE).any(|_| self.part.get(Register::Status) & BUSY == 0);
        if idle {
            Ok(())
        } else {
            Err(FlashError::Controller)
        }
    }

    /// Waits for the end of an operation.
    fn done(&self) -> Result<(), FlashError> {
        self.idle()?;
        if self.part.get(Register::Status) & ERRORS == 0 {
            Ok(())
        } else {
            Err(FlashError::Controller)
        }
    }

    /// Runs `act` with the controller unlocked and set to `control`, what it said of other operations forgotten, and locks it
    /// again.
    fn unlocked(
        &mut self,
        control: u32,
        act: impl FnOnce(&mut Self) -> Result<(), FlashError>,
    ) -> Result<(), FlashError> {
        self.idle()?;
        if self.part.get(Register::Control) & LOCK != 0 {
            KEYS.into_iter()
                .for_each(|key| self.part.set(Register::Key, key));
        }
        self.part.set(Register::Status, ERRORS);
        self.part.set(Register::Control, control | BY_WORDS);
        let result = act(self);
        // One that hangs is not written to: the core would hang with it.
        if self.part.get(Register::Status) & BUSY == 0 {
            self.part.set(Register::Control, LOCK);
        }
        result
    }

    /// What was there before an operation may still be in the data cache, which is reset while it is off only.
    fn forget_cached(&mut self) {
        let access = self.part.get(Register::Access);
        let off = access & !DATA_CACHE;
        self.part.set(Register::Access, off);
        self.part.set(Register::Access, off | DATA_CACHE_RESET);
        self.part.set(Register::Access, off);
        self.part.set(Register::Access, access);
    }

    fn erase_unit(&mut self, unit: usize) -> Result<(), FlashError> {
        let Some(&(sector, base)) = SECTORS.get(unit) else {
            return Err(FlashError::Range(NorFlashErrorKind::OutOfBounds));
        };
        let control = ERASE | sector << 3;
        let erased = self.unlocked(control, |units| {
            units
                .part
                .set(Register::Control, control | BY_WORDS | START);
            units.done()
        });
        self.forget_cached();
        erased?;
        let mut words = (base..base + UNIT).step_by(WORD);
        if words.all(|address| self.part.word(address) == u32::MAX) {
            Ok(())
        } else {
            Err(FlashError::ReadBack)
        }
    }
}

impl<P> ErrorType for Units<P> {
    type Error = FlashError;
}

impl<P: Part> ReadNorFlash for Units<P> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len()).map_err(FlashError::Range)?;
        for (at, byte) in (offset as usize..).zip(bytes) {
            let word = self.part.word(Self::address(at & !(WORD - 1)));
            *byte = (word >> (8 * (at % WORD))) as u8;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        UNITS * UNIT as usize
    }
}

impl<P: Part> NorFlash for Units<P> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = UNIT as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        check_erase(self, from, to).map_err(FlashError::Range)?;
        (from / UNIT..to / UNIT).try_for_each(|unit| self.erase_unit(unit as usize))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len()).map_err(FlashError::Range)?;
        let words = || {
            let words = bytes
                .chunks_exact(WORD)
                .filter_map(|word| word.first_chunk().copied());
            (offset as usize..)
                .step_by(WORD)
                .map(Self::address)
                .zip(words.map(u32::from_le_bytes))
        };
        let programmed = self.unlocked(PROGRAM, |units| {
            words().try_for_each(|(address, word)| {
                units.part.write(address, word);
                units.done()
            })
        });
        self.forget_cached();
        programmed?;
        if words().all(|(address, word)| self.part.word(address) == word) {
            Ok(())
        } else {
            Err(FlashError::ReadBack)
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::cell::{Cell, RefCell};
    use std::collections::BTreeMap;
    use std::vec::Vec;

    /// A controller as the manual describes it: locked until both keys have come in order, busy for a while after each
    /// operation, its error bits kept until they are written, its data cache blind to what was erased or programmed.
    #[derive(Default)]
    struct Made {
        words: BTreeMap<u32, u32>,
        cached: RefCell<BTreeMap<u32, u32>>,
        access: u32,
        control: u32,
        errors: u32,
        keys: Vec<u32>,
        busy_for: Cell<u32>,
        busy: u32,
        erased: Vec<u32>,
        /// Error bits that the next operation raises.
        fails: u32,
    }

    impl Made {
        fn new() -> Self {
            Self {
                control: LOCK,
                access: DATA_CACHE | 5,
                busy: 3,
                ..Self::default()
            }
        }

        fn operate(&mut self) {
            assert_eq!(self.busy_for.get(), 0, "an operation while it is busy");
            assert_eq!(
                self.errors, 0,
                "an operation with errors pending does not start"
            );
            self.errors = core::mem::take(&mut self.fails);
            self.busy_for.set(self.busy);
        }
    }

    impl Part for Made {
        fn get(&self, register: Register) -> u32 {
            match register {
                Register::Access => self.access,
                Register::Key => 0,
                Register::Status => {
                    let left = self.busy_for.get();
                    self.busy_for.set(left.saturating_sub(1));
                    self.errors | if left > 0 { BUSY } else { 0 }
                }
                Register::Control => self.control,
            }
        }

        fn set(&mut self, register: Register, value: u32) {
            match register {
                Register::Access => {
                    if value & DATA_CACHE_RESET != 0 && self.access & DATA_CACHE == 0 {
                        self.cached.get_mut().clear();
                    }
                    self.access = value;
                }
                Register::Key => {
                    self.keys.push(value);
                    if self.keys.ends_with(&KEYS) {
                        self.control &= !LOCK;
                    }
                }
                Register::Status => self.errors &= !value,
                Register::Control => {
                    assert_eq!(
                        self.busy_for.get(),
                        0,
                        "control is written while it is busy"
                    );
                    if self.control & LOCK != 0 {
                        return;
                    }
                    self.control = value;
                    if value & (ERASE | START) == ERASE | START {
                        let failed = self.fails != 0;
                        self.operate();
                        let sector = value >> 3 & 0xf;
                        self.erased.push(sector);
                        let of = |address: &u32| {
                            SECTORS.iter().any(|(s, base)| {
                                *s == sector && (*base..*base + UNIT).contains(address)
                            })
                        };
                        if !failed {
                            self.words.retain(|address, _| !of(address));
                        }
                        self.control &= !START;
                    }
                }
            }
        }

        fn word(&self, address: u32) -> u32 {
            let now = self.words.get(&address).copied().unwrap_or(u32::MAX);
            if self.access & DATA_CACHE == 0 {
                return now;
            }
            *self.cached.borrow_mut().entry(address).or_insert(now)
        }

        fn write(&mut self, address: u32, word: u32) {
            assert!(
                self.control & (LOCK | PROGRAM) == PROGRAM,
                "not set to programming"
            );
            let failed = self.fails != 0;
            self.operate();
            if !failed {
                let before = self.words.get(&address).copied().unwrap_or(u32::MAX);
                self.words.insert(address, before & word);
            }
        }
    }

    fn read(units: &mut Units<Made>, at: u32) -> [u8; 8] {
        let mut bytes = [0; 8];
        units.read(at, &mut bytes).unwrap();
        bytes
    }

    #[test]
    fn what_is_written_is_read_past_the_cache_in_every_unit() {
        let mut units = Units::new(Made::new());
        for unit in 0..UNITS as u32 {
            let at = unit * UNIT + 64;
            // Read first: the cache knows the blank words.
            assert_eq!(read(&mut units, at), [0xff; 8]);
            units.write(at, &[1, 2, 3, 4, 5, 6, 7, 8]).unwrap();
            assert_eq!(read(&mut units, at), [1, 2, 3, 4, 5, 6, 7, 8]);
            units.erase(unit * UNIT, (unit + 1) * UNIT).unwrap();
            assert_eq!(read(&mut units, at), [0xff; 8]);
        }
        assert_eq!(units.part.erased, [1, 2, 3, 10, 11]);
        assert!(units.part.control & LOCK != 0 && units.part.access & DATA_CACHE != 0);
    }

    #[test]
    fn lost_ticks_are_those_that_fell_due() {
        const PERIOD: u32 = 168_000;
        for begin in [0, 1, PERIOD / 2, PERIOD - 1] {
            for cycles in [0, 1, PERIOD - 1, PERIOD, 5 * PERIOD + 7, 336_000_000] {
                let due = (u64::from(begin) + 1..=u64::from(begin) + u64::from(cycles))
                    .filter(|cycle| cycle % u64::from(PERIOD) == 0)
                    .count();
                assert_eq!(
                    ticks_due(cycles, begin, PERIOD) as usize,
                    due,
                    "{begin} {cycles}"
                );
            }
        }
        assert_eq!(ticks_due(u32::MAX, 5, 0), 0);
    }

    /// An error of one operation is told once, and the next one works.
    #[test]
    fn one_error_bit_does_not_last() {
        let mut units = Units::new(Made::new());
        for bit in [1, 4, 5, 6, 7] {
            units.part.fails = 1 << bit;
            assert_eq!(
                units.write(0, &[0; 4]),
                Err(FlashError::Controller),
                "{bit}"
            );
            units.write(0, &[0, 1, 2, 3]).unwrap();
            units.part.fails = 1 << bit;
            assert_eq!(units.erase(0, UNIT), Err(FlashError::Controller), "{bit}");
            units.erase(0, UNIT).unwrap();
        }
    }

    #[test]
    fn a_controller_that_hangs_is_given_up_and_taken_up_again() {
        let mut units = Units::new(Made::new());
        units.part.busy = PATIENCE + 10;
        assert_eq!(units.erase(0, UNIT), Err(FlashError::Controller));
        units.part.busy = 3;
        units.part.busy_for.set(0);
        units.part.control = LOCK;
        units.erase(0, UNIT).unwrap();
    }

    #[test]
    fn a_flash_that_does_not_keep_what_it_is_given_is_found_out() {
        let mut units = Units::new(Made::new());
        units.write(0, &[0, 0, 0, 0]).unwrap();
        // Bits do not come back without an erasure.
        assert_eq!(units.write(0, &[1, 2, 3, 4]), Err(FlashError::ReadBack));
    }
}
