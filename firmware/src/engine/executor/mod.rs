//! The tick: one set-point for each axis, every time it is called.
//!
//! Timing contract: [`Executor::tick`] is called once per period from the highest-priority interrupt. It has no loop
//! whose length depends on data, no division, no `f64`, no allocation, and cannot panic. Phases are integers; one sine and
//! cosine serve position, correction and all linear terms, and each periodic error takes one more. What it runs was
//! prepared by the planner in the background and comes through an [`Inbox`] as a whole, so that a new table never
//! acts inside a segment.
//!
//! Longest ticks on a Cortex-M4F, in instructions (`giotto-hil ticks` counts them all and knows their bars, `--check` fails on them):
//!
//! | tick | steady | at most | bar |
//! |---|---|---|---|
//! | arc, β model (`arc`) | 128 | 185, in a ramp | 300 |
//! | arc with eight profile terms, two slides with play and friction pulses (`arc`) | 350 | 444, in a ramp in which they turn | 450 |
//! | arc with the dearest eight (`arc`) | | 576 | |
//! | helix (`curve`), the same with eight terms | | 292, 619 | |
//! | set-point of a stream ([`super::Stream`]) | 149 | 149 | 250 |
//! | arc of a six-joint arm, eight dear terms of its joints (`engine/arm`), at 1 kHz | 26,617 | 26,748 | 33,600: a fifth of the F405's clock |
//! | whole interrupt, helix with the dearest eight, each set-point recorded | | 992, in a ramp in which two slides turn at once | 1000 |
//!
//! | the same tick, a stop beginning in its ramp: once a run | | 2026 | 3125, what there is at 8 kHz on 25 MHz |
//! | the same, on its way to rest after that | | 1050 | 3125 |
//!
//! What kept them within their bars is registers: a part of the tick that has its own call (linear terms, sides, periodic errors)
//! pays five instructions for it and saves the dozens that put away and fetch again what does not fit beside the rest.
//!
//! A segment is begun in three ticks: taken, its sides, the offset that it starts with. In one they took 2441.
//!
//! Lines and helices run in `curve`, stops begin in `stop`, what is between motions is in `transitions`.
mod arc;
mod curve;
mod pause;
mod phase;
mod stop;
mod transitions;

use crate::engine::arm::Arm;
use crate::engine::descent::Descent;
use crate::engine::engage::Engage;
use crate::engine::guard::Guard;
use crate::engine::hysteresis::Sides;
use crate::engine::planned::{Law, Planned};
use crate::engine::ramp::{Clock, POLYNOMIAL};
use crate::engine::{Counters, Fault, Output, flag};
use giotto_shared::angle::SINCOS;

/// Where the next segment comes from: the receiving end of a lock-free queue.
pub trait Inbox {
    /// Moves the next segment, if there is one, to a place: it is large, and the interrupt's stack is not.
    fn take(&mut self, place: &mut Planned) -> bool;
}

impl<const N: usize> Inbox for heapless::spsc::Queue<Planned, N> {
    fn take(&mut self, place: &mut Planned) -> bool {
        self.dequeue().map(|next| *place = next).is_some()
    }
}

impl Inbox for heapless::spsc::Consumer<'_, Planned> {
    fn take(&mut self, place: &mut Planned) -> bool {
        self.dequeue().map(|next| *place = next).is_some()
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    /// Stands still, nothing in hand.
    Rest,
    /// Stands still, a segment taken in this tick: the sides of its slides are for the next …
    Taken,
    /// … and the offset that it starts with for the one after that.
    Sided,
    /// Stands still while the offset moves to what the segment in hand starts with.
    Settle,
    /// Stands still for a time.
    Dwell,
    /// Arc without profile terms at constant rate.
    ArcCruise,
    /// The same in a rising ramp.
    ArcRise,
    /// The same in a falling ramp.
    ArcFall,
    /// Arc with profile terms at constant rate.
    TermCruise,
    /// The same in a rising ramp.
    TermRise,
    /// The same in a falling ramp.
    TermFall,
    /// Any segment at constant rate.
    Cruise,
    /// Any segment in a rising ramp.
    Rise,
    /// Any segment in a falling ramp.
    Fall,
    /// An arc without profile terms, stopped.
    ArcStop,
    /// The same with profile terms.
    TermStop,
    /// Any segment, stopped.
    Stop,
}

/// The engine's fast half: what runs in the timer interrupt. In this order: large parts last.
#[repr(C)]
#[derive(Clone, Debug)]
pub struct Executor {
    mode: Mode,
    left: u32,
    /// Phase; in a ramp the running sum of the steps.
    phase: u64,
    clock: Clock,
    /// The law of the segment in its falling ramp.
    fall: Law,
    ramp: [i32; 4],
    sincos: [i32; 2],
    guard: Guard,
    engage: Engage,
    counters: Counters,
    /// Phase where the fall in hand ends.
    end: u64,
    /// Whole turns, for the rise of a helix.
    turns: i32,
    /// A stop: its way to rest, and whether it began in a falling ramp.
    descent: Descent,
    falls: bool,
    /// Programmed position where it stands or last stood.
    rest_nm: [i32; 3],
    /// Offset wanted there, before engagement, and what the next segment wants there.
    rest_offset_nm: [i32; 3],
    target_nm: [i32; 3],
    sides: Sides,
    /// Segments planned before the last stop or fault carry an older epoch and are thrown away.
    epoch: u8,
    /// On the way to a standstill that was asked for.
    halting: bool,
    /// Feed hold: nothing begins, and what runs comes to rest on its path …
    pause: bool,
    /// … is on its way there, to go on with so many ticks at constant rate …
    pausing: Option<u32>,
    /// … and stands there.
    held: bool,
    /// Where the segment in hand begins, or goes on: phase and whole turns.
    from: u64,
    from_turns: i32,
    fault: Option<Fault>,
    segment: Planned,
    arm: Arm,
}

impl Executor {
    /// Standing at a position, correction engaged or bypassed from the start.
    pub fn new(position_nm: [i32; 3], engage_ticks: u32, bypass: bool) -> Self {
        Self {
            mode: Mode::Rest,
            left: 0,
            phase: 0,
            clock: Clock::default(),
            segment: Planned::default(),
            fall: Law::default(),
            ramp: POLYNOMIAL,
            sincos: SINCOS,
            // Bounds of 0 take the careful way, which also minds the engagement.
            guard: Guard::new(0, [0; 3]),
            engage: Engage::new(engage_ticks, !bypass),
            counters: Counters::default(),
            end: 0,
            turns: 0,
            descent: Descent::default(),
            falls: false,
            rest_nm: position_nm,
            rest_offset_nm: [0; 3],
            target_nm: [0; 3],
            sides: Sides::default(),
            arm: Arm::new(),
            epoch: 0,
            halting: false,
            pause: false,
            pausing: None,
            held: false,
            from: 0,
            from_turns: 0,
            fault: None,
        }
    }

    /// Programmed position where the machine stands, or last stood, nm.
    pub const fn rest_nm(&self) -> [i32; 3] {
        self.rest_nm
    }

    /// Nothing in hand.
    pub fn idle(&self) -> bool {
        self.mode == Mode::Rest && !self.held
    }

    /// Moves, or is about to.
    pub fn busy(&self) -> bool {
        self.mode != Mode::Rest
    }

    /// Stands in a feed hold, a part of the segment in hand still to come.
    pub fn paused(&self) -> bool {
        self.mode == Mode::Rest && self.held
    }

    /// Epoch that a planned segment must carry to be run; grows with each stop and fault.
    pub const fn epoch(&self) -> u8 {
        self.epoch
    }

    /// Counts since start.
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Counts what has begun without a zone of the table.
    pub fn count_uncorrected(&mut self, uncorrected: bool) {
        let uncorrected = u32::from(uncorrected);
        self.counters.uncorrected = self.counters.uncorrected.wrapping_add(uncorrected);
    }

    /// Why nothing runs, if so.
    pub const fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// Declares the position while standing still. `false` (and no effect) while moving.
    pub fn set_position(&mut self, position_nm: [i32; 3]) -> bool {
        if self.idle() {
            self.rest_nm = position_nm;
            self.arm.stand(position_nm);
        }
        self.idle()
    }

    /// Disengages (`true`) or engages (`false`) the correction, without a step.
    pub fn set_bypass(&mut self, bypass: bool) {
        self.engage.set(!bypass);
        self.watch();
    }

    /// Whether the correction is disengaged or on its way to be.
    pub const fn bypass(&self) -> bool {
        !self.engage.is_on()
    }

    /// Whether the correction is on its way, to be engaged or disengaged.
    pub const fn blending(&self) -> bool {
        self.engage.blending()
    }

    /// The board saw that a tick came late or was lost: stops, and runs nothing more until [`Self::clear_fault`].
    pub fn overrun(&mut self) {
        self.counters.overruns = self.counters.overruns.wrapping_add(1);
        self.fault = Some(Fault::Overrun);
        self.stop();
    }

    /// Something went wrong at rest: nothing more runs until [`Self::clear_fault`], and what is open ends here.
    pub fn fail(&mut self, fault: Fault) {
        self.fault = Some(fault);
        (self.held, self.pausing) = (false, None);
        self.epoch = self.epoch.wrapping_add(1);
    }

    /// A stop was asked for and the machine still moves.
    pub fn stopping(&self) -> bool {
        self.halting && !self.idle()
    }

    /// Accepts segments again after a fault; `false` while still moving.
    pub fn clear_fault(&mut self) -> bool {
        if self.idle() {
            self.fault = None;
        }
        self.idle()
    }

    /// Makes all but so many of the constant-rate ticks in hand in one step: the same integers, one product.
    #[cfg(test)]
    pub(crate) fn skip_cruise(&mut self, but: u32) -> u32 {
        let skipped = self.left.saturating_sub(but);
        self.left -= skipped;
        self.phase = self
            .phase
            .wrapping_add(self.segment.timing.step.wrapping_mul(u64::from(skipped)));
        skipped
    }

    /// One tick. See the module for its contract.
    #[inline]
    pub fn tick(&mut self, inbox: &mut impl Inbox) -> Output {
        if self.mode == Mode::Rest {
            return self.rest(inbox);
        }
        self.busy_tick()
    }

    /// A tick with a segment in hand: the same code whatever the inbox is.
    #[inline(never)]
    fn busy_tick(&mut self) -> Output {
        match self.mode {
            Mode::ArcCruise => self.arc_cruise::<false>(),
            Mode::ArcRise => self.arc_ramp::<false, false>(),
            Mode::ArcFall => self.arc_ramp::<false, true>(),
            Mode::TermCruise => self.arc_cruise::<true>(),
            Mode::TermRise => self.arc_ramp::<true, false>(),
            Mode::TermFall => self.arc_ramp::<true, true>(),
            Mode::Cruise => self.cruise(),
            Mode::Rise => self.any_ramp(false),
            Mode::Fall => self.any_ramp(true),
            Mode::ArcStop => self.arc_stop::<false>(),
            Mode::TermStop => self.arc_stop::<true>(),
            Mode::Stop => self.any_stop(),
            Mode::Taken => self.begin_sides(),
            Mode::Sided => self.begin_settle(),
            Mode::Settle => self.settle(),
            Mode::Dwell => self.dwell(),
            Mode::Rest => self.finish(self.rest_nm, self.rest_offset_nm, 0),
        }
    }

    /// Engagement, bounds, and out: the quick way if it will do.
    #[inline(always)]
    fn out(&mut self, nominal: [i32; 3], wanted: [i32; 3], flags: u16) -> Output {
        if self.guard.pass_easily(wanted) {
            return Output::new(nominal, wanted, flags);
        }
        self.finish(nominal, wanted, flags)
    }

    /// Nothing passes easily while the correction is on its way in or out, or goes through the joints of an arm.
    #[inline(always)]
    fn watch(&mut self) {
        self.guard.watch(!self.engage.full() || self.arm.acts());
    }

    /// The joints of an arm, engagement, bounds, and out.
    #[inline(never)]
    fn finish(&mut self, nominal: [i32; 3], wanted: [i32; 3], flags: u16) -> Output {
        // At rest nobody has looked yet.
        if self.guard.pass_easily(wanted) {
            return Output::new(nominal, wanted, flags);
        }
        let mut wanted = wanted;
        if self.arm.acts() {
            for (wanted, joints) in wanted.iter_mut().zip(self.arm.tick(nominal)) {
                *wanted = wanted.wrapping_add(joints);
            }
        }
        let wanted = self.engage.apply(wanted);
        let (offset, verdict) = self.guard.pass(wanted);
        self.watch();
        let mut flags = flags;
        if verdict.offset_cut | verdict.slew_cut {
            self.counters.offset_cuts = self
                .counters
                .offset_cuts
                .wrapping_add(u32::from(verdict.offset_cut));
            self.counters.slew_cuts = self
                .counters
                .slew_cuts
                .wrapping_add(u32::from(verdict.slew_cut));
            flags |= flag::CUT;
        }
        Output::new(nominal, offset, flags)
    }
}
