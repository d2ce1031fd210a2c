//! What host and controller say to each other.
//!
//! ```text
//! frame = COBS( postcard(message) · CRC-32 little endian ) · 00
//! ```
//!
//! The host sends a [`Request`] and waits for the [`FromController::Reply`] with the same session and
//! sequence number; if none comes it sends the same request again. The controller remembers the last request it
//! carried out and answers a repetition from memory, so a lost answer never makes a command happen twice; a
//! request that comes late, after a newer one of the session, is dropped. A session begins with
//! [`Command::Hello`].
//!
//! Up to [`IN_FLIGHT`] bytes of requests may be on their way at once if each of them does no harm a second time:
//! [`Command::WriteChunk`], of which the controller takes the next in order only, and [`Command::ReadBack`]. What is
//! lost of them is sent again as a new request.
//!
//! Between replies the controller may send [`FromController::SetPoints`] to a subscriber.
//!
//! | module | holds |
//! |---|---|
//! | [`message`] | what is said |
//! | [`machine`] | its limits, as they are stored |
//! | [`owner`] | whose tables it takes |
//! | [`event`] | what it has done and seen |
//! | [`frame`] | how it is put into bytes, and found again among any bytes |
//! | `steps` | set-points of a stream in few bytes |
//! | [`refusal`] | why a controller says no |
pub mod event;
pub mod frame;
pub mod machine;
pub mod message;
pub mod owner;
pub mod refusal;
mod steps;

pub use crate::encoding::{Crc32, crc32, put, take};
/// Paths are asked for in the engine's own numbers.
pub use crate::path::{ExactArc, ExactCircle, ExactSegment, Quantity};
pub use event::{ClockSource, EVENTS, Event, ResetCause, What};
pub use frame::{Accumulator, FrameCounts, MAX_FRAME, MAX_PAYLOAD, encode};
pub use machine::{ConfigField, MachineConfig, STEP_MOST, TICK_HZ};
pub use message::{
    CHUNK, Chunk, Command, Counters, FaultCause, FromController, IN_FLIGHT, Identity, MotionState,
    OVERRIDE_PERCENT, POINTS, PROTOCOL_VERSION, Pose, PositionState, Probation, Reply, Request,
    SET_POINTS, SUPERVISE_MS, SetPoint, SetPoints, SlotState, Status, TableInfo,
};
pub use owner::{KeyInfo, KeyState, replacement};
pub use refusal::{FlashFault, MotionRefusal, Refusal};
pub use steps::Steps;
