//! The robot of the source paper and where it drew its circles.
use super::{Branch, Opw};

/// ABB IRB 1600-x/1.45 by the URDF of ROS-Industrial's `abb_irb1600_support`, with the paper's tool, pointing down.
///
/// ```
/// use giotto_shared::kinematics::{IRB1600, Kinematics, PAPER_CENTRE_M};
///
/// let arm = Kinematics::Opw(IRB1600);
/// let [x, y, z] = arm.place(&arm.angles(PAPER_CENTRE_M)?);
/// assert!((x + 0.29).abs() < 1e-12 && (y - 0.987).abs() < 1e-12 && (z - 0.615).abs() < 1e-12);
/// # Ok::<(), giotto_shared::kinematics::ReachError>(())
/// ```
pub const IRB1600: Opw<f64> = Opw {
    a1_m: 0.150,
    a2_m: 0.0,
    b_m: 0.0,
    c1_m: 0.4865,
    c2_m: 0.700,
    c3_m: 0.600,
    c4_m: 0.065,
    tool_m: [0.0, 0.065, 0.149],
    orientation: [0.0, 0.0, 1.0, 0.0],
    branch: Branch::ElbowUp,
};

/// Centre of the paper's circles in the base of that robot, m.
pub const PAPER_CENTRE_M: [f64; 3] = [-0.290, 0.987, 0.615];
