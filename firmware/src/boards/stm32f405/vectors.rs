//! Interrupt vectors of the STM32F405 (RM0090 table 62): USART3 is 39.
use super::{common, usart};
use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::NVIC;

/// Vectors of the part.
const COUNT: usize = 82;
const USART3: u16 = 39;

/// Number of USART3's interrupt.
#[derive(Clone, Copy)]
struct Usart3;

// SAFETY: 39 is below the number of interrupts of the part.
#[allow(unsafe_code, reason = "cortex-m asks for it")]
unsafe impl InterruptNumber for Usart3 {
    fn number(self) -> u16 {
        USART3
    }
}

extern "C" fn unexpected() {
    cortex_m::asm::udf();
}

/// The vectors behind those of the core.
#[allow(unsafe_code, reason = "the linker script of cortex-m-rt looks for this name and section")]
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
pub static __INTERRUPTS: [extern "C" fn(); COUNT] = {
    let mut vectors = [unexpected as extern "C" fn(); COUNT];
    vectors[USART3 as usize] = usart::received as extern "C" fn();
    vectors
};

/// Lets USART3's interrupt through, below the tick.
pub fn enable(nvic: &mut NVIC) {
    // SAFETY: its queue is in place, and no critical section is based on priorities.
    #[allow(unsafe_code, reason = "cortex-m has no safe way to enable an interrupt")]
    unsafe {
        nvic.set_priority(Usart3, common::LINK_PRIORITY);
        NVIC::unmask(Usart3);
    }
}
