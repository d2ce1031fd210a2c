//! What has happened on a controller, for its log: kept in memory, asked for by the host.
use super::{FaultCause, Refusal};
use serde::{Deserialize, Serialize};

/// Most events in one message.
pub const EVENTS: usize = 4;

/// Something that happened, and when.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Event {
    /// Ticks since boot, wrapping.
    pub tick: u32,
    /// What.
    pub what: What,
}

/// What happened.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum What {
    /// The controller started.
    Booted {
        /// Why.
        cause: ResetCause,
        /// The slot whose table it corrects with, if it has one.
        slot: Option<u8>,
    },
    /// A run began.
    Started,
    /// A run came to its end, or was brought to rest.
    Rested,
    /// It is in fault.
    Faulted(FaultCause),
    /// A fault was cleared.
    Cleared,
    /// A stop was asked for.
    Stopped,
    /// The stop input became active, or inactive.
    StopInput {
        /// Active.
        active: bool,
    },
    /// Nothing was heard from the host during a run.
    LinkLost,
    /// What outlived its host was stopped.
    Overdue,
    /// A slot was programmed.
    Written {
        /// Which.
        slot: u8,
    },
    /// Its table is in use, on probation.
    Committed {
        /// Which.
        slot: u8,
    },
    /// Its table is the one that boots.
    Confirmed {
        /// Which.
        slot: u8,
    },
    /// Back to the last good table.
    RolledBack {
        /// Its slot, if there is one.
        slot: Option<u8>,
    },
    /// The correction was switched off, or on.
    Bypassed {
        /// Off.
        on: bool,
    },
    /// Where the machine stands was declared.
    Declared,
    /// The configuration was changed, or stored.
    Configured {
        /// Stored.
        saved: bool,
    },
    /// A request was refused.
    Refused {
        /// Number of the request, as in the protocol.
        request: u8,
        /// Why.
        why: Refusal,
    },
}

/// Why the controller started.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ResetCause {
    /// The board cannot tell.
    Unknown,
    /// Power came.
    Power,
    /// The reset pin.
    Pin,
    /// It was asked to.
    Request,
    /// The background or the tick hung.
    Watchdog,
}

/// What the ticks are counted by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ClockSource {
    /// A crystal, or an emulator.
    Crystal,
    /// The oscillator of the part, good to a per cent: feed and correction are as wrong. Nothing is corrected unless the
    /// configuration allows it.
    Internal,
}
