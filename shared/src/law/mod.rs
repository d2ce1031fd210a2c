//! The compensator is one operator: p_cmd = p − (κ2/2) p″ + (κ2²/8 − κ4/24) p⁗.
//!
//! It undoes, to fourth order, a linear chain whose impulse response has the cumulants κ2 and κ4. On a circle it is
//! the radius correction R/(1 + β1 ω² + β2 ω⁴) to that order, on curves the curvature correction, in entry and exit
//! the ramp. Beside it, [`Profile`] gathers the profile terms of a zone, and [`ArmLaw`] does the same through the joints of an arm.
mod arm;
mod operator;
mod profile;

pub use arm::{
    ArmErrors, ArmLaw, Common, Gear, JointErrors, JointSide, JointSides, MAX_GEAR, Pace,
};
pub use operator::{AngularMotion, Gain, Operator};
pub use profile::{CyclicError, MAX_CYCLIC, Profile, Spike, Unmergeable};
pub(crate) use profile::{finite, joint_errors, positive, slide_index};
