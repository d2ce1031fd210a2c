//! How much of the correction is engaged: all, none, or on the way without a step.
use super::ramp::{Clock, POLYNOMIAL, clock_step, shapes};

/// Share of the correction that goes out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Engage {
    /// All of it, and no change under way.
    full: bool,
    /// Q31.
    share_q31: i32,
    /// What was asked for last.
    wanted: bool,
    /// Where the blend in hand leads, or where it led.
    heading: bool,
    blending: bool,
    ticks: u32,
    clock: Clock,
}

impl Engage {
    /// Settled on or off.
    pub(crate) fn new(ticks: u32, on: bool) -> Self {
        let share_q31 = if on { i32::MAX } else { 0 };
        Self {
            full: on,
            share_q31,
            wanted: on,
            heading: on,
            blending: false,
            ticks,
            clock: Clock::default(),
        }
    }

    /// Whether it is, or is to be, on.
    pub(crate) const fn is_on(&self) -> bool {
        self.wanted
    }

    /// All of the correction goes out, and no change is under way.
    #[inline(always)]
    pub(crate) const fn full(&self) -> bool {
        self.full
    }

    /// A change is under way.
    pub(crate) const fn blending(&self) -> bool {
        self.blending
    }

    /// Asks for on or off. A blend under way is finished first: turning it round would be a step in velocity.
    pub(crate) fn set(&mut self, on: bool) {
        self.wanted = on;
        if !self.blending {
            self.begin();
        }
    }

    fn begin(&mut self) {
        if self.heading != self.wanted {
            self.heading = self.wanted;
            let step = clock_step(self.ticks);
            self.clock = if self.heading {
                Clock::rising(step)
            } else {
                Clock::falling(step)
            };
            self.blending = true;
            self.full = false;
        }
    }

    /// The share of the offset that goes out this tick.
    pub(crate) fn apply(&mut self, offset: [i32; 3]) -> [i32; 3] {
        if self.full {
            return offset;
        }
        if self.blending {
            let (x, end) = if self.heading {
                self.clock.rise()
            } else {
                self.clock.fall()
            };
            self.share_q31 = match (end, self.heading) {
                (true, true) => i32::MAX,
                (true, false) => 0,
                _ => shapes(&POLYNOMIAL, x).s_q31,
            };
            if end {
                self.full = self.heading;
                self.blending = false;
                self.begin();
            }
            if self.full {
                return offset;
            }
        }
        let share = i64::from(self.share_q31);
        offset.map(|o| (i64::from(o).wrapping_mul(share) >> 31) as i32)
    }
}
