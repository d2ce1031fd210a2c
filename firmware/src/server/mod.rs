//! The protocol state machine: bytes in, bytes out, over a flash and an engine. No clock, no registers.
//!
//! What a request does is never inlined into the loop that waits for it: its frame would lie under all others, and
//! the stack is the half of a controller's memory.
//!
//! Tables live in three places: the [`Store`] (what boots), the engine (what corrects), and in between the
//! buffer of an upload. The order of an update is `WriteBegin`, `WriteChunk`…, `WriteEnd` (the table is
//! checked in memory, only then is the slot not in use programmed and compared), `Commit` (the engine, at
//! rest, takes it over on probation), `Confirm` (it is what boots from now on).
mod authority;
mod bounds;
mod events;
mod motion;
mod session;
mod settings;
mod supervision;
mod tables;
mod upload;

pub mod link;
#[cfg(test)]
mod tests;

pub use bounds::{CENTRIPETAL_MAX_M_S2, MAX_LAPS};
pub use motion::{Motion, Snapshot, TimedSetPoint};

use crate::engine::Config;
use crate::store::{ImageBuffer, Layout, Store, StoredKey};
use core::ops::DerefMut;
use embedded_storage::nor_flash::NorFlash;
use events::Events;
use giotto_shared::table::image::MachineId;
use giotto_shared::table::{FORMAT_VERSION, MAX_IMAGE_BYTES, SCHEMA_HASH};
use giotto_shared::wire::{
    self, Accumulator, CHUNK, Chunk, ClockSource, Command, ConfigField, Counters, Event,
    ExactCircle, ExactSegment, FromController, Identity, MAX_FRAME, MachineConfig, MotionRefusal,
    MotionState, PROTOCOL_VERSION, Probation, Refusal, Reply, ResetCause, SET_POINTS, SUPERVISE_MS,
    SetPoints, Status, What,
};
use session::{Session, Turn};
use supervision::Supervision;
use upload::Upload;

/// What an image says of itself.
#[derive(Clone, Copy, Debug)]
pub struct Board {
    /// Name of the board.
    pub name: &'static str,
    /// Version and, if known, commit it was built from.
    pub build: &'static str,
    /// Ticks a second.
    pub tick_hz: u32,
    /// What they are counted by.
    pub clock: ClockSource,
    /// Why it started.
    pub reset: ResetCause,
    /// Whom tables are bound to: no two boards have the same.
    pub machine: MachineId,
    /// Units of a step of its outputs, where nothing else is stored: so many nm in so many steps.
    pub step: [[u32; 2]; 3],
    /// Whether its timer and its outputs bear these limits; the first that they do not.
    pub bears: fn(&MachineConfig) -> Result<(), ConfigField>,
}

impl Board {
    /// Its own limits, where none are stored.
    pub const fn limits(&self) -> MachineConfig {
        MachineConfig {
            step: self.step,
            ..Config::robot(self.tick_hz).said()
        }
    }
}

/// Memory of a server that is too large for a stack: a board keeps it in a static, the host on the heap.
#[derive(Debug)]
pub struct Buffers {
    image: ImageBuffer,
    accumulator: Accumulator,
    /// The reply to the last request, for its repetition.
    reply: [u8; MAX_FRAME],
    reply_length: usize,
    /// Any other frame on its way out.
    frame: [u8; MAX_FRAME],
}

impl Default for Buffers {
    fn default() -> Self {
        Self::new()
    }
}

impl Buffers {
    /// Empty.
    pub const fn new() -> Self {
        let frame = [0; MAX_FRAME];
        Self {
            image: [0; MAX_IMAGE_BYTES],
            accumulator: Accumulator::new(),
            reply: frame,
            reply_length: 0,
            frame,
        }
    }
}

/// The server of one controller.
#[derive(Debug)]
pub struct Server<F, M, B> {
    board: Board,
    store: Store<F>,
    key: StoredKey,
    motion: M,
    buffers: B,
    session: Session,
    upload: Upload,
    /// Slot whose table the engine has.
    active: Option<u8>,
    /// Slot programmed since boot and not yet committed.
    written: Option<u8>,
    probation: Probation,
    /// Asked for by the host; without a table the engine is in bypass anyway.
    bypass: bool,
    every: u16,
    on_link: bool,
    /// A set-point that does not continue the batch before it.
    held: Option<TimedSetPoint>,
    supervision: Supervision,
    events: Events,
    config: MachineConfig,
    config_stored: bool,
    lost_bytes: u32,
    stack_bytes: u32,
    stack_left_bytes: u32,
    worst_tick_permille: Option<u16>,
    idle_permille: Option<u16>,
    reset: bool,
}

impl<F: NorFlash, M: Motion, B: DerefMut<Target = Buffers>> Server<F, M, B> {
    /// Boots: the newest confirmed table that this image reads goes to the engine; if there is none, bypass.
    pub fn boot(board: Board, flash: F, layout: Layout, motion: M, buffers: B) -> Self {
        let mut server = Self::new(board, flash, layout, motion, buffers);
        server.wake();
        server
    }

    /// Before it [wakes](Self::wake): where a stack is short this frame is not to lie under what checks a signature.
    #[inline(never)]
    pub fn new(board: Board, flash: F, layout: Layout, motion: M, mut buffers: B) -> Self {
        let mut store = Store::open(flash, layout, &mut buffers.image);
        Self {
            key: store.boot_key(),
            board,
            store,
            motion,
            buffers,
            session: Session::new(),
            upload: Upload::new(),
            active: None,
            written: None,
            probation: Probation::None,
            bypass: false,
            every: 0,
            on_link: false,
            held: None,
            supervision: Supervision::new(board.tick_hz),
            events: Events::new(),
            config: board.limits(),
            config_stored: false,
            lost_bytes: 0,
            stack_bytes: 0,
            stack_left_bytes: 0,
            worst_tick_permille: None,
            idle_permille: None,
            reset: false,
        }
    }

    /// Takes limits and table from the store; once, before anything else.
    #[inline(never)]
    pub fn wake(&mut self) {
        self.load_config();
        self.install_last_good();
        // What power has kept from being said is said now; a flash that fails says so at the next confirmation.
        let _ = self.keep_serial();
        self.events.booted(self.board.reset, self.active);
    }

    /// The engine.
    pub const fn motion_mut(&mut self) -> &mut M {
        &mut self.motion
    }

    /// The store.
    pub const fn store_mut(&mut self) -> &mut Store<F> {
        &mut self.store
    }

    /// Goes on in the bypass that another server of the same engine has left.
    pub fn keep_bypass(&mut self, on: bool) {
        self.bypass = on;
    }

    /// Gives back flash and engine, as a reset does.
    pub fn into_parts(self) -> (F, M) {
        (self.store.into_flash(), self.motion)
    }

    /// Slot whose table the engine corrects with.
    pub const fn active(&self) -> Option<u8> {
        self.active
    }

    /// Whether a reset was asked for; the reply has to leave first.
    pub const fn reset_requested(&self) -> bool {
        self.reset
    }

    /// Counts bytes that the port lost before [`Server::receive`].
    pub const fn count_lost_bytes(&mut self, count: u32) {
        self.lost_bytes = self.lost_bytes.wrapping_add(count);
    }

    /// Deepest stack since boot, and what is left of it, as the board measures them.
    pub const fn note_stack(&mut self, bytes: u32, left_bytes: u32) {
        (self.stack_bytes, self.stack_left_bytes) = (bytes, left_bytes);
    }

    /// Longest tick since boot, thousandths of the time between two, as the board measures it.
    pub const fn note_worst_tick(&mut self, permille: u16) {
        self.worst_tick_permille = Some(permille);
    }

    /// Keeps it for the log.
    fn note(&mut self, what: What) {
        let tick = self.motion.now();
        self.events.add(tick, what);
    }

    /// Share of its time the core sleeps, thousandths, as the board measures it.
    pub const fn note_idle(&mut self, permille: u16) {
        self.idle_permille = Some(permille);
    }

    /// Looks whether the link is still alive; to be called again and again.
    pub fn supervise(&mut self) {
        let snapshot = self.motion.snapshot();
        self.events.look(&snapshot);
        if !self.motion.plans() {
            return;
        }
        let now = self.motion.now();
        if self.supervision.silent(now) && self.supervision.dead(snapshot.state, now) {
            self.motion.hold();
            self.note(What::LinkLost);
        }
        if self.supervision.overdue(now) {
            self.motion.stop();
            self.note(What::Overdue);
        }
    }

    /// Takes a byte from the link; returns the frame to send if it completed a request.
    pub fn receive(&mut self, byte: u8) -> Option<&[u8]> {
        let payload = self.buffers.accumulator.push(byte)?;
        let number = session::number(payload);
        let (head, command) = match session::read(payload) {
            Some(request) => request,
            None => {
                self.session.count_malformed();
                return None;
            }
        };
        self.supervision.heard(self.motion.now());
        let opens = matches!(command, Ok(Command::Hello));
        match self.session.turn(head, opens) {
            Turn::Repeated => {}
            Turn::Late => return None,
            // Not remembered: a stranger does not disturb whoever has the session. But whoever sees the need may stop, hold, and
            // slow down.
            Turn::Unknown => {
                let reply = match command {
                    Ok(command) if session::from_anyone(&command) => {
                        self.execute(&command).unwrap_or_else(Reply::Refused)
                    }
                    _ => Reply::Refused(Refusal::NoSession),
                };
                return session::frame(head, reply, &mut self.buffers.frame);
            }
            Turn::New => {
                let reply = match command {
                    Ok(command) => match self.execute(&command) {
                        Ok(reply) => reply,
                        Err(why) => self.refuse(number, why),
                    },
                    Err(session::NotUnderstood) => Reply::Refused(Refusal::NotUnderstood),
                };
                self.session.answered(head);
                let framed = session::frame(head, reply, &mut self.buffers.reply);
                self.buffers.reply_length = framed.map_or(0, <[u8]>::len);
            }
        }
        self.buffers.reply.get(..self.buffers.reply_length)
    }

    /// The next frame of set-points, once it is full or the run has ended.
    fn set_points(&mut self) -> Option<&[u8]> {
        let moving = self.motion.snapshot().state.is_run();
        if moving && self.motion.set_points_waiting() < SET_POINTS {
            return None;
        }
        let first = self.held.take().or_else(|| self.motion.next_set_point())?;
        let (tick, every) = (first.tick, self.every);
        let mut batch = SetPoints {
            tick,
            every,
            last: first.last,
            points: heapless::Vec::new(),
        };
        let mut due = first.tick;
        let mut next = Some(first);
        while let Some(point) = next.take() {
            if point.tick != due {
                self.held = Some(point);
                break;
            }
            batch.last = point.last;
            due = due.wrapping_add(u32::from(every));
            if batch.points.push(point.point).is_err() || batch.points.is_full() || batch.last {
                break;
            }
            next = self.motion.next_set_point();
        }
        wire::encode(&FromController::SetPoints(batch), &mut self.buffers.frame)
            .ok()
            .map(|frame| &*frame)
    }

    #[inline(never)]
    fn execute(&mut self, command: &Command) -> Result<Reply, Refusal> {
        match command {
            Command::Hello => {
                self.supervision.set(SUPERVISE_MS);
                return Ok(Reply::Identity(self.identity()));
            }
            Command::Status => return Ok(Reply::Status(self.status())),
            Command::WriteBegin { length, crc } => self.upload.begin(*length, *crc)?,
            Command::WriteChunk { offset, data } => {
                self.upload.chunk(*offset, data, &mut self.buffers.image)?
            }
            Command::WriteEnd => {
                let slot = self.program()?;
                self.note(What::Written { slot });
                return Ok(Reply::Written { slot });
            }
            Command::ReadBack {
                slot,
                offset,
                length,
            } => return self.read_back(*slot, *offset, *length),
            Command::Commit => {
                let slot = self.commit()?;
                self.note(What::Committed { slot });
            }
            Command::Confirm => {
                let slot = self.confirm()?;
                self.note(What::Confirmed { slot });
            }
            Command::Rollback => {
                self.roll_back()?;
                let slot = self.active;
                self.note(What::RolledBack { slot });
            }
            Command::Bypass { on } => {
                if !*on && self.active.is_none() {
                    return Err(Refusal::NoTable);
                }
                if !*on && self.clock_forbids() {
                    return Err(Refusal::Clock);
                }
                self.bypass = *on;
                self.apply_bypass();
                self.note(What::Bypassed { on: *on });
            }
            Command::RunCircle(run) => self.run_circle(run)?,
            Command::Begin => self.begin()?,
            Command::Append {
                segment,
                tolerance_nm,
            } => self.append(segment, *tolerance_nm)?,
            Command::End => self.motion.end().map_err(Refusal::Motion)?,
            Command::BeginStream { feed_m_s, ahead } => self.begin_stream(*feed_m_s, *ahead)?,
            Command::Points { steps } => self.motion.points(steps).map_err(Refusal::Motion)?,
            Command::Stop => {
                self.motion.stop();
                self.note(What::Stopped);
            }
            Command::Subscribe { every, on_link } => self.subscribe(*every, *on_link),
            Command::Reset => {
                self.idle()?;
                self.reset = true;
            }
            Command::ClearFault => self.motion.clear_fault().map_err(Refusal::Motion)?,
            Command::Declare { place_nm } => {
                self.motion.declare(*place_nm).map_err(Refusal::Motion)?;
                self.note(What::Declared);
            }
            Command::Pause => self.motion.pause(true).map_err(Refusal::Motion)?,
            Command::Resume => self.motion.pause(false).map_err(Refusal::Motion)?,
            Command::Override { percent } => self.set_override(*percent)?,
            Command::Config => return Ok(self.config()),
            Command::Configure(config) => self.configure(config)?,
            Command::SaveConfig => self.save_config()?,
            Command::Events { from } => return Ok(self.events(*from)),
            Command::Supervise { after_ms } => self.supervision.set(*after_ms),
            Command::Provision { key } => self.provision(key)?,
            Command::Key => return Ok(Reply::Key(self.key_info())),
            Command::ReplaceKey { key, signature } => self.replace_key(key, signature)?,
        }
        Ok(Reply::Done)
    }

    /// For the log, unless it is only a matter of time.
    #[inline(never)]
    fn refuse(&mut self, request: u8, why: Refusal) -> Reply {
        if why != Refusal::Motion(MotionRefusal::QueueFull) {
            self.note(What::Refused { request, why });
        }
        Reply::Refused(why)
    }

    #[inline(never)]
    fn events(&self, from: u32) -> Reply {
        let (first, events) = self.events.from(from);
        Reply::Events { first, events }
    }

    /// Whether something has happened since the event before this number.
    #[inline]
    pub fn has_event(&self, number: u32) -> bool {
        self.events.next() != number
    }

    /// The event of this number, or the oldest one still known, with its own; for a board's log.
    pub fn event(&self, number: u32) -> Option<(u32, Event)> {
        let (first, events) = self.events.from(number);
        events.first().map(|event| (first, *event))
    }

    fn set_override(&mut self, percent: u8) -> Result<(), Refusal> {
        bounds::check_override(percent).map_err(Refusal::Motion)?;
        self.motion.set_override(percent);
        Ok(())
    }

    /// Sends every so many ticks' set-point, on the link or on the port for set-points; 0: none.
    pub fn subscribe(&mut self, every: u16, on_link: bool) {
        (self.every, self.on_link) = (every, on_link);
        self.motion.subscribe(every);
    }

    fn idle(&self) -> Result<(), Refusal> {
        match self.motion.snapshot().state {
            MotionState::Idle | MotionState::Fault => Ok(()),
            MotionState::Running | MotionState::Stopping | MotionState::Paused => {
                Err(Refusal::Busy)
            }
        }
    }

    /// A table may be exchanged.
    fn exchanges(&self) -> Result<(), Refusal> {
        if self.motion.plans() {
            self.idle()
        } else {
            Ok(())
        }
    }

    fn bypassed(&self) -> bool {
        self.bypass || self.active.is_none() || self.clock_forbids()
    }

    fn apply_bypass(&mut self) {
        self.motion.bypass(self.bypassed());
    }

    #[inline(never)]
    fn read_back(&mut self, slot: u8, offset: u16, length: u8) -> Result<Reply, Refusal> {
        let length = usize::from(length);
        if slot > 1 || length > CHUNK {
            return Err(Refusal::NoSuchPlace);
        }
        let mut data = Chunk::new();
        data.resize(length, 0).map_err(|_| Refusal::NoSuchPlace)?;
        self.store
            .read(slot, u32::from(offset), &mut data)
            .map_err(|_| Refusal::NoSuchPlace)?;
        Ok(Reply::Data { offset, data })
    }

    #[inline(never)]
    fn run_circle(&mut self, run: &ExactCircle) -> Result<(), Refusal> {
        self.may_run()?;
        bounds::check_run(run).map_err(Refusal::Motion)?;
        self.motion.run_circle(run).map_err(Refusal::Motion)?;
        self.has_run();
        Ok(())
    }

    /// A program is one run however many segments it has, and however long it waits for them.
    #[inline(never)]
    fn begin(&mut self) -> Result<(), Refusal> {
        self.may_run()?;
        self.motion.begin().map_err(Refusal::Motion)?;
        self.has_run();
        Ok(())
    }

    #[inline(never)]
    fn begin_stream(&mut self, feed_m_s: f32, ahead: u16) -> Result<(), Refusal> {
        self.may_run()?;
        bounds::check_feed(feed_m_s)
            .and_then(|()| self.motion.begin_stream(feed_m_s, ahead))
            .map_err(Refusal::Motion)?;
        self.has_run();
        Ok(())
    }

    #[inline(never)]
    fn append(&mut self, segment: &ExactSegment, tolerance_nm: u32) -> Result<(), Refusal> {
        bounds::check_segment(segment)
            .and_then(|()| self.motion.append(segment, tolerance_nm))
            .map_err(Refusal::Motion)
    }

    /// At rest, and a table on probation has not had its run yet.
    fn may_run(&self) -> Result<(), Refusal> {
        self.idle()?;
        if self.probation == Probation::FirstRun {
            Err(Refusal::ProbationOver)
        } else {
            Ok(())
        }
    }

    fn has_run(&mut self) {
        if self.probation == Probation::Fresh {
            self.probation = Probation::FirstRun;
        }
    }

    #[inline(never)]
    fn identity(&self) -> Identity {
        Identity {
            board: cut(self.board.name),
            build: cut(self.board.build),
            protocol: PROTOCOL_VERSION,
            table_format: FORMAT_VERSION,
            schema_hash: SCHEMA_HASH,
            max_image_bytes: MAX_IMAGE_BYTES as u16,
            tick_hz: self.board.tick_hz,
            signed_only: self.signed_only(),
            machine: self.board.machine,
        }
    }

    #[inline(never)]
    fn status(&self) -> Status {
        let now = self.motion.snapshot();
        let frames = self.buffers.accumulator.counts();
        Status {
            motion: now.state,
            fault: now.fault,
            stop_input: now.stop_input,
            bypass: self.bypassed(),
            active: self.active,
            slots: [self.store.state(0), self.store.state(1)],
            probation: self.probation,
            queued: now.queued,
            tick: now.tick,
            stack_bytes: self.stack_bytes,
            idle_permille: self.idle_permille,
            raw_nm: now.raw_nm,
            corrected_nm: now.corrected_nm,
            position: now.position,
            reset: self.board.reset,
            clock: self.board.clock,
            worst_tick_permille: self.worst_tick_permille,
            stack_left_bytes: self.stack_left_bytes,
            override_percent: now.override_percent,
            counters: Counters {
                tick_overruns: now.tick_overruns,
                offset_clamps: now.offset_clamps,
                slew_clamps: now.slew_clamps,
                dropped_set_points: now.dropped_set_points,
                crc_errors: frames.crc_errors,
                malformed_frames: frames.malformed.wrapping_add(self.session.malformed()),
                overlong_frames: frames.overlong,
                repeated_requests: self.session.repeated(),
                lost_bytes: self.lost_bytes,
                dropped_segments: now.dropped_segments,
                uncorrected_segments: now.uncorrected_segments,
                stops: now.stops,
                segments: now.segments,
                missing_set_points: now.missing_set_points,
                late_set_points: now.late_set_points,
                rejected_set_points: now.rejected_set_points,
                link_losses: self.supervision.losses(),
            },
        }
    }
}

/// A name, cut to fit.
fn cut(name: &str) -> heapless::String<16> {
    let mut out = heapless::String::new();
    // Names are ASCII; one that could not be cut here would be left out.
    let _ = out.push_str(name.get(..16).unwrap_or(name));
    out
}
