//! The background's half: plans what the tick runs, and is the [`Motion`] of the server.
use super::SEGMENTS;
use super::ports::{Receiver, Sender};
use super::shared::Shared;
use crate::engine::{Planned, Planner, Refused, ZoneError};
use crate::server::{Motion, Snapshot, TimedSetPoint};
use core::ops::{Deref, DerefMut};
use core::sync::atomic::Ordering::Relaxed;
use giotto_shared::path::{ExactCircle, ExactSegment};
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

    /// A run may begin; it is planned from where the machine stands.
    fn ready(&mut self) -> Result<(), MotionRefusal> {
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
        Ok(())
    }

    /// A program is open.
    fn program(&self) -> Result<(), MotionRefusal> {
        let open = self.shared.program_open(self.shared.epoch());
        if open { Ok(()) } else { Err(MotionRefusal::NoProgram) }
    }

    fn accepted(&mut self, sent: bool) -> Result<(), MotionRefusal> {
        self.accepted_at = Some(self.shared.snapshot().tick);
        if sent { Ok(()) } else { Err(MotionRefusal::QueueFull) }
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
        Refused::NotANumber(quantity) | Refused::OutOfBounds(quantity) => MotionRefusal::Path(quantity),
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
        now.queued = self.segments.waiting() as u8;
        let open = self.shared.program_open(self.shared.epoch());
        let accepted = open || self.accepted_at == Some(now.tick) || now.queued > 0;
        if accepted && now.state == MotionState::Idle {
            now.state = MotionState::Running;
        }
        now
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
    fn run_circle(&mut self, run: &ExactCircle) -> Result<(), MotionRefusal> {
        self.ready()?;
        let Self { planner, segments, .. } = self;
        // At rest the queue is empty, and it has room for both.
        let mut sent = true;
        planner
            .circle_from_here(run, &mut Planned::default(), |planned| sent &= segments.send(planned))
            .map_err(in_words)?;
        self.accepted(sent)
    }

    fn begin(&mut self) -> Result<(), MotionRefusal> {
        self.ready()?;
        self.shared.set_program(true);
        Ok(())
    }

    #[inline(never)]
    fn append(&mut self, segment: &ExactSegment, _tolerance_nm: u32) -> Result<(), MotionRefusal> {
        self.program()?;
        // Before the work of planning.
        if self.segments.waiting() >= SEGMENTS {
            return Err(MotionRefusal::QueueFull);
        }
        let mut planned = Planned::default();
        self.planner.segment(segment, &mut planned).map_err(in_words)?;
        let sent = self.segments.send(&planned);
        self.accepted(sent)
    }

    fn end(&mut self) -> Result<(), MotionRefusal> {
        self.program()?;
        self.shared.set_program(false);
        // Until the tick has seen it, what was appended last counts as running.
        self.accepted(true)
    }

    fn stop(&mut self) {
        self.shared.stop.store(true, Relaxed);
        self.shared.set_program(false);
    }

    fn hold(&mut self) {
        self.shared.hold.store(true, Relaxed);
        self.shared.set_program(false);
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
