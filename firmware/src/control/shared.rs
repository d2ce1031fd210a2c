//! Words that the tick writes and the background reads, and the other way round.
use crate::engine::{Counters, Fault, Output, StreamCounters};
use crate::server::Snapshot;
use core::sync::atomic::{
    AtomicBool, AtomicI32, AtomicU8, AtomicU16, AtomicU32, Ordering::Relaxed,
};
use core::sync::atomic::{Ordering, compiler_fence};
use giotto_shared::wire::{FaultCause, MotionState, PositionState};

/// State of the engine as the tick leaves it, and wishes of the background. On one core, so that a
/// compiler fence orders what the interrupt writes.
#[derive(Debug)]
pub struct Shared {
    // Written by the tick.
    tick: AtomicU32,
    state: AtomicU8,
    epoch: AtomicU8,
    raw_nm: [AtomicI32; 3],
    corrected_nm: [AtomicI32; 3],
    overruns: AtomicU32,
    offset_cuts: AtomicU32,
    slew_cuts: AtomicU32,
    dropped: AtomicU32,
    fault: AtomicU8,
    dropped_segments: AtomicU32,
    uncorrected: AtomicU32,
    stops: AtomicU32,
    segments: AtomicU32,
    missing: AtomicU32,
    late: AtomicU32,
    rejected: AtomicU32,
    // Written by the background.
    position: AtomicU8,
    override_percent: AtomicU8,
    /// Wishes for a machine at rest, each a bit: raised by the background, lowered by the tick.
    pub(super) asked: AtomicU8,
    declared_nm: [AtomicI32; 3],
    /// Feed hold.
    pub(super) pause: AtomicBool,
    /// A stream that waits may begin.
    pub(super) go: AtomicBool,
    /// Epoch of the program that is open, or [`NO_PROGRAM`]. A stop ends the epoch, and the program with it.
    pub(super) program: AtomicU16,
    pub(super) bypass: AtomicBool,
    pub(super) hold: AtomicBool,
    /// Raised by the background, lowered by the tick that obeys.
    pub(super) stop: AtomicBool,
    pub(super) every: AtomicU16,
    // Written by the board.
    pub(super) stop_input: AtomicBool,
    /// Ticks that fell due while the core stood still.
    pub(super) lost: AtomicU32,
}

impl Default for Shared {
    fn default() -> Self {
        Self::new()
    }
}

const NO_PROGRAM: u16 = u16::MAX;

/// Bits of `asked`: forget the fault; the machine stands where `declared_nm` says.
pub(super) const CLEAR: u8 = 1;
pub(super) const DECLARE: u8 = 2;

const REST: u8 = 0;
const RUNNING: u8 = 1;
const STOPPING: u8 = 2;
const FAULT: u8 = 3;
const PAUSED: u8 = 4;

const UNKNOWN: u8 = 0;
const KNOWN: u8 = 1;
const KEPT: u8 = 2;

const NO_FAULT: u8 = 0;
const OVERRUN: u8 = 1;
const DISCONTINUITY: u8 = 2;
const STARVED: u8 = 3;

impl Shared {
    /// At rest at the origin, which is where the machine stands, bypassed.
    pub const fn new() -> Self {
        Self {
            position: AtomicU8::new(KNOWN),
            override_percent: AtomicU8::new(100),
            asked: AtomicU8::new(0),
            declared_nm: [const { AtomicI32::new(0) }; 3],
            pause: AtomicBool::new(false),
            tick: AtomicU32::new(0),
            state: AtomicU8::new(REST),
            epoch: AtomicU8::new(0),
            raw_nm: [const { AtomicI32::new(0) }; 3],
            corrected_nm: [const { AtomicI32::new(0) }; 3],
            overruns: AtomicU32::new(0),
            offset_cuts: AtomicU32::new(0),
            slew_cuts: AtomicU32::new(0),
            dropped: AtomicU32::new(0),
            fault: AtomicU8::new(NO_FAULT),
            dropped_segments: AtomicU32::new(0),
            uncorrected: AtomicU32::new(0),
            stops: AtomicU32::new(0),
            segments: AtomicU32::new(0),
            missing: AtomicU32::new(0),
            late: AtomicU32::new(0),
            rejected: AtomicU32::new(0),
            go: AtomicBool::new(false),
            program: AtomicU16::new(NO_PROGRAM),
            bypass: AtomicBool::new(true),
            hold: AtomicBool::new(false),
            stop: AtomicBool::new(false),
            every: AtomicU16::new(0),
            stop_input: AtomicBool::new(false),
            lost: AtomicU32::new(0),
        }
    }

    /// The board's stop input: while it is active a run under way stops within limits, from the next tick on, and
    /// nothing starts.
    pub fn set_stop_input(&self, active: bool) {
        self.stop_input.store(active, Relaxed);
    }

    /// So many ticks fell due while the core stood still, as it does while its flash is erased: they have passed, and nothing
    /// moved in them. To be called with the tick's interrupt masked, at rest.
    pub fn lose(&self, ticks: u32) {
        self.lost
            .store(self.lost.load(Relaxed).wrapping_add(ticks), Relaxed);
        // Whoever asks before the next tick knows of them as well.
        self.pass(self.now().wrapping_add(ticks));
    }

    /// Before the first tick: where the machine stands, and how that is known. The executor has to begin there too.
    pub fn stands(&self, place_nm: [i32; 3], known: PositionState) {
        for words in [&self.raw_nm, &self.corrected_nm] {
            for (word, nm) in words.iter().zip(place_nm) {
                word.store(nm, Relaxed);
            }
        }
        let known = match known {
            PositionState::Unknown => UNKNOWN,
            PositionState::Known => KNOWN,
            PositionState::Kept => KEPT,
        };
        self.position.store(known, Relaxed);
    }

    /// Whether it is known where the machine stands.
    pub(super) fn known(&self) -> bool {
        self.position.load(Relaxed) != UNKNOWN
    }

    /// Asks the tick to forget a fault.
    pub(super) fn clear_fault(&self) {
        self.asked.fetch_or(CLEAR, Relaxed);
    }

    /// Tells the tick where the machine stands.
    pub(super) fn declare(&self, place_nm: [i32; 3]) {
        for (word, nm) in self.declared_nm.iter().zip(place_nm) {
            word.store(nm, Relaxed);
        }
        self.position.store(KNOWN, Relaxed);
        // The interrupt that sees the wish sees the place.
        compiler_fence(Ordering::Release);
        self.asked.fetch_or(DECLARE, Relaxed);
    }

    /// What was declared last, nm.
    pub(super) fn declared_nm(&self) -> [i32; 3] {
        self.declared_nm.each_ref().map(|word| word.load(Relaxed))
    }

    /// Share of the feed that is asked for, percent.
    pub(super) fn set_override(&self, percent: u8) {
        self.override_percent.store(percent, Relaxed);
    }

    /// The same.
    pub(super) fn override_percent(&self) -> u8 {
        self.override_percent.load(Relaxed)
    }

    /// Publishes a tick.
    #[allow(clippy::too_many_arguments, reason = "the words of one tick")]
    pub(super) fn publish(
        &self,
        tick: u32,
        state: MotionState,
        epoch: u8,
        fault: Option<Fault>,
        output: &Output,
        (counters, dropped): (&Counters, u32),
        stream: &StreamCounters,
    ) {
        let state = match state {
            MotionState::Idle => REST,
            MotionState::Running => RUNNING,
            MotionState::Stopping => STOPPING,
            MotionState::Fault => FAULT,
            MotionState::Paused => PAUSED,
        };
        self.state.store(state, Relaxed);
        self.epoch.store(epoch, Relaxed);
        let store = |[x, y, z]: &[AtomicI32; 3], nm: [i32; 3]| {
            x.store(nm[0], Relaxed);
            y.store(nm[1], Relaxed);
            z.store(nm[2], Relaxed);
        };
        store(&self.raw_nm, output.nominal_nm);
        store(&self.corrected_nm, output.corrected_nm);
        self.overruns.store(counters.overruns, Relaxed);
        // Executor and stream count for themselves, and so does the queue.
        let sum =
            |word: &AtomicU32, one: u32, other: u32| word.store(one.wrapping_add(other), Relaxed);
        let bounds = &stream.bounds;
        sum(&self.offset_cuts, counters.offset_cuts, bounds.offset_cuts);
        sum(&self.slew_cuts, counters.slew_cuts, bounds.slew_cuts);
        sum(&self.dropped_segments, counters.dropped, dropped);
        self.uncorrected.store(counters.uncorrected, Relaxed);
        self.stops.store(counters.stops, Relaxed);
        self.segments.store(counters.segments, Relaxed);
        self.missing.store(stream.missing, Relaxed);
        self.late.store(stream.late, Relaxed);
        self.rejected.store(stream.rejected, Relaxed);
        let fault = match fault {
            None => NO_FAULT,
            Some(Fault::Overrun) => OVERRUN,
            Some(Fault::Discontinuity) => DISCONTINUITY,
            Some(Fault::Starved) => STARVED,
        };
        self.fault.store(fault, Relaxed);
        compiler_fence(Ordering::Release);
        self.tick.store(tick, Relaxed);
    }

    /// Publishes that time has passed and nothing else.
    pub(super) fn pass(&self, tick: u32) {
        self.tick.store(tick, Relaxed);
    }

    /// Ticks since boot.
    #[inline]
    pub fn now(&self) -> u32 {
        self.tick.load(Relaxed)
    }

    /// Counts a set-point that found no room.
    pub(super) fn drop_one(&self) {
        self.dropped
            .store(self.dropped.load(Relaxed).wrapping_add(1), Relaxed);
    }

    /// Opens a program in the present epoch, or closes it.
    pub(super) fn set_program(&self, open: bool) {
        self.program.store(
            if open {
                u16::from(self.epoch())
            } else {
                NO_PROGRAM
            },
            Relaxed,
        );
    }

    /// Whether a program is open in this epoch.
    pub(super) fn program_open(&self, epoch: u8) -> bool {
        self.program.load(Relaxed) == u16::from(epoch)
    }

    /// Epoch of the executor after the last tick.
    pub(super) fn epoch(&self) -> u8 {
        self.epoch.load(Relaxed)
    }

    /// All words of one tick: read again if a tick came between.
    pub(super) fn snapshot(&self) -> Snapshot {
        self.snapshot_between(&|| {})
    }

    /// The same, with what may happen before each word is read: on one core that is the tick's interrupt, and a test has all of its
    /// places.
    fn snapshot_between(&self, between: &impl Fn()) -> Snapshot {
        loop {
            let tick = self.tick.load(Relaxed);
            compiler_fence(Ordering::Acquire);
            let snapshot = self.read(tick, between);
            compiler_fence(Ordering::Acquire);
            between();
            if self.tick.load(Relaxed) == tick {
                return snapshot;
            }
        }
    }

    fn read(&self, tick: u32, between: &impl Fn()) -> Snapshot {
        let count = |word: &AtomicU32| {
            between();
            word.load(Relaxed)
        };
        let byte = |word: &AtomicU8| {
            between();
            word.load(Relaxed)
        };
        let place = |words: &[AtomicI32; 3]| {
            words.each_ref().map(|word| {
                between();
                word.load(Relaxed)
            })
        };
        Snapshot {
            state: match byte(&self.state) {
                REST => MotionState::Idle,
                RUNNING => MotionState::Running,
                STOPPING => MotionState::Stopping,
                PAUSED => MotionState::Paused,
                _ => MotionState::Fault,
            },
            tick,
            raw_nm: place(&self.raw_nm),
            corrected_nm: place(&self.corrected_nm),
            tick_overruns: count(&self.overruns),
            offset_clamps: count(&self.offset_cuts),
            slew_clamps: count(&self.slew_cuts),
            dropped_set_points: count(&self.dropped),
            dropped_segments: count(&self.dropped_segments),
            uncorrected_segments: count(&self.uncorrected),
            stops: count(&self.stops),
            segments: count(&self.segments),
            missing_set_points: count(&self.missing),
            late_set_points: count(&self.late),
            rejected_set_points: count(&self.rejected),
            queued: 0,
            fault: match byte(&self.fault) {
                NO_FAULT => None,
                OVERRUN => Some(FaultCause::Overrun),
                DISCONTINUITY => Some(FaultCause::Discontinuity),
                _ => Some(FaultCause::Starved),
            },
            stop_input: self.stop_input.load(Relaxed),
            position: match byte(&self.position) {
                UNKNOWN => PositionState::Unknown,
                KEPT => PositionState::Kept,
                _ => PositionState::Known,
            },
            override_percent: byte(&self.override_percent),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::Cell;

    /// All words of tick `n` say `n`.
    fn publish(shared: &Shared, n: u32) {
        let nm = n as i32;
        let (nominal_nm, corrected_nm) = ([nm, nm + 1, nm + 2], [nm, -nm, nm]);
        let output = Output {
            nominal_nm,
            corrected_nm,
            flags: 0,
        };
        let counters = Counters {
            overruns: n,
            offset_cuts: n,
            slew_cuts: n,
            dropped: n,
            uncorrected: n,
            stops: n,
            segments: n,
        };
        let stream = StreamCounters {
            missing: n,
            late: n,
            rejected: n,
            ..StreamCounters::default()
        };
        let (state, fault) = if n.is_multiple_of(2) {
            (MotionState::Running, None)
        } else {
            (MotionState::Fault, Some(Fault::Starved))
        };
        shared.publish(n, state, n as u8, fault, &output, (&counters, 0), &stream);
    }

    /// An interrupt may come before any word is read, once or again and again: what is read is one tick's, whole.
    #[test]
    fn a_snapshot_is_one_tick_s_wherever_the_interrupt_comes() {
        let shared = Shared::new();
        let mut places = 0;
        for at in 0..200 {
            for ticks in 1..4 {
                publish(&shared, 7);
                let (reads, now) = (Cell::new(0), Cell::new(7));
                let interrupt = || {
                    reads.set(reads.get() + 1);
                    // So often in a row, as of a background that is slow.
                    if (at..at + ticks).contains(&reads.get()) {
                        now.set(now.get() + 1);
                        publish(&shared, now.get());
                    }
                };
                let seen = shared.snapshot_between(&interrupt);
                let whole = Shared::new();
                publish(&whole, seen.tick);
                assert_eq!(seen, whole.snapshot(), "interrupted at {at}");
                assert!(seen.tick >= 7 && seen.tick <= now.get());
                places = places.max(if seen.tick > 7 { at } else { 0 });
            }
        }
        // All places of a reading were tried.
        assert!((20..150).contains(&places), "{places}");
    }
}
