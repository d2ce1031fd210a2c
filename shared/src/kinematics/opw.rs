//! Six joints with a spherical wrist, in closed form: Brandstötter, Angerer and Hofbaur, "An analytical solution of the
//! inverse kinematics problem of industrial serial manipulators with an ortho-parallel basis and a spherical wrist", 2014.
//!
//! Angles are those of the paper: at zero the arm stands upright with the forearm pointing up. The orientation of the
//! flange is constant along a circle, so that a place has one set of angles on each branch.
use super::rotation::{
    Matrix, about_y, about_z, axes, cross, difference, of_quaternion, product, sum, turned,
};
use super::{ReachError, Real, STRETCHED, Scalar, number};
use serde::{Deserialize, Serialize};

/// Lengths of the arm, its tool and its orientation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Opw<T> {
    /// Axis 2 in front of axis 1, m.
    pub a1_m: T,
    /// Axis 4 behind axis 3 (below the forearm: negative), m.
    pub a2_m: T,
    /// Arm beside axis 1, m.
    pub b_m: T,
    /// Axis 2 above the base, m.
    pub c1_m: T,
    /// Upper arm, m.
    pub c2_m: T,
    /// Forearm, m.
    pub c3_m: T,
    /// Wrist to flange, m.
    pub c4_m: T,
    /// Measured point in the flange's frame (Z out of the flange), m.
    pub tool_m: [T; 3],
    /// That frame in the base: unit quaternion w, x, y, z.
    pub orientation: [T; 4],
    /// Which solution.
    pub branch: Branch,
}

/// Which of the solutions that look forward.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
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

/// |sin| of the fifth angle below which the fourth and the sixth are not determined: 1.1°.
const WRIST: f64 = 0.02;
/// Distance of the wrist from axis 1 below which the first angle is not determined, m.
const SHOULDER_M: f64 = 0.01;

/// The arm at some angles: what the place and the Jacobian are made of.
struct Posture<T> {
    /// Axes: directions …
    axes: [[T; 3]; 6],
    /// … and a point on each.
    points: [[T; 3]; 6],
    /// Directions of the upper arm and of the forearm.
    links: [[T; 3]; 2],
    tool: [T; 3],
}

impl<T: Real> Opw<T> {
    /// From the wrist to the measured point, in the flange's frame.
    fn hand_m(&self) -> [T; 3] {
        let [x, y, z] = self.tool_m;
        [x, y, z + self.c4_m]
    }

    fn posture(&self, [q1, q2, q3, q4, q5, q6]: [T; 6]) -> Posture<T> {
        let (zero, one) = (T::zero(), T::one());
        let base = about_z(q1);
        let upper = product(&base, &about_y(q2));
        let fore = product(&upper, &about_y(q3));
        let wrist = product(&fore, &about_z(q4));
        let hand = product(&wrist, &about_y(q5));
        let flange = product(&hand, &about_z(q6));
        let shoulder = turned(&base, [self.a1_m, self.b_m, self.c1_m]);
        let elbow = sum(shoulder, turned(&upper, [zero, zero, self.c2_m]));
        let centre = sum(elbow, turned(&fore, [self.a2_m, zero, self.c3_m]));
        let ([_, across, _], [_, _, up]) = (axes(&base), axes(&upper));
        let ([_, _, forward], [_, bend, _]) = (axes(&fore), axes(&wrist));
        let [_, _, out] = axes(&hand);
        Posture {
            axes: [[zero, zero, one], across, across, forward, bend, out],
            points: [[zero; 3], shoulder, elbow, centre, centre, centre],
            links: [up, forward],
            tool: sum(centre, turned(&flange, self.hand_m())),
        }
    }

    pub(super) fn place(&self, q: &[T; 6]) -> [T; 3] {
        self.posture(*q).tool
    }

    pub(super) fn levers(&self, q: &[T; 6]) -> [[T; 3]; 6] {
        let posture = self.posture(*q);
        let mut levers = posture.axes;
        for (lever, point) in levers.iter_mut().zip(posture.points) {
            *lever = cross(*lever, difference(posture.tool, point));
        }
        levers
    }

    pub(super) fn along_link(&self, joint: usize, q: &[T; 6]) -> Option<[T; 3]> {
        let link = joint.checked_sub(1)?;
        self.posture(*q).links.get(link).copied()
    }

    pub(super) fn angles<S: Scalar<Base = T>>(&self, place: [S; 3]) -> Result<[S; 6], ReachError> {
        let flange = of_quaternion(self.orientation);
        let [hx, hy, hz] = turned(&flange, self.hand_m()).map(S::constant);
        let [px, py, pz] = place;
        let (cx, cy, cz) = (px - hx, py - hy, pz - hz);
        let beside = S::constant(self.b_m);
        let forward2 = cx * cx + cy * cy - beside * beside;
        let shoulder_m = number::<T>(SHOULDER_M);
        let square = forward2.value();
        if square.is_nan() || square < shoulder_m * shoulder_m {
            return Err(ReachError::Shoulder);
        }
        // In the plane of the arm, from axis 2 to the wrist.
        let forward = forward2.root();
        let (along, height) = (
            forward - S::constant(self.a1_m),
            cz - S::constant(self.c1_m),
        );
        let q1 = cx.angle(cy) - forward.angle(beside);
        let [q2, q3] = self.elbow(along, height)?;
        let [q4, q5, q6] = self.wrist(q1, q2 + q3, &flange)?;
        Ok([q1, q2, q3, q4, q5, q6])
    }

    /// Angles of axes 2 and 3 for a wrist so far along and so high from axis 2.
    fn elbow<S: Scalar<Base = T>>(&self, along: S, height: S) -> Result<[S; 2], ReachError> {
        let one = S::constant(T::one());
        let fore_m = (self.a2_m * self.a2_m + self.c3_m * self.c3_m).sqrt();
        let (upper, fore) = (S::constant(self.c2_m), S::constant(fore_m));
        let span2 = along * along + height * height;
        let bend = (span2 - upper * upper - fore * fore) / ((upper + upper) * fore);
        let size = bend.value().abs();
        if size.is_nan() || size > T::one() {
            return Err(ReachError::OutOfReach);
        }
        if size > number(STRETCHED) {
            return Err(ReachError::Elbow);
        }
        let across = (one - bend * bend).root();
        let across = if self.branch.up() { across } else { -across };
        let q2 = height.angle(along) - (upper + fore * bend).angle(fore * across);
        let q3 = bend.angle(across) - S::constant(self.a2_m.atan2(self.c3_m));
        Ok([q2, q3])
    }

    /// Angles of the wrist behind a forearm turned by `q1` about Z and then by `lean` about Y.
    fn wrist<S: Scalar<Base = T>>(
        &self,
        q1: S,
        lean: S,
        flange: &Matrix<T>,
    ) -> Result<[S; 3], ReachError> {
        let ((s1, c1), (s, c)) = (q1.sine_cosine(), lean.sine_cosine());
        // Axes of the flange in the forearm: (Rz(q1)·Ry(lean))ᵀ·flange.
        let [x, y, z] = axes(flange).map(|axis| {
            let [fx, fy, fz] = axis.map(S::constant);
            let ahead = c1 * fx + s1 * fy;
            [c * ahead - s * fz, c1 * fy - s1 * fx, s * ahead + c * fz]
        });
        let ([zx, zy, zz], [_, _, xz], [_, _, yz]) = (z, x, y);
        let sine2 = zx * zx + zy * zy;
        let least = number::<T>(WRIST);
        let square = sine2.value();
        if square.is_nan() || square < least * least {
            return Err(ReachError::Wrist);
        }
        let turned_over = |v: S| if self.branch.flipped() { -v } else { v };
        let q4 = turned_over(zx).angle(turned_over(zy));
        let q5 = zz.angle(turned_over(sine2.root()));
        let q6 = turned_over(-xz).angle(turned_over(yz));
        Ok([q4, q5, q6])
    }
}
