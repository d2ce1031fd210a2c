//! Kinematics: from the angles of an arm's joints to the place of its tool, and back.
//!
//! | file | holds |
//! |---|---|
//! | `opw` | six joints with a spherical wrist, in closed form |
//! | `scara` | two links in a plane, then the height as a slide |
//! | `robots` | lengths of known robots, with their source |
//! | `written` | the block `[kinematics]` of campaigns and models |
//! | `orbit` | a circle as the joints see it |
//!
//! The closed form is our own, since a controller will need it without an operating system and the Jacobian with it;
//! `rs-opw-kinematics` is the oracle of the tests.
mod opw;
mod orbit;
mod robots;
mod rotation;
mod scara;
#[cfg(test)]
mod tests;
mod written;

pub use opw::{Branch, Opw};
pub(crate) use orbit::waves;
pub use orbit::{COARSE, Cycle, JointNode, NODES, Orbit, Reversal, WAVES, walk};
pub use robots::{ROBOTS, Robot};
pub use scara::{Elbow, Scara};
pub use written::{Fault, KEYS, WrittenKinematics};

use giotto_shared::Actuator;

/// Coordinates of the actuators: angles in rad; of a SCARA's third joint, a slide, in m. What an arm does not have is 0.
pub type Angles = [f64; 6];

/// How actuators become a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kinematics {
    /// Three slides: the actuators are X, Y and Z.
    Slides,
    /// Two links and a height.
    Scara(Scara),
    /// Six joints with a spherical wrist.
    Opw(Opw),
}

/// Why an arm cannot stand at a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ReachError {
    /// Beyond its links.
    #[error("the arm does not reach there")]
    OutOfReach,
    /// The elbow is stretched or folded, or so near to it that its angle is not determined.
    #[error("the elbow is stretched or folded there")]
    Elbow,
    /// Axes 4 and 6 lie on one line.
    #[error("the wrist is stretched there")]
    Wrist,
    /// The wrist is on the axis of joint 1.
    #[error("the wrist is above the base there, on the axis of joint 1")]
    Shoulder,
    /// The circle goes round the axis of joint 1, so that the joint would have to turn on and on.
    #[error("the circle goes round the axis of joint 1")]
    Around,
}

impl Kinematics {
    /// Joints that turn: 0, 2 or 6.
    pub const fn turning(&self) -> usize {
        match self {
            Self::Slides => 0,
            Self::Scara(_) => 2,
            Self::Opw(_) => 6,
        }
    }

    /// The joints that turn, by name.
    pub fn joints(&self) -> &'static [Actuator] {
        &Actuator::JOINTS[..self.turning()]
    }

    /// Place of the measured point, m.
    pub fn place(&self, q: &Angles) -> [f64; 3] {
        match self {
            Self::Slides => [q[0], q[1], q[2]],
            Self::Scara(scara) => scara.place(q),
            Self::Opw(opw) => opw.place(q),
        }
    }

    /// Coordinates of the actuators for a place, m; angles within one turn.
    ///
    /// # Errors
    /// [`ReachError`]: out of reach, or so near a singularity that the angles are not determined.
    pub fn angles(&self, place_m: [f64; 3]) -> Result<Angles, ReachError> {
        match self {
            Self::Slides => {
                let [x, y, z] = place_m;
                Ok([x, y, z, 0.0, 0.0, 0.0])
            }
            Self::Scara(scara) => scara.angles(place_m),
            Self::Opw(opw) => opw.angles(place_m),
        }
    }

    /// Column of the Jacobian of every actuator: ∂place/∂q, m/rad (m/m for a slide).
    pub fn levers(&self, q: &Angles) -> [[f64; 3]; 6] {
        match self {
            Self::Slides => {
                let mut out = [[0.0; 3]; 6];
                (0..3).for_each(|k| out[k][k] = 1.0);
                out
            }
            Self::Scara(scara) => scara.levers(q),
            Self::Opw(opw) => opw.levers(q),
        }
    }

    /// Change of the place with the length of the link behind `joint`, the angles held (unit vector): a SCARA's two
    /// links, the upper arm (joint 2) and the forearm (joint 3) of six joints. `None`: no such link.
    pub fn along_link(&self, joint: usize, q: &Angles) -> Option<[f64; 3]> {
        match self {
            Self::Slides => None,
            Self::Scara(scara) => scara.along_link(joint, q),
            Self::Opw(opw) => opw.along_link(joint, q),
        }
    }

    /// The same arm with links that are longer by these lengths, m (index: the joint before the link).
    pub fn with_links(&self, longer_m: &[f64; 6]) -> Self {
        match *self {
            Self::Slides => Self::Slides,
            Self::Scara(mut scara) => {
                scara.l1_m += longer_m[0];
                scara.l2_m += longer_m[1];
                Self::Scara(scara)
            }
            Self::Opw(mut opw) => {
                opw.c2_m += longer_m[1];
                opw.c3_m += longer_m[2];
                Self::Opw(opw)
            }
        }
    }
}

/// The shorter way from one angle to another, −π to π.
pub(crate) fn short_way(from_rad: f64, to_rad: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    let way = to_rad - from_rad;
    way - turn * (way / turn).round()
}
