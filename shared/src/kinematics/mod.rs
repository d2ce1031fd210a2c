//! Kinematics: from the angles of an arm's joints to the place of its tool, and back, in closed form.
//!
//! | file | holds |
//! |---|---|
//! | `opw` | six joints with a spherical wrist |
//! | `paper` | the robot of the source paper |
//! | `scara` | two links in a plane, then the height as a slide |
//! | `scalar`, `jet` | what the closed forms are computed with: numbers, or numbers with their derivatives along a path |
//! | `rotation` | matrices and vectors |
//!
//! Computed in the precision of the lengths: `f64` on the host, `f32` in a tick. With a [`Jet`] for each coordinate of the path
//! the same closed form gives angles, rates, accelerations and so on of all joints, without a Jacobian to be solved.
mod jet;
mod opw;
mod paper;
mod rotation;
mod scalar;
mod scara;

pub use jet::{Jet, path};
pub use opw::{Branch, Opw};
pub use paper::{IRB1600, PAPER_CENTRE_M};
pub use scalar::{Real, Scalar};
pub use scara::{Elbow, Scara};

use crate::Actuator;
use num_traits::Float;
use serde::{Deserialize, Serialize};

/// |cos| between two links above which the elbow's angle is not determined: 2.6° from stretched or folded.
const STRETCHED: f64 = 0.999;

/// A constant in the precision at hand.
fn number<T: Float>(value: f64) -> T {
    T::from(value).unwrap_or_else(T::nan)
}

/// How actuators become a place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Kinematics<T> {
    /// Three slides: the actuators are X, Y and Z.
    Slides,
    /// Two links and a height.
    Scara(Scara<T>),
    /// Six joints with a spherical wrist.
    Opw(Opw<T>),
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

impl<T> Kinematics<T> {
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
        Actuator::JOINTS.get(..self.turning()).unwrap_or(&[])
    }

    /// The same lengths in another precision.
    pub fn map<U>(self, f: impl Fn(T) -> U + Copy) -> Kinematics<U> {
        match self {
            Self::Slides => Kinematics::Slides,
            Self::Scara(s) => Kinematics::Scara(Scara {
                l1_m: f(s.l1_m),
                l2_m: f(s.l2_m),
                elbow: s.elbow,
            }),
            Self::Opw(o) => Kinematics::Opw(Opw {
                a1_m: f(o.a1_m),
                a2_m: f(o.a2_m),
                b_m: f(o.b_m),
                c1_m: f(o.c1_m),
                c2_m: f(o.c2_m),
                c3_m: f(o.c3_m),
                c4_m: f(o.c4_m),
                tool_m: o.tool_m.map(f),
                orientation: o.orientation.map(f),
                branch: o.branch,
            }),
        }
    }
}

impl<T: Real> Kinematics<T> {
    /// Place of the measured point, m.
    pub fn place(&self, q: &[T; 6]) -> [T; 3] {
        match self {
            Self::Slides => {
                let [x, y, z, ..] = *q;
                [x, y, z]
            }
            Self::Scara(scara) => scara.place(q),
            Self::Opw(opw) => opw.place(q),
        }
    }

    /// Coordinates of the actuators for a place, m; angles within one turn. With [`Jet`]s: and their derivatives.
    ///
    /// # Errors
    /// [`ReachError`]: out of reach, or so near a singularity that the angles are not determined.
    ///
    /// ```
    /// use giotto_shared::kinematics::{Elbow, Jet, Kinematics, Scara};
    ///
    /// let arm = Kinematics::Scara(Scara { l1_m: 0.4_f64, l2_m: 0.3, elbow: Elbow::Positive });
    /// let q = arm.angles([0.5, 0.2, 0.0])?;
    /// let [x, y, _] = arm.place(&q);
    /// assert!((x - 0.5).abs() < 1e-12 && (y - 0.2).abs() < 1e-12);
    /// // Along X at 0.1 m/s: how fast the joints turn.
    /// let still = |m| Jet::new([m, 0.0, 0.0, 0.0, 0.0]);
    /// let path = [Jet::new([0.5, 0.1, 0.0, 0.0, 0.0]), still(0.2), still(0.0)];
    /// let [_, rate, ..] = arm.angles(path)?[0].derivatives();
    /// let later = arm.angles([0.5 + 0.1e-6, 0.2, 0.0])?;
    /// assert!((rate - (later[0] - q[0]) / 1e-6).abs() < 1e-6);
    /// # Ok::<(), giotto_shared::kinematics::ReachError>(())
    /// ```
    pub fn angles<S: Scalar<Base = T>>(&self, place_m: [S; 3]) -> Result<[S; 6], ReachError> {
        match self {
            Self::Slides => {
                let ([x, y, z], zero) = (place_m, S::constant(T::zero()));
                Ok([x, y, z, zero, zero, zero])
            }
            Self::Scara(scara) => scara.angles(place_m),
            Self::Opw(opw) => opw.angles(place_m),
        }
    }

    /// Column of the Jacobian of every actuator: ∂place/∂q, m/rad (m/m for a slide).
    pub fn levers(&self, q: &[T; 6]) -> [[T; 3]; 6] {
        match self {
            Self::Slides => {
                let (zero, one) = (T::zero(), T::one());
                let still = [zero; 3];
                let slides = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
                let [x, y, z] = slides;
                [x, y, z, still, still, still]
            }
            Self::Scara(scara) => scara.levers(q),
            Self::Opw(opw) => opw.levers(q),
        }
    }

    /// Change of the place with the length of the link behind `joint`, the angles held (unit vector): a SCARA's two
    /// links, the upper arm (joint 2) and the forearm (joint 3) of six joints. `None`: no such link.
    pub fn along_link(&self, joint: usize, q: &[T; 6]) -> Option<[T; 3]> {
        match self {
            Self::Slides => None,
            Self::Scara(scara) => scara.along_link(joint, q),
            Self::Opw(opw) => opw.along_link(joint, q),
        }
    }

    /// The same arm with links that are longer by these lengths, m (index: the joint before the link).
    pub fn with_links(&self, longer_m: &[T; 6]) -> Self {
        let [of_first, of_second, of_third, ..] = *longer_m;
        match *self {
            Self::Slides => Self::Slides,
            Self::Scara(scara) => Self::Scara(Scara {
                l1_m: scara.l1_m + of_first,
                l2_m: scara.l2_m + of_second,
                ..scara
            }),
            Self::Opw(opw) => Self::Opw(Opw {
                c2_m: opw.c2_m + of_second,
                c3_m: opw.c3_m + of_third,
                ..opw
            }),
        }
    }
}

#[cfg(test)]
mod tests;
