//! Access to registers by their addresses (RM0090 2.3).
use core::ptr;

/// A register.
#[derive(Clone, Copy)]
pub struct Register(*mut u32);

/// How often a register is looked at before its hardware is given up: at 16 MHz some 50 ms.
const PATIENCE: u32 = 100_000;

impl Register {
    /// The register at `offset` of the peripheral at `base`.
    pub const fn at(base: usize, offset: usize) -> Self {
        Self((base + offset) as *mut u32)
    }

    /// Its value.
    pub fn get(self) -> u32 {
        // SAFETY: only made for addresses of this part's peripherals, aligned to words.
        #[allow(unsafe_code, reason = "registers")]
        unsafe {
            ptr::read_volatile(self.0)
        }
    }

    /// Sets all of it.
    pub fn set(self, value: u32) {
        // SAFETY: as in `get`; none of the registers used starts a transfer to memory.
        #[allow(unsafe_code, reason = "registers")]
        unsafe {
            ptr::write_volatile(self.0, value);
        }
    }

    /// Changes the bits of `mask` to those of `value`.
    pub fn change(self, mask: u32, value: u32) {
        self.set(self.get() & !mask | value);
    }

    /// Waits until the bits of `mask` are `value`; `false`: they never were.
    pub fn wait(self, mask: u32, value: u32) -> bool {
        (0..PATIENCE).any(|_| self.get() & mask == value)
    }
}
