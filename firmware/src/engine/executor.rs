//! The tick: one set-point for each axis, every time it is called.
//!
//! Timing contract: [`Executor::tick`] is called once per period from the highest-priority interrupt. It has no loop
//! whose length depends on data, no division, no `f64`, no allocation, and cannot panic; its longest path is counted
//! in instructions by `giotto-hil ticks`. What it runs was prepared by the planner in the background and comes
//! through an [`Inbox`] by value, so that a new table never acts inside a segment.
use super::engage::Engage;
use super::extra::Sides;
use super::guard::Guard;
use super::planned::{Kind, Planned, turn};
use super::ramp::{Clock, POLYNOMIAL, Shapes, shapes};
use super::{Counters, Fault, Output, flag};
use giotto_shared::angle::{SINCOS, sincos, sincos_with};
use giotto_shared::fixed::mulh;

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
    /// Arc without profile terms at constant rate, its change of offset proven by the planner.
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
    /// Stopped while rising: the rising ramp runs on, a falling one is laid over it. Each has four continuous
    /// derivatives, so their sum has; it never runs backwards because the second is never ahead of the first.
    Both,
}

/// The engine's fast half: what runs in the timer interrupt.
#[derive(Clone, Debug)]
pub struct Executor {
    mode: Mode,
    left: u32,
    /// Phase; in a ramp the running sum of the steps.
    phase: u64,
    clock: Clock,
    segment: Planned,
    ramp: [i32; 4],
    sincos: [i32; 2],
    guard: Guard,
    engage: Engage,
    counters: Counters,
    /// Phase where the fall in hand ends.
    end: u64,
    /// Whole turns, for the rise of a helix.
    turns: i32,
    second: Clock,
    /// Programmed position where it stands or last stood.
    rest_nm: [i32; 3],
    /// Offset wanted there, before engagement, and what the next segment wants there.
    rest_offset_nm: [i32; 3],
    target_nm: [i32; 3],
    sides: Sides,
    /// Segments planned before the last stop carry an older epoch and are thrown away.
    epoch: u8,
    /// On the way to a standstill that was asked for.
    halting: bool,
    fault: Option<Fault>,
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
            ramp: POLYNOMIAL,
            sincos: SINCOS,
            // Bounds of 0 take the careful way, which also minds the engagement.
            guard: Guard::new(0, 0),
            engage: Engage::new(engage_ticks, !bypass),
            counters: Counters::default(),
            end: 0,
            turns: 0,
            second: Clock::default(),
            rest_nm: position_nm,
            rest_offset_nm: [0; 3],
            target_nm: [0; 3],
            sides: Sides::default(),
            epoch: 0,
            halting: false,
            fault: None,
        }
    }

    /// Programmed position where the machine stands, or last stood, nm.
    pub const fn rest_nm(&self) -> [i32; 3] {
        self.rest_nm
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
    pub fn set_position(&mut self, position_nm: [i32; 3]) -> bool {
        if self.idle() {
            self.rest_nm = position_nm;
        }
        self.idle()
    }

    /// Disengages (`true`) or engages (`false`) the correction, without a step.
    pub fn set_bypass(&mut self, bypass: bool) {
        self.engage.set(!bypass);
        self.guard.watch(!self.engage.full());
    }

    /// Whether the correction is disengaged or on its way to be.
    pub const fn bypass(&self) -> bool {
        !self.engage.is_on()
    }

    /// The board saw that a tick came late or was lost: stops, and runs nothing more until [`Self::clear_fault`].
    pub fn overrun(&mut self) {
        self.counters.overruns = self.counters.overruns.wrapping_add(1);
        self.fault = Some(Fault::Overrun);
        self.stop();
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

    /// Stops within the limits, beginning with the next tick; what is queued is thrown away.
    pub fn stop(&mut self) {
        if self.stopping() {
            return;
        }
        self.halting = true;
        self.epoch = self.epoch.wrapping_add(1);
        self.counters.stops = self.counters.stops.wrapping_add(1);
        let timing = &self.segment.timing;
        match self.mode {
            Mode::ArcCruise | Mode::TermCruise | Mode::Cruise => {
                let distance = (timing.step >> 1).wrapping_mul(u64::from(timing.ramp_ticks));
                self.end = self.phase.wrapping_add(distance);
                self.begin_fall();
            }
            Mode::ArcRise | Mode::TermRise | Mode::Rise => {
                // ∫ of the two ramps together: one step for each tick between their starts.
                let apart = self.clock.elapsed();
                self.end = timing.start.wrapping_add(timing.step.wrapping_mul(u64::from(apart)));
                self.second = Clock::rising(timing.clock_step);
                self.mode = if apart == 0 { Mode::Rest } else { Mode::Both };
            }
            // At the end of a settling or dwelling in hand the segment is seen to be of an old epoch.
            _ => {}
        }
    }

    /// Makes all but so many of the constant-rate ticks in hand in one step: the same integers, one product.
    #[cfg(test)]
    pub(crate) fn skip_cruise(&mut self, but: u32) -> u32 {
        let skipped = self.left.saturating_sub(but);
        self.left -= skipped;
        self.phase = self.phase.wrapping_add(self.segment.timing.step.wrapping_mul(u64::from(skipped)));
        skipped
    }

    /// One tick. See the module for its contract.
    #[inline]
    pub fn tick(&mut self, inbox: &mut impl Inbox) -> Output {
        match self.mode {
            Mode::ArcCruise => self.arc_cruise(),
            Mode::ArcRise => self.arc_ramp::<false>(),
            Mode::ArcFall => self.arc_ramp::<true>(),
            Mode::TermCruise => self.term_cruise(),
            Mode::TermRise => self.term_ramp::<false>(),
            Mode::TermFall => self.term_ramp::<true>(),
            Mode::Cruise => self.cruise(),
            Mode::Rise => self.any_ramp(false),
            Mode::Fall => self.any_ramp(true),
            Mode::Both => self.both(),
            Mode::Settle => self.settle(),
            Mode::Dwell => self.dwell(),
            Mode::Rest => self.rest(inbox),
        }
    }

    #[inline(always)]
    fn arc_cruise(&mut self) -> Output {
        let phase = self.phase.wrapping_add(self.segment.timing.step);
        self.phase = phase;
        self.left = self.left.wrapping_sub(1);
        if self.left == 0 {
            self.begin_fall();
        }
        let (c, s) = sincos_with(self.sincos, (phase >> 32) as u32);
        let [x, y, z] = &self.segment.axes;
        let wanted = [x.steady(c, s), y.steady(c, s), z.steady(c, s)];
        self.arc_out(c, s, wanted, flag::MOVING | flag::CRUISE)
    }

    /// The offset first, the position last: so the tick needs the fewest registers. The rare case is a call with
    /// scalar arguments: arrays would pass through memory in every tick.
    #[inline(always)]
    fn arc_out(&mut self, c: i32, s: i32, wanted: [i32; 3], flags: u16) -> Output {
        let [wx, wy, wz] = wanted;
        if !self.guard.small([wx, wy, wz]) {
            return self.arc_out_with_care(c, s, wx, wy, wz, flags);
        }
        let [x, y, z] = &self.segment.axes;
        Output::new([x.on_arc(c, s), y.on_arc(c, s), z.on_arc(c, s)], [wx, wy, wz], flags)
    }

    #[inline(never)]
    fn arc_out_with_care(&mut self, c: i32, s: i32, wx: i32, wy: i32, wz: i32, flags: u16) -> Output {
        let axes = &self.segment.axes;
        let nominal = [axes[0].on_arc(c, s), axes[1].on_arc(c, s), axes[2].on_arc(c, s)];
        self.finish(nominal, [wx, wy, wz], flags)
    }

    #[inline(always)]
    fn arc_ramp<const FALLING: bool>(&mut self) -> Output {
        let (x, end) = if FALLING { self.clock.fall() } else { self.clock.rise() };
        if end {
            return if FALLING { self.standstill() } else { self.top() };
        }
        let shape = shapes(&self.ramp, x);
        let step = scaled(self.segment.timing.step_q1, shape.s_q31);
        self.phase = self.phase.wrapping_add(step);
        core::sync::atomic::compiler_fence(core::sync::atomic::Ordering::AcqRel);
        let law = if FALLING { &self.segment.fall } else { &self.segment.rise };
        let phase_q32 = ramp_phase(self.phase, step, law.end_term(&shape));
        let (radial, tangential) = law.gain(&shape);
        core::sync::atomic::compiler_fence(core::sync::atomic::Ordering::AcqRel);
        let (c, s) = sincos_with(self.sincos, phase_q32);
        let (re, im) = turn(radial, tangential, c, s);
        let [x, y, z] = &self.segment.axes;
        let [nx, ny, nz] = [x.on_arc(c, s), y.on_arc(c, s), z.on_arc(c, s)];
        let [wx, wy, wz] = [x.turned(re, im), y.turned(re, im), z.turned(re, im)];
        if !self.guard.small([wx, wy, wz]) {
            return self.arc_out_with_care(c, s, wx, wy, wz, flag::MOVING);
        }
        Output::new([nx, ny, nz], [wx, wy, wz], flag::MOVING)
    }

    #[inline(never)]
    fn term_cruise(&mut self) -> Output {
        let phase = self.phase.wrapping_add(self.segment.timing.step);
        self.phase = phase;
        let (c, s) = sincos_with(self.sincos, (phase >> 32) as u32);
        let [x, y, z] = &self.segment.axes;
        let nominal = [x.on_arc(c, s), y.on_arc(c, s), z.on_arc(c, s)];
        let wanted = [x.steady(c, s), y.steady(c, s), z.steady(c, s)];
        let around = ([x.turned(c, s), y.turned(c, s)], self.segment.extra.ahead_at(c, s));
        self.left = self.left.wrapping_sub(1);
        if self.left == 0 {
            self.begin_fall();
        }
        self.term_out(nominal, wanted, around, flag::MOVING | flag::CRUISE)
    }

    #[inline(never)]
    fn term_ramp<const FALLING: bool>(&mut self) -> Output {
        let (x, end) = if FALLING { self.clock.fall() } else { self.clock.rise() };
        if end {
            return if FALLING { self.standstill() } else { self.top() };
        }
        let shape = shapes(&self.ramp, x);
        let step = scaled(self.segment.timing.step_q1, shape.s_q31);
        self.phase = self.phase.wrapping_add(step);
        core::sync::atomic::compiler_fence(core::sync::atomic::Ordering::AcqRel);
        let law = if FALLING { &self.segment.fall } else { &self.segment.rise };
        let phase_q32 = ramp_phase(self.phase, step, law.end_term(&shape));
        let (radial, tangential) = law.gain(&shape);
        let (c, s) = sincos_with(self.sincos, phase_q32);
        let (re, im) = turn(radial, tangential, c, s);
        let [x, y, z] = &self.segment.axes;
        let nominal = [x.on_arc(c, s), y.on_arc(c, s), z.on_arc(c, s)];
        let around = ([x.turned(c, s), y.turned(c, s)], self.segment.extra.ahead_at(c, s));
        let turning = if FALLING { shape.w4_q31.wrapping_neg() } else { shape.w4_q31 };
        let [lx, ly, lz] = &self.segment.extra.linear;
        let rate = shape.s_q31;
        let rate2 = mulh(rate, rate).wrapping_mul(2);
        let wanted = [
            x.turned(re, im).wrapping_add(lx.on_arc(rate, rate2, turning, c, s)),
            y.turned(re, im).wrapping_add(ly.on_arc(rate, rate2, turning, c, s)),
            z.turned(re, im).wrapping_add(lz.at_rest(c, s)),
        ];
        self.term_out(nominal, wanted, around, flag::MOVING)
    }

    /// `around`: distance from the centre and indicators of the sense, X and Y.
    #[inline(always)]
    fn term_out(
        &mut self,
        nominal: [i32; 3],
        wanted: [i32; 3],
        around: ([i32; 2], [i32; 2]),
        flags: u16,
    ) -> Output {
        let (arm, ahead) = around;
        let extra = &self.segment.extra;
        let [ex, ey] = extra.unsteady_at(&mut self.sides, &self.ramp, ahead, nominal, arm);
        let [x, y, z] = wanted;
        self.out(nominal, [x.wrapping_add(ex), y.wrapping_add(ey), z], flags)
    }

    #[inline(never)]
    fn cruise(&mut self) -> Output {
        self.advance(self.segment.timing.step);
        let phase_q32 = (self.phase >> 32) as u32;
        let (c, s) = self.weights(phase_q32);
        let nominal = self.place(c, s, phase_q32);
        let [x, y, z] = &self.segment.axes;
        let mut wanted = match self.segment.kind {
            Kind::Arc | Kind::Helix => [x.steady(c, s), y.steady(c, s), z.steady(c, s)],
            Kind::Line | Kind::Dwell => [0; 3],
        };
        if self.segment.extended {
            if self.segment.kind == Kind::Line {
                let [x, y, _] = &self.segment.extra.linear;
                wanted[0] = wanted[0].wrapping_add(x.on_line(c, i32::MAX, 0));
                wanted[1] = wanted[1].wrapping_add(y.on_line(c, i32::MAX, 0));
            }
            wanted = self.with_terms(c, s, nominal, wanted);
        }
        self.left = self.left.wrapping_sub(1);
        if self.left == 0 {
            self.begin_fall();
        }
        self.out(nominal, wanted, flag::MOVING | flag::CRUISE)
    }

    /// Adds the profile terms that are not linear.
    #[inline(always)]
    fn with_terms(&mut self, c: i32, s: i32, nominal: [i32; 3], wanted: [i32; 3]) -> [i32; 3] {
        let (arm, ahead) = (self.arm(c, s), self.segment.extra.ahead_at(c, s));
        let tables = &self.ramp;
        let [ex, ey] = self.segment.extra.unsteady_at(&mut self.sides, tables, ahead, nominal, arm);
        let [x, y, z] = wanted;
        [x.wrapping_add(ex), y.wrapping_add(ey), z]
    }

    /// Distance from the centre of an arc, nm, X and Y.
    #[inline(always)]
    fn arm(&self, c: i32, s: i32) -> [i32; 2] {
        let [x, y, _] = &self.segment.axes;
        match self.segment.kind {
            Kind::Arc | Kind::Helix => [x.turned(c, s), y.turned(c, s)],
            Kind::Line | Kind::Dwell => [0; 2],
        }
    }

    #[inline(never)]
    fn any_ramp(&mut self, falling: bool) -> Output {
        let (x, end) = if falling { self.clock.fall() } else { self.clock.rise() };
        if end {
            return if falling { self.standstill() } else { self.top() };
        }
        self.ramp_at(shapes(&self.ramp, x), falling)
    }

    #[inline(never)]
    fn both(&mut self) -> Output {
        let (x, end) = self.clock.rise();
        let (later, _) = self.second.rise();
        if end {
            // The rising ramp is over: what remains is the falling one alone.
            self.clock = self.second.mirrored();
            self.mode = Mode::Fall;
            let shape = shapes(&self.ramp, self.clock.here());
            return self.ramp_at(shape, true);
        }
        self.ramp_at(shapes(&self.ramp, x).minus(shapes(&self.ramp, later)), false)
    }

    /// One tick of a ramp on any curve.
    #[inline(always)]
    fn ramp_at(&mut self, shape: Shapes, falling: bool) -> Output {
        let step = scaled(self.segment.timing.step_q1, shape.s_q31);
        self.advance(step);
        let law = if falling { &self.segment.fall } else { &self.segment.rise };
        let phase_q32 = ramp_phase(self.phase, step, law.end_term(&shape));
        let (c, s) = self.weights(phase_q32);
        let nominal = self.place(c, s, phase_q32);
        let [x, y, z] = &self.segment.axes;
        let mut wanted = if self.segment.kind == Kind::Line {
            let along = law.along(&shape);
            [mulh(x.v, along), mulh(y.v, along), mulh(z.v, along)]
        } else {
            let (radial, tangential) = law.gain(&shape);
            let (re, im) = turn(radial, tangential, c, s);
            [x.turned(re, im), y.turned(re, im), z.turned(re, im)]
        };
        if self.segment.extended {
            let turning = if falling { shape.w4_q31.wrapping_neg() } else { shape.w4_q31 };
            wanted = self.with_linear(c, s, shape.s_q31, turning, wanted);
            wanted = self.with_terms(c, s, nominal, wanted);
        }
        self.out(nominal, wanted, flag::MOVING)
    }

    /// Adds the linear profile terms.
    #[inline(always)]
    fn with_linear(&self, c: i32, s: i32, rate: i32, turning: i32, wanted: [i32; 3]) -> [i32; 3] {
        let [x, y, z] = &self.segment.extra.linear;
        let [wx, wy, wz] = wanted;
        if self.segment.kind == Kind::Line {
            let (ex, ey) = (x.on_line(c, rate, turning), y.on_line(c, rate, turning));
            return [wx.wrapping_add(ex), wy.wrapping_add(ey), wz];
        }
        let rate2 = mulh(rate, rate).wrapping_mul(2);
        let (ex, ey) = (x.on_arc(rate, rate2, turning, c, s), y.on_arc(rate, rate2, turning, c, s));
        [wx.wrapping_add(ex), wy.wrapping_add(ey), wz.wrapping_add(z.at_rest(c, s))]
    }

    /// Offset wanted, nm, standing at these weights.
    fn standing_offset(&self, c: i32, s: i32) -> [i32; 3] {
        if !self.segment.extended {
            return [0; 3];
        }
        let tables = &self.ramp;
        let (arm, extra) = (self.arm(c, s), &self.segment.extra);
        let [ex, ey] = extra.standing_at(&self.sides, tables, self.rest_nm, arm);
        self.with_linear(c, s, 0, 0, [ex, ey, 0])
    }

    /// Top of a rising ramp: the phase is set to its exact value, one step early for the cruise to make.
    #[inline(never)]
    fn top(&mut self) -> Output {
        self.set_phase(self.segment.timing.up);
        let (before, wrapped) = self.phase.overflowing_sub(self.segment.timing.step);
        (self.phase, self.turns) = (before, self.turns.wrapping_sub(i32::from(wrapped)));
        self.left = self.segment.timing.cruise_ticks.wrapping_add(1);
        let mut out = match self.mode {
            Mode::ArcRise => {
                self.mode = Mode::ArcCruise;
                self.arc_cruise()
            }
            Mode::TermRise => {
                self.mode = Mode::TermCruise;
                self.term_cruise()
            }
            _ => {
                self.mode = Mode::Cruise;
                self.cruise()
            }
        };
        // The last tick of the ramp is not yet one at constant feed.
        out.flags &= !flag::CRUISE;
        out
    }

    #[inline(never)]
    fn standstill(&mut self) -> Output {
        self.counters.segments = self.counters.segments.wrapping_add(1);
        if self.mode == Mode::ArcFall && self.end == self.segment.timing.end {
            // Without profile terms nothing is wanted at rest.
            self.mode = Mode::Rest;
            (self.rest_nm, self.rest_offset_nm) = (self.segment.end_nm, [0; 3]);
            if self.guard.rest() {
                return Output::new(self.rest_nm, [0; 3], flag::MOVING);
            }
            return self.finish(self.rest_nm, [0; 3], flag::MOVING);
        }
        self.set_phase(self.end);
        self.mode = Mode::Rest;
        let phase_q32 = (self.phase >> 32) as u32;
        let (c, s) = self.weights(phase_q32);
        self.rest_nm = self.place(c, s, phase_q32);
        if self.end == self.segment.timing.end {
            self.rest_nm = self.segment.end_nm;
        }
        self.rest_offset_nm = self.standing_offset(c, s);
        self.finish(self.rest_nm, self.rest_offset_nm, flag::MOVING)
    }

    #[inline(always)]
    fn begin_fall(&mut self) {
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
    fn rest(&mut self, inbox: &mut impl Inbox) -> Output {
        self.halting = false;
        if let Some(next) = inbox.take() {
            if next.epoch != self.epoch || self.fault.is_some() {
                self.counters.dropped = self.counters.dropped.wrapping_add(1);
            } else if next.start_nm != self.rest_nm {
                self.counters.dropped = self.counters.dropped.wrapping_add(1);
                self.fault = Some(Fault::Discontinuity);
            } else {
                self.segment = next;
                self.begin_settle();
                return self.finish(self.rest_nm, self.rest_offset_nm, flag::SETTLING);
            }
        }
        self.finish(self.rest_nm, self.rest_offset_nm, 0)
    }

    fn begin_settle(&mut self) {
        self.guard.set(self.segment.offset_nm, self.segment.slew_nm);
        self.guard.watch(!self.engage.full());
        let uncorrected = u32::from(!self.segment.corrected);
        self.counters.uncorrected = self.counters.uncorrected.wrapping_add(uncorrected);
        self.mode = Mode::Settle;
        self.clock = Clock::rising(self.segment.settle_step);
        self.target_nm = self.rest_offset_nm;
        if self.segment.kind != Kind::Dwell {
            let (c, s) = self.weights((self.segment.timing.start >> 32) as u32);
            self.sides.seed(&self.segment.extra, c, s);
            self.target_nm = self.standing_offset(c, s);
        }
    }

    /// Moves the offset from what it is to what the segment starts with, then lets the segment begin.
    #[inline(never)]
    fn settle(&mut self) -> Output {
        let target = self.target_nm;
        let (x, end) = self.clock.rise();
        let share = shapes(&self.ramp, x).s_q31;
        if end || self.rest_offset_nm == target {
            self.rest_offset_nm = target;
            self.begin_segment();
            return self.finish(self.rest_nm, target, flag::SETTLING);
        }
        let mut offset = self.rest_offset_nm;
        for (o, t) in offset.iter_mut().zip(target) {
            let way = i64::from(t).wrapping_sub(i64::from(*o)).wrapping_mul(i64::from(share));
            *o = o.wrapping_add((way >> 31) as i32);
        }
        self.finish(self.rest_nm, offset, flag::SETTLING)
    }

    fn begin_segment(&mut self) {
        let timing = self.segment.timing;
        self.left = timing.cruise_ticks;
        self.mode = match self.segment.kind {
            _ if self.segment.epoch != self.epoch => Mode::Rest,
            Kind::Dwell => Mode::Dwell,
            Kind::Arc if self.segment.extended => Mode::TermRise,
            Kind::Arc if self.segment.proven => Mode::ArcRise,
            Kind::Arc | Kind::Line | Kind::Helix => Mode::Rise,
        };
        if self.mode == Mode::ArcRise {
            self.guard.rely_on_plan();
        }
        self.clock = Clock::rising(timing.clock_step);
        self.phase = timing.start;
        self.turns = 0;
        self.end = timing.end;
    }

    #[inline(never)]
    fn dwell(&mut self) -> Output {
        self.left = self.left.wrapping_sub(1);
        if self.left == 0 || self.segment.epoch != self.epoch {
            self.mode = Mode::Rest;
            self.counters.segments = self.counters.segments.wrapping_add(1);
        }
        self.finish(self.rest_nm, self.rest_offset_nm, 0)
    }

    fn advance(&mut self, by: u64) {
        let (phase, wrapped) = self.phase.overflowing_add(by);
        self.phase = phase;
        self.turns = self.turns.wrapping_add(i32::from(wrapped));
    }

    /// Replaces the phase by an exact value close to it, whole turns included.
    fn set_phase(&mut self, exact: u64) {
        let ahead = exact.wrapping_sub(self.phase) as i64 > 0;
        let wrapped = i32::from(ahead && exact < self.phase) - i32::from(!ahead && exact > self.phase);
        self.phase = exact;
        self.turns = self.turns.wrapping_add(wrapped);
    }

    /// Weights of a curve's two vectors, Q31: cosine and sine, or the share of a line.
    #[inline(always)]
    fn weights(&self, phase_q32: u32) -> (i32, i32) {
        if self.segment.kind == Kind::Line { ((phase_q32 >> 1) as i32, 0) } else { sincos(phase_q32) }
    }

    /// Position, nm.
    #[inline(always)]
    fn place(&self, c: i32, s: i32, phase_q32: u32) -> [i32; 3] {
        let [x, y, z] = &self.segment.axes;
        match self.segment.kind {
            Kind::Dwell => self.rest_nm,
            Kind::Line => {
                let share = phase_q32 as i32;
                [x.on_line(share), y.on_line(share), z.on_line(share)]
            }
            Kind::Arc => [x.on_arc(c, s), y.on_arc(c, s), z.on_arc(c, s)],
            Kind::Helix => self.on_helix([x.on_arc(c, s), y.on_arc(c, s), z.on_arc(c, s)], phase_q32),
        }
    }

    #[inline(never)]
    fn on_helix(&self, flat: [i32; 3], phase_q32: u32) -> [i32; 3] {
        // A ramp's sum of steps runs ahead of the phase and may have passed a whole turn before it.
        let sum_q32 = (self.phase >> 32) as u32;
        let early = sum_q32 < phase_q32 && phase_q32.wrapping_sub(sum_q32) > 1 << 31;
        let turns = self.turns.wrapping_sub(i32::from(early));
        let [x, y, z] = self.segment.risen(turns, phase_q32);
        let [bx, by, bz] = self.segment.risen(0, (self.segment.timing.start >> 32) as u32);
        let [fx, fy, fz] = flat;
        let add = |f: i32, r: i32, b: i32| f.wrapping_add(r).wrapping_sub(b);
        [add(fx, x, bx), add(fy, y, by), add(fz, z, bz)]
    }

    /// Engagement, bounds, and out: the quick way if it will do.
    #[inline(always)]
    fn out(&mut self, nominal: [i32; 3], wanted: [i32; 3], flags: u16) -> Output {
        if self.guard.pass_easily(wanted) {
            return Output::new(nominal, wanted, flags);
        }
        self.finish(nominal, wanted, flags)
    }

    /// Engagement, bounds, and out.
    #[inline(never)]
    fn finish(&mut self, nominal: [i32; 3], wanted: [i32; 3], flags: u16) -> Output {
        let wanted = self.engage.apply(wanted);
        let (offset, verdict) = self.guard.pass(wanted);
        self.guard.watch(!self.engage.full());
        if matches!(self.mode, Mode::ArcRise | Mode::ArcCruise | Mode::ArcFall) {
            self.guard.rely_on_plan_if_easy();
        }
        let mut flags = flags;
        if verdict.offset_cut | verdict.slew_cut {
            self.counters.offset_cuts = self.counters.offset_cuts.wrapping_add(u32::from(verdict.offset_cut));
            self.counters.slew_cuts = self.counters.slew_cuts.wrapping_add(u32::from(verdict.slew_cut));
            flags |= flag::CUT;
        }
        Output::new(nominal, offset, flags)
    }
}

/// Phase in a ramp from the sum of steps. ∫ of the rate is the trapezoidal sum less T²/12 of its derivative
/// (Euler–Maclaurin); the next term is below 1e-5 of a step from 32 ticks up.
#[inline(always)]
fn ramp_phase(sum: u64, step: u64, end_term: i32) -> u32 {
    ((sum >> 32) as u32).wrapping_sub((step >> 33) as u32).wrapping_sub(end_term as u32)
}

/// step·share, step doubled, share in Q31.
#[inline(always)]
fn scaled(step_q1: u64, share_q31: i32) -> u64 {
    let share = u64::from(share_q31 as u32);
    let low = u64::from(step_q1 as u32).wrapping_mul(share) >> 32;
    (step_q1 >> 32).wrapping_mul(share).wrapping_add(low)
}
