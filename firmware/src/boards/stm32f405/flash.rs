//! The last three sectors of the flash (RM0090 3.6), 128 KiB each: the key, and one for each slot. Whatever is erased or programmed is read
//! back at once: a controller that says "done" is not believed.
//!
//! Interrupts are masked meanwhile: the part has one bank, so a core that fetches from it stands still anyway, and the tick
//! must not take that for a run gone late. The store writes at rest only.
use super::common::flash::FlashError;
use super::register::Register;
use core::ptr;
use cortex_m::peripheral::SCB;
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, ReadNorFlash, check_erase, check_read, check_write,
};
use giotto_firmware::store::Layout;

const FLASH: usize = 0x4002_3c00;
const KEY: Register = Register::at(FLASH, 0x04);
const STATUS: Register = Register::at(FLASH, 0x0c);
const CONTROL: Register = Register::at(FLASH, 0x10);

const KEYS: [u32; 2] = [0x4567_0123, 0xcdef_89ab];
const BUSY: u32 = 1 << 16;
/// Operation, write protection, alignment, parallelism, sequence.
const ERRORS: u32 = 0b1111_0010;
const PROGRAM: u32 = 1;
const ERASE: u32 = 1 << 1;
const START: u32 = 1 << 16;
const LOCK: u32 = 1 << 31;
/// Words of 32 bits, which 2.7 to 3.6 V allow.
const BY_WORDS: u32 = 0b10 << 8;
/// How often the controller is asked whether it is done; the core stands still during most of it.
const PATIENCE: u32 = 10_000_000;

/// First byte of sector 9.
const BASE: usize = 0x080a_0000;
const FIRST_SECTOR: u32 = 9;
const SECTOR: u32 = 128 * 1024;
const SIZE: usize = 3 * SECTOR as usize;
const WORD: usize = 4;

/// Where the slots are.
pub const LAYOUT: Layout = Layout::new([SECTOR, 2 * SECTOR], SECTOR).with_key(0);

/// The three sectors. Nothing else of the image uses them.
pub struct Sectors(());

#[allow(unsafe_code, reason = "memory that no Rust object owns")]
impl Sectors {
    /// The sectors.
    pub const fn new() -> Self {
        Self(())
    }

    fn word(&self, at: usize) -> u32 {
        // SAFETY: callers stay below SIZE, aligned to words; reading flash has no effect.
        unsafe { ptr::read_volatile((BASE + at) as *const u32) }
    }

    fn program(&mut self, at: usize, word: u32) -> Result<(), FlashError> {
        // SAFETY: as in `word`; a write to flash only starts its controller.
        unsafe { ptr::write_volatile((BASE + at) as *mut u32, word) };
        done()?;
        if self.word(at) == word {
            Ok(())
        } else {
            Err(FlashError::ReadBack)
        }
    }

    /// Runs `act` with the controller unlocked and set to `control`, and locks it again.
    fn unlocked(
        &mut self,
        control: u32,
        act: impl FnOnce(&mut Self) -> Result<(), FlashError>,
    ) -> Result<(), FlashError> {
        critical_section::with(|_| {
            KEYS.into_iter().for_each(|key| KEY.set(key));
            let result = done().and_then(|()| {
                STATUS.set(ERRORS);
                CONTROL.set(control | BY_WORDS);
                act(self)
            });
            CONTROL.set(LOCK);
            // The tick that fell due meanwhile is not late: time stood still.
            SCB::clear_pendst();
            result
        })
    }
}

/// Waits for the controller.
fn done() -> Result<(), FlashError> {
    let waited = (0..PATIENCE).any(|_| STATUS.get() & BUSY == 0);
    if waited && STATUS.get() & ERRORS == 0 {
        Ok(())
    } else {
        Err(FlashError::Controller)
    }
}

impl ErrorType for Sectors {
    type Error = FlashError;
}

impl ReadNorFlash for Sectors {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len()).map_err(FlashError::Range)?;
        for (at, byte) in (offset as usize..).zip(bytes) {
            let word = self.word(at & !(WORD - 1));
            *byte = (word >> (8 * (at % WORD))) as u8;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        SIZE
    }
}

impl NorFlash for Sectors {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        check_erase(self, from, to).map_err(FlashError::Range)?;
        for sector in from / SECTOR..to / SECTOR {
            let control = ERASE | (FIRST_SECTOR + sector) << 3;
            self.unlocked(control, |flash| {
                CONTROL.set(control | BY_WORDS | START);
                done()?;
                let first = (sector * SECTOR) as usize;
                let blank = (first..first + SECTOR as usize)
                    .step_by(WORD)
                    .all(|at| flash.word(at) == u32::MAX);
                if blank {
                    Ok(())
                } else {
                    Err(FlashError::ReadBack)
                }
            })?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len()).map_err(FlashError::Range)?;
        self.unlocked(PROGRAM, |flash| {
            let words = bytes
                .chunks_exact(WORD)
                .filter_map(|word| word.first_chunk().copied());
            (offset as usize..)
                .step_by(WORD)
                .zip(words)
                .try_for_each(|(at, word)| flash.program(at, u32::from_le_bytes(word)))
        })
    }
}
