//! Time laws with limited jerk and the paths they run along.
//!
//! | module | holds |
//! |---|---|
//! | `feed_ramp` | the ramp of the feed, its derivatives |
//! | `segment` | circles and segments as a program asks for them, SI |
//! | `exact` | the same in the engine's integers: what the wire carries |
//! | `convert` | from the one to the other |
//! | `quantity` | the numbers of a path by their names |
mod convert;
mod exact;
mod feed_ramp;
mod quantity;
mod segment;

pub use convert::PathError;
pub use exact::{
    ExactArc, ExactCircle, ExactSegment, MAX_POSITION_M, MAX_RADIUS_M, MAX_TURNS, MIN_FRACTION,
    MIN_RADIUS_M, on_arc, risen,
};
pub use feed_ramp::{FeedRamp, MotionLimits, STEEPEST, Smoothstep, smoothstep};
pub use quantity::Quantity;
pub use segment::{CircleRun, Segment, Step};
