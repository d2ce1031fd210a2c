//! The interrupt's half: one tick of the executor or of a stream, its wishes before and its report after.
use super::STREAM_PLACES;
use super::job::Job;
use super::jobs::Jobs;
use super::ports::{Receiver, Sender};
use super::shared::{CLEAR, DECLARE, Shared};
use crate::engine::{Executor, Fault, Output, Stream, StreamState};
use crate::server::TimedSetPoint;
use core::ops::Deref;
use core::sync::atomic::Ordering::{Acquire, Relaxed};
use core::sync::atomic::compiler_fence;
use giotto_shared::wire::{MotionState, SetPoint};

/// What the timer interrupt owns.
pub struct Tick<S, I, O> {
    executor: Executor,
    stream: Stream<STREAM_PLACES>,
    /// The stream runs; the executor stands.
    streaming: bool,
    shared: S,
    jobs: Jobs<I>,
    set_points: O,
    now: u32,
    /// Ticks that were lost so far, as the board counts them.
    lost: u32,
    bypass: bool,
    pause: bool,
    stop_input: bool,
    /// Ticks to the next set-point of the record; 0: none is being made.
    until_next: u16,
    recording: bool,
    /// In this tick the machine was said to stand elsewhere.
    placed: bool,
}

impl<S, I, O> Tick<S, I, O>
where
    S: Deref<Target = Shared>,
    I: Receiver<Job>,
    O: Sender<TimedSetPoint>,
{
    /// At rest at the origin, bypassed.
    pub fn new(executor: Executor, shared: S, jobs: I, set_points: O) -> Self {
        Self {
            executor,
            stream: Stream::idle(),
            streaming: false,
            shared,
            jobs: Jobs::new(jobs),
            set_points,
            now: 0,
            lost: 0,
            bypass: true,
            pause: false,
            stop_input: false,
            until_next: 1,
            recording: false,
            placed: false,
        }
    }

    /// Once a period. Takes the wishes of the background, lets the executor or the stream make one set-point and reports it;
    /// the executor states the timing contract. `late`: the last tick was not finished when this one was due.
    #[inline]
    pub fn tick(&mut self, late: bool) -> Output {
        self.wishes(late);
        let output = if self.streaming {
            self.stream_tick()
        } else {
            self.executor.tick(&mut self.jobs)
        };
        if let Some(plan) = self.jobs.begins() {
            self.stream
                .start(plan, self.executor.rest_nm(), 0, self.bypass);
            self.streaming = true;
            self.executor.count_uncorrected(!plan.corrected());
        }
        let lost = self.shared.lost.load(Relaxed);
        let passed = lost.wrapping_sub(self.lost).wrapping_add(1);
        (self.now, self.lost) = (self.now.wrapping_add(passed), lost);
        let state = self.state();
        self.record(&output, state);
        let (epoch, fault) = (self.executor.epoch(), self.executor.fault());
        self.shared.publish(
            self.now,
            state,
            epoch,
            fault,
            &output,
            (self.executor.counters(), self.jobs.dropped()),
            self.stream.counters(),
        );
        output
    }

    /// One set-point of the stream from the queue, if it has come.
    #[inline(never)]
    fn stream_tick(&mut self) -> Output {
        let mut last = false;
        let mut sample = None;
        if self.stream.takes() {
            let late;
            (sample, last, late) = self.jobs.point(self.stream.expected());
            self.stream.count_late(late);
        }
        if last {
            // It comes behind the last set-point.
            self.stream.finish();
        }
        let output = self.stream.tick(sample);
        let starved = matches!(
            self.stream.state(),
            StreamState::Stopping | StreamState::Fault
        );
        if starved && self.executor.fault().is_none() {
            // From now on what comes is refused, not only once it stands.
            self.executor.fail(Fault::Starved);
        }
        if self.stream.over() {
            self.streaming = false;
            self.executor.set_position(output.nominal_nm);
        }
        output
    }

    /// For who simulates long rests: lets so many ticks pass at once and says so, or does nothing. At rest, with no
    /// program open, no wish and no set-point waiting, with the correction wholly engaged or disengaged, a tick only
    /// counts the time, provided that the last two ticks had the same output, which is the caller's to know.
    pub fn rest(&mut self, count: u32) -> bool {
        let shared = &self.shared;
        let wishes = shared.stop.load(Relaxed)
            || shared.stop_input.load(Relaxed) != self.stop_input
            || shared.asked.load(Relaxed) != 0
            || shared.pause.load(Relaxed) != self.pause
            || shared.bypass.load(Relaxed) != self.bypass;
        let state = self.state();
        let still = matches!(state, MotionState::Idle | MotionState::Fault)
            && shared.snapshot().state == state;
        let rests = still
            && self.jobs.waiting() == 0
            && !self.executor.blending()
            && !self.recording
            && !wishes;
        if rests {
            self.now = self.now.wrapping_add(count);
            self.shared.pass(self.now);
        }
        rests
    }

    #[inline]
    fn wishes(&mut self, late: bool) {
        if late {
            self.executor.overrun();
            self.stream.stop();
        }
        let active = self.shared.stop_input.load(Relaxed);
        let pressed = active && !(self.stop_input && self.at_rest());
        self.stop_input = active;
        if pressed || self.shared.stop.load(Relaxed) {
            self.shared.stop.store(false, Relaxed);
            // A stream that stops already is not stopped again.
            if !self.streaming || self.stream.takes() {
                self.executor.stop();
                self.stream.stop();
            }
        }
        if self.shared.asked.load(Relaxed) != 0 && self.at_rest() {
            self.asked();
        }
        let pause = self.shared.pause.load(Relaxed);
        if pause != self.pause {
            self.pause = pause;
            self.executor.set_pause(pause);
        }
        let closed = active || self.shared.hold.load(Relaxed);
        self.jobs
            .look_at(closed, self.shared.go.load(Relaxed), self.executor.epoch());
        let bypass = self.shared.bypass.load(Relaxed);
        if bypass != self.bypass {
            self.bypass = bypass;
            self.executor.set_bypass(bypass);
            self.stream.set_bypass(bypass);
        }
    }

    /// What can be done at rest only.
    #[inline(never)]
    fn asked(&mut self) {
        let asked = self.shared.asked.swap(0, Relaxed);
        compiler_fence(Acquire);
        if asked & CLEAR != 0 {
            self.executor.clear_fault();
        }
        if asked & DECLARE != 0 {
            self.executor.set_position(self.shared.declared_nm());
            self.placed = true;
        }
    }

    /// Whether the set-point of this tick is where the machine was said to stand, which is not a way to go: asked once by whoever
    /// turns ways into pulses.
    pub fn placed(&mut self) -> bool {
        core::mem::take(&mut self.placed)
    }

    pub(super) fn shared(&self) -> &Shared {
        &self.shared
    }

    pub(super) const fn faulty(&self) -> bool {
        self.executor.fault().is_some()
    }

    /// Neither executor nor stream move anything.
    pub(super) fn at_rest(&self) -> bool {
        self.executor.idle() && !self.streaming
    }

    #[inline]
    fn state(&self) -> MotionState {
        if self.streaming {
            return if self.stream.takes() {
                MotionState::Running
            } else {
                MotionState::Stopping
            };
        }
        // What moves is looked at first: those ticks are the long ones.
        if self.executor.busy() {
            return if self.executor.stopping() {
                MotionState::Stopping
            } else {
                MotionState::Running
            };
        }
        let waits = self.jobs.waiting() > 0;
        if self.executor.fault().is_some() {
            // Whatever still waits is thrown away, in a feed hold once it is over.
            MotionState::Fault
        } else if self.executor.paused() || (waits && self.pause) {
            MotionState::Paused
        } else if waits || self.shared.program_open(self.executor.epoch()) {
            // It goes on, or waits for more.
            MotionState::Running
        } else {
            MotionState::Idle
        }
    }

    /// Hands every so many ticks' set-point to the background, from the first of a run to the first after it.
    #[inline]
    fn record(&mut self, output: &Output, state: MotionState) {
        let every = self.shared.every.load(Relaxed);
        let moving = state.is_run();
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
        let point = SetPoint {
            raw_nm,
            corrected_nm,
        };
        let timed = TimedSetPoint {
            tick: self.now,
            point,
            last: !moving,
        };
        if self.set_points.send(&timed) {
            // The last one is tried again: without it the reader would wait for ever.
            self.recording = moving;
        } else {
            self.shared.drop_one();
        }
    }
}
