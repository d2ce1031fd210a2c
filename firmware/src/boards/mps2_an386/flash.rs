//! The flash stand-in: a window of code memory that programs bits to 0 and erases units to 1, as NOR flash does.
use super::common::flash::FlashError;
use core::ptr;
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, ReadNorFlash, check_erase, check_read, check_write,
};
use giotto_firmware::store::Layout;

/// First byte of the window, behind the image in SSRAM1.
const BASE: usize = 0x0010_0000;
/// Bytes of an erase unit, and of a slot.
const UNIT: u32 = 4096;
/// Bytes of the window.
const SIZE: usize = 5 * UNIT as usize;

/// Where the slots are in the window.
pub const LAYOUT: Layout = Layout::new([0, UNIT], UNIT)
    .with_key(2 * UNIT)
    .with_config([3 * UNIT, 4 * UNIT]);

/// Twelve bytes behind the window: whom tables are bound to. A chip has them from its maker; here they are zeros, or what the emulator is
/// told to put there.
#[allow(unsafe_code, reason = "memory that no Rust object owns")]
pub fn machine() -> [u8; 12] {
    // SAFETY: memory of SSRAM1 behind the window, which nothing writes.
    core::array::from_fn(|at| unsafe { ptr::read_volatile((BASE + SIZE + at) as *const u8) })
}

/// The window. There is one; nothing else of the image uses this memory.
pub struct Window(());

#[allow(unsafe_code, reason = "memory that no Rust object owns")]
impl Window {
    /// The window. QEMU starts with memory of zeros where a chip comes erased: such a window is erased first.
    pub fn new() -> Self {
        let mut window = Self(());
        if (0..SIZE).all(|at| window.get(at) == 0) {
            (0..SIZE).for_each(|at| window.set(at, 0xff));
        }
        window
    }

    fn get(&mut self, at: usize) -> u8 {
        // SAFETY: callers stay below SIZE; the window is memory that only this driver uses.
        unsafe { ptr::read_volatile((BASE + at) as *const u8) }
    }

    fn set(&mut self, at: usize, value: u8) {
        // SAFETY: as in `get`.
        unsafe { ptr::write_volatile((BASE + at) as *mut u8, value) }
    }
}

impl ErrorType for Window {
    type Error = FlashError;
}

impl ReadNorFlash for Window {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len()).map_err(FlashError::Range)?;
        for (at, byte) in (offset as usize..).zip(bytes) {
            *byte = self.get(at);
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        SIZE
    }
}

impl NorFlash for Window {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = UNIT as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        check_erase(self, from, to).map_err(FlashError::Range)?;
        (from as usize..to as usize).for_each(|at| self.set(at, 0xff));
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len()).map_err(FlashError::Range)?;
        for (at, byte) in (offset as usize..).zip(bytes) {
            let cell = self.get(at);
            self.set(at, cell & byte);
        }
        Ok(())
    }
}
