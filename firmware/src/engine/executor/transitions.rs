//! Ticks between motions: the top of a ramp, standstill, rest, settling, dwelling.
use super::{Executor, Inbox, Mode};
use crate::engine::planned::Kind;
use crate::engine::ramp::{Clock, shapes};
use crate::engine::{Fault, Output, flag};

impl Executor {
    /// Top of a rising ramp: the phase is set to its exact value, one step early for the cruise to make.
    #[inline(never)]
    pub(super) fn top(&mut self) -> Output {
        self.set_phase(self.segment.timing.up);
        let (before, wrapped) = self.phase.overflowing_sub(self.segment.timing.step);
        (self.phase, self.turns) = (before, self.turns.wrapping_sub(i32::from(wrapped)));
        self.left = self.segment.timing.cruise_ticks.wrapping_add(1);
        let mut out = match self.mode {
            Mode::ArcRise => {
                self.mode = Mode::ArcCruise;
                self.arc_cruise::<false>()
            }
            Mode::TermRise => {
                self.mode = Mode::TermCruise;
                self.arc_cruise::<true>()
            }
            _ => {
                self.mode = Mode::Cruise;
                self.cruise()
            }
        };
        if self.pause {
            self.begin_pause();
        }
        // The last tick of the ramp is not yet one at constant feed.
        out.flags &= !flag::CRUISE;
        out
    }

    #[inline(never)]
    pub(super) fn standstill(&mut self) -> Output {
        self.set_phase(self.end);
        self.stands();
        self.mode = Mode::Rest;
        let phase_q32 = (self.phase >> 32) as u32;
        let (c, s) = self.weights(phase_q32);
        self.rest_nm = self.place([c, s], phase_q32, &self.risen(phase_q32));
        if self.end == self.segment.timing.end && !self.held {
            self.rest_nm = self.segment.end_nm;
        }
        self.rest_offset_nm = self.standing_offset(c, s);
        self.finish(self.rest_nm, self.rest_offset_nm, flag::MOVING)
    }

    #[inline(always)]
    pub(super) fn begin_fall(&mut self) {
        self.mode = match self.mode {
            Mode::ArcCruise => Mode::ArcFall,
            Mode::TermCruise => Mode::TermFall,
            _ => Mode::Fall,
        };
        self.clock = Clock::falling(self.segment.timing.clock_step);
        // So that the sum of steps less half the last one is the phase.
        self.advance(self.segment.timing.step >> 1);
    }

    #[inline(never)]
    pub(super) fn rest(&mut self, inbox: &mut impl Inbox) -> Output {
        self.halting = false;
        if self.held {
            return self.pause_tick();
        }
        if self.pause {
            return self.finish(self.rest_nm, self.rest_offset_nm, 0);
        }
        // At rest nothing else needs the segment in hand.
        if inbox.take(&mut self.segment) {
            if self.segment.epoch != self.epoch || self.fault.is_some() {
                self.counters.dropped = self.counters.dropped.wrapping_add(1);
            } else if !same(self.segment.start_nm, self.rest_nm) {
                self.counters.dropped = self.counters.dropped.wrapping_add(1);
                self.fail(Fault::Discontinuity);
            } else {
                self.mode = Mode::Taken;
                return self.finish(self.rest_nm, self.rest_offset_nm, flag::SETTLING);
            }
        }
        self.finish(self.rest_nm, self.rest_offset_nm, 0)
    }

    /// The tick after a segment was taken: in one with that and with what follows it would be the longest of all.
    #[inline(never)]
    pub(super) fn begin_sides(&mut self) -> Output {
        self.mode = Mode::Sided;
        self.guard.set(self.segment.offset_nm, self.segment.slew_nm);
        if self.segment.kind != Kind::Dwell {
            self.arm.begin(&self.segment.arm, self.rest_nm);
        }
        self.watch();
        let uncorrected = u32::from(!self.segment.corrected);
        self.counters.uncorrected = self.counters.uncorrected.wrapping_add(uncorrected);
        self.fall = self.segment.rise.turned_round();
        if self.segment.extended && self.segment.kind != Kind::Dwell {
            let (c, s) = self.weights((self.segment.timing.start >> 32) as u32);
            let extra = &self.segment.extra;
            self.sides.begin(extra, extra.ahead_at(c, s));
        }
        self.finish(self.rest_nm, self.rest_offset_nm, flag::SETTLING)
    }

    #[inline(never)]
    pub(super) fn begin_settle(&mut self) -> Output {
        self.mode = Mode::Settle;
        self.clock = Clock::rising(self.segment.settle_step);
        self.target_nm = match self.segment.kind {
            Kind::Clear => [0; 3],
            Kind::Dwell => self.rest_offset_nm,
            Kind::Line | Kind::Arc | Kind::Helix => {
                let (c, s) = self.weights((self.segment.timing.start >> 32) as u32);
                self.standing_offset(c, s)
            }
        };
        (self.from, self.from_turns) = (self.segment.timing.start, 0);
        self.finish(self.rest_nm, self.rest_offset_nm, flag::SETTLING)
    }

    /// Moves the offset from what it is to what the segment starts with, then lets the segment begin.
    #[inline(never)]
    pub(super) fn settle(&mut self) -> Output {
        let target = self.target_nm;
        let there = same(self.rest_offset_nm, target);
        let (x, end) = if there { (0, true) } else { self.clock.rise() };
        let share = shapes(&self.ramp, x).s_q31;
        if end {
            self.rest_offset_nm = target;
            // So does what the joints of an arm ask for.
            if !self.arm.fading() {
                self.begin_segment();
            }
            return self.finish(self.rest_nm, target, flag::SETTLING);
        }
        let mut offset = self.rest_offset_nm;
        for (o, t) in offset.iter_mut().zip(target) {
            let way = i64::from(t)
                .wrapping_sub(i64::from(*o))
                .wrapping_mul(i64::from(share));
            *o = o.wrapping_add((way >> 31) as i32);
        }
        self.finish(self.rest_nm, offset, flag::SETTLING)
    }

    pub(super) fn begin_segment(&mut self) {
        let timing = self.segment.timing;
        self.left = timing.cruise_ticks;
        self.mode = match self.segment.kind {
            _ if self.segment.epoch != self.epoch => Mode::Rest,
            Kind::Dwell | Kind::Clear => Mode::Dwell,
            Kind::Arc if self.segment.extended => Mode::TermRise,
            Kind::Arc => Mode::ArcRise,
            Kind::Line | Kind::Helix => Mode::Rise,
        };
        self.clock = Clock::rising(timing.clock_step);
        (self.phase, self.turns) = (self.from, self.from_turns);
        self.end = timing.end;
    }

    #[inline(never)]
    pub(super) fn dwell(&mut self) -> Output {
        self.left = self.left.wrapping_sub(1);
        if self.left == 0 || self.segment.epoch != self.epoch {
            self.mode = Mode::Rest;
            self.counters.segments = self.counters.segments.wrapping_add(1);
        }
        self.finish(self.rest_nm, self.rest_offset_nm, 0)
    }
}

/// Whether two places are one. Arrays compared as such are a call of memcmp, a hundred instructions.
#[inline(always)]
const fn same([ax, ay, az]: [i32; 3], [bx, by, bz]: [i32; 3]) -> bool {
    (ax ^ bx) | (ay ^ by) | (az ^ bz) == 0
}
