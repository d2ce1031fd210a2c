//! The shape of the step that brings a correction in behind a joint.
//!
//! The machine of a model (`chain`) is driven along the two circles or lines that meet, in the plane and at their true
//! curvature; what it leaves beside them is to be taken off by a step of the command from one offset to the other. The
//! step may not begin on the block of a line, which stands untouched, nor have a corner, and so this is met as well as a
//! cubic with free nodes can: least squares, reweighted towards the least largest error. Where a line meets an arc
//! remains, as a share of the offset (the tests hold the numbers):
//!
//! | machine | κ4/κ2² | remains |
//! |---|---|---|
//! | a lag | 6 | 0.2 % |
//! | second order, ζ 0.95 | 1.4 | 0.5 % |
//! | a lag of 20 ms, an average of 40 ms | 3.3 | 2.5 % |
//! | an average alone | −1.2 | 11 % |
//!
//! An average alone answers before the joint, on the line that may not be touched, and what is left of that is no matter of
//! shape. The summary of `giotto compensate` names the arcs whose joints keep more than 5 %.
use super::chain::{Chain, STEP};

/// Most nodes between the ends of a step.
const NODES: usize = 2;
/// Rounds of reweighting; the largest error has settled to a tenth of a percent.
const ROUNDS: usize = 8;

/// A step from 0 to 1 over a length, flat at both ends, through nodes evenly between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Transition {
    /// Value and slope per length.
    nodes: [[f64; 2]; NODES],
    count: usize,
}

impl Transition {
    /// The smooth step 3u² − 2u³.
    pub(super) const SMOOTH: Self = Self {
        nodes: [[0.5, 1.5], [0.0; 2]],
        count: 1,
    };

    /// The nodes behind the start: place, value and slope per length.
    pub(super) fn nodes(self) -> impl Iterator<Item = (f64, f64, f64)> {
        let width = ((self.count + 1) as f64).recip();
        (0..self.count)
            .map(move |i| ((i + 1) as f64 * width, self.nodes[i][0], self.nodes[i][1]))
            .chain([(1.0, 1.0, 0.0)])
    }

    /// Largest |g″|·L²: what it adds to the curvature, in Δ/L².
    pub(super) fn curvature(self) -> f64 {
        let width = ((self.count + 1) as f64).recip();
        let (mut most, mut y0, mut m0) = (0.0, 0.0, 0.0);
        for (_, y1, slope) in self.nodes() {
            let m1 = slope * width;
            let rise = 6.0 * (y1 - y0);
            for c in [rise - 4.0 * m0 - 2.0 * m1, -rise + 2.0 * m0 + 4.0 * m1] {
                most = f64::max(most, c.abs());
            }
            (y0, m0) = (y1, m1);
        }
        most / (width * width)
    }

    fn at(self, u: f64) -> f64 {
        if u >= 1.0 {
            return 1.0;
        }
        let parts = (self.count + 1) as f64;
        let i = (u * parts) as usize;
        let node = |i: usize| match i {
            0 => (0.0, 0.0),
            i if i > self.count => (1.0, 0.0),
            i => (self.nodes[i - 1][0], self.nodes[i - 1][1] / parts),
        };
        let ((y0, m0), (y1, m1), v) = (node(i), node(i + 1), u * parts - i as f64);
        let (v2, v3) = (v * v, v * v * v);
        (2.0 * v3 - 3.0 * v2 + 1.0) * y0
            + (v3 - 2.0 * v2 + v) * m0
            + (3.0 * v2 - 2.0 * v3) * y1
            + (v3 - v2) * m1
    }
}

/// How the path is travelled about a joint, in units of the chain's time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pace {
    /// Through it at speed.
    Through,
    /// From rest in it; the speed is reached after so long.
    From(f64),
    /// To rest in it, within so long.
    To(f64),
}

impl Pace {
    /// Way behind the joint at a time.
    fn way(self, t: f64) -> f64 {
        match self {
            Self::Through => t,
            Self::From(ramp) => match t {
                t if t <= 0.0 => 0.0,
                t if t < ramp => 0.5 * t * t / ramp,
                t => t - 0.5 * ramp,
            },
            Self::To(ramp) => {
                let t = (t + 0.5 * ramp).min(ramp);
                if t <= 0.0 {
                    t - 0.5 * ramp
                } else {
                    t - 0.5 * t * t / ramp - 0.5 * ramp
                }
            }
        }
    }
}

/// A joint of two circles or lines in units of the chain's time and the way made in it; curvatures and offsets are positive
/// to the left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Corner {
    /// Before the joint and behind it.
    pub(super) curvature: [f64; 2],
    /// Of the command from the path.
    pub(super) offset: [f64; 2],
    /// The step begins so far before the joint.
    pub(super) lead: f64,
    pub(super) pace: Pace,
}

impl Corner {
    fn curvature_at(&self, way: f64) -> f64 {
        self.curvature[usize::from(way >= 0.0)]
    }

    /// Place and left normal of the path, from the joint along its tangent.
    fn path(&self, way: f64) -> ([f64; 2], [f64; 2]) {
        let k = self.curvature_at(way);
        let (sin, cos) = (k * way).sin_cos();
        let half = (0.5 * k * way).sin();
        let place = if k == 0.0 {
            [way, 0.0]
        } else {
            [sin / k, 2.0 * half * half / k]
        };
        (place, [-sin, cos])
    }

    /// How far to the left of the path a place lies, and the left normal there.
    fn aside(&self, [x, y]: [f64; 2]) -> (f64, [f64; 2]) {
        let k = self.curvature_at(x);
        let w = k * k * (x * x + y * y) - 2.0 * k * y;
        let left = (2.0 * y - k * (x * x + y * y)) / (1.0 + (1.0 + w).max(0.0).sqrt());
        let norm = (k * x).hypot(1.0 - k * y);
        (left, [-k * x / norm, (1.0 - k * y) / norm])
    }
}

/// A step about a joint of a chain.
pub(super) struct Joint {
    chain: Chain,
    corner: Corner,
    length: f64,
    /// Time of the first sample that counts.
    begin: f64,
    samples: usize,
    /// What is missing without a step, to the left.
    missing: Vec<f64>,
    /// Left normals of the path where the command and where the machine is.
    normals: Vec<[[f64; 2]; 2]>,
}

impl Joint {
    /// Of a step over `length` units.
    pub(super) fn new(chain: Chain, corner: Corner, length: f64) -> Self {
        let settling = chain.settling();
        // A line is travelled straight on; a circle must be in its stride.
        let before = if matches!(corner.pace, Pace::From(_)) {
            0.0
        } else {
            settling + corner.lead
        };
        let ramp = match corner.pace {
            Pace::Through => 0.0,
            Pace::From(ramp) | Pace::To(ramp) => ramp,
        };
        let counted = length - corner.lead + ramp + 3.0 * chain.delay() + 1.0;
        let all = ((before + counted) / STEP) as usize + 1;
        let skipped = ((before - corner.lead) / STEP) as usize;
        let time = |k: usize| k as f64 * STEP - before;
        let command: Vec<([f64; 2], [f64; 2])> = (0..all)
            .map(|k| {
                let (p, n) = corner.path(corner.pace.way(time(k)));
                let o = corner.offset[0];
                ([p[0] + o * n[0], p[1] + o * n[1]], n)
            })
            .collect();
        let start = command[0].0;
        let axis = |i: usize| -> Vec<f64> {
            let moved: Vec<f64> = command.iter().map(|(p, _)| p[i] - start[i]).collect();
            chain.apply(&moved)
        };
        let (x, y) = (axis(0), axis(1));
        let mut missing = Vec::with_capacity(all - skipped);
        let mut normals = Vec::with_capacity(all - skipped);
        for k in skipped..all {
            let (left, normal) = corner.aside([x[k] + start[0], y[k] + start[1]]);
            missing.push(-left);
            normals.push([command[k].1, normal]);
        }
        Self {
            chain,
            corner,
            length,
            begin: time(skipped),
            samples: all - skipped,
            missing,
            normals,
        }
    }

    /// What is answered to a step of height 1, to the left of where the machine is.
    fn answer(&self, shape: Transition) -> Vec<f64> {
        let step: Vec<f64> = (0..self.samples)
            .map(|k| {
                let way = self.corner.pace.way(self.begin + k as f64 * STEP);
                shape.at((way + self.corner.lead).max(0.0) / self.length)
            })
            .collect();
        let axis = |i: usize| -> Vec<f64> {
            let moved: Vec<f64> = step
                .iter()
                .zip(&self.normals)
                .map(|(g, n)| g * n[0][i])
                .collect();
            self.chain.apply(&moved)
        };
        let (x, y) = (axis(0), axis(1));
        self.normals
            .iter()
            .enumerate()
            .map(|(k, n)| x[k] * n[1][0] + y[k] * n[1][1])
            .collect()
    }

    /// Height of the step.
    fn rise(&self) -> f64 {
        self.corner.offset[1] - self.corner.offset[0]
    }

    /// Largest error that a step leaves, in units.
    pub(super) fn remaining(&self, shape: Transition) -> f64 {
        let rise = self.rise();
        let left = self.missing.iter().zip(self.answer(shape));
        left.fold(0.0, |most, (m, a)| f64::max(most, (m - rise * a).abs()))
    }

    /// The best step through `count` nodes.
    pub(super) fn best(&self, count: usize) -> Transition {
        let rise = self.rise();
        let count = count.min(NODES);
        let unknowns = 2 * count;
        let blank = Transition {
            nodes: [[0.0; 2]; NODES],
            count,
        };
        let end = self.answer(blank);
        let parts: Vec<Vec<f64>> = (0..unknowns)
            .map(|i| {
                let mut unit = blank;
                unit.nodes[i / 2][i % 2] = 1.0;
                let answer = self.answer(unit);
                // A part contains the end of the step as well.
                answer.iter().zip(&end).map(|(a, e)| a - e).collect()
            })
            .collect();
        let target: Vec<f64> = self
            .missing
            .iter()
            .zip(&end)
            .map(|(m, e)| m / rise - e)
            .collect();
        let mut weights = vec![1.0; self.samples];
        let mut best = (f64::INFINITY, Transition::SMOOTH);
        for _ in 0..ROUNDS {
            let Some(solved) = weighted(&parts, &target, &weights) else {
                break;
            };
            let left: Vec<f64> = (0..self.samples)
                .map(|k| {
                    let got: f64 = (0..unknowns).map(|i| solved[i] * parts[i][k]).sum();
                    (target[k] - got).abs()
                })
                .collect();
            let most = left.iter().copied().fold(0.0, f64::max);
            if most < best.0 {
                let mut shape = blank;
                (0..unknowns).for_each(|i| shape.nodes[i / 2][i % 2] = solved[i]);
                best = (most, shape);
            }
            let scale = most.max(f64::MIN_POSITIVE);
            weights
                .iter_mut()
                .zip(&left)
                .for_each(|(w, e)| *w *= e / scale + 1e-3);
            let sum: f64 = weights.iter().sum();
            weights.iter_mut().for_each(|w| *w /= sum);
        }
        best.1
    }
}

/// Weighted least squares of a few columns, by elimination; `None` if they are not independent.
fn weighted(parts: &[Vec<f64>], target: &[f64], weights: &[f64]) -> Option<[f64; 2 * NODES]> {
    let n = parts.len();
    let mut m = [[0.0; 2 * NODES + 1]; 2 * NODES];
    for (k, (w, t)) in weights.iter().zip(target).enumerate() {
        for i in 0..n {
            let wi = w * parts[i][k];
            m[i][2 * NODES] += wi * t;
            for j in i..n {
                m[i][j] += wi * parts[j][k];
            }
        }
    }
    #[allow(
        clippy::needless_range_loop,
        reason = "indices are those of the formula"
    )]
    for i in 0..n {
        #[allow(
            clippy::needless_range_loop,
            reason = "indices are those of the formula"
        )]
        for j in 0..i {
            m[i][j] = m[j][i];
        }
    }
    for i in 0..n {
        let pivot = (i..n).max_by(|a, b| m[*a][i].abs().total_cmp(&m[*b][i].abs()))?;
        m.swap(i, pivot);
        if m[i][i].abs() < 1e-300 {
            return None;
        }
        for j in i + 1..n {
            let factor = m[j][i] / m[i][i];
            #[allow(
                clippy::needless_range_loop,
                reason = "indices are those of the formula"
            )]
            for c in i..=2 * NODES {
                m[j][c] -= factor * m[i][c];
            }
        }
    }
    let mut solved = [0.0; 2 * NODES];
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| m[i][j] * solved[j]).sum();
        solved[i] = (m[i][2 * NODES] - known) / m[i][i];
    }
    solved.iter().all(|v| v.is_finite()).then_some(solved)
}

#[cfg(test)]
mod tests {
    use super::super::steps::{base_length, nodes};
    use super::*;

    /// From a line into a flat arc that the machine makes too small by κ2/2 of its curvature.
    fn joint(chain: Chain, kappa2: f64) -> (Joint, f64) {
        let k = 1e-3;
        let corner = Corner {
            curvature: [0.0, k],
            offset: [0.0, -0.5 * kappa2 * k],
            lead: 0.0,
            pace: Pace::Through,
        };
        (
            Joint::new(chain, corner, base_length(chain)),
            0.5 * kappa2.abs() * k,
        )
    }

    /// What the module's table says.
    #[test]
    fn errors_are_those_of_the_table() {
        let sigma = (4e-4_f64 + 1.6e-3 / 12.0).sqrt();
        let both = Chain::LagAverage {
            lag: 0.02 / sigma,
            average: 0.04 / sigma,
        };
        let average = Chain::LagAverage {
            lag: 0.0,
            average: 12.0_f64.sqrt(),
        };
        let lag = Chain::LagAverage {
            lag: 1.0,
            average: 0.0,
        };
        let second = |zeta: f64| (Chain::SecondOrder { zeta }, 4.0 * zeta * zeta - 2.0);
        for ((chain, kappa2), most) in [
            ((lag, 1.0), 0.0025),
            ((both, 1.0), 0.028),
            ((average, 1.0), 0.115),
            (second(0.95), 0.006),
            (second(0.8), 0.012),
            (second(1.2), 0.005),
            (second(0.5), 0.005),
        ] {
            let (joint, offset) = joint(chain, kappa2);
            let shape = joint.best(nodes(chain));
            let share = joint.remaining(shape) / offset;
            println!("{chain:?}: {share:.4}");
            assert!(share < most, "{chain:?}: {share} {shape:?}");
        }
    }

    /// The second derivative by differences, as an independent measure of the curvature.
    #[test]
    fn curvature_is_that_of_the_curve() {
        for count in [1, 2] {
            let chain = Chain::LagAverage {
                lag: 1.0,
                average: 0.0,
            };
            let t = joint(chain, 1.0).0.best(count);
            let h = 1e-4;
            let joint = |k: &i32| (f64::from(*k) * 1e-4 * (count + 1) as f64).fract() > 1e-3;
            let most = (2..9998).filter(joint).map(|k| {
                let u = f64::from(k) * 1e-4;
                ((t.at(u + h) - 2.0 * t.at(u) + t.at(u - h)) / (h * h)).abs()
            });
            let most = most.fold(0.0, f64::max);
            assert!(
                (most / t.curvature() - 1.0).abs() < 0.01,
                "{most} {}",
                t.curvature()
            );
            assert_eq!((t.at(0.0), t.at(1.0)), (0.0, 1.0));
        }
    }
}
