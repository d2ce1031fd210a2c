//! The one interrupt behind those of the core: the link's.
use super::LINK_PRIORITY;
use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::NVIC;

/// Number of the link's receive interrupt on a part that has more than `N`.
#[derive(Clone, Copy)]
struct Number<const N: u16>;

// SAFETY: the table of vectors of a board has a place for its link, so N is below the number of interrupts of the part.
#[allow(unsafe_code, reason = "cortex-m asks for it")]
unsafe impl<const N: u16> InterruptNumber for Number<N> {
    fn number(self) -> u16 {
        N
    }
}

/// Any other interrupt.
pub extern "C" fn unexpected() {
    cortex_m::asm::udf();
}

/// A table of `COUNT` vectors, of which the link's is number `link`.
pub const fn table<const COUNT: usize>(
    link: u16,
    received: extern "C" fn(),
) -> [extern "C" fn(); COUNT] {
    let mut vectors = [unexpected as extern "C" fn(); COUNT];
    vectors[link as usize] = received;
    vectors
}

/// Lets the link's interrupt through, below the tick.
pub fn enable<const N: u16>(nvic: &mut NVIC) {
    // SAFETY: its queue is in place, and no critical section is based on priorities.
    #[allow(
        unsafe_code,
        reason = "cortex-m has no safe way to enable an interrupt"
    )]
    unsafe {
        nvic.set_priority(Number::<N>, LINK_PRIORITY);
        NVIC::unmask(Number::<N>);
    }
}
