//! The engine split between interrupt and background, with nothing between them that locks.
//!
//! ```text
//!  background            │ queue of jobs             │        timer interrupt
//!  Desk: plans, installs ├──────────────────────────►│ Tick: one set-point a period
//!                        │◄──────────────────────────┤
//!                        │  queue of set-points      │
//!                        │◄────── Shared: words ────►│
//! ```
//!
//! Either end of a queue has one owner. The words of [`Shared`] are written by one side each; a table and a
//! segment cross whole, inside the queue.
mod alive;
mod background;
pub mod bench;
mod job;
mod jobs;
mod lines;
mod ports;
mod shared;
mod tick;

pub use alive::Alive;
pub use background::Desk;
pub use job::{BATCH, Job};
pub use lines::Lines;
pub use ports::{Receiver, Sender};
pub use shared::Shared;
pub use tick::Tick;

/// Segments, or batches of set-points, that wait for the tick, at most: the look-ahead.
pub const SEGMENTS: usize = 3;
/// Places of the stream's differentiator: the next power of two above those of 15 ms at 1 kHz.
pub const STREAM_PLACES: usize = 16;
/// Set-points that wait for the link, at most.
pub const SET_POINTS: usize = 48;

#[cfg(test)]
mod tests;
