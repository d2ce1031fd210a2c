//! The flash of the part, and where tables, key and configuration are in it.
//!
//! Interrupts are masked while it is erased or programmed: a core that fetches from it stands still anyway, and the tick must
//! not take that for a run gone late. The store writes at rest only.
use super::{common, register};
use core::ptr;
use cortex_m::peripheral::{DWT, SCB, SYST};
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use giotto_firmware::stm32_flash::{FlashError, Part, Register, UNIT, Units, ticks_due};
use giotto_firmware::store::Layout;

const FLASH: usize = 0x4002_3c00;

/// Slots and key in sectors of 16 KiB, between the vectors and the code; the configuration in the last two.
pub const LAYOUT: Layout = Layout::new([0, UNIT], UNIT)
    .with_key(2 * UNIT)
    .with_config([3 * UNIT, 4 * UNIT]);

/// The part's own registers and memory.
struct Own;

fn at(register: Register) -> register::Register {
    register::Register::at(
        FLASH,
        match register {
            Register::Access => 0x00,
            Register::Key => 0x04,
            Register::Status => 0x0c,
            Register::Control => 0x10,
        },
    )
}

#[allow(unsafe_code, reason = "memory that no Rust object owns")]
impl Part for Own {
    fn get(&self, register: Register) -> u32 {
        at(register).get()
    }

    fn set(&mut self, register: Register, value: u32) {
        at(register).set(value);
    }

    fn word(&self, address: u32) -> u32 {
        // SAFETY: only asked for addresses of the five units, aligned to words; reading flash has no effect.
        unsafe { ptr::read_volatile(address as *const u32) }
    }

    fn write(&mut self, address: u32, word: u32) {
        // SAFETY: as in `word`; a write to flash only starts its controller.
        unsafe { ptr::write_volatile(address as *mut u32, word) };
    }
}

/// The part's own number, which its maker has given no other (RM0090 39.1): whom tables are bound to. Zeros in the emulator, where
/// asking is a fault: its core is of revision r0p0, the part's of r0p1 (PM0214 4.4.1).
#[allow(unsafe_code, reason = "memory that no Rust object owns")]
pub fn machine() -> [u8; 12] {
    const UNIQUE: usize = 0x1fff_7a10;
    const CORE: register::Register = register::Register::at(0xe000_ed00, 0);
    if CORE.get() & 0xf == 0 {
        return [0; 12];
    }
    // SAFETY: three words of the part's system memory; reading them has no effect.
    core::array::from_fn(|at| unsafe { ptr::read_volatile((UNIQUE + at) as *const u8) })
}

/// The units of the part. Nothing else of the image uses them.
pub struct Flash(Units<Own>);

impl Flash {
    /// The units.
    pub const fn new() -> Self {
        Self(Units::new(Own))
    }
}

/// With interrupts masked. The ticks that fell due meanwhile are not late, the core stood still; they are counted as passed. The
/// counter of cycles runs on, and wraps after 25 s.
fn masked<T>(act: impl FnOnce() -> T) -> T {
    critical_section::with(|_| {
        let period = SYST::get_reload().wrapping_add(1);
        let (began, into) = (DWT::cycle_count(), period.wrapping_sub(SYST::get_current()));
        let result = act();
        let took = DWT::cycle_count().wrapping_sub(began);
        SCB::clear_pendst();
        common::lose(ticks_due(took, into, period));
        result
    })
}

impl ErrorType for Flash {
    type Error = FlashError;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        self.0.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = Units::<Own>::WRITE_SIZE;
    const ERASE_SIZE: usize = Units::<Own>::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        masked(|| self.0.erase(from, to))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        masked(|| self.0.write(offset, bytes))
    }
}
