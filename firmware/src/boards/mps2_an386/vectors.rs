//! Interrupt vectors of the AN386 (DAI0386 table 3-4): UART0 receive is 0.
use super::{common::interrupt, uart};

/// Vectors that QEMU's machine has.
const COUNT: usize = 32;
/// The link's receive interrupt.
pub const LINK: u16 = 0;

/// The vectors behind those of the core.
#[allow(
    unsafe_code,
    reason = "the linker script of cortex-m-rt looks for this name and section"
)]
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
pub static __INTERRUPTS: [extern "C" fn(); COUNT] = interrupt::table(LINK, uart::received);
