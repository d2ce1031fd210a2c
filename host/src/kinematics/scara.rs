//! Two links that turn about Z, then the height as a slide along Z.
use super::{Angles, ReachError};

/// A SCARA, or any two-link arm. The forearm's own turn of the hand does not move the measured point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scara {
    /// From the base to the elbow, m.
    pub l1_m: f64,
    /// From the elbow to the measured point, m.
    pub l2_m: f64,
    /// Which of the two solutions.
    pub elbow: Elbow,
}

/// Sign of the second angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Elbow {
    /// Second angle above 0.
    Positive,
    /// Second angle below 0.
    Negative,
}

/// |cos| of the second angle above which it is not determined: 2.6° from the stretched arm.
const STRETCHED: f64 = 0.999;

impl Scara {
    pub(super) fn place(&self, q: &Angles) -> [f64; 3] {
        let (s1, c1) = q[0].sin_cos();
        let (s12, c12) = (q[0] + q[1]).sin_cos();
        [
            self.l1_m * c1 + self.l2_m * c12,
            self.l1_m * s1 + self.l2_m * s12,
            q[2],
        ]
    }

    pub(super) fn angles(&self, [x, y, z]: [f64; 3]) -> Result<Angles, ReachError> {
        let (l1, l2) = (self.l1_m, self.l2_m);
        let cosine = (x * x + y * y - l1 * l1 - l2 * l2) / (2.0 * l1 * l2);
        if cosine.is_nan() || cosine.abs() > 1.0 {
            return Err(ReachError::OutOfReach);
        }
        if cosine.abs() > STRETCHED {
            return Err(ReachError::Elbow);
        }
        let q2 = match self.elbow {
            Elbow::Positive => cosine.acos(),
            Elbow::Negative => -cosine.acos(),
        };
        let q1 = y.atan2(x) - (l2 * q2.sin()).atan2(l1 + l2 * q2.cos());
        Ok([q1, q2, z, 0.0, 0.0, 0.0])
    }

    pub(super) fn levers(&self, q: &Angles) -> [[f64; 3]; 6] {
        let [x, y, _] = self.place(q);
        let (s12, c12) = (q[0] + q[1]).sin_cos();
        let mut out = [[0.0; 3]; 6];
        out[0] = [-y, x, 0.0];
        out[1] = [-self.l2_m * s12, self.l2_m * c12, 0.0];
        out[2] = [0.0, 0.0, 1.0];
        out
    }

    pub(super) fn along_link(&self, joint: usize, q: &Angles) -> Option<[f64; 3]> {
        let angle_rad = match joint {
            0 => q[0],
            1 => q[0] + q[1],
            _ => return None,
        };
        let (sin, cos) = angle_rad.sin_cos();
        Some([cos, sin, 0.0])
    }
}
