//! Interrupt vectors of the STM32F405 (RM0090 table 62): USART3 is 39.
use super::{common::interrupt, usart};

/// Vectors of the part.
const COUNT: usize = 82;
/// The link's receive interrupt.
pub const LINK: u16 = 39;

/// The vectors behind those of the core.
#[allow(
    unsafe_code,
    reason = "the linker script of cortex-m-rt looks for this name and section"
)]
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
pub static __INTERRUPTS: [extern "C" fn(); COUNT] = interrupt::table(LINK, usart::received);
