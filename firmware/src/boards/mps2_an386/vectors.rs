//! Interrupt vectors of the AN386 (DAI0386 table 3-4): UART0 receive is 0.
use super::{common, uart};
use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::NVIC;

/// Vectors that QEMU's machine has.
const COUNT: usize = 32;

/// Number of UART0's receive interrupt.
#[derive(Clone, Copy)]
struct Uart0Receive;

// SAFETY: 0 is below the number of interrupts of the part.
#[allow(unsafe_code, reason = "cortex-m asks for it")]
unsafe impl InterruptNumber for Uart0Receive {
    fn number(self) -> u16 {
        0
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
    vectors[0] = uart::received as extern "C" fn();
    vectors
};

/// Lets UART0's receive interrupt through, below the tick.
pub fn enable(nvic: &mut NVIC) {
    // SAFETY: its queue is in place, and no critical section is based on priorities.
    #[allow(unsafe_code, reason = "cortex-m has no safe way to enable an interrupt")]
    unsafe {
        nvic.set_priority(Uart0Receive, common::LINK_PRIORITY);
        NVIC::unmask(Uart0Receive);
    }
}
