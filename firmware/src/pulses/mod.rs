//! Step and direction, out and in.
//!
//! ```text
//!   pulses in ──► Counted ──► Stream (corrects) ──► Stepper ──► pulses out
//!                 counts       a set-point a tick    a Pattern
//!                 to nm                              a tick
//! ```
//!
//! | part | does |
//! |---|---|
//! | [`Scale`] | how many steps go into how many nanometres: a ratio of whole numbers, so that nothing ever drifts |
//! | [`Stepper`] | the way from one set-point to the next as a [`Pattern`]: the levels of all lines, slot by slot |
//! | [`Counted`] | the counts of hardware counters, which wrap, as a place |
//! | [`Relay`] | all of the above: stream mode without a host, between a planner that makes pulses and drives that take them |
//!
//! A tick is cut into [`SLOTS`] slots; a line changes where one begins. A step is made in the slot in which the straight way
//! between two set-points passes from one step's place to the next: steps are as evenly spaced as the path is, to a slot.
//! The count of steps made is kept, never that of steps to make, so that a step that has to wait (for the direction to settle) is
//! late and not lost. What is made in a tick is played in the next one: **one tick of latency, constant**; the relay adds that of
//! its stream.
mod counted;
mod relay;
mod scale;
mod stepper;

pub use counted::Counted;
pub use relay::{FeedTooHigh, Relay};
pub use scale::{Scale, ScaleError};
pub use stepper::{Pattern, SLOTS, Stepper, TooFast, Widths};

#[cfg(test)]
mod tests;
