//! The messages. A change here is a change of [`PROTOCOL_VERSION`].
use super::{ClockSource, EVENTS, Event, KeyInfo, MachineConfig, Refusal, ResetCause};
use crate::path::{ExactCircle, ExactSegment};
use crate::table::image::MachineId;
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

/// Version of the messages of this build; both sides must have the same.
pub const PROTOCOL_VERSION: u16 = 5;

/// Most bytes of a table in one message.
pub const CHUNK: usize = 128;
/// Most set-points in one message from the controller.
pub const SET_POINTS: usize = 6;
/// Most set-points of a stream in one message to it.
pub const POINTS: usize = 40;

/// Bytes of requests that a host may have on their way: a controller keeps as many, and one more frame, until it has
/// time for them.
pub const IN_FLIGHT: usize = 768;

/// A link that is silent for so long during a run counts as dead, unless the host asks otherwise, ms: four times the
/// host's longest silence.
pub const SUPERVISE_MS: u16 = 1000;

/// Least and most of an override of the feed, percent.
pub const OVERRIDE_PERCENT: [u8; 2] = [20, 120];

/// A piece of a table.
pub type Chunk = heapless::Vec<u8, CHUNK>;

/// From the host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Request {
    /// Drawn anew by each client, so that one cannot be answered from what another was told.
    pub session: u16,
    /// Grows by one with each new request; the same in a repetition.
    pub seq: u16,
    /// What to do.
    pub command: Command,
}

/// What a host may ask.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Command {
    /// Who are you? → [`Reply::Identity`].
    Hello,
    /// How are you? → [`Reply::Status`].
    Status,
    /// A table image of this length and CRC will follow.
    WriteBegin {
        /// Length of the image, bytes.
        length: u16,
        /// CRC-32 of all its bytes.
        crc: u32,
    },
    /// The bytes of the image from `offset` on; in order.
    WriteChunk {
        /// Where the bytes belong.
        offset: u16,
        /// The bytes.
        data: Chunk,
    },
    /// All chunks are sent: check the table, program the inactive slot, compare → [`Reply::Written`].
    WriteEnd,
    /// Bytes of a slot → [`Reply::Data`].
    ReadBack {
        /// Slot 0 or 1.
        slot: u8,
        /// First byte.
        offset: u16,
        /// How many, at most [`CHUNK`].
        length: u8,
    },
    /// Use the table written last; until [`Command::Confirm`] it is on probation.
    Commit,
    /// Keep the table on probation: it is the one that boots from now on.
    Confirm,
    /// Return to the last good table.
    Rollback,
    /// Switch the correction off or on.
    Bypass {
        /// `true`: off.
        on: bool,
    },
    /// Run circles.
    RunCircle(ExactCircle),
    /// Stop within limits.
    Stop,
    /// Send every so many ticks' set-point while a run is in progress; 0: none.
    Subscribe {
        /// Ticks from one set-point to the next.
        every: u16,
        /// On the link between replies; otherwise on the board's own port for set-points.
        on_link: bool,
    },
    /// Warm reset, when idle. Where the machine stands is kept.
    Reset,
    /// Provision the public key: from now on only tables signed with it are accepted. Once; where a key was lost, the one
    /// that a confirmed table there is signed with.
    Provision {
        /// Ed25519 public key.
        #[serde(deserialize_with = "array")]
        key: [u8; 32],
    },
    /// After so long without a request the link counts as dead: the segment in hand finishes, nothing else starts.
    /// 0: never. A hello sets [`SUPERVISE_MS`].
    Supervise {
        /// ms.
        after_ms: u16,
    },
    /// Opens a program, at rest: a run whose segments follow. It lasts until [`Command::End`] and what was appended before
    /// it; a stop, a fault or a dead link ends it at once.
    Begin,
    /// The next segment of the open program, from where the one before ends. Refused with
    /// [`QueueFull`](super::MotionRefusal::QueueFull) while there is no room: the queue is the look-ahead.
    Append {
        /// The segment.
        segment: ExactSegment,
        /// How far the path may leave its joint with the segment before, nm; 0: exact stop. This firmware always stops
        /// exactly, which is within any tolerance.
        tolerance_nm: u32,
    },
    /// The program has no more segments, the stream no more set-points.
    End,
    /// Opens a stream of set-points, one a tick, from where the machine stands: a run as a program is.
    BeginStream {
        /// Largest feed, m/s: set-points farther apart are not taken.
        feed_m_s: f32,
        /// The machine begins to follow when so many set-points wait, or as many as the queue holds, or all.
        ahead: u16,
    },
    /// The next set-points of the open stream. Refused with [`QueueFull`](super::MotionRefusal::QueueFull) while there is no
    /// room.
    Points {
        /// For each set-point and axis (X, Y, Z) the change of the step that leads to it from the one before, nm, each as an
        /// i32 of this encoding; the step before the first is 0, the place before it where the machine stands.
        steps: Chunk,
    },
    /// At rest in fault: forget it. Where the machine stands is kept.
    ClearFault,
    /// At rest: the machine stands here. Nothing moves.
    Declare {
        /// Where, nm.
        place_nm: Pose,
    },
    /// Feed hold: slow down along the path within limits; what runs and what waits stays as it is. A ramp in hand is finished
    /// first, and so is a segment too short to gain its feed again.
    Pause,
    /// Ends a feed hold.
    Resume,
    /// Feed of what is accepted from now on, as a share of the one asked for, never above the machine's.
    Override {
        /// [`OVERRIDE_PERCENT`].
        percent: u8,
    },
    /// The limits in use → [`Reply::Config`].
    Config,
    /// At rest: use these limits from now on. A restart brings back those that are stored.
    Configure(MachineConfig),
    /// At rest: store the limits in use.
    SaveConfig,
    /// What has happened from this number on → [`Reply::Events`].
    Events {
        /// Number of the first one wanted; they count from 0 at boot.
        from: u32,
    },
    /// Whose tables are taken → [`Reply::Key`].
    Key,
    /// At rest: another key from now on, by word of the owner of the one before.
    ReplaceKey {
        /// The new one.
        #[serde(deserialize_with = "array")]
        key: [u8; 32],
        /// Signature of the [`replacement`](super::replacement) by the present one: 64 bytes.
        signature: Chunk,
    },
}

/// Reads an array of bytes in a loop: serde's own way is a piece of code a byte, 700 bytes of an image.
fn array<'de, D: Deserializer<'de>, const N: usize>(from: D) -> Result<[u8; N], D::Error> {
    struct Bytes<const N: usize>;
    impl<'de, const N: usize> Visitor<'de> for Bytes<N> {
        type Value = [u8; N];

        fn expecting(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
            f.write_str("bytes")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut from: A) -> Result<[u8; N], A::Error> {
            let mut bytes = [0; N];
            for byte in &mut bytes {
                *byte = from
                    .next_element()?
                    .ok_or_else(|| A::Error::custom("too few"))?;
            }
            Ok(bytes)
        }
    }
    from.deserialize_tuple(N, Bytes)
}

/// From the controller.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant, reason = "no heap to box on")]
pub enum FromController {
    /// The answer to the request with these numbers.
    Reply {
        /// Session of the request.
        session: u16,
        /// Sequence number of the request.
        seq: u16,
        /// The answer.
        reply: Reply,
    },
    /// Unasked, to a subscriber.
    SetPoints(SetPoints),
}

/// Answers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant, reason = "no heap to box on")]
pub enum Reply {
    /// Done.
    Done,
    /// To [`Command::Hello`].
    Identity(Identity),
    /// To [`Command::Status`].
    Status(Status),
    /// To [`Command::WriteEnd`].
    Written {
        /// The slot that now holds the table, programmed and compared.
        slot: u8,
    },
    /// To [`Command::ReadBack`].
    Data {
        /// First byte.
        offset: u16,
        /// The bytes.
        data: Chunk,
    },
    /// Not done, and why.
    Refused(Refusal),
    /// To [`Command::Config`].
    Config {
        /// In use.
        config: MachineConfig,
        /// They are the ones that are stored; `false` as well where none are.
        stored: bool,
    },
    /// To [`Command::Events`].
    Events {
        /// Number of the first one below; what is older than the controller's memory is left out.
        first: u32,
        /// In order; none: there are no more.
        events: heapless::Vec<Event, EVENTS>,
    },
    /// To [`Command::Key`].
    Key(KeyInfo),
}

/// Who the controller is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// Board: `mps2-an386`, `stm32f405`, `virtual`.
    pub board: heapless::String<16>,
    /// Version of the firmware package.
    pub build: heapless::String<16>,
    /// [`PROTOCOL_VERSION`] of the image.
    pub protocol: u16,
    /// Newest table format it reads.
    pub table_format: u16,
    /// Schema hash of its tables.
    pub schema_hash: u32,
    /// Longest table image, bytes.
    pub max_image_bytes: u16,
    /// Ticks a second.
    pub tick_hz: u32,
    /// Whether a key is provisioned: only signed tables are accepted.
    pub signed_only: bool,
    /// Whom signed tables have to be bound to.
    pub machine: MachineId,
}

/// A whole table in a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TableInfo {
    /// Length of the image, bytes.
    pub length: u16,
    /// CRC-32 in its header.
    pub crc: u32,
    /// Generation it was last confirmed as; `None`: never confirmed.
    pub generation: Option<u32>,
}

/// What a slot holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SlotState {
    /// Erased.
    Empty,
    /// Bytes that are not a whole table.
    Invalid,
    /// A whole table of a format this build does not read.
    OtherFormat {
        /// Its format version.
        version: u16,
    },
    /// A whole table.
    Table(TableInfo),
}

/// Where a table committed but not confirmed stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Probation {
    /// No table is on probation.
    None,
    /// It has not run yet.
    Fresh,
    /// Its first run has begun; no second one starts before it is confirmed.
    FirstRun,
}

/// What the engine is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MotionState {
    /// At rest, ready.
    Idle,
    /// Executing a program.
    Running,
    /// Decelerating after a stop.
    Stopping,
    /// In fault: at rest, nothing starts before the fault is cleared.
    Fault,
    /// At rest in a feed hold, the rest of the run still to come.
    Paused,
}

impl MotionState {
    /// A run is under way, if only paused.
    pub const fn is_run(self) -> bool {
        matches!(self, Self::Running | Self::Stopping | Self::Paused)
    }
}

/// What is known of where the machine stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum PositionState {
    /// Nothing: no run starts and no set-point is meant for a drive, before it is declared, or adopted from the first
    /// set-point of a stream.
    Unknown,
    /// Declared, adopted, or that of a machine which is simulated.
    Known,
    /// Kept over a reset.
    Kept,
}

/// Why the engine is in fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FaultCause {
    /// A tick was not finished when the next was due.
    Overrun,
    /// A segment did not start where the machine stood.
    Discontinuity,
    /// Set-points of a stream stayed away.
    Starved,
}

/// Everything that went wrong and was survived; all count from boot and wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Ticks that were not finished when the next was due.
    pub tick_overruns: u32,
    /// Set-points whose offset was clamped.
    pub offset_clamps: u32,
    /// Set-points whose offset rate was clamped.
    pub slew_clamps: u32,
    /// Set-points that a subscriber did not get because the link was full.
    pub dropped_set_points: u32,
    /// Frames with a wrong CRC.
    pub crc_errors: u32,
    /// Frames that were not COBS or not a message.
    pub malformed_frames: u32,
    /// Frames longer than any message.
    pub overlong_frames: u32,
    /// Requests answered from memory.
    pub repeated_requests: u32,
    /// Bytes lost before they were read.
    pub lost_bytes: u32,
    /// Segments thrown away: after a stop, in a fault, or because the link was dead.
    pub dropped_segments: u32,
    /// Segments begun for which no zone of the table holds.
    pub uncorrected_segments: u32,
    /// Stops, by command or input.
    pub stops: u32,
    /// Segments finished.
    pub segments: u32,
    /// Ticks of a stream without a usable set-point.
    pub missing_set_points: u32,
    /// Set-points of a stream that came after their tick.
    pub late_set_points: u32,
    /// Set-points of a stream farther from the one before than its feed allows.
    pub rejected_set_points: u32,
    /// Runs during which the link died.
    pub link_losses: u32,
}

/// A position, nm: whole numbers, so that a set-point is on the host what it was in the tick.
pub type Pose = [i32; 3];

/// The controller's state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Status {
    /// The engine.
    pub motion: MotionState,
    /// Why it is in fault, or will be when it has come to rest.
    pub fault: Option<FaultCause>,
    /// The stop input is active: nothing starts.
    pub stop_input: bool,
    /// Correction off.
    pub bypass: bool,
    /// Slot of the table in use, if one is.
    pub active: Option<u8>,
    /// Both slots.
    pub slots: [SlotState; 2],
    /// Probation of the table in use.
    pub probation: Probation,
    /// Segments, or batches of set-points, that wait.
    pub queued: u8,
    /// Ticks since boot, wrapping.
    pub tick: u32,
    /// Deepest stack since boot, bytes; 0: not measured.
    pub stack_bytes: u32,
    /// Share of its time the core sleeps, thousandths; `None`: not measured.
    pub idle_permille: Option<u16>,
    /// Programmed position, nm.
    pub raw_nm: Pose,
    /// Corrected position, nm.
    pub corrected_nm: Pose,
    /// What is known of where the machine stands.
    pub position: PositionState,
    /// Override of the feed, percent.
    pub override_percent: u8,
    /// Why the controller started.
    pub reset: ResetCause,
    /// What its ticks are counted by.
    pub clock: ClockSource,
    /// Longest tick seen, thousandths of the time between two; `None`: not measured.
    pub worst_tick_permille: Option<u16>,
    /// Stack never used since boot, bytes; 0: not measured.
    pub stack_left_bytes: u32,
    /// Counts.
    pub counters: Counters,
}

/// A set-point before and after the correction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SetPoint {
    /// Programmed position, nm.
    pub raw_nm: Pose,
    /// Corrected position, nm.
    pub corrected_nm: Pose,
}

/// Consecutive set-points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SetPoints {
    /// Tick of the first; a gap to the batch before shows a loss.
    pub tick: u32,
    /// Ticks from one to the next.
    pub every: u16,
    /// No more follow in this run.
    pub last: bool,
    /// The points.
    pub points: heapless::Vec<SetPoint, SET_POINTS>,
}
