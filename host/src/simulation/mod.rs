//! The time-domain machine: command → interpolator → acc/dec filter → servo → mechanics → friction and
//! backlash → geometry → instrument. It knows laws of motion and no data.
//!
//! | call | gives |
//! |---|---|
//! | [`circle`] | one lap in the steady state, free of noise |
//! | [`drive`] | where the tool goes under the set-points of an outside controller |
//! | [`campaign`] | a whole plan, read by an instrument with noise |
//!
//! Linear elements are stepped exactly (matrix exponential under a command that is cubic within a step), so a
//! lap needs steps enough for its shape, not for its time constants. On a circle at a constant rate they start in the
//! state that these very steps reproduce, where a run-in from rest would end; only chords and set-points need one.
//! Backlash and friction follow the axis through its turning points, from a reversal before the lap on. Everything is
//! deterministic; noise comes from the instrument and its seed.
pub mod arm;
mod axis;
mod chain;
mod circle;
mod command;
mod drive;
mod extend;
mod from_model;
mod geometry;
mod hysteresis;
mod instrument;
pub mod machine;
mod machine_spec;
mod plan;
pub mod plan_file;
mod preset;
mod steady_circle;
mod wave;

pub use arm::Arm;
pub use circle::{CircleTest, MAX_RATE_HZ, SAMPLES_PER_TURN, Trace, ballbar_samples, circle};
pub use drive::{Hold, Path, SetPoints, drive};
pub use instrument::Instrument;
pub use machine::{Machine, MachineError};
pub use machine_spec::{AxisSpec, MachineSpec, VibrationSpec};
pub use plan::{Plan, PlannedTest, campaign};
pub use preset::PRESETS;

#[cfg(test)]
mod closed_forms;
#[cfg(test)]
mod in_every_plane;
#[cfg(test)]
mod of_joints;
#[cfg(test)]
mod plan_tests;
