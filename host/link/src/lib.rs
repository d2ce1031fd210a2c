//! The client side of the wire: opening a port, the virtual controller, the emulated image, and what is done
//! with them.
//!
//! | module | holds |
//! |---|---|
//! | [`client`] | requests and replies over any [`link`](link::Link): status, slots, runs |
//! | `pipelined` | requests of which several are on their way at once |
//! | [`flash`] | a table onto a controller, and the proof that it is there |
//! | [`recording`] | circles run, set-points received |
//! | [`program`], [`streaming`] | programs and set-points, sent ahead of the machine |
//! | [`outside`] | stop, hold and override on a port that another program has |
//! | [`log`] | a board's log, out of defmt's encoding |
//! | [`settings`] | stored limits, and the log of events |
//! | [`port`] | what `--port` may name, and opening it |
//! | [`serial`] | a serial device |
//! | [`linuxcnc`] | the component in a LinuxCNC that runs on this computer |
//! | [`stepped`] | an emulator whose time passes only while someone waits |
//! | [`virtual_controller`] | the firmware's library in this process, in simulated time, or behind a pty |
//! | [`emulator`] | the firmware image in QEMU |
//! | [`serve`] | either of them on a pty, by the clock |
//! | [`image`] | finding or building that image |
//!
//! ```
//! use giotto_link::{circle, open, OpenOptions, Port};
//! use giotto_shared::Direction;
//!
//! // The virtual controller: the firmware's library in this process, in simulated time.
//! let port: Port = "sim".parse()?;
//! let mut controller = open(&port, &OpenOptions::default(), &mut |_| {})?;
//! assert_eq!(controller.identity().board, "virtual");
//! // A circle of 20 mm at 100 mm/s, every tenth set-point recorded; without a table nothing is corrected.
//! let run = controller.run_circle(&circle(0.02, 0.1, Direction::Ccw, 1), 10)?;
//! let apart = |p: &giotto_link::SetPointRecord| (p.corrected_m[0] - p.programmed_m[0]).abs();
//! assert!(run.points.len() > 100 && run.points.iter().all(|p| apart(p) < 2e-9));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

pub mod client;
pub mod emulator;
pub mod error;
pub mod flash;
pub mod image;
pub mod link;
pub mod linuxcnc;
pub mod log;
pub mod outside;
mod pipelined;
pub mod port;
pub mod program;
pub mod recording;
pub mod serial;
pub mod serve;
pub mod settings;
pub mod signing;
pub mod stepped;
pub mod streaming;
pub mod virtual_controller;
mod wires;

#[cfg(test)]
mod tests;

pub use client::Controller;
pub use emulator::Pace;
pub use error::ControllerError;
pub use giotto_shared::path::{CircleRun, Segment, Step};
pub use image::Board;
pub use port::{OpenOptions, Port, open};
pub use program::ProgramError;
pub use recording::{Recording, SetPointRecord, circle};
