//! Where the tool is for angles, and angles for a place: two links, or six joints with a spherical wrist.
use std::f64::consts::PI;

type Matrix = [[f64; 3]; 3];

/// Lengths of an arm, m. The tool keeps its orientation along a circle.
#[derive(Clone, Debug, PartialEq)]
pub enum Kinematics {
    /// Two links that turn about Z, then a slide along Z.
    Scara {
        /// From the base to the elbow, m.
        l1_m: f64,
        /// From the elbow to the tool, m.
        l2_m: f64,
        /// The second angle is positive.
        positive: bool,
    },
    /// Six joints about Z, Y, Y, X, Y, X; at zero the upper arm stands and the forearm points along X.
    Six {
        /// Axis 2 in front of axis 1, m.
        a1_m: f64,
        /// Axis 2 above the base, m.
        c1_m: f64,
        /// Upper arm, m.
        c2_m: f64,
        /// Forearm up to the wrist, m.
        c3_m: f64,
        /// Wrist to flange, m.
        c4_m: f64,
        /// Measured point in the flange's frame (Z out of the flange), m.
        tool_m: [f64; 3],
        /// That frame in the base, quaternion w, x, y, z.
        orientation: [f64; 4],
    },
}

impl Kinematics {
    /// ABB IRB 1600-x/1.45 by its URDF, with the tool of the paper, pointing down.
    pub fn irb1600() -> Self {
        Self::Six {
            a1_m: 0.150,
            c1_m: 0.4865,
            c2_m: 0.700,
            c3_m: 0.600,
            c4_m: 0.065,
            tool_m: [0.0, 0.065, 0.149],
            orientation: [0.0, 0.0, 1.0, 0.0],
        }
    }

    /// Joints that turn.
    pub fn turning(&self) -> usize {
        match self {
            Self::Scara { .. } => 2,
            Self::Six { .. } => 6,
        }
    }

    /// Place of the tool, m, for the angles `q`.
    pub fn forward(&self, q: &[f64; 6]) -> [f64; 3] {
        match self {
            Self::Scara { l1_m, l2_m, .. } => {
                let (s1, c1) = q[0].sin_cos();
                let (s12, c12) = (q[0] + q[1]).sin_cos();
                [l1_m * c1 + l2_m * c12, l1_m * s1 + l2_m * s12, q[2]]
            }
            Self::Six {
                a1_m,
                c1_m,
                c2_m,
                c3_m,
                c4_m,
                tool_m,
                ..
            } => {
                // From the tool inward, joint by joint. The flange's Z is the X of the wrist.
                let [x, y, z] = *tool_m;
                let mut p = [z + c4_m, y, -x];
                p = turn(&about_x(q[5]), p);
                p = turn(&about_y(q[4]), p);
                p = turn(&about_x(q[3]), p);
                p[0] += c3_m;
                p = turn(&about_y(q[2]), p);
                p[2] += c2_m;
                p = turn(&about_y(q[1]), p);
                p[0] += a1_m;
                p[2] += c1_m;
                turn(&about_z(q[0]), p)
            }
        }
    }

    /// Angles for a place; `None` out of reach, or where the wrist is stretched. Elbow up, wrist not flipped.
    pub fn inverse(&self, p: [f64; 3]) -> Option<[f64; 6]> {
        match self {
            Self::Scara {
                l1_m,
                l2_m,
                positive,
            } => {
                let d2 = p[0] * p[0] + p[1] * p[1];
                let cosine = (d2 - l1_m * l1_m - l2_m * l2_m) / (2.0 * l1_m * l2_m);
                if cosine.abs() > 0.999 {
                    return None;
                }
                let q2 = cosine.acos() * if *positive { 1.0 } else { -1.0 };
                let q1 = p[1].atan2(p[0]) - (l2_m * q2.sin()).atan2(l1_m + l2_m * q2.cos());
                Some([q1, q2, p[2], 0.0, 0.0, 0.0])
            }
            Self::Six {
                a1_m,
                c1_m,
                c2_m,
                c3_m,
                c4_m,
                tool_m,
                orientation,
            } => {
                let flange = of_quaternion(*orientation);
                let reach = turn(&flange, [tool_m[0], tool_m[1], tool_m[2] + c4_m]);
                let w = [0, 1, 2].map(|k| p[k] - reach[k]);
                let q1 = w[1].atan2(w[0]);
                let (r, h) = (w[0].hypot(w[1]) - a1_m, w[2] - c1_m);
                let sine = (c2_m * c2_m + c3_m * c3_m - r * r - h * h) / (2.0 * c2_m * c3_m);
                if sine.abs() > 0.999 {
                    return None;
                }
                let q3 = sine.asin();
                let (a, b) = (c2_m - c3_m * q3.sin(), c3_m * q3.cos());
                let q2 = (a * r - b * h).atan2(b * r + a * h);
                // What is left for the wrist, in its own axes: the flange's Z, Y, −X are its X, Y, Z.
                let wrist = [0, 1, 2].map(|i| [flange[i][2], flange[i][1], -flange[i][0]]);
                let arm = product(&about_z(q1), &about_y(q2 + q3));
                let m = product(&transposed(&arm), &wrist);
                let q5 = m[0][0].clamp(-1.0, 1.0).acos();
                if q5.sin().abs() < 0.02 {
                    return None;
                }
                let q4 = m[1][0].atan2(-m[2][0]);
                let q6 = m[0][1].atan2(m[0][2]);
                Some([q1, q2, q3, q4, q5, q6])
            }
        }
    }

    /// Change of the place with an angle, m/rad, by differences.
    pub fn lever(&self, q: &[f64; 6], joint: usize) -> [f64; 3] {
        const STEP_RAD: f64 = 1e-6;
        let at = |by: f64| {
            let mut q = *q;
            q[joint] += by;
            self.forward(&q)
        };
        let (more, less) = (at(STEP_RAD), at(-STEP_RAD));
        [0, 1, 2].map(|k| (more[k] - less[k]) / (2.0 * STEP_RAD))
    }

    /// The contract's block.
    pub fn block(&self) -> String {
        let mm = |x: f64| (x * 1e7).round() / 1e4;
        match self {
            Self::Scara {
                l1_m,
                l2_m,
                positive,
            } => format!(
                "\n[kinematics]\nmodel = \"scara\"\nl1_mm = {:?}\nl2_mm = {:?}\nelbow = \"{}\"\n",
                mm(*l1_m),
                mm(*l2_m),
                if *positive { "positive" } else { "negative" }
            ),
            Self::Six {
                a1_m,
                c1_m,
                c2_m,
                c3_m,
                c4_m,
                tool_m,
                orientation,
            } => format!(
                "\n[kinematics]\nmodel = \"opw\"\na1_mm = {:?}\na2_mm = 0.0\nb_mm = 0.0\nc1_mm = {:?}\nc2_mm = {:?}\nc3_mm = {:?}\n\
                 c4_mm = {:?}\ntool_mm = {:?}\norientation = {orientation:?}\nbranch = \"elbow-up\"\n",
                mm(*a1_m),
                mm(*c1_m),
                mm(*c2_m),
                mm(*c3_m),
                mm(*c4_m),
                tool_m.map(mm),
            ),
        }
    }
}

fn about_x(q: f64) -> Matrix {
    let (s, c) = q.sin_cos();
    [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]
}

fn about_y(q: f64) -> Matrix {
    let (s, c) = q.sin_cos();
    [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]
}

fn about_z(q: f64) -> Matrix {
    let (s, c) = q.sin_cos();
    [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
}

fn turn(m: &Matrix, p: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * p[0] + row[1] * p[1] + row[2] * p[2])
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    a.map(|row| [0, 1, 2].map(|j| row[0] * b[0][j] + row[1] * b[1][j] + row[2] * b[2][j]))
}

fn transposed(m: &Matrix) -> Matrix {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| m[j][i]))
}

fn of_quaternion([w, x, y, z]: [f64; 4]) -> Matrix {
    [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - w * z),
            2.0 * (x * z + w * y),
        ],
        [
            2.0 * (x * y + w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - w * x),
        ],
        [
            2.0 * (x * z - w * y),
            2.0 * (y * z + w * x),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ]
}

/// Difference of two angles in −π…π.
pub(super) fn short_way(from: f64, to: f64) -> f64 {
    to - 2.0 * PI * ((to - from) / (2.0 * PI)).round() - from
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_lead_back_to_the_place() {
        let scara = |positive| Kinematics::Scara {
            l1_m: 0.4,
            l2_m: 0.35,
            positive,
        };
        let places = [[0.35, 0.2, 0.0], [0.1, -0.5, 0.0], [-0.3, 0.3, 0.0]];
        for arm in [scara(true), scara(false)] {
            for place in places {
                let q = arm.inverse(place).unwrap();
                let back = arm.forward(&q);
                for k in 0..3 {
                    assert!((back[k] - place[k]).abs() < 1e-12, "{place:?} {back:?}");
                }
            }
        }
        let six = Kinematics::irb1600();
        for place in [[-0.29, 0.987, 0.615], [0.8, 0.1, 0.5], [0.6, -0.6, 0.9]] {
            let q = six.inverse(place).unwrap();
            let back = six.forward(&q);
            for k in 0..3 {
                assert!((back[k] - place[k]).abs() < 1e-12, "{place:?} {back:?}");
            }
        }
        assert!(six.inverse([2.0, 0.0, 0.5]).is_none(), "out of reach");
    }

    /// At zero, as the URDF draws it; and the flange looks down where it is told to.
    #[test]
    fn the_six_joint_arm_is_that_of_its_drawing() {
        let mut six = Kinematics::irb1600();
        if let Kinematics::Six { tool_m, .. } = &mut six {
            *tool_m = [0.0; 3];
        }
        let zero = six.forward(&[0.0; 6]);
        for (got, want) in zero
            .iter()
            .zip([0.150 + 0.600 + 0.065, 0.0, 0.4865 + 0.700])
        {
            assert!((got - want).abs() < 1e-12);
        }
        // Pointing down: a longer tool reaches lower, nowhere else.
        let q = six.inverse([0.8, 0.2, 0.5]).unwrap();
        if let Kinematics::Six { tool_m, .. } = &mut six {
            tool_m[2] = 0.1;
        }
        let lower = six.forward(&q);
        for (got, want) in lower.iter().zip([0.8, 0.2, 0.4]) {
            assert!((got - want).abs() < 1e-12, "{lower:?}");
        }
    }

    /// A two-link arm's Jacobian in closed form against the differences.
    #[test]
    fn levers_are_those_of_two_links() {
        let arm = Kinematics::Scara {
            l1_m: 0.4,
            l2_m: 0.3,
            positive: true,
        };
        let q = [0.3, 0.9, 0.0, 0.0, 0.0, 0.0];
        let (s1, c1) = 0.3_f64.sin_cos();
        let (s12, c12) = 1.2_f64.sin_cos();
        let want = [
            [-0.4 * s1 - 0.3 * s12, 0.4 * c1 + 0.3 * c12],
            [-0.3 * s12, 0.3 * c12],
        ];
        for (joint, want) in want.iter().enumerate() {
            let got = arm.lever(&q, joint);
            for k in 0..2 {
                assert!((got[k] - want[k]).abs() < 1e-9);
            }
        }
    }
}
