//! The size of a circle that was not seen evenly: arcs, holes, starts and stops.
//!
//! Where points lie evenly over the turn, every order of the form but the mean falls out of the least-squares circle. Where they
//! do not, form passes for size: on 220° an oval of 20 µm moves the circle by 19 µm. Here size, centre and form are estimated
//! together; orders from 2 on have a prior of their own size, which the data tell, and what they leave open enters the
//! standard error. The scales of form and noise are averaged over what the data allow.
use super::points::Polar;
use giotto_shared::circle::Merge;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Sectors whose means stand for the points.
const SECTORS: usize = 240;
/// Highest order of form.
const HIGHEST: usize = 16;
const UNKNOWNS: usize = 2 * HIGHEST + 1;
/// Powers by which form falls with its order.
const FALLS: [f64; 3] = [0.75, 1.5, 2.5];
/// Scales of form over the noise of all points, from hardly seen to a thousand times it.
const SCALES: usize = 15;
/// Noise over that between neighbours: correlated noise is larger over sectors.
const NOISES: [f64; 3] = [1.0, 1.8, 3.5];
/// Form is there once the data make it this many times as likely as none.
const ODDS: f64 = 1.0;

/// An estimate of what is to be added to the radius of the least-squares circle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Correction {
    /// m.
    pub(super) value_m: f64,
    /// Standard error of the corrected radius, m.
    pub(super) se_m: f64,
}

/// Sums of angle and distance, sector by sector.
#[derive(Clone)]
struct Sectors(Vec<[f64; 4]>);

impl Default for Sectors {
    fn default() -> Self {
        Self(vec![[0.0; 4]; SECTORS])
    }
}

impl Merge for Sectors {
    fn merge(&mut self, other: &Self) {
        for (a, b) in self.0.iter_mut().zip(&other.0) {
            a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        }
    }
}

/// Whether points lie so unevenly that form can pass for size: some steps, that over the seam of the turn too, are much larger
/// than the usual one, or the points gather somewhere. Of dense recordings every n-th point is looked at.
pub(super) fn uneven(angle: &[f64]) -> bool {
    const MOST: usize = 20_000;
    let used: Vec<f64> = angle
        .iter()
        .copied()
        .step_by(angle.len().div_ceil(MOST).max(1))
        .collect();
    let (Some(first), Some(last), n) = (used.first(), used.last(), used.len()) else {
        return false;
    };
    if n < 8 {
        return false;
    }
    let extent = (last - first).abs();
    let mean = extent / (n as f64 - 1.0);
    let largest = used
        .windows(2)
        .map(|w| (w[1] - w[0]).abs())
        .fold(0.0, f64::max);
    let seam = (TAU - extent).abs();
    // Rows that lie closer at a start show in how far the quarters of the rows are from the quarters of the angle.
    let bent = (1..4).any(|quarter| {
        let share = (used[n * quarter / 4] - first).abs() / extent;
        (share - (n * quarter / 4) as f64 / (n as f64 - 1.0)).abs() > 1.0 / n as f64 + 1e-3
    });
    largest > 1.8 * mean || (seam - mean).abs() > 0.5 * mean || bent
}

/// The correction for points about a least-squares circle: `residual` is the distance from it by angle and deviation, `noise_m`
/// the standard deviation of a reading. `None` where no form is seen, so that the least-squares circle stands.
pub(super) fn correction(
    points: &Polar<'_>,
    residual: impl Fn(f64, f64) -> f64 + Sync,
    noise_m: f64,
) -> Option<Correction> {
    let sectors: Sectors = points.fold(|angle, deviation| {
        let mut sums = Sectors::default();
        for (a, v) in angle.iter().zip(deviation) {
            let turn = (a / TAU).rem_euclid(1.0);
            let slot = ((turn * SECTORS as f64) as usize).min(SECTORS - 1);
            let e = residual(*a, *v);
            let sector = &mut sums.0[slot];
            sector[0] += 1.0;
            sector[1] += TAU * turn;
            sector[2] += e;
            sector[3] += e * e;
        }
        sums
    });
    let seen: Vec<(f64, f64, f64)> = sectors
        .0
        .iter()
        .filter(|s| s[0] > 0.0)
        .map(|s| (s[0], s[1] / s[0], s[2] / s[0]))
        .collect();
    let count: f64 = seen.iter().map(|s| s.0).sum();
    let spread = (sectors.0.iter().map(|s| s[3]).sum::<f64>() / count).sqrt();
    // Of a simulation without noise the form itself is all there is.
    let noise_m = noise_m.max(1e-3 * spread).max(1e-12);
    let normal = Normal::of(&seen);
    let mut none: Vec<Candidate> = Vec::new();
    let mut some: Vec<Candidate> = Vec::new();
    for factor in NOISES {
        let noise = noise_m * factor;
        none.extend(normal.solve(noise, None));
        for fall in FALLS {
            for k in 0..SCALES {
                let scale = noise_m / count.sqrt() * 10f64.powf(0.3 * (k as f64 - 1.0));
                some.extend(normal.solve(noise, Some((scale, fall))));
            }
        }
    }
    let likelihood = |all: &[Candidate], top: f64| {
        all.iter().map(|c| (c.evidence - top).exp()).sum::<f64>() / all.len().max(1) as f64
    };
    let all = none.iter().chain(&some);
    let top = all.map(|c| c.evidence).fold(f64::NEG_INFINITY, f64::max);
    if likelihood(&some, top) < ODDS * likelihood(&none, top) {
        return None;
    }
    let weight: f64 = some.iter().map(|c| (c.evidence - top).exp()).sum();
    let mean = |of: &dyn Fn(&Candidate) -> f64| {
        some.iter()
            .map(|c| (c.evidence - top).exp() * of(c))
            .sum::<f64>()
            / weight
    };
    let value_m = mean(&|c| c.size);
    let variance = mean(&|c| c.variance + (c.size - value_m).powi(2));
    Some(Correction {
        value_m,
        se_m: variance.max(0.0).sqrt(),
    })
}

/// Size with its variance under one assumption on form and noise, and how well that explains the data (logarithm).
struct Candidate {
    size: f64,
    variance: f64,
    evidence: f64,
}

/// Sums of the basis functions over the sectors.
struct Normal {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
    squares: f64,
    rows: f64,
}

impl Normal {
    fn of(seen: &[(f64, f64, f64)]) -> Self {
        let mut matrix = DMatrix::zeros(UNKNOWNS, UNKNOWNS);
        let mut right = DVector::zeros(UNKNOWNS);
        let mut squares = 0.0;
        for &(weight, angle, value) in seen {
            let basis = DVector::from_fn(UNKNOWNS, |k, _| {
                let order = k.div_ceil(2) as f64;
                if k % 2 == 1 {
                    (order * angle).cos()
                } else if k == 0 {
                    1.0
                } else {
                    (order * angle).sin()
                }
            });
            matrix.ger(weight, &basis, &basis, 1.0);
            right.axpy(weight * value, &basis, 1.0);
            squares += weight * value * value;
        }
        Self {
            matrix,
            right,
            squares,
            rows: seen.len() as f64,
        }
    }

    /// `form`: amplitude of order 2 and the power by which the others fall; none of it otherwise.
    fn solve(&self, noise: f64, form: Option<(f64, f64)>) -> Option<Candidate> {
        let size = if form.is_some() { UNKNOWNS } else { 3 };
        let precision = 1.0 / (noise * noise);
        let mut information = self.matrix.view((0, 0), (size, size)) * precision;
        let mut prior = 0.0;
        if let Some((scale, fall)) = form {
            for k in 3..UNKNOWNS {
                let order = k.div_ceil(2) as f64;
                let deviation = scale * (order / 2.0).powf(-fall);
                information[(k, k)] += deviation.powi(-2);
                prior -= 2.0 * deviation.ln();
            }
        }
        let right = self.right.rows(0, size) * precision;
        let solved = information.cholesky()?;
        let unknowns = solved.solve(&right);
        let determinant: f64 = solved
            .l_dirty()
            .diagonal()
            .iter()
            .map(|d| 2.0 * d.ln())
            .sum();
        let unit = DVector::from_fn(size, |k, _| f64::from(u8::from(k == 0)));
        let fitted = right.dot(&unknowns);
        Some(Candidate {
            size: unknowns[0],
            variance: solved.solve(&unit)[0],
            evidence: 0.5 * (prior - determinant + fitted - precision * self.squares)
                - self.rows * noise.ln(),
        })
    }
}
