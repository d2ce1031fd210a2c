//! The engine split between interrupt and background, with nothing between them that locks.
//!
//! ```text
//!  background            │ queue of planned segments │        timer interrupt
//!  Desk: plans, installs ├──────────────────────────►│ Tick: one set-point a period
//!                        │◄──────────────────────────┤
//!                        │  queue of set-points      │
//!                        │◄────── Shared: words ────►│
//! ```
//!
//! Either end of a queue has one owner. The words of [`Shared`] are written by one side each; a table and a
//! segment cross whole, inside the queue.
mod desk;
mod ports;
mod shared;
mod tick;

pub use desk::Desk;
pub use ports::{Receiver, Sender};
pub use shared::Shared;
pub use tick::Tick;

/// Segments that wait for the tick, at most: the look-ahead of a program.
pub const SEGMENTS: usize = 3;
/// Set-points that wait for the link, at most.
pub const SET_POINTS: usize = 64;

#[cfg(test)]
mod tests;
