//! The background's half: plans what the tick runs, and is the [`Motion`] of the server.
use super::ports::{Receiver, Sender};
use super::shared::Shared;
use crate::engine::{Planned, Planner, Refused, ZoneError};
use crate::server::{Motion, Snapshot, TimedSetPoint};
use core::ops::{Deref, DerefMut};
use core::sync::atomic::Ordering::Relaxed;
use giotto_shared::path::CircleRun;
use giotto_shared::table::{self, Table, TableError};
use giotto_shared::wire::{MotionRefusal, MotionState, Refusal};

/// What the background owns.
pub struct Desk<P, S, O, I> {
    planner: P,
    shared: S,
    segments: O,
    set_points: I,
    /// Ticks that had passed when a run was accepted: until the tick has seen it, it counts as running.
    accepted_at: Option<u32>,
}

impl<P, S, O, I> Desk<P, S, O, I>
where
    P: DerefMut<Target = Planner>,
    S: Deref<Target = Shared>,
    O: Sender<Planned>,
    I: Receiver<TimedSetPoint>,
{
    /// Plans for the tick at the other end of these queues.
    pub fn new(planner: P, shared: S, segments: O, set_points: I) -> Self {
        Self { planner, shared, segments, set_points, accepted_at: None }
    }
}

/// Why a table cannot be used.
enum Unusable {
    Table(TableError),
    Terms,
}

impl From<ZoneError> for Unusable {
    fn from(_: ZoneError) -> Self {
        Self::Terms
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

impl<P, S, O, I> Motion for Desk<P, S, O, I>
where
    P: DerefMut<Target = Planner>,
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

    #[inline]
    fn now(&self) -> u32 {
        self.shared.now()
    }

    fn install(&mut self, image: Option<&[u8]>) -> Result<(), Refusal> {
        if matches!(self.snapshot().state, MotionState::Running | MotionState::Stopping) {
            return Err(Refusal::Motion(MotionRefusal::Busy));
        }
        let Some(image) = image else {
            return self.planner.set_table(None).map_err(|_| Refusal::Motion(MotionRefusal::Terms));
        };
        let fill = |table: &mut Table| table::decode_into(image, table).map_err(Unusable::Table);
        self.planner.load_table(fill).map_err(|unusable| match unusable {
            Unusable::Table(error) => Refusal::Table(error),
            Unusable::Terms => Refusal::Motion(MotionRefusal::Terms),
        })
    }

    fn bypass(&mut self, on: bool) {
        self.shared.bypass.store(on, Relaxed);
    }

    #[inline(never)]
    fn run_circle(&mut self, run: &CircleRun) -> Result<(), MotionRefusal> {
        let now = self.snapshot();
        match now.state {
            MotionState::Idle => {}
            MotionState::Running | MotionState::Stopping => return Err(MotionRefusal::Busy),
            MotionState::Fault => return Err(MotionRefusal::Fault),
        }
        if now.stop_input {
            return Err(MotionRefusal::StopInput);
        }
        self.shared.hold.store(false, Relaxed);
        self.planner.resync(now.raw_nm, self.shared.epoch());
        let (mut approach, mut circle) = (None, Planned::default());
        self.planner.circle(run, &mut approach, &mut circle).map_err(in_words)?;
        // At rest the queue is empty, and it has room for both.
        if !(approach.as_ref().is_none_or(|approach| self.segments.send(approach))
            && self.segments.send(&circle))
        {
            return Err(MotionRefusal::QueueFull);
        }
        self.accepted_at = Some(now.tick);
        Ok(())
    }

    fn stop(&mut self) {
        self.shared.stop.store(true, Relaxed);
    }

    fn hold(&mut self) {
        self.shared.hold.store(true, Relaxed);
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
