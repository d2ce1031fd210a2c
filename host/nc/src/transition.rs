//! The shape of the step that brings a correction in behind a joint.
//!
//! In units of the chain's own time u (`chain`) and of u²f²/R across the path: a curvature that sets in at a joint,
//! n = s²/2, is answered by h∗n, late by κ1 and offset by κ2/2. The offset g that the command is given instead should
//! leave h∗(n − g) = n(s − κ1). It may not begin before the joint, where the block of a line stands untouched, nor have
//! a corner, and so this is met as well as a cubic with free nodes can: least squares, reweighted towards the least
//! largest error. What remains at the joint, as a share of the offset (the tests hold the numbers):
//!
//! | machine | κ4/κ2² | smooth step | this one |
//! |---|---|---|---|
//! | a lag | 6 | 4 % | 0.4 % |
//! | a lag of 20 ms, an average of 40 ms | 3.3 | 8 % | 3.5 % |
//! | an average alone | −1.2 | 20 % | 12.3 % |
//!
//! An average alone answers before the joint, on the line that may not be touched, and what is left of that is no matter of
//! shape: with eight free nodes over three averages 5 % would remain, over one 12 %. The summary of `giotto compensate`
//! names the arcs whose joints keep more than 5 %.
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

/// A step that starts from a joint of a chain.
pub(super) struct Joint {
    chain: Chain,
    length: f64,
    samples: usize,
    /// What is missing behind the joint, in units.
    missing: Vec<f64>,
}

impl Joint {
    /// Of a step over `length` units.
    pub(super) fn new(chain: Chain, length: f64) -> Self {
        let samples = ((chain.settling() + length) / STEP) as usize;
        let time = |k: usize| k as f64 * STEP;
        let curve: Vec<f64> = (0..samples).map(|k| 0.5 * time(k).powi(2)).collect();
        let wanted = |k: usize| 0.5 * (time(k) - chain.delay()).max(0.0).powi(2);
        let mut missing = chain.apply(&curve);
        for (k, m) in missing.iter_mut().enumerate() {
            *m -= wanted(k);
        }
        Self {
            chain,
            length,
            samples,
            missing,
        }
    }

    /// Samples that the joint has a part in. Behind them the offset is what the circle's own law says, which holds terms
    /// beyond κ2/2: no error of the joint.
    fn window(&self) -> usize {
        let end = self.length + 2.0 * self.chain.delay() + 1.0;
        ((end / STEP) as usize).min(self.samples)
    }

    /// What is answered to a step of height 1.
    fn answer(&self, shape: Transition) -> Vec<f64> {
        let step: Vec<f64> = (0..self.samples)
            .map(|k| shape.at(k as f64 * STEP / self.length))
            .collect();
        self.chain.apply(&step)
    }

    /// Largest error that a step of `rise` units leaves, in units.
    pub(super) fn remaining(&self, shape: Transition, rise: f64) -> f64 {
        let answer = self.answer(shape);
        let left = self.missing.iter().zip(answer).take(self.window());
        left.fold(0.0, |most, (m, a)| f64::max(most, (m - rise * a).abs()))
    }

    /// The best step of `rise` units through `count` nodes.
    pub(super) fn best(&self, rise: f64, count: usize) -> Transition {
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
        let window = self.window();
        let mut weights = vec![1.0; window];
        let mut best = (f64::INFINITY, Transition::SMOOTH);
        for _ in 0..ROUNDS {
            let Some(solved) = weighted(&parts, &target, &weights) else {
                break;
            };
            let left: Vec<f64> = (0..window)
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
    for i in 0..n {
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
    use super::super::steps::base_length;
    use super::*;

    /// What the module's table says; the smooth step beside it by the same measure.
    #[test]
    fn errors_are_those_of_the_table() {
        let m = 0.04 / (4e-4_f64 + 1.6e-3 / 12.0).sqrt();
        let l = 0.02 / (4e-4_f64 + 1.6e-3 / 12.0).sqrt();
        for (lag, average, most) in [
            (1.0, 0.0, 0.004),
            (l, m, 0.035),
            (0.0, 12.0_f64.sqrt(), 0.123),
        ] {
            let chain = Chain::LagAverage { lag, average };
            let length = base_length(chain);
            let joint = Joint::new(chain, length);
            let t = joint.best(0.5, 1);
            let remaining = joint.remaining(t, 0.5) / 0.5;
            assert!(
                remaining <= most && remaining > 0.5 * most,
                "{chain:?}: {remaining} {t:?}"
            );
            // No more acceleration (curvature over length squared) than 40 over the length of a shorter step.
            let short = 1.6 * lag + 0.6 * average;
            assert!(
                t.curvature() / length.powi(2) < 40.0 / short.powi(2),
                "{t:?}"
            );
        }
    }

    #[test]
    fn second_order_is_shaped_for_too() {
        for (zeta, most) in [(0.95, 0.02), (0.8, 0.06), (1.2, 0.02)] {
            let chain = Chain::SecondOrder { zeta };
            let joint = Joint::new(chain, base_length(chain));
            let rise = 2.0 * zeta * zeta - 1.0;
            let share = joint.remaining(joint.best(rise, 2), rise) / rise;
            println!("{zeta}: {share}");
            assert!(share < most, "{zeta}: {share}");
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
            let t = Joint::new(chain, 1.6).best(0.5, count);
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
