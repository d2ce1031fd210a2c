//! Corrected set-points for a robot's controller, over the controller's own door: ABB's EGM, KUKA's RSI, FANUC's stream motion.
//!
//! [`Door::answer`] is a state machine without sockets and clocks: a datagram and the time go in, the datagrams to be sent
//! come out. [`socket`] gives it both.
//!
//! | file | holds |
//! |---|---|
//! | `setup` | what a door is told once |
//! | `door` | the one state machine: engage, answer, hold, leave, refuse |
//! | `protocol` | what a door has to be able to: read the robot, write to it |
//! | `egm`, `egm_path`, `rsi`, `j519` | ONE FILE A DOOR: its bytes and its habits |
//! | `sequence` | what is new, lost, late, out of order |
//! | `adder` | a correction for a path that is the robot's |
//! | `player` | set-points of a path that is ours |
//! | `path` | the file of such a path |
//! | `program` | what is loaded on the controller |
//! | `record` | what the robot measured, for `giotto import` |
//! | `socket` | UDP and the clock |
//!
//! Promises, each with its test in `tests`: the correction never changes faster than the table allows, whatever is lost, late or
//! out of order; nothing is answered twice; sequence numbers and IPOC come back to the letter.
//!
//! X, Y and Z are corrected, in the frame that the table was made in; orientations and outer axes pass as they are.
#![forbid(unsafe_code)]

mod adder;
mod door;
mod egm;
mod egm_path;
mod j519;
mod path;
mod player;
pub mod program;
mod protocol;
pub mod record;
mod rsi;
mod sequence;
mod setup;
pub mod socket;

pub use door::{Door, Phase};
pub use path::{Path, PathError};
pub use player::Motion;
pub use protocol::{Kind, Mode};
pub use sequence::Counters;
pub use setup::{Setup, SetupError};

/// A place or an offset, mm.
pub type Place = [f64; 3];
