//! How much of its time the core sleeps, by SysTick's count.
use cortex_m::peripheral::SYST;

/// Counts of SysTick over which the share is taken: some tenths of a second.
const SPAN: u32 = 1 << 22;

/// Sleep so far.
pub struct Idle {
    asleep: u32,
    passed: u32,
    last: u32,
}

/// Counts from one value of SysTick, which counts down, to a later one within one period.
fn since(earlier: u32, later: u32, period: u32) -> u32 {
    if earlier >= later {
        earlier - later
    } else {
        earlier + period - later
    }
}

impl Idle {
    /// Begins to count.
    pub fn new() -> Self {
        Self {
            asleep: 0,
            passed: 0,
            last: SYST::get_current(),
        }
    }

    /// Sleeps until an interrupt is due. Interrupts are masked meanwhile, so that what they do does not count as sleep;
    /// the core wakes all the same and serves them on return. The share, in thousandths, each time a span is over.
    ///
    /// A round of the background that takes longer than a tick counts as shorter than it was: by whole ticks, none of
    /// them asleep.
    ///
    /// Asked with interrupts masked, `may` can keep it awake.
    pub fn sleep(&mut self, may: impl FnOnce() -> bool) -> Option<u16> {
        let period = SYST::get_reload() + 1;
        let woke = cortex_m::interrupt::free(|_| {
            let before = SYST::get_current();
            if may() {
                cortex_m::asm::wfi();
            }
            let woke = SYST::get_current();
            self.asleep += since(before, woke, period);
            self.passed += since(self.last, before, period) + since(before, woke, period);
            woke
        });
        self.last = woke;
        if self.passed < SPAN {
            return None;
        }
        let permille = self.asleep / (self.passed / 1000);
        (self.asleep, self.passed) = (0, 0);
        Some(permille.min(1000) as u16)
    }
}
