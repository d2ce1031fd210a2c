//! Kinematics: from the angles of an arm's joints to the place of its tool, and back.
//!
//! | file | holds |
//! |---|---|
//! | `robots` | lengths of known robots, with their source |
//! | `written` | the block `[kinematics]` of campaigns and models |
//! | `orbit` | a circle as the joints see it |
//! | `urdf` | lengths from the description that ROS uses |
//!
//! The closed forms themselves are in [`giotto_shared::kinematics`], since a controller needs them as well; here in double precision.
//! `rs-opw-kinematics` is the oracle of the tests.
mod orbit;
mod robots;
#[cfg(test)]
mod tests;
pub mod urdf;
mod written;

pub use giotto_shared::kinematics::{Branch, Elbow, ReachError};
pub(crate) use orbit::waves;
pub use orbit::{COARSE, Cycle, JointNode, NODES, Orbit, Reversal, WAVES, walk};
pub use robots::{ROBOTS, Robot};
pub use written::{Fault, KEYS, WrittenKinematics};

/// Coordinates of the actuators: angles in rad; of a SCARA's third joint, a slide, in m. What an arm does not have is 0.
pub type Angles = [f64; 6];
/// How actuators become a place.
pub type Kinematics = giotto_shared::kinematics::Kinematics<f64>;
/// Six joints with a spherical wrist.
pub type Opw = giotto_shared::kinematics::Opw<f64>;
/// Two links and a height.
pub type Scara = giotto_shared::kinematics::Scara<f64>;

/// The shorter way from one angle to another, −π to π.
pub(crate) fn short_way(from_rad: f64, to_rad: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    let way = to_rad - from_rad;
    way - turn * (way / turn).round()
}
