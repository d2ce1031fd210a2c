//! The worst stack since boot: cortex-m-rt paints the stack before `main`, and what is still paint was never
//! used.
use core::ptr;

/// What cortex-m-rt paints with.
const PAINT: u32 = 0xcccc_cccc;

#[allow(unsafe_code, reason = "symbols of the linker script")]
unsafe extern "C" {
    static _stack_start: u32;
    static _stack_end: u32;
}

/// Bytes of stack used at the deepest so far, and those never used.
#[allow(unsafe_code, reason = "the stack is memory that no Rust object owns")]
pub fn worst_and_left_bytes() -> (u32, u32) {
    let (top, bottom) = (&raw const _stack_start, &raw const _stack_end);
    let mut at = bottom;
    // SAFETY: the linker puts the stack between these two symbols, aligned to words; reading it is reading RAM.
    while at < top && unsafe { ptr::read_volatile(at) } == PAINT {
        at = at.wrapping_add(1);
    }
    (top as u32 - at as u32, at as u32 - bottom as u32)
}
