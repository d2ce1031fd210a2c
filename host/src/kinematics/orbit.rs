//! A circle as the joints see it: their angles over the turn, what a unit error of each does to the radius, where they turn
//! back, and what the joints' common response makes of the whole.
//!
//! Tables are over the polar angle ψ of the command, [`NODES`] to a turn; between them lines are drawn, which is good to 4e-7
//! of an angle's swing. Where more is needed the waves of the angles are used.
use super::{Angles, Kinematics, ReachError, short_way};
use giotto_shared::Frame;
use rustfft::num_complex::Complex;
use std::f64::consts::TAU;

/// Nodes of the tables over one turn.
pub const NODES: usize = 2048;
/// Nodes at which short sums of waves are evaluated.
pub const COARSE: usize = 64;
/// Waves of an angle that are kept, the mean among them: 12 waves a turn hold what a circle does to an angle that is not near a
/// singularity, to (radius over distance)¹³.
pub const WAVES: usize = 13;
/// Swing below which a joint stands still, rad.
const STANDS_RAD: f64 = 1e-9;

/// The joints at one angle of the circle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointNode {
    /// Angles, continuous over the turn, rad.
    pub q_rad: Angles,
    /// Their change with the polar angle, rad/rad.
    pub rate: Angles,
    /// What a unit error of each does to the radius: n̂ᵀ J e_k, m/rad.
    pub lever_m: Angles,
}

/// Where a joint turns back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reversal {
    /// Polar angle, rad, 0 to 2π.
    pub angle_rad: f64,
    /// Second derivative of the joint's angle with the polar angle there, rad: its sign is that of the new motion, whichever
    /// way the circle is run.
    pub bend: f64,
}

/// One circle of an arm.
#[derive(Clone, Debug)]
pub struct Orbit {
    kinematics: Kinematics,
    centre_m: [f64; 3],
    frame: Frame,
    radius_m: f64,
    nodes: Vec<JointNode>,
    reversals: [Vec<Reversal>; 6],
    waves: [[Complex<f64>; WAVES]; 6],
}

/// A quantity over one turn, at evenly spaced angles from 0.
pub type Cycle = [f64; COARSE];

impl Orbit {
    /// Follows a circle through the joints.
    ///
    /// # Errors
    /// Where the arm cannot stand on the circle: the polar angle, rad, and why.
    pub fn new(
        kinematics: &Kinematics,
        centre_m: [f64; 3],
        frame: Frame,
        radius_m: f64,
    ) -> Result<Self, (f64, ReachError)> {
        let path = walk(kinematics, centre_m, frame, radius_m, NODES)?;
        let step = TAU / NODES as f64;
        let nodes: Vec<JointNode> = (0..NODES)
            .map(|node| {
                let (next, last) = (&path[(node + 1) % NODES], &path[(node + NODES - 1) % NODES]);
                let (sin, cos) = (step * node as f64).sin_cos();
                let normal = [0, 1, 2].map(|k| cos * frame.first()[k] + sin * frame.second()[k]);
                let levers = kinematics.levers(&path[node]);
                JointNode {
                    q_rad: path[node],
                    rate: std::array::from_fn(|k| (next[k] - last[k]) / (2.0 * step)),
                    lever_m: levers.map(|l| l[0] * normal[0] + l[1] * normal[1] + l[2] * normal[2]),
                }
            })
            .collect();
        Ok(Self {
            kinematics: *kinematics,
            centre_m,
            frame,
            radius_m,
            reversals: std::array::from_fn(|joint| reversals(&nodes, joint)),
            waves: std::array::from_fn(|joint| waves(&path, joint)),
            nodes,
        })
    }

    /// The arm.
    pub const fn kinematics(&self) -> &Kinematics {
        &self.kinematics
    }

    /// The tables, [`NODES`] to a turn from polar angle 0.
    pub fn nodes(&self) -> &[JointNode] {
        &self.nodes
    }

    /// Angle, rate and lever of one joint at a polar angle, rad.
    pub fn at(&self, joint: usize, angle_rad: f64) -> [f64; 3] {
        let place = (angle_rad * (NODES as f64 / TAU)).rem_euclid(NODES as f64);
        let first = (place as usize).min(NODES - 1);
        let share = place - first as f64;
        let (a, b) = (&self.nodes[first], &self.nodes[(first + 1) % NODES]);
        let between = |x: f64, y: f64| x + share * (y - x);
        [
            between(a.q_rad[joint], b.q_rad[joint]),
            between(a.rate[joint], b.rate[joint]),
            between(a.lever_m[joint], b.lever_m[joint]),
        ]
    }

    /// Where a joint turns back, in the order of the polar angle.
    pub fn reversals(&self, joint: usize) -> &[Reversal] {
        &self.reversals[joint]
    }

    /// Lowest and highest angle of a joint, rad.
    pub fn range_rad(&self, joint: usize) -> [f64; 2] {
        self.nodes
            .iter()
            .fold([f64::MAX, f64::MIN], |[low, high], node| {
                [low.min(node.q_rad[joint]), high.max(node.q_rad[joint])]
            })
    }

    /// Largest change of a joint's angle with the polar angle, rad/rad.
    pub fn fastest(&self, joint: usize) -> f64 {
        self.nodes
            .iter()
            .fold(0.0, |most, node| f64::max(most, node.rate[joint].abs()))
    }

    /// Distance of the centre of the circle from a joint's axis, as far as the joint moves it, m.
    pub fn arm_m(&self, joint: usize) -> f64 {
        let Ok(q) = self.kinematics.angles(self.centre_m) else {
            return 0.0;
        };
        let lever = self.kinematics.levers(&q)[joint];
        lever.iter().map(|l| l * l).sum::<f64>().sqrt()
    }

    /// Waves of a joint's angle: q(ψ) = Re Σ cₙ e^{inψ}, rad.
    pub const fn waves(&self, joint: usize) -> &[Complex<f64>; WAVES] {
        &self.waves[joint]
    }

    /// A joint's angle passed through an answer per wave: Re Σ hₙ cₙ e^{inψ} over one turn, rad.
    pub fn answered(&self, joint: usize, answers: &[Complex<f64>; WAVES]) -> Cycle {
        let parts: [Complex<f64>; WAVES] =
            std::array::from_fn(|n| answers[n] * self.waves[joint][n]);
        std::array::from_fn(|node| {
            let turn = Complex::cis(TAU * node as f64 / COARSE as f64);
            // Horner's scheme in e^{iψ}.
            let sum = parts
                .iter()
                .rev()
                .fold(Complex::new(0.0, 0.0), |sum, part| sum * turn + part);
            sum.re
        })
    }

    /// What an error of a joint over one turn does to the radius, m.
    pub fn seen(&self, joint: usize, error_rad: &Cycle) -> Cycle {
        std::array::from_fn(|node| {
            error_rad[node] * self.nodes[node * (NODES / COARSE)].lever_m[joint]
        })
    }

    /// What a longer link does to the radius, m/m; `None`: no such link.
    pub fn seen_of_link(&self, joint: usize) -> Option<Cycle> {
        let mut out = [0.0; COARSE];
        for (node, out) in out.iter_mut().enumerate() {
            let q = &self.nodes[node * (NODES / COARSE)].q_rad;
            let along = self.kinematics.along_link(joint, q)?;
            let (sin, cos) = (TAU * node as f64 / COARSE as f64).sin_cos();
            let (u, v) = self.in_plane(along);
            *out = u * cos + v * sin;
        }
        Some(out)
    }

    /// Radius error over one turn where every joint answers its waves alike, m: exact in the kinematics.
    pub fn common(&self, answers: &[Complex<f64>; WAVES]) -> Cycle {
        let lagged: [Complex<f64>; WAVES] = answers.map(|answer| answer - 1.0);
        let turning = self.kinematics.turning();
        let errors: Vec<Cycle> = (0..turning.max(3))
            .map(|joint| self.answered(joint, &lagged))
            .collect();
        std::array::from_fn(|node| {
            let mut q = self.nodes[node * (NODES / COARSE)].q_rad;
            for (q, error) in q.iter_mut().zip(&errors) {
                *q += error[node];
            }
            self.radius_error_m(self.kinematics.place(&q))
        })
    }

    /// Distance of a place from the centre in the plane of the circle, less the radius, m.
    pub fn radius_error_m(&self, place_m: [f64; 3]) -> f64 {
        let (u, v) = self.in_plane([0, 1, 2].map(|k| place_m[k] - self.centre_m[k]));
        u.hypot(v) - self.radius_m
    }

    fn in_plane(&self, v: [f64; 3]) -> (f64, f64) {
        let (first, second) = (self.frame.first(), self.frame.second());
        let dot = |a: [f64; 3]| a[0] * v[0] + a[1] * v[1] + a[2] * v[2];
        (dot(first), dot(second))
    }
}

/// Angles of the joints at so many places of a circle, continuous over the turn.
///
/// # Errors
/// Where the arm cannot stand on the circle: the polar angle, rad, and why.
pub fn walk(
    kinematics: &Kinematics,
    centre_m: [f64; 3],
    frame: Frame,
    radius_m: f64,
    places: usize,
) -> Result<Vec<Angles>, (f64, ReachError)> {
    let mut path: Vec<Angles> = Vec::with_capacity(places);
    for node in 0..places {
        let angle = TAU * node as f64 / places as f64;
        let place = on_circle(centre_m, frame, radius_m, angle);
        let mut q = kinematics.angles(place).map_err(|e| (angle, e))?;
        if let Some(before) = path.last() {
            for joint in 0..kinematics.turning() {
                q[joint] = before[joint] + short_way(before[joint], q[joint]);
            }
        }
        path.push(q);
    }
    if let (Some(first), Some(last)) = (path.first(), path.last()) {
        for joint in 0..kinematics.turning() {
            let closing = last[joint] + short_way(last[joint], first[joint]) - first[joint];
            if closing.abs() > 1.0 {
                return Err((0.0, ReachError::Around));
            }
        }
    }
    Ok(path)
}

/// Place at a polar angle of a circle, m.
fn on_circle(centre_m: [f64; 3], frame: Frame, radius_m: f64, angle_rad: f64) -> [f64; 3] {
    let (sin, cos) = angle_rad.sin_cos();
    let (first, second) = (frame.first(), frame.second());
    [0, 1, 2].map(|k| centre_m[k] + radius_m * (cos * first[k] + sin * second[k]))
}

fn reversals(nodes: &[JointNode], joint: usize) -> Vec<Reversal> {
    let (low, high) = nodes.iter().fold((f64::MAX, f64::MIN), |(low, high), n| {
        (low.min(n.q_rad[joint]), high.max(n.q_rad[joint]))
    });
    if high - low < STANDS_RAD {
        return Vec::new();
    }
    let step = TAU / NODES as f64;
    (0..NODES)
        .filter_map(|node| {
            let (a, b) = (
                nodes[node].rate[joint],
                nodes[(node + 1) % NODES].rate[joint],
            );
            // A node that stands exactly belongs to the interval that it opens.
            let crossed = (a == 0.0 && b != 0.0) || a * b < 0.0;
            crossed.then(|| Reversal {
                angle_rad: step * (node as f64 + a / (a - b)),
                bend: (b - a) / step,
            })
        })
        .collect()
}

/// Waves of a joint's angle over evenly spaced places of one turn: q = Re Σ cₙ e^{inψ}.
pub(crate) fn waves(path: &[Angles], joint: usize) -> [Complex<f64>; WAVES] {
    let n = path.len() as f64;
    std::array::from_fn(|order| {
        let sum: Complex<f64> = path
            .iter()
            .enumerate()
            .map(|(node, q)| {
                let turned = (order * node) % path.len();
                Complex::cis(-TAU * turned as f64 / n) * q[joint]
            })
            .sum();
        sum * if order == 0 { 1.0 } else { 2.0 } / n
    })
}
