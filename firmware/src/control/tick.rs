//! The interrupt's half: one tick of the executor, its wishes before and its report after.
use super::ports::{Receiver, Sender};
use super::shared::Shared;
use crate::engine::{Executor, Inbox, Output, Planned};
use crate::server::TimedSetPoint;
use core::ops::Deref;
use core::sync::atomic::Ordering::Relaxed;
use giotto_shared::wire::{MotionState, SetPoint};

/// What the timer interrupt owns.
pub struct Tick<S, I, O> {
    executor: Executor,
    shared: S,
    segments: Segments<I>,
    set_points: O,
    now: u32,
    bypass: bool,
    stop_input: bool,
    /// Ticks to the next set-point of the record; 0: none is being made.
    until_next: u16,
    recording: bool,
}

/// The queue, as the executor wants it.
struct Segments<I> {
    queue: I,
    /// What waits is thrown away.
    closed: bool,
    dropped: u32,
}

impl<I: Receiver<Planned>> Inbox for Segments<I> {
    #[inline]
    fn take(&mut self, place: &mut Planned) -> bool {
        let taken = self.queue.receive_into(place);
        let thrown_away = taken && self.closed;
        self.dropped = self.dropped.wrapping_add(u32::from(thrown_away));
        taken && !thrown_away
    }
}

impl<S, I, O> Tick<S, I, O>
where
    S: Deref<Target = Shared>,
    I: Receiver<Planned>,
    O: Sender<TimedSetPoint>,
{
    /// At rest at the origin, bypassed.
    pub fn new(executor: Executor, shared: S, segments: I, set_points: O) -> Self {
        Self {
            executor,
            shared,
            segments: Segments { queue: segments, closed: false, dropped: 0 },
            set_points,
            now: 0,
            bypass: true,
            stop_input: false,
            until_next: 1,
            recording: false,
        }
    }

    /// Once a period. Takes the wishes of the background, lets the executor make one set-point and reports it;
    /// the executor states the timing contract. `late`: the last tick was not finished when this one was due.
    #[inline]
    pub fn tick(&mut self, late: bool) -> Output {
        self.wishes(late);
        let output = self.executor.tick(&mut self.segments);
        self.now = self.now.wrapping_add(1);
        let state = self.state();
        self.record(&output, state);
        let mut counters = *self.executor.counters();
        counters.dropped = counters.dropped.wrapping_add(self.segments.dropped);
        let (epoch, fault) = (self.executor.epoch(), self.executor.fault());
        self.shared.publish(self.now, state, epoch, fault, &output, &counters);
        output
    }

    /// For who simulates long rests: lets so many ticks pass at once and says so, or does nothing. At rest, with no
    /// segment, no wish and no set-point waiting, a tick only counts the time, provided that the last two ticks
    /// had the same output and that the correction is wholly engaged or disengaged, which is the caller's to know.
    pub fn rest(&mut self, count: u32) -> bool {
        let shared = &self.shared;
        let wishes = shared.stop.load(Relaxed)
            || shared.stop_input.load(Relaxed) != self.stop_input
            || shared.bypass.load(Relaxed) != self.bypass;
        let rests = self.executor.idle() && self.segments.queue.waiting() == 0 && !self.recording && !wishes;
        if rests {
            self.now = self.now.wrapping_add(count);
            self.shared.pass(self.now);
        }
        rests
    }

    /// Whether the correction is disengaged, or on its way to be.
    pub const fn bypassed(&self) -> bool {
        self.bypass
    }

    #[inline]
    fn wishes(&mut self, late: bool) {
        if late {
            self.executor.overrun();
        }
        let active = self.shared.stop_input.load(Relaxed);
        let pressed = active && !(self.stop_input && self.executor.idle());
        self.stop_input = active;
        if pressed || self.shared.stop.load(Relaxed) {
            self.shared.stop.store(false, Relaxed);
            self.executor.stop();
        }
        self.segments.closed = active || self.shared.hold.load(Relaxed);
        let bypass = self.shared.bypass.load(Relaxed);
        if bypass != self.bypass {
            self.bypass = bypass;
            self.executor.set_bypass(bypass);
        }
    }

    #[inline]
    fn state(&self) -> MotionState {
        let at_rest = self.executor.idle() && self.segments.queue.waiting() == 0;
        if !at_rest {
            if self.executor.stopping() { MotionState::Stopping } else { MotionState::Running }
        } else if self.executor.fault().is_some() {
            MotionState::Fault
        } else {
            MotionState::Idle
        }
    }

    /// Hands every so many ticks' set-point to the background, from the first of a run to the first after it.
    #[inline]
    fn record(&mut self, output: &Output, state: MotionState) {
        let every = self.shared.every.load(Relaxed);
        let moving = matches!(state, MotionState::Running | MotionState::Stopping);
        if every == 0 {
            self.recording = false;
            return;
        }
        if !self.recording {
            if !moving {
                return;
            }
            self.recording = true;
            self.until_next = 1;
        }
        self.until_next = self.until_next.wrapping_sub(1);
        if self.until_next != 0 {
            return;
        }
        self.until_next = every;
        let (raw_nm, corrected_nm) = (output.nominal_nm, output.corrected_nm);
        let point = SetPoint { raw_nm, corrected_nm };
        let timed = TimedSetPoint { tick: self.now, point, last: !moving };
        if self.set_points.send(&timed) {
            // The last one is tried again: without it the reader would wait for ever.
            self.recording = moving;
        } else {
            self.shared.drop_one();
        }
    }
}
