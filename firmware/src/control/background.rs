//! The background's half: plans what the tick runs, and is the [`Motion`] of the server.
use super::job::{Job, Points};
use super::ports::{Receiver, Sender};
use super::shared::{DECLARE, Shared};
use super::{SEGMENTS, STREAM_PLACES};
use crate::engine::{
    Config, FARTHEST_NM, MAX_POSITION_M, Planned, Planner, Refused, ZoneError, farthest_nm,
};
use crate::server::{Motion, Snapshot, TimedSetPoint};
use core::ops::{Deref, DerefMut};
use core::sync::atomic::Ordering::Relaxed;
use giotto_shared::path::{ExactArc, ExactCircle, ExactSegment, Quantity};
use giotto_shared::table::{self, Table, TableError};
use giotto_shared::wire::{MotionRefusal, MotionState, Pose, PositionState, Refusal, Steps};

/// What the background owns.
pub struct Desk<P, S, O, I> {
    planner: P,
    shared: S,
    segments: O,
    set_points: I,
    /// Ticks that had passed when a run was accepted: until the tick has seen it, it counts as running.
    accepted_at: Option<u32>,
    /// What is open is a stream.
    stream: Option<Streamed>,
}

/// Set-points of a stream so far.
#[derive(Clone, Copy)]
struct Streamed {
    steps: Steps,
    /// Number of the next one.
    next: u16,
    /// So many have to wait before the tick begins.
    ahead: u16,
    batches: u16,
    /// Ticks that the tick may carry on beyond what has come, and its limits when it then stops.
    hold_ticks: u32,
    limits: [f32; 2],
}

/// Farthest coordinate of a set-point, nm.
const MAX_POSITION_NM: u32 = (MAX_POSITION_M * 1e9) as u32;

impl Streamed {
    /// Reads set-points.
    ///
    /// # Errors
    /// Bytes are left over, they are more than a batch, a place is none, or one from which a stop would lead out of all places.
    fn read(&mut self, mut bytes: &[u8], points: &mut Points) -> Result<(), MotionRefusal> {
        const NONE: MotionRefusal = MotionRefusal::Path(Quantity::Position);
        points.first = self.next;
        while !bytes.is_empty() {
            let before = self.steps.step_nm();
            bytes = self.steps.read(bytes).ok_or(NONE)?;
            let place_nm = self.steps.place_nm;
            if place_nm
                .iter()
                .any(|nm| nm.unsigned_abs() > MAX_POSITION_NM)
            {
                return Err(NONE);
            }
            if self.leads_out(before) {
                return Err(MotionRefusal::NoRoomToStop);
            }
            *points
                .place_nm
                .get_mut(usize::from(points.count))
                .ok_or(NONE)? = place_nm;
            points.count = points.count.wrapping_add(1);
            self.next = self.next.wrapping_add(1);
        }
        Ok(())
    }

    /// Whether the machine, were the newest set-point the last one to come, would leave the coordinates before it stands: at once
    /// braked, or carried on first at the last velocity and acceleration. Mostly one comparison an axis: few are so near.
    fn leads_out(&self, before: Pose) -> bool {
        /// Farther from the end of the coordinates than any brake is long.
        const FAR_NM: u32 = FARTHEST_NM as u32 / 2;
        /// What single precision, whole nanometres and the length of a tick leave, nm.
        const SLACK_NM: f32 = 50_000.0;
        let step = self.steps.step_nm();
        let place = self.steps.place_nm;
        if place.iter().all(|nm| nm.unsigned_abs() < FAR_NM) {
            return false;
        }
        let velocity = step.map(|nm| nm as f32);
        let (mut change, mut carried) = ([0.0; 3], velocity);
        for axis in 0..3 {
            change[axis] = step[axis].wrapping_sub(before[axis]) as f32;
            carried[axis] += self.hold_ticks as f32 * change[axis];
        }
        (0..3).any(|axis| {
            let mut outward = [0.0; 3];
            outward[axis] = if place[axis] < 0 { -1.0 } else { 1.0 };
            let farthest = |velocity| farthest_nm(self.limits, velocity, change, outward);
            let side = outward[axis];
            // While carried on the velocity changes evenly: on average it is that between its ends.
            let mean = 0.5 * side * (velocity[axis] + carried[axis] + change[axis]);
            let on = self.hold_ticks as f32 * mean.max(side * velocity[axis]).max(0.0);
            let way = farthest(velocity).max(on + farthest(carried));
            way > 0.0 && place[axis].unsigned_abs() as f32 + way + SLACK_NM > FARTHEST_NM as f32
        })
    }
}

impl<P, S, O, I> Desk<P, S, O, I>
where
    P: DerefMut<Target = Planner>,
    S: Deref<Target = Shared>,
    O: Sender<Job>,
    I: Receiver<TimedSetPoint>,
{
    /// Plans for the tick at the other end of these queues.
    pub fn new(planner: P, shared: S, segments: O, set_points: I) -> Self {
        Self {
            planner,
            shared,
            segments,
            set_points,
            accepted_at: None,
            stream: None,
        }
    }

    /// A run may begin; it is planned from where the machine stands.
    fn ready(&mut self) -> Result<(), MotionRefusal> {
        let now = self.snapshot();
        match now.state {
            MotionState::Idle => {}
            MotionState::Running | MotionState::Stopping | MotionState::Paused => {
                return Err(MotionRefusal::Busy);
            }
            MotionState::Fault => return Err(MotionRefusal::Fault),
        }
        if now.stop_input {
            return Err(MotionRefusal::StopInput);
        }
        if now.position == PositionState::Unknown {
            return Err(MotionRefusal::NoPosition);
        }
        self.shared.hold.store(false, Relaxed);
        self.shared.pause.store(false, Relaxed);
        // What was declared a moment ago the tick may not have seen.
        let declared = self.shared.asked.load(Relaxed) & DECLARE != 0;
        let here_nm = if declared {
            self.shared.declared_nm()
        } else {
            now.raw_nm
        };
        self.planner.resync(here_nm, self.shared.epoch());
        Ok(())
    }

    /// Something is open: a program, or a stream.
    fn open(&self, stream: bool) -> Result<(), MotionRefusal> {
        let open = self.shared.program_open(self.shared.epoch()) && self.stream.is_some() == stream;
        if open {
            Ok(())
        } else {
            Err(MotionRefusal::NoProgram)
        }
    }

    /// Before the work of planning.
    fn room(&self) -> Result<(), MotionRefusal> {
        if self.segments.waiting() < SEGMENTS {
            Ok(())
        } else {
            Err(MotionRefusal::QueueFull)
        }
    }

    fn accepted(&mut self, sent: bool) -> Result<(), MotionRefusal> {
        self.accepted_at = Some(self.shared.snapshot().tick);
        if sent {
            Ok(())
        } else {
            Err(MotionRefusal::QueueFull)
        }
    }

    /// The feed asked for under the override: never above the machine's, unless it was asked for, which is refused.
    fn overridden(&self, feed_m_s: f32) -> f32 {
        let limit = self.planner.feed_limit();
        let wanted = feed_m_s * f32::from(self.shared.override_percent()) * 0.01;
        if feed_m_s > limit {
            feed_m_s
        } else if wanted > limit {
            limit
        } else {
            wanted
        }
    }

    /// Plans a segment where the queue will take it from.
    fn plan(
        &mut self,
        plan: impl FnOnce(&mut Planner, &mut Planned) -> Result<bool, Refused>,
    ) -> Result<(), MotionRefusal> {
        let mut job = Job::blank();
        let Some(planned) = job.planned() else {
            return Ok(());
        };
        let sent = !plan(&mut self.planner, planned).map_err(in_words)? || self.segments.send(&job);
        self.accepted(sent)
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
        Refused::SoftLimit(axis) => MotionRefusal::SoftLimit { axis },
        Refused::OutOfBounds(Quantity::Length) => MotionRefusal::TooLong,
        Refused::NotANumber(quantity) | Refused::OutOfBounds(quantity) => {
            MotionRefusal::Path(quantity)
        }
    }
}

impl<P, S, O, I> Motion for Desk<P, S, O, I>
where
    P: DerefMut<Target = Planner>,
    S: Deref<Target = Shared>,
    O: Sender<Job>,
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

    #[inline]
    fn now(&self) -> u32 {
        self.shared.now()
    }

    fn install(&mut self, image: Option<&[u8]>) -> Result<(), Refusal> {
        if self.snapshot().state.is_run() {
            return Err(Refusal::Motion(MotionRefusal::Busy));
        }
        let Some(image) = image else {
            return self
                .planner
                .set_table(None)
                .map_err(|_| Refusal::Motion(MotionRefusal::Terms));
        };
        let fill = |table: &mut Table| table::decode_into(image, table).map_err(Unusable::Table);
        self.planner
            .load_table(fill)
            .map_err(|unusable| match unusable {
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
        self.stream = None;
        // At rest the queue is empty, and it has room for both.
        let feed_m_s = self.overridden(run.feed_m_s);
        let run = ExactCircle { feed_m_s, ..*run };
        self.planner.soft_circle(&run).map_err(in_words)?;
        self.plan(|planner, planned| {
            let moves = planner.approach(&run, planned);
            // The way there is not what was asked for.
            planned.leave_out();
            moves
        })?;
        self.plan(|planner, planned| planner.circle(&run, planned).map(|()| true))
    }

    fn begin(&mut self) -> Result<(), MotionRefusal> {
        self.ready()?;
        self.stream = None;
        self.shared.set_program(true);
        Ok(())
    }

    #[inline(never)]
    fn append(&mut self, segment: &ExactSegment, _tolerance_nm: u32) -> Result<(), MotionRefusal> {
        self.open(false)?;
        self.room()?;
        let mut segment = *segment;
        if let ExactSegment::Line { feed_m_s, .. } | ExactSegment::Arc(ExactArc { feed_m_s, .. }) =
            &mut segment
        {
            *feed_m_s = self.overridden(*feed_m_s);
        }
        self.plan(|planner, planned| planner.segment(&segment, planned).map(|()| true))
    }

    #[inline(never)]
    fn begin_stream(&mut self, feed_m_s: f32, ahead: u16) -> Result<(), MotionRefusal> {
        self.ready()?;
        let plan = self
            .planner
            .stream(feed_m_s, STREAM_PLACES)
            .map_err(in_words)?;
        self.plan(|planner, planned| {
            planner.clear(planned);
            Ok(true)
        })?;
        self.shared.go.store(false, Relaxed);
        let sent = self.segments.send(&Job::Stream(plan));
        let place_nm = self.planner.position_nm();
        self.stream = Some(Streamed {
            steps: Steps::from(place_nm),
            next: 0,
            ahead,
            batches: 0,
            hold_ticks: plan.longest_gap(),
            limits: plan.limits(),
        });
        self.shared.set_program(true);
        self.accepted(sent)
    }

    #[inline(never)]
    fn points(&mut self, bytes: &[u8]) -> Result<(), MotionRefusal> {
        self.open(true)?;
        self.room()?;
        let Some(mut streamed) = self.stream else {
            return Err(MotionRefusal::NoProgram);
        };
        let mut job = Job::Points(Points::NONE);
        if let Job::Points(points) = &mut job {
            streamed.read(bytes, points)?;
            let count = usize::from(points.count);
            for place_nm in points.place_nm.get(..count).unwrap_or(&[]) {
                self.planner.soft_place(place_nm).map_err(in_words)?;
            }
        }
        let sent = self.segments.send(&job);
        streamed.batches = streamed.batches.saturating_add(1);
        self.stream = Some(streamed);
        // The queue is full of set-points alone.
        let full = usize::from(streamed.batches) >= SEGMENTS && self.segments.waiting() >= SEGMENTS;
        if streamed.next >= streamed.ahead || full {
            self.shared.go.store(true, Relaxed);
        }
        self.accepted(sent)
    }

    #[inline(never)]
    fn end(&mut self) -> Result<(), MotionRefusal> {
        if self.open(true).is_ok() {
            self.room()?;
            let first = self.stream.map_or(0, |streamed| streamed.next);
            self.segments.send(&Job::Points(Points {
                first,
                last: true,
                ..Points::NONE
            }));
            self.shared.go.store(true, Relaxed);
        } else {
            self.open(false)?;
        }
        self.shared.set_program(false);
        // Until the tick has seen it, what was appended last counts as running.
        self.accepted(true)
    }

    fn stop(&mut self) {
        self.shared.stop.store(true, Relaxed);
        self.shared.pause.store(false, Relaxed);
        self.shared.set_program(false);
    }

    fn hold(&mut self) {
        self.shared.hold.store(true, Relaxed);
        self.shared.set_program(false);
    }

    fn configure(&mut self, config: &Config) -> Result<(), MotionRefusal> {
        if self.snapshot().state.is_run() {
            return Err(MotionRefusal::Busy);
        }
        self.planner.set_config(config);
        Ok(())
    }

    fn pause(&mut self, on: bool) -> Result<(), MotionRefusal> {
        let now = self.snapshot();
        let holds = matches!(now.state, MotionState::Running | MotionState::Paused)
            && self.stream.is_none();
        if on && !holds {
            return Err(MotionRefusal::NotHeld);
        }
        self.shared.pause.store(on, Relaxed);
        Ok(())
    }

    fn set_override(&mut self, percent: u8) {
        self.shared.set_override(percent);
    }

    fn clear_fault(&mut self) -> Result<(), MotionRefusal> {
        if self.snapshot().state.is_run() {
            return Err(MotionRefusal::Busy);
        }
        self.shared.clear_fault();
        Ok(())
    }

    fn declare(&mut self, place_nm: Pose) -> Result<(), MotionRefusal> {
        if self.snapshot().state.is_run() {
            return Err(MotionRefusal::Busy);
        }
        let outside = |nm: &i32| nm.unsigned_abs() > MAX_POSITION_NM;
        if place_nm.iter().any(outside) {
            return Err(MotionRefusal::Path(Quantity::Position));
        }
        self.shared.declare(place_nm);
        Ok(())
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
