//! A serial arm of the tests' own: its place follows from its joints, its errors belong to them.
//!
//! Command → own inverse → each joint's chain (lag, friction, play, gear) → own forward with the lengths and zeros
//! that the arm really has → instrument. No line is shared with the code under test or with the crate it uses.
//! Joints are counted from 0 (joint 1 of the contract); SI units, angles in rad.
pub mod effects;
pub mod hidden;
pub mod kinematics;
pub mod run;

pub use effects::{ARM_EFFECTS, arm_effect};
pub use hidden::{Setting, hidden, hidden_arm};
pub use kinematics::Kinematics;
pub use run::{follow, simulate};

use crate::machine::AxisChain;

/// An arm: what its controller believes and what it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    /// Lengths that the controller computes with.
    pub believed: Kinematics,
    /// Lengths that it has.
    pub real: Kinematics,
    /// The joints; of a SCARA the first two turn and the third is its height.
    pub joints: [Joint; 6],
}

/// One joint, from its command to its angle.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Joint {
    /// Chain with friction and play; what is a length there is an angle here (rad for m).
    pub chain: AxisChain,
    /// Periodic error of the gear.
    pub gear: Option<Gear>,
    /// Real angle where the controller reads zero, rad.
    pub zero_rad: f64,
}

/// `amplitude·sin(waves·q + phase)`: a gear of ratio N has waves N and 2N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gear {
    /// Amplitude, rad.
    pub amplitude_rad: f64,
    /// Waves a turn of the joint.
    pub waves: f64,
    /// Phase, rad.
    pub phase_rad: f64,
}

impl Arm {
    /// An arm without defects whose joints all answer with one lag and one second order.
    pub fn sound(kinematics: Kinematics, chain: AxisChain) -> Self {
        Self {
            believed: kinematics.clone(),
            real: kinematics,
            joints: std::array::from_fn(|_| Joint {
                chain: chain.clone(),
                ..Joint::default()
            }),
        }
    }
}
