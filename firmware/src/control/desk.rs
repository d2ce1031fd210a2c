//! The background's half: plans what the tick runs, and is the [`Motion`] of the server.
use super::ports::{Receiver, Sender};
use super::shared::Shared;
use crate::engine::{Planned, Planner, Refused};
use crate::server::{Motion, Snapshot, TimedSetPoint};
use core::ops::Deref;
use core::sync::atomic::Ordering::Relaxed;
use giotto_shared::path::CircleRun;
use giotto_shared::table::Table;
use giotto_shared::wire::{MotionRefusal, MotionState};

/// What the background owns.
pub struct Desk<S, O, I> {
    planner: Planner,
    shared: S,
    segments: O,
    set_points: I,
    /// Ticks that had passed when a run was accepted: until the tick has seen it, it counts as running.
    accepted_at: Option<u32>,
}

impl<S, O, I> Desk<S, O, I>
where
    S: Deref<Target = Shared>,
    O: Sender<Planned>,
    I: Receiver<TimedSetPoint>,
{
    /// Plans for the tick at the other end of these queues.
    pub fn new(planner: Planner, shared: S, segments: O, set_points: I) -> Self {
        Self { planner, shared, segments, set_points, accepted_at: None }
    }
}

/// The engine's refusal in the words of the wire.
fn in_words(refused: Refused) -> MotionRefusal {
    match refused {
        Refused::Busy => MotionRefusal::Busy,
        Refused::Fault => MotionRefusal::Fault,
        Refused::NotANumber(_) | Refused::OutOfBounds(_) => MotionRefusal::Unreachable,
    }
}

impl<S, O, I> Motion for Desk<S, O, I>
where
    S: Deref<Target = Shared>,
    O: Sender<Planned>,
    I: Receiver<TimedSetPoint>,
{
    fn snapshot(&self) -> Snapshot {
        let mut now = self.shared.snapshot();
        let accepted = self.accepted_at == Some(now.tick) || self.segments.waiting() > 0;
        if accepted && now.state == MotionState::Idle {
            now.state = MotionState::Running;
        }
        now
    }

    fn install(&mut self, table: Option<&Table>) -> Result<(), MotionRefusal> {
        if matches!(self.snapshot().state, MotionState::Running | MotionState::Stopping) {
            return Err(MotionRefusal::Busy);
        }
        self.planner.set_table(table).map_err(|_| MotionRefusal::Terms)
    }

    fn bypass(&mut self, on: bool) {
        self.shared.bypass.store(on, Relaxed);
    }

    fn run_circle(&mut self, run: &CircleRun) -> Result<(), MotionRefusal> {
        let now = self.snapshot();
        match now.state {
            MotionState::Idle => {}
            MotionState::Running | MotionState::Stopping => return Err(MotionRefusal::Busy),
            MotionState::Fault => return Err(MotionRefusal::Fault),
        }
        self.planner.resync(now.raw_nm, self.shared.epoch());
        let (approach, circle) = self.planner.circle(run).map_err(in_words)?;
        // At rest the queue is empty, and it has room for both.
        if let Some(approach) = approach {
            self.segments.send(approach).map_err(|_| MotionRefusal::QueueFull)?;
        }
        self.segments.send(circle).map_err(|_| MotionRefusal::QueueFull)?;
        self.accepted_at = Some(now.tick);
        Ok(())
    }

    fn stop(&mut self) {
        self.shared.stop.store(true, Relaxed);
    }

    fn subscribe(&mut self, every: u16) {
        self.shared.every.store(every, Relaxed);
    }

    fn set_points_waiting(&self) -> usize {
        self.set_points.waiting()
    }

    fn next_set_point(&mut self) -> Option<TimedSetPoint> {
        self.set_points.receive()
    }
}
