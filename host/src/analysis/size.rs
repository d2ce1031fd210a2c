//! The size of a circle that was not seen evenly: arcs, holes, starts and stops.
//!
//! Where points lie evenly over the turn, every order of the form but the mean falls out of the least-squares circle. Where they
//! do not, form passes for size: on 220° an oval of 20 µm moves the circle by 19 µm. Here size, centre and form are estimated
//! together. The orders from 2 on have the horseshoe prior (Carvalho, Polson and Scott 2010, DOI 10.1093/biomet/asq017): one scale
//! for all and one of its own for each, so that a single large order leaves the others small. Scales, noise and form are drawn in
//! turns (Gibbs; Makalic and Schmidt 2016, DOI 10.1109/LSP.2015.2503725), and the size averaged over the draws, so that what
//! the points leave open enters the standard error.
use super::points::Polar;
use giotto_shared::circle::Merge;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Gamma, StandardNormal};
use std::f64::consts::TAU;

/// Sectors whose means stand for the points.
const SECTORS: usize = 240;
/// Highest order of form.
const HIGHEST: usize = 16;
/// Size, centre, and two coefficients of each order of form.
const UNKNOWNS: usize = 2 * HIGHEST + 1;
/// Orders of form.
const ORDERS: usize = HIGHEST - 1;
/// Size and centre, which have no prior.
const FREE: usize = 3;
/// Draws of scales and noise, and how many of the first are forgotten. The error of the size that is left by their number is about
/// 1/15 of the standard error.
const DRAWS: usize = 300;
const FORGOTTEN: usize = 60;
/// Largest correlation of neighbouring sectors that is believed.
const HIGHEST_CORRELATION: f64 = 0.8;

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
/// the standard deviation of a reading by its neighbours. `None` for points that hold neither form nor noise.
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
    let count: f64 = sectors.0.iter().map(|s| s[0]).sum();
    let spread_m = (sectors.0.iter().map(|s| s[3]).sum::<f64>() / count).sqrt();
    if spread_m <= 0.0 || !spread_m.is_finite() {
        return None;
    }
    // Of a simulation without noise the form itself is all there is.
    let noise_m = noise_m.max(1e-3 * spread_m);
    let seen = Seen::of(&sectors, spread_m);
    let mut chain = Chain::start(&seen, noise_m / spread_m);
    let (mut sizes, mut variances) = (Vec::new(), 0.0);
    for draw in 0..DRAWS {
        let (size, variance) = chain.draw(&seen)?;
        if draw >= FORGOTTEN {
            sizes.push(size);
            variances += variance;
        }
    }
    let kept = sizes.len() as f64;
    let size = sizes.iter().sum::<f64>() / kept;
    let between = sizes.iter().map(|s| (s - size).powi(2)).sum::<f64>() / kept;
    Some(Correction {
        value_m: size * spread_m,
        se_m: (variances / kept + between).sqrt() * spread_m,
    })
}

/// Means of the sectors with points in them, in multiples of their spread, and what a fit of all orders needs of them.
struct Seen {
    /// Points of each.
    weight: Vec<f64>,
    mean: Vec<f64>,
    basis: DMatrix<f64>,
    matrix: DMatrix<f64>,
    right: DVector<f64>,
    /// Whether the next one lies beside it.
    beside: Vec<bool>,
}

impl Seen {
    fn of(sectors: &Sectors, unit_m: f64) -> Self {
        let seen: Vec<(usize, &[f64; 4])> = sectors
            .0
            .iter()
            .enumerate()
            .filter(|(_, s)| s[0] > 0.0)
            .collect();
        let weight: Vec<f64> = seen.iter().map(|(_, s)| s[0]).collect();
        let mean: Vec<f64> = seen.iter().map(|(_, s)| s[2] / s[0] / unit_m).collect();
        let basis = DMatrix::from_fn(UNKNOWNS, seen.len(), |k, i| {
            let (_, sums) = seen[i];
            let angle = k.div_ceil(2) as f64 * sums[1] / sums[0];
            match k {
                0 => 1.0,
                k if k % 2 == 1 => angle.cos(),
                _ => angle.sin(),
            }
        });
        let weighted = DMatrix::from_fn(UNKNOWNS, seen.len(), |k, i| basis[(k, i)] * weight[i]);
        Self {
            matrix: &weighted * basis.transpose(),
            right: &weighted * DVector::from_column_slice(&mean),
            beside: seen.windows(2).map(|w| w[1].0 == w[0].0 + 1).collect(),
            weight,
            mean,
            basis,
        }
    }

    /// What a form leaves of the means, each in units of its own noise.
    fn left(&self, form: &DVector<f64>) -> Vec<f64> {
        let model = self.basis.tr_mul(form);
        self.mean
            .iter()
            .zip(&self.weight)
            .zip(model.iter())
            .map(|((mean, weight), model)| (mean - model) * weight.sqrt())
            .collect()
    }

    /// By how much correlation of neighbours makes the variance of a sum larger than that of independent sectors.
    fn inflation(&self, left: &[f64], squares: f64) -> f64 {
        let pairs = || left.windows(2).zip(&self.beside).filter(|(_, b)| **b);
        let count = pairs().count();
        if count == 0 || squares <= 0.0 {
            return 1.0;
        }
        let products: f64 = pairs().map(|(pair, _)| pair[0] * pair[1]).sum();
        let correlation = products / count as f64 / (squares / left.len() as f64);
        let correlation = correlation.clamp(0.0, HIGHEST_CORRELATION);
        (1.0 + correlation) / (1.0 - correlation)
    }
}

/// The state of the draws: variances of noise and form.
struct Chain {
    random: ChaCha8Rng,
    /// Of a reading by its neighbours: never less.
    least_noise: f64,
    noise: f64,
    /// Of all form, and its mixing variable.
    common: f64,
    common_mixing: f64,
    /// Of each order beside that, and its mixing variables.
    own: [f64; ORDERS],
    own_mixing: [f64; ORDERS],
}

impl Chain {
    fn start(seen: &Seen, noise: f64) -> Self {
        debug_assert!(!seen.mean.is_empty());
        Self {
            // Draws are the same for the same points.
            random: ChaCha8Rng::seed_from_u64(1),
            least_noise: noise * noise,
            noise: noise * noise,
            common: 1.0,
            common_mixing: 1.0,
            own: [1.0; ORDERS],
            own_mixing: [1.0; ORDERS],
        }
    }

    /// Draws form, scales and noise; mean and variance of the size by the scales and noise that were there before. `None` if
    /// the sums cannot be solved.
    fn draw(&mut self, seen: &Seen) -> Option<(f64, f64)> {
        let mut information = &seen.matrix / self.noise;
        for (index, own) in self.own.iter().enumerate() {
            let precision = 1.0 / (self.common * own * fall(index));
            for k in [FREE + 2 * index, FREE + 2 * index + 1] {
                information[(k, k)] += precision;
            }
        }
        let solved: Cholesky<f64, Dyn> = information.cholesky()?;
        let mean = solved.solve(&(&seen.right / self.noise));
        let unit = DVector::from_fn(UNKNOWNS, |k, _| f64::from(u8::from(k == 0)));
        let variance = solved.solve(&unit)[0];
        let random = &mut self.random;
        let free = DVector::from_fn(UNKNOWNS, |_, _| StandardNormal.sample(random));
        let form = &mean + solved.l_dirty().tr_solve_lower_triangular(&free)?;
        self.draw_scales(&form);
        let left = seen.left(&form);
        let squares: f64 = left.iter().map(|e| e * e).sum();
        let drawn = self.inverse_gamma(0.5 * left.len() as f64, 0.5 * squares);
        self.noise = drawn.max(self.least_noise) * seen.inflation(&left, squares);
        Some((mean[0], variance))
    }

    fn draw_scales(&mut self, form: &DVector<f64>) {
        let mut sum = 0.0;
        for index in 0..ORDERS {
            let k = FREE + 2 * index;
            let squares = (form[k].powi(2) + form[k + 1].powi(2)) / fall(index);
            let own = self.inverse_gamma(
                1.5,
                1.0 / self.own_mixing[index] + squares / (2.0 * self.common),
            );
            self.own[index] = own.clamp(1e-12, 1e12);
            self.own_mixing[index] = self.inverse_gamma(1.0, 1.0 + 1.0 / self.own[index]);
            sum += squares / self.own[index];
        }
        let shape = 0.5 * (2 * ORDERS + 1) as f64;
        let common = self.inverse_gamma(shape, 1.0 / self.common_mixing + 0.5 * sum);
        // From a thousandth of the noise of a reading to a thousand times all that is seen.
        self.common = common.clamp(1e-6 * self.least_noise, 1e6);
        self.common_mixing = self.inverse_gamma(1.0, 1.0 + 1.0 / self.common);
    }

    /// A draw from the inverse gamma distribution with this shape and scale.
    fn inverse_gamma(&mut self, shape: f64, scale: f64) -> f64 {
        // Shapes are positive: there is at least one sector.
        let gamma = Gamma::new(shape.max(0.5), 1.0).map_or(1.0, |g| g.sample(&mut self.random));
        scale / gamma.max(f64::MIN_POSITIVE)
    }
}

/// How the variance of an order falls beforehand, from 1 at order 2: scales, angles and servos make ovals, and what makes the
/// orders above falls at least with the square (a jump's slope, a rectified sine).
fn fall(index: usize) -> f64 {
    (2.0 / (index as f64 + 2.0)).powi(4)
}
