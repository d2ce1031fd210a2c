//! The timer interrupt as an image has it, for counting its instructions.
use super::{Job, SEGMENTS, SET_POINTS, Shared, Tick};
use crate::engine::{Config, Executor, Output, bench};
use crate::server::TimedSetPoint;
use core::sync::atomic::Ordering::Relaxed;
use heapless_spsc::spsc::{Consumer, Producer, Queue};

/// Segments on their way, as on a board.
pub type Segments = Queue<Job, { SEGMENTS + 1 }>;
/// Set-points on their way back.
pub type Points = Queue<TimedSetPoint, { SET_POINTS + 1 }>;

/// A helix in a tilted plane with the dearest table, each of its set-points recorded.
pub struct Interrupt<'a> {
    tick: Tick<
        &'a Shared,
        Consumer<'a, Job, { SEGMENTS + 1 }>,
        Producer<'a, TimedSetPoint, { SET_POINTS + 1 }>,
    >,
    shared: &'a Shared,
    points: Consumer<'a, TimedSetPoint, { SET_POINTS + 1 }>,
}

impl<'a> Interrupt<'a> {
    /// Planned and waiting; `None` if it could not be.
    pub fn new(
        rise_m: f64,
        shared: &'a Shared,
        segments: &'a mut Segments,
        points: &'a mut Points,
    ) -> Option<Self> {
        let (start, planned) = bench::planned(&bench::DEAREST, rise_m);
        let (mut segments_in, segments_out) = segments.split();
        let (points_in, points_out) = points.split();
        segments_in.enqueue(Job::Segment(planned?)).ok()?;
        shared.bypass.store(false, Relaxed);
        shared.every.store(1, Relaxed);
        let executor = Executor::new(start, Config::robot(1000).engage_ticks(), false);
        Some(Self {
            tick: Tick::new(executor, shared, segments_out, points_in),
            shared,
            points: points_out,
        })
    }

    /// What is counted: all that the handler of a board does.
    #[inline(never)]
    pub fn run(&mut self, stop_input: bool, late: bool) -> Output {
        self.shared.set_stop_input(stop_input);
        self.tick.tick(late)
    }

    /// What the background does meanwhile; not counted. Whether set-points still come.
    pub fn drain(&mut self) -> bool {
        let mut last = false;
        while let Some(point) = self.points.dequeue() {
            last = point.last;
        }
        !last
    }
}
