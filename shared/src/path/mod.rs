//! Time laws with limited jerk and the paths they run along.
mod feed_ramp;
mod segment;

pub use feed_ramp::{FeedRamp, MotionLimits, STEEPEST, Smoothstep, smoothstep};
pub use segment::{CircleRun, Segment};
