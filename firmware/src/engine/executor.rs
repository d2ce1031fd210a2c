//! The tick: one set-point for each axis, every time it is called.
//!
//! Timing contract: [`Executor::tick`] is called once per period from the highest-priority interrupt. It has no loop
//! whose length depends on data, no division, no `f64`, no allocation, and cannot panic; its longest path is counted
//! in instructions by `giotto-hil ticks`. What it runs was prepared by the planner in the background and comes
//! through an [`Inbox`] by value, so that a new table never acts inside a segment.
use super::engage::Engage;
use super::guard::Guard;
use super::planned::{Kind, Planned};
use super::ramp::{Clock, Shapes, shapes};
use super::{Counters, Fault, Output, flag};
use giotto_shared::angle::sincos;

/// Where the next segment comes from: the receiving end of a lock-free queue.
pub trait Inbox {
    /// The next segment, if there is one.
    fn take(&mut self) -> Option<Planned>;
}

impl<const N: usize> Inbox for heapless::spsc::Queue<Planned, N> {
    fn take(&mut self) -> Option<Planned> {
        self.dequeue()
    }
}

impl Inbox for heapless::spsc::Consumer<'_, Planned> {
    fn take(&mut self) -> Option<Planned> {
        self.dequeue()
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    /// Stands still, nothing in hand.
    Rest,
    /// Stands still while the offset moves to what the segment in hand starts with.
    Settle,
    /// Stands still for a time.
    Dwell,
    Rise,
    Cruise,
    Fall,
    /// Stopped while rising: the rising ramp runs on, a falling one is laid over it. Each has four continuous
    /// derivatives, so their sum has; it never runs backwards because the second is never ahead of the first.
    Both,
}

/// The engine's fast half: what runs in the timer interrupt.
#[derive(Clone, Debug)]
pub struct Executor {
    mode: Mode,
    left: u32,
    /// Phase; in a ramp the running sum of the steps, see [`Self::ramp_phase`].
    phase: u64,
    /// Whole turns, for the rise of a helix.
    turns: i32,
    /// Phase where the fall in hand ends.
    end: u64,
    clock: Clock,
    second: Clock,
    /// Ticks that the second ramp runs longer than the first.
    second_left: u32,
    segment: Planned,
    guard: Guard,
    nominal_nm: [i32; 3],
    /// Offset wanted at rest, before engagement.
    rest_nm: [i32; 3],
    engage: Engage,
    /// Segments planned before the last stop carry an older epoch and are thrown away.
    epoch: u8,
    stop: bool,
    fault: Option<Fault>,
    counters: Counters,
}

impl Executor {
    /// Standing at a position, correction engaged or bypassed from the start.
    pub fn new(nominal_nm: [i32; 3], engage_ticks: u32, bypass: bool) -> Self {
        Self {
            mode: Mode::Rest,
            left: 0,
            phase: 0,
            turns: 0,
            end: 0,
            clock: Clock::default(),
            second: Clock::default(),
            second_left: 0,
            segment: Planned::default(),
            guard: Guard::new(0, 0),
            nominal_nm,
            rest_nm: [0; 3],
            engage: Engage::new(engage_ticks, !bypass),
            epoch: 0,
            stop: false,
            fault: None,
            counters: Counters::default(),
        }
    }

    /// Programmed position of the last tick, nm.
    pub const fn nominal_nm(&self) -> [i32; 3] {
        self.nominal_nm
    }

    /// Nothing in hand.
    pub fn idle(&self) -> bool {
        self.mode == Mode::Rest
    }

    /// Epoch that a planned segment must carry to be run; grows with each stop.
    pub const fn epoch(&self) -> u8 {
        self.epoch
    }

    /// Counts since start.
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Why nothing runs, if so.
    pub const fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// Declares the position while standing still. `false` (and no effect) while moving.
    pub fn set_position(&mut self, nominal_nm: [i32; 3]) -> bool {
        let idle = self.idle();
        if idle {
            self.nominal_nm = nominal_nm;
        }
        idle
    }

    /// Stops within the limits, beginning with the next tick; what is queued is thrown away.
    pub fn stop(&mut self) {
        self.stop = true;
    }

    /// Disengages (`true`) or engages (`false`) the correction, without a step.
    pub fn set_bypass(&mut self, bypass: bool) {
        self.engage.set(!bypass);
    }

    /// The board saw that a tick came late or was lost: stops, and runs nothing more until [`Self::clear_fault`].
    pub fn overrun(&mut self) {
        self.counters.overruns = self.counters.overruns.wrapping_add(1);
        self.fault = Some(Fault::Overrun);
        self.stop = true;
    }

    /// Whether the correction is disengaged or on its way to be.
    pub const fn bypass(&self) -> bool {
        !self.engage.is_on()
    }

    /// A stop was asked for and the machine still moves.
    pub fn stopping(&self) -> bool {
        self.stop || (!self.idle() && self.segment.epoch != self.epoch)
    }

    /// Accepts segments again after a fault; `false` while still moving.
    pub fn clear_fault(&mut self) -> bool {
        if self.idle() {
            self.fault = None;
        }
        self.idle()
    }

    /// One tick. See the module for its contract.
    #[inline]
    pub fn tick(&mut self, inbox: &mut impl Inbox) -> Output {
        self.counters.ticks = self.counters.ticks.wrapping_add(1);
        if self.stop {
            self.begin_stop();
        }
        match self.mode {
            Mode::Cruise => self.cruise(),
            Mode::Rise => self.rise(),
            Mode::Fall => self.fall(),
            Mode::Both => self.both(),
            Mode::Settle => self.settle(),
            Mode::Dwell => self.dwell(),
            Mode::Rest => self.rest(inbox),
        }
    }

    #[inline(always)]
    fn cruise(&mut self) -> Output {
        self.advance(self.segment.timing.step);
        self.left = self.left.wrapping_sub(1);
        let phase = self.phase;
        if self.left == 0 {
            self.begin_fall(self.segment.timing.end);
        }
        self.steady_at(phase, flag::MOVING | flag::CRUISE)
    }

    #[inline(always)]
    fn rise(&mut self) -> Output {
        self.left = self.left.wrapping_sub(1);
        let shape = shapes(self.clock.advance());
        if self.left == 0 {
            return self.top();
        }
        self.ramp_at(shape, 0)
    }

    #[inline(always)]
    fn fall(&mut self) -> Output {
        self.left = self.left.wrapping_sub(1);
        let shape = shapes(self.clock.advance());
        if self.left == 0 {
            return self.standstill();
        }
        self.ramp_at(shape, -1)
    }

    #[inline(never)]
    fn both(&mut self) -> Output {
        self.left = self.left.wrapping_sub(1);
        let up = shapes(self.clock.advance());
        let down = shapes(self.second.advance());
        if self.left == 0 {
            // The rising ramp is over: what remains is the falling one alone.
            self.clock = self.second.mirrored();
            self.left = self.second_left;
            self.mode = Mode::Fall;
            return self.ramp_at(shapes(self.clock.here()), -1);
        }
        self.ramp_at(up.minus(down), 0)
    }

    /// End of a rising ramp: the phase is set to its exact value.
    #[inline(never)]
    fn top(&mut self) -> Output {
        let phase = self.segment.timing.up;
        self.set_phase(phase);
        self.left = self.segment.timing.cruise_ticks;
        self.mode = Mode::Cruise;
        if self.left == 0 {
            self.begin_fall(self.segment.timing.end);
        }
        self.steady_at(phase, flag::MOVING)
    }

    /// End of a falling ramp: exactly where it was planned to end.
    #[inline(never)]
    fn standstill(&mut self) -> Output {
        self.set_phase(self.end);
        self.mode = Mode::Rest;
        let curve = self.segment.curve;
        let (c, s) = curve.weights(self.phase_q32());
        self.nominal_nm = self.place(c, s, self.phase_q32());
        if self.end == self.segment.timing.end {
            self.nominal_nm = self.segment.end_nm;
        }
        self.rest_nm = self.segment.rest_offset(c, s);
        self.counters.segments = self.counters.segments.wrapping_add(1);
        self.finish(self.nominal_nm, self.rest_nm, flag::MOVING)
    }

    fn begin_fall(&mut self, end: u64) {
        let timing = &self.segment.timing;
        self.mode = Mode::Fall;
        self.left = timing.ramp_ticks;
        self.clock = Clock::falling(timing.clock_step);
        self.end = end;
        // So that the sum of steps less half the last one is the phase.
        self.advance(timing.step >> 1);
    }

    #[inline(never)]
    fn begin_stop(&mut self) {
        self.stop = false;
        self.epoch = self.epoch.wrapping_add(1);
        self.counters.stops = self.counters.stops.wrapping_add(1);
        let timing = &self.segment.timing;
        match self.mode {
            Mode::Cruise => {
                let distance = (timing.step >> 1).wrapping_mul(u64::from(timing.ramp_ticks));
                self.begin_fall(self.phase.wrapping_add(distance));
            }
            Mode::Rise => {
                // ∫ of the two ramps together: one step for each tick between their starts.
                let apart = timing.ramp_ticks.wrapping_sub(self.left);
                self.end = timing.start.wrapping_add(timing.step.wrapping_mul(u64::from(apart)));
                self.second = Clock::rising(timing.clock_step);
                self.second_left = apart;
                self.mode = if apart == 0 { Mode::Rest } else { Mode::Both };
            }
            // At the end of the settling or dwelling in hand the segment is seen to be of an old epoch.
            Mode::Rest | Mode::Settle | Mode::Dwell | Mode::Fall | Mode::Both => {}
        }
    }

    #[inline(never)]
    fn rest(&mut self, inbox: &mut impl Inbox) -> Output {
        if let Some(next) = inbox.take() {
            if next.epoch != self.epoch || self.fault.is_some() {
                self.counters.dropped = self.counters.dropped.wrapping_add(1);
            } else if next.start_nm != self.nominal_nm {
                self.counters.dropped = self.counters.dropped.wrapping_add(1);
                self.fault = Some(Fault::Discontinuity);
            } else {
                self.segment = next;
                self.guard.set(next.offset_nm, next.slew_nm);
                let uncorrected = u32::from(!next.corrected);
                self.counters.uncorrected = self.counters.uncorrected.wrapping_add(uncorrected);
                self.mode = Mode::Settle;
                self.left = next.settle_ticks;
                self.clock = Clock::rising(next.settle_step);
                return self.finish(self.nominal_nm, self.rest_nm, flag::SETTLING);
            }
        }
        self.finish(self.nominal_nm, self.rest_nm, 0)
    }

    /// Moves the offset from what it is to what the segment starts with, then lets the segment begin.
    #[inline(never)]
    fn settle(&mut self) -> Output {
        let target = self.segment.start_offset_nm;
        self.left = self.left.wrapping_sub(1);
        let share = shapes(self.clock.advance()).s_q32;
        if self.left == 0 || self.rest_nm == target {
            self.rest_nm = target;
            self.begin_segment();
            return self.finish(self.nominal_nm, target, flag::SETTLING);
        }
        let mut offset = self.rest_nm;
        for (o, t) in offset.iter_mut().zip(target) {
            let way = (i64::from(t) - i64::from(*o)).wrapping_mul(i64::from(share));
            *o = o.wrapping_add((way >> 32) as i32);
        }
        self.finish(self.nominal_nm, offset, flag::SETTLING)
    }

    fn begin_segment(&mut self) {
        let timing = &self.segment.timing;
        if self.segment.epoch != self.epoch {
            self.mode = Mode::Rest;
        } else if self.segment.curve.kind == Kind::Dwell {
            self.mode = Mode::Dwell;
            self.left = timing.cruise_ticks;
        } else {
            self.mode = Mode::Rise;
            self.left = timing.ramp_ticks;
            self.clock = Clock::rising(timing.clock_step);
            self.phase = timing.start;
            self.turns = 0;
            self.end = timing.end;
        }
    }

    #[inline(never)]
    fn dwell(&mut self) -> Output {
        self.left = self.left.wrapping_sub(1);
        if self.left == 0 || self.segment.epoch != self.epoch {
            self.mode = Mode::Rest;
            self.counters.segments = self.counters.segments.wrapping_add(1);
        }
        self.finish(self.nominal_nm, self.rest_nm, 0)
    }

    #[inline(always)]
    fn advance(&mut self, by: u64) {
        let (phase, wrapped) = self.phase.overflowing_add(by);
        self.phase = phase;
        self.turns = self.turns.wrapping_add(i32::from(wrapped));
    }

    /// Replaces the phase by an exact value close to it, whole turns included.
    fn set_phase(&mut self, exact: u64) {
        let change = exact.wrapping_sub(self.phase) as i64;
        let before = self.phase;
        self.phase = exact;
        let wrapped = i32::from(change > 0 && exact < before) - i32::from(change < 0 && exact > before);
        self.turns = self.turns.wrapping_add(wrapped);
    }

    #[inline(always)]
    fn phase_q32(&self) -> u32 {
        (self.phase >> 32) as u32
    }

    /// Position at the weights c, s and the phase (whole turns from `self.turns`).
    #[inline(always)]
    fn place(&self, c: i32, s: i32, phase_q32: u32) -> [i32; 3] {
        let curve = &self.segment.curve;
        let mut at = curve.at(c, s);
        if curve.kind == Kind::Helix {
            let start = (self.segment.timing.start >> 32) as u32;
            // A ramp's sum of steps runs up to one step ahead of the phase and may have wrapped before it.
            let ahead = self.phase_q32() < phase_q32 && phase_q32.wrapping_sub(self.phase_q32()) > 1 << 31;
            let turns = self.turns.wrapping_sub(i32::from(ahead));
            let risen = curve.risen(turns, phase_q32);
            let before = curve.risen(0, start);
            for ((p, r), b) in at.iter_mut().zip(risen).zip(before) {
                *p = p.wrapping_add(r).wrapping_sub(b);
            }
        }
        at
    }

    #[inline(always)]
    fn steady_at(&mut self, phase: u64, flags: u16) -> Output {
        let phase_q32 = (phase >> 32) as u32;
        let (c, s) = if self.segment.curve.kind == Kind::Arc {
            sincos(phase_q32)
        } else {
            self.segment.curve.weights(phase_q32)
        };
        let nominal = self.place(c, s, phase_q32);
        let offset = self.segment.steady.at(c, s);
        self.finish(nominal, offset, flags)
    }

    /// One tick of a ramp. `falling` is −1 where the ramp runs backwards in time.
    #[inline(always)]
    fn ramp_at(&mut self, shape: Shapes, falling: i32) -> Output {
        let timing = &self.segment.timing;
        let step = scaled(timing.step, shape.s_q32);
        let end_term = timing.end_term(shape.w4_q30);
        self.advance(step);
        // ∫ of the rate is the trapezoidal sum less T²/12 of its derivative (Euler–Maclaurin); the next term is
        // below 1e-8 of a step from 32 ticks up.
        let phase_q32 = self
            .phase_q32()
            .wrapping_sub((step >> 33) as u32)
            .wrapping_sub((end_term ^ falling).wrapping_sub(falling) as u32);
        let (c, s) = if self.segment.curve.kind == Kind::Arc {
            sincos(phase_q32)
        } else {
            self.segment.curve.weights(phase_q32)
        };
        let nominal = self.place(c, s, phase_q32);
        let offset = if self.segment.curve.kind == Kind::Line {
            self.segment.law.on_line(&self.segment.curve.v_nm, shape, falling)
        } else {
            self.segment.law.on_arc(&self.segment.curve, shape, falling, c, s)
        };
        self.finish(nominal, offset, flag::MOVING)
    }

    /// Engagement, bounds, and out.
    #[inline(always)]
    fn finish(&mut self, nominal: [i32; 3], wanted: [i32; 3], flags: u16) -> Output {
        self.nominal_nm = nominal;
        let wanted = self.engage.apply(wanted);
        let (offset, verdict) = self.guard.pass(wanted);
        let mut flags = flags;
        if verdict.offset_cut | verdict.slew_cut {
            self.counters.offset_cuts = self.counters.offset_cuts.wrapping_add(u32::from(verdict.offset_cut));
            self.counters.slew_cuts = self.counters.slew_cuts.wrapping_add(u32::from(verdict.slew_cut));
            flags |= flag::CUT;
        }
        let ([nx, ny, nz], [ox, oy, oz]) = (nominal, offset);
        Output {
            nominal_nm: nominal,
            corrected_nm: [nx.wrapping_add(ox), ny.wrapping_add(oy), nz.wrapping_add(oz)],
            flags,
        }
    }
}

/// step·share, share in Q32.
#[inline(always)]
fn scaled(step: u64, share_q32: u32) -> u64 {
    let share = u64::from(share_q32);
    let low = (u64::from(step as u32).wrapping_mul(share)) >> 32;
    (step >> 32).wrapping_mul(share).wrapping_add(low)
}
