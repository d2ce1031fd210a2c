//! Why a controller says no, in a form the host can put into words.
use super::ConfigField;
use crate::path::Quantity;
use crate::table::TableError;
use serde::{Deserialize, Serialize};

/// Why a command was not carried out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refusal {
    /// The CRC held but this build has no such command.
    #[error("the controller does not know this command")]
    NotUnderstood,
    /// The session was not opened by a hello, or the controller has restarted since.
    #[error("the controller has restarted; the session is over")]
    NoSession,
    /// Only possible at rest.
    #[error("a run is in progress")]
    Busy,
    /// The table is wrong.
    #[error("{0}")]
    Table(TableError),
    /// No upload has begun, or it was broken off by a reset.
    #[error("no table is being written")]
    NoUpload,
    /// A chunk that does not continue where the last one ended.
    #[error("chunk out of order, expected offset {expected}")]
    OutOfOrder {
        /// Next offset.
        expected: u16,
    },
    /// More bytes than announced, or than any table has.
    #[error("table of more than {max} bytes")]
    UploadTooLong {
        /// Most bytes possible.
        max: u16,
    },
    /// Not all bytes came, or they are not the ones announced.
    #[error("the bytes received are not the ones announced")]
    UploadIncomplete,
    /// The flash failed; the table in use is untouched.
    #[error("flash: {0}")]
    Flash(FlashFault),
    /// Commit without a written table.
    #[error("nothing has been written that could be committed")]
    NothingToCommit,
    /// Confirm without a table on probation.
    #[error("no table is on probation")]
    NothingToConfirm,
    /// Rollback without an older confirmed table.
    #[error("no other confirmed table to return to")]
    NothingToRollBack,
    /// A second run of a table on probation.
    #[error("the table on probation has had its first run: confirm it or roll back")]
    ProbationOver,
    /// Correction on without a table.
    #[error("no valid table to correct with")]
    NoTable,
    /// Slot, offset or length that do not exist.
    #[error("no such slot or offset")]
    NoSuchPlace,
    /// The engine says no.
    #[error("{0}")]
    Motion(MotionRefusal),
    /// A key is already provisioned, and not this one.
    #[error("a key is already provisioned")]
    KeyProvisioned,
    /// A number of the configuration is none, or beyond what the image allows.
    #[error("configuration, out of range: {0}")]
    Config(ConfigField),
    /// This controller has nowhere to store a configuration.
    #[error("this controller has nowhere to store a configuration")]
    NoConfigStore,
    /// Ticks are not counted by a crystal: feed and correction would be wrong by a per cent or two.
    #[error("the crystal does not run: not corrected unless the configuration allows it")]
    Clock,
    /// This image has no signatures built in.
    #[error("this image cannot check signatures")]
    NoSignatures,
    /// A key was there and cannot be read.
    #[error("the key of this controller is lost: it takes no table")]
    KeyLost,
    /// Another key without one before it.
    #[error("this controller has no key that could be replaced")]
    NoKey,
    /// The key given is not the one, or the signature is not its owner's.
    #[error("this is not by the owner of the controller's key")]
    NotTheOwner,
}

/// How a flash failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FlashFault {
    /// Erasing failed.
    #[error("erase failed")]
    Erase,
    /// Programming failed.
    #[error("programming failed")]
    Program,
    /// Reading failed.
    #[error("reading failed")]
    Read,
    /// What was read back is not what was written.
    #[error("byte {offset} does not read back as written")]
    ReadBack {
        /// First differing byte of the slot.
        offset: u32,
    },
    /// Every place for a confirmation in this slot is used.
    #[error("no room for another confirmation in this slot; flash the table again")]
    Full,
}

/// Why the engine does not start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MotionRefusal {
    /// A number beyond the bounds of the image, or not a number.
    #[error("{quantity} is {value}, allowed are {lo} to {hi}")]
    OutOfBounds {
        /// Which.
        quantity: Quantity,
        /// Its value.
        value: f32,
        /// Smallest allowed.
        lo: f32,
        /// Largest allowed.
        hi: f32,
    },
    /// Not a number, or one that does not fit what this controller can plan.
    #[error("{0}: does not fit the feed, the workspace or the time of this controller")]
    Path(Quantity),
    /// The queue of segments is full.
    #[error("no room in the queue of segments")]
    QueueFull,
    /// Nothing to append to: none was opened, or it was stopped, or the link was dead.
    #[error("no program or stream of this kind is open, or it was stopped")]
    NoProgram,
    /// The engine is in fault.
    #[error("the controller is in fault; clear it")]
    Fault,
    /// Not possible in the present state.
    #[error("a run is in progress")]
    Busy,
    /// Terms of one kind that cannot be undone at once: cyclic ones, or spikes of one axis with unlike decays.
    #[error(
        "a zone of the table has more cyclic terms, or more reversal spikes on one axis, than can be undone at once"
    )]
    Terms,
    /// The stop input is active.
    #[error("the stop input is active")]
    StopInput,
    /// The path leaves the soft limits of an axis (0 is X).
    #[error("the path leaves the soft limits of axis {axis}", axis = ['X', 'Y', 'Z'].get(usize::from(*.axis)).copied().unwrap_or('?'))]
    SoftLimit {
        /// Which axis.
        axis: u8,
    },
    /// A line longer than a coordinate can say.
    #[error("a line of more than 2.147 m along an axis: split it")]
    TooLong,
    /// Nobody has said where the machine stands.
    #[error("where the machine stands is not known")]
    NoPosition,
    /// A set-point from which a stop would lead out of the workspace.
    #[error("a stop from there would lead out of the workspace")]
    NoRoomToStop,
    /// Nothing runs that could be held, or it is a stream, whose feed is its sender's.
    #[error("nothing runs whose feed could be held")]
    NotHeld,
    /// The path is planned by the machine's own controller.
    #[error("the machine's own controller plans the path: run the program there")]
    PlannedElsewhere,
}
