//! The time-domain machine: command → interpolator → acc/dec filter → servo → friction → mechanics →
//! geometry → instrument. It knows laws of motion and no data.
pub mod machine;
