//! What a door is told once, and why it may be refused.
use crate::Path;
use crate::player::Motion;
use crate::protocol::{Kind, Mode};
use giotto_corrector::{LawError, SettingsError};
use giotto_shared::table::{Limits, TableError};
use std::time::Duration;

/// What a door is told once.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Which door.
    pub kind: Kind,
    /// The bytes of the table.
    pub table: Vec<u8>,
    /// Time between two datagrams of the robot, ms.
    pub cycle_ms: f64,
    /// From the robot's datagram until an answer to it acts, ms.
    pub dead_time_ms: f64,
    /// Largest correction of each coordinate that the robot is asked to add, mm; the table's bound holds as well.
    pub limit_mm: f64,
    /// What the robot does with a correction.
    pub mode: Mode,
    /// The robot's planned place has the correction in it.
    pub planned_is_corrected: bool,
    /// The robot's path coordinates have their y to the left, seen along the path with the tool pointing down.
    pub left_handed: bool,
    /// Path to be followed, for doors that have no path of their own.
    pub path: Option<Path>,
    /// Bounds on the set-points of that path.
    pub motion: Motion,
    /// A robot that is not ready is waited for so long since it was heard first.
    pub patience: Duration,
}

impl Setup {
    /// As robots come, for a table.
    pub fn new(kind: Kind, table: Vec<u8>) -> Self {
        let cycle_ms = kind.usual_cycle_ms();
        Self {
            kind,
            table,
            cycle_ms,
            dead_time_ms: cycle_ms,
            limit_mm: 5.0,
            mode: Mode::Absolute,
            planned_is_corrected: false,
            left_handed: false,
            path: None,
            motion: Motion::default(),
            patience: Duration::from_secs(60),
        }
    }
}

/// Why a door cannot be set up.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SetupError {
    /// The table.
    #[error("{0}")]
    Table(TableError),
    /// A term of a zone of the table.
    #[error("zone {0} of the table cannot be used: {1:?}")]
    Term(usize, giotto_shared::term::ProfileError),
    /// A number out of its range.
    #[error("{0}")]
    Number(&'static str),
    /// The path asks for more than the bounds.
    #[error("{0}")]
    Path(String),
}

impl From<LawError> for SetupError {
    fn from(error: LawError) -> Self {
        match error {
            LawError::Table(error) => Self::Table(error),
            LawError::Term(zone, error) => Self::Term(zone, error),
            LawError::Busy => Self::Number("a table is being exchanged"),
        }
    }
}

impl From<SettingsError> for SetupError {
    fn from(SettingsError(name): SettingsError) -> Self {
        Self::Number(name)
    }
}

/// The bounds of a table, the harder ones of table and engine.
pub(crate) fn limits(table: &[u8]) -> Result<Limits, SetupError> {
    let table = giotto_shared::table::decode(table).map_err(SetupError::Table)?;
    Ok(Limits {
        offset_m: table
            .limits
            .offset_m
            .min(giotto_shared::table::bounds::OFFSET_MAX_M),
        slew_m_s: table
            .limits
            .slew_m_s
            .min(giotto_shared::table::bounds::SLEW_MAX_M_S),
    })
}
