//! Feed hold: the segment in hand comes to rest on its path with its own ramp, and goes on from there with the same ramp.
//!
//! The two ramps together take as far as one tick of constant rate for each tick of a ramp, to the unit of phase: what is left
//! of the constant rate after them ends where it was planned to. So the segment stays the one that was planned and proven.
use super::{Executor, Mode};
use crate::engine::{Output, flag};

impl Executor {
    /// Holds the feed (`true`) or lets it go on.
    pub fn set_pause(&mut self, pause: bool) {
        self.pause = pause;
        if pause {
            self.begin_pause();
        }
    }

    /// At constant rate, with enough of it left; otherwise the segment is finished, and the next one waits. A rising ramp
    /// asks again at its top.
    pub(super) fn begin_pause(&mut self) {
        let timing = self.segment.timing;
        let steady = matches!(self.mode, Mode::ArcCruise | Mode::TermCruise | Mode::Cruise);
        if !steady || self.left <= timing.ramp_ticks {
            return;
        }
        self.pausing = Some(self.left.wrapping_sub(timing.ramp_ticks));
        let distance = (timing.step >> 1).wrapping_mul(u64::from(timing.ramp_ticks));
        self.end = self.phase.wrapping_add(distance);
        self.begin_fall();
    }

    /// Stands, phase and turns at their exact values; whether that is a feed hold.
    pub(super) fn stands(&mut self) {
        match self.pausing.take() {
            Some(left) => {
                self.held = true;
                (self.from, self.from_turns) = (self.phase, self.turns);
                let timing = &mut self.segment.timing;
                let ramp = (timing.step >> 1).wrapping_mul(u64::from(timing.ramp_ticks));
                timing.up = self.from.wrapping_add(ramp);
                timing.cruise_ticks = left;
            }
            None => self.counters.segments = self.counters.segments.wrapping_add(1),
        }
    }

    /// A tick of a feed hold; the last one begins the ramp.
    #[inline(never)]
    pub(super) fn pause_tick(&mut self) -> Output {
        if !self.pause {
            self.held = false;
            self.begin_segment();
        }
        self.finish(self.rest_nm, self.rest_offset_nm, flag::SETTLING)
    }
}
