//! Corrects the set-points of another controller: the stream mode for 2 to 9 joints, in double precision.
//!
//! Another controller (LinuxCNC, a robot's door) plans the path and sends one set-point a period for each joint.
//! [`Corrector::tick`] takes them in, adds what the table asks for, and gives back the feedback as the planner would see
//! it without correction and without latency.
//!
//! | file | holds |
//! |---|---|
//! | `settings` | what is said once: joints and their slides, units, times |
//! | `law` | a table in the form that the tick runs |
//! | `history` | the last set-points, their derivatives |
//! | `stencil` | what undoes the machine's chain, as weights of five set-points |
//! | `watch` | whether the machine rests, whether its planner follows the feedback |
//! | `senses` | which way each slide travels: for play and friction |
//! | `arc` | the circle that the path is on, if any |
//! | `voice` | the offset that one zone of one table asks for |
//! | `fade` | smooth change from one voice to another |
//! | `guard` | the bounds of offset and slew, the soft limits |
//! | `corrector` | one tick |
//! | `handover` | words shared with the program that serves the protocol |
//! | `marks` | how they are written and read without waiting |
//!
//! Promises, each with its test in `tests`: never enabled, the output is the input bit for bit; the offset never jumps,
//! whatever the planner, the operator or a new table does; nothing panics, allocates, locks or asks for the time.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

mod arc;
mod corrector;
mod fade;
mod guard;
pub mod handover;
mod history;
mod law;
pub mod marks;
mod senses;
mod settings;
mod settle;
mod stencil;
mod voice;
mod watch;

pub use corrector::{Corrector, Counters, Input, Output};
pub use history::LONGEST_STRIDE;
pub use law::{Law, LawError};
pub use settings::{JOINTS, PERIOD_S, Settings, SettingsError};
#[cfg(test)]
mod tests;
