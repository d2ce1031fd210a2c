//! Six joints with a spherical wrist, in closed form: Brandstötter, Angerer and Hofbaur, "An analytical solution of the
//! inverse kinematics problem of industrial serial manipulators with an ortho-parallel basis and a spherical wrist", 2014.
//!
//! Angles are those of the paper: at zero the arm stands upright with the forearm pointing up. The orientation of the
//! flange is constant along a circle, so that a place has one set of angles on each branch.
use super::rotation::{
    Matrix, about_y, about_z, column, cross, difference, of_quaternion, product, sum, transposed,
    turned,
};
use super::{Angles, ReachError};

/// Lengths of the arm, its tool and its orientation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Opw {
    /// Axis 2 in front of axis 1, m.
    pub a1_m: f64,
    /// Axis 4 behind axis 3 (below the forearm: negative), m.
    pub a2_m: f64,
    /// Arm beside axis 1, m.
    pub b_m: f64,
    /// Axis 2 above the base, m.
    pub c1_m: f64,
    /// Upper arm, m.
    pub c2_m: f64,
    /// Forearm, m.
    pub c3_m: f64,
    /// Wrist to flange, m.
    pub c4_m: f64,
    /// Measured point in the flange's frame (Z out of the flange), m.
    pub tool_m: [f64; 3],
    /// That frame in the base: unit quaternion w, x, y, z.
    pub orientation: [f64; 4],
    /// Which solution.
    pub branch: Branch,
}

/// Which of the solutions that look forward.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Branch {
    /// Elbow up, fifth angle above 0.
    ElbowUp,
    /// Elbow down, fifth angle above 0.
    ElbowDown,
    /// Elbow up, wrist turned over: fifth angle below 0.
    ElbowUpFlipped,
    /// Elbow down, wrist turned over.
    ElbowDownFlipped,
}

impl Branch {
    /// All, with their names in files.
    pub const ALL: [(Self, &'static str); 4] = [
        (Self::ElbowUp, "elbow-up"),
        (Self::ElbowDown, "elbow-down"),
        (Self::ElbowUpFlipped, "elbow-up-flipped"),
        (Self::ElbowDownFlipped, "elbow-down-flipped"),
    ];

    const fn up(self) -> bool {
        matches!(self, Self::ElbowUp | Self::ElbowUpFlipped)
    }

    const fn flipped(self) -> bool {
        matches!(self, Self::ElbowUpFlipped | Self::ElbowDownFlipped)
    }
}

/// |cos| between the links above which the elbow's angle is not determined: 2.6° from stretched or folded.
const STRETCHED: f64 = 0.999;
/// |sin| of the fifth angle below which the fourth and the sixth are not determined: 1.1°.
const WRIST: f64 = 0.02;
/// Distance of the wrist from axis 1 below which the first angle is not determined, m.
const SHOULDER_M: f64 = 0.01;

/// The arm at some angles: what the place and the Jacobian are made of.
struct Posture {
    /// Axes 2 to 6: directions …
    axes: [[f64; 3]; 6],
    /// … and a point on each.
    points: [[f64; 3]; 6],
    /// Directions of the upper arm and of the forearm.
    links: [[f64; 3]; 2],
    tool: [f64; 3],
}

impl Opw {
    fn posture(&self, q: &Angles) -> Posture {
        let base = about_z(q[0]);
        let upper = product(&base, &about_y(q[1]));
        let fore = product(&upper, &about_y(q[2]));
        let wrist = product(&fore, &about_z(q[3]));
        let hand = product(&wrist, &about_y(q[4]));
        let flange = product(&hand, &about_z(q[5]));
        let shoulder = turned(&base, [self.a1_m, self.b_m, self.c1_m]);
        let elbow = sum(shoulder, turned(&upper, [0.0, 0.0, self.c2_m]));
        let centre = sum(elbow, turned(&fore, [self.a2_m, 0.0, self.c3_m]));
        let [x, y, z] = self.tool_m;
        let across = column(&base, 1);
        Posture {
            axes: [
                [0.0, 0.0, 1.0],
                across,
                across,
                column(&fore, 2),
                column(&wrist, 1),
                column(&hand, 2),
            ],
            points: [[0.0; 3], shoulder, elbow, centre, centre, centre],
            links: [column(&upper, 2), column(&fore, 2)],
            tool: sum(centre, turned(&flange, [x, y, z + self.c4_m])),
        }
    }

    pub(super) fn place(&self, q: &Angles) -> [f64; 3] {
        self.posture(q).tool
    }

    pub(super) fn levers(&self, q: &Angles) -> [[f64; 3]; 6] {
        let posture = self.posture(q);
        std::array::from_fn(|joint| {
            let arm = difference(posture.tool, posture.points[joint]);
            cross(posture.axes[joint], arm)
        })
    }

    pub(super) fn along_link(&self, joint: usize, q: &Angles) -> Option<[f64; 3]> {
        let link = joint.checked_sub(1)?;
        self.posture(q).links.get(link).copied()
    }

    pub(super) fn angles(&self, place_m: [f64; 3]) -> Result<Angles, ReachError> {
        let flange = of_quaternion(self.orientation);
        let [x, y, z] = self.tool_m;
        let centre = difference(place_m, turned(&flange, [x, y, z + self.c4_m]));
        let [cx, cy, cz] = centre;
        let forward2 = cx * cx + cy * cy - self.b_m * self.b_m;
        if forward2.is_nan() || forward2 < SHOULDER_M * SHOULDER_M {
            return Err(ReachError::Shoulder);
        }
        // In the plane of the arm, from axis 2 to the wrist.
        let (along, height) = (forward2.sqrt() - self.a1_m, cz - self.c1_m);
        let q1 = cy.atan2(cx) - self.b_m.atan2(along + self.a1_m);
        let fore = self.a2_m.hypot(self.c3_m);
        let span2 = along * along + height * height;
        let bend = (span2 - self.c2_m * self.c2_m - fore * fore) / (2.0 * self.c2_m * fore);
        if bend.is_nan() || bend.abs() > 1.0 {
            return Err(ReachError::OutOfReach);
        }
        if bend.abs() > STRETCHED {
            return Err(ReachError::Elbow);
        }
        let span = span2.sqrt();
        let lift = (span2 + self.c2_m * self.c2_m - fore * fore) / (2.0 * span * self.c2_m);
        let side = if self.branch.up() { 1.0 } else { -1.0 };
        let q2 = along.atan2(height) - side * lift.clamp(-1.0, 1.0).acos();
        let q3 = side * bend.acos() - self.a2_m.atan2(self.c3_m);
        let arm = product(&about_z(q1), &about_y(q2 + q3));
        let wrist: Matrix = product(&transposed(&arm), &flange);
        let sine = wrist[0][2].hypot(wrist[1][2]);
        if sine < WRIST {
            return Err(ReachError::Wrist);
        }
        let side = if self.branch.flipped() { -1.0 } else { 1.0 };
        let q4 = (side * wrist[1][2]).atan2(side * wrist[0][2]);
        let q5 = (side * sine).atan2(wrist[2][2]);
        let q6 = (side * wrist[2][1]).atan2(-side * wrist[2][0]);
        Ok([q1, q2, q3, q4, q5, q6])
    }
}
