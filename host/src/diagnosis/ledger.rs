//! The ledger: for every run, the scalar products of all columns in play.
//!
//! Selection, folds, intervals and the bootstrap all work on sums of these small matrices over runs, so that
//! a thousand refits cost less than one pass over the samples. Two metrics are kept: `white` weighs by noise
//! and scatter between runs (evidence), `plain` is the energy on the circle with the centre free (misfit).
use super::basis::{COLUMNS, dot};
use super::spread::Spread;
use super::survey::Prepared;
use nalgebra::DMatrix;
use rayon::prelude::*;

/// A column run by run.
pub type Samples = Vec<Vec<f64>>;

#[derive(Clone, Debug)]
struct Entry {
    samples: Samples,
    coordinates: Vec<[f64; COLUMNS]>,
    /// What lies outside the low orders; empty for the many columns that lie wholly within them.
    outside: Samples,
}

/// A column that is only tried, over some of the runs.
#[derive(Clone, Debug)]
pub struct Trial {
    samples: Samples,
    coordinates: Vec<[f64; COLUMNS]>,
}

/// Products of columns; column 0 is the data.
#[derive(Clone, Debug)]
pub struct Ledger {
    entries: Vec<Entry>,
    /// Per run: discount of each basis column.
    discounts: Vec<[f64; COLUMNS]>,
    noise_m2: f64,
    white: Vec<DMatrix<f64>>,
    plain: Vec<DMatrix<f64>>,
}

impl Ledger {
    /// Opens a ledger on the data.
    pub fn open(runs: &[Prepared], spread: &Spread, data: Samples) -> Self {
        let discounts = runs.iter().map(|run| spread.discounts(run.visible())).collect();
        let mut ledger = Self {
            entries: Vec::new(),
            discounts,
            noise_m2: spread.noise_m2,
            white: vec![DMatrix::zeros(0, 0); runs.len()],
            plain: vec![DMatrix::zeros(0, 0); runs.len()],
        };
        ledger.push(runs, data);
        ledger
    }

    /// Adds a column and gives its number.
    pub fn push(&mut self, runs: &[Prepared], samples: Samples) -> usize {
        let at = self.entries.len();
        self.entries.push(entry(runs, samples));
        for matrices in [&mut self.white, &mut self.plain] {
            for matrix in matrices.iter_mut() {
                *matrix = std::mem::replace(matrix, DMatrix::zeros(0, 0)).resize(at + 1, at + 1, 0.0);
            }
        }
        self.cross(at);
        at
    }

    /// Replaces a column.
    pub fn replace(&mut self, runs: &[Prepared], at: usize, samples: Samples) {
        self.entries[at] = entry(runs, samples);
        self.cross(at);
    }

    /// Takes out all columns from number `size` on.
    pub fn truncate(&mut self, size: usize) {
        self.entries.truncate(size);
        for matrix in self.white.iter_mut().chain(&mut self.plain) {
            *matrix = std::mem::replace(matrix, DMatrix::zeros(0, 0)).resize(size, size, 0.0);
        }
    }

    /// Number of columns, that of the data included.
    pub fn size(&self) -> usize {
        self.entries.len()
    }

    /// Samples of a column.
    pub fn samples(&self, at: usize) -> &Samples {
        &self.entries[at].samples
    }

    fn cross(&mut self, at: usize) {
        let (entries, discounts, noise) = (&self.entries, &self.discounts, self.noise_m2);
        self.white.par_iter_mut().zip(&mut self.plain).enumerate().for_each(|(run, (white, plain))| {
            for other in 0..entries.len() {
                let (w, p) = products(&entries[at], &entries[other], run, &discounts[run], noise);
                white[(at, other)] = w;
                white[(other, at)] = w;
                plain[(at, other)] = p;
                plain[(other, at)] = p;
            }
        });
    }

    /// Evidence products summed over runs with the given weights (1 keep, 0 leave out, bootstrap counts).
    pub fn white(&self, weights: &[f64]) -> DMatrix<f64> {
        total(&self.white, weights)
    }

    /// Energy products summed over runs.
    pub fn plain(&self, weights: &[f64]) -> DMatrix<f64> {
        total(&self.plain, weights)
    }

    /// Evidence products of one run.
    pub fn white_of(&self, run: usize) -> &DMatrix<f64> {
        &self.white[run]
    }

    /// Energy products of one run.
    pub fn plain_of(&self, run: usize) -> &DMatrix<f64> {
        &self.plain[run]
    }

    /// Coordinates of a column in the low orders of each run.
    pub fn coordinates(&self, at: usize) -> &[[f64; COLUMNS]] {
        &self.entries[at].coordinates
    }

    /// A column outside the ledger over the runs `over`, one vector of samples for each.
    pub fn trial(&self, runs: &[Prepared], over: &[usize], samples: Samples) -> Trial {
        let coordinates = over.iter().zip(&samples).map(|(&run, s)| runs[run].basis.coordinates(s)).collect();
        Trial { samples, coordinates }
    }

    /// White products of a trial with the columns `with`, and with itself.
    pub fn probe(&self, trial: &Trial, with: &[usize], over: &[usize]) -> (Vec<f64>, f64) {
        let mut out = vec![0.0; with.len()];
        for (at, &run) in over.iter().enumerate() {
            let (samples, coordinates) = (&trial.samples[at], &trial.coordinates[at]);
            for (out, &column) in out.iter_mut().zip(with) {
                let entry = &self.entries[column];
                let outside = entry.outside.get(run).map_or(0.0, |outside| dot(samples, outside));
                *out += kept(coordinates, &entry.coordinates[run], &self.discounts[run]) + outside;
            }
        }
        out.iter_mut().for_each(|value| *value /= self.noise_m2);
        (out, self.between(trial, trial, over))
    }

    /// White product of two trials.
    pub fn between(&self, a: &Trial, b: &Trial, over: &[usize]) -> f64 {
        let sum: f64 = over
            .iter()
            .enumerate()
            .map(|(at, &run)| {
                let discount = &self.discounts[run];
                let (ca, cb) = (&a.coordinates[at], &b.coordinates[at]);
                let scatter: f64 = (0..COLUMNS).map(|k| discount[k] * ca[k] * cb[k]).sum();
                dot(&a.samples[at], &b.samples[at]) - scatter
            })
            .sum();
        sum / self.noise_m2
    }
}

/// A column counts as within the low orders below this share of its energy outside.
const WITHIN: f64 = 1e-20;

fn entry(runs: &[Prepared], samples: Samples) -> Entry {
    let parts: Vec<([f64; COLUMNS], Vec<f64>, [f64; 2])> = runs
        .par_iter()
        .zip(&samples)
        .map(|(run, samples)| {
            if let Some(level) = flat(run, samples) {
                let mut coordinates = [0.0; COLUMNS];
                coordinates[0] = level * run.basis.length_of_ones();
                return (coordinates, vec![0.0; samples.len()], [0.0, coordinates[0].powi(2)]);
            }
            let coordinates = run.basis.coordinates(samples);
            let mut outside = samples.clone();
            for (k, amount) in coordinates.iter().enumerate() {
                run.basis.add(k, -amount, &mut outside);
            }
            let energy = [dot(&outside, &outside), dot(samples, samples)];
            (coordinates, outside, energy)
        })
        .collect();
    let energy = parts.iter().fold([0.0; 2], |sum, part| [sum[0] + part.2[0], sum[1] + part.2[1]]);
    let keep = energy[0] > WITHIN * energy[1];
    let mut coordinates = Vec::with_capacity(parts.len());
    let mut outside = Samples::new();
    for part in parts {
        coordinates.push(part.0);
        if keep {
            outside.push(part.1);
        }
    }
    Entry { samples, coordinates, outside }
}

/// The level of a column that is the same at every sample seen: most of them are, and lie wholly in the first order.
fn flat(run: &Prepared, samples: &[f64]) -> Option<f64> {
    let seen = |i: usize| !run.hidden.get(i).copied().unwrap_or(false);
    let level = samples[(0..samples.len()).find(|&i| seen(i))?];
    samples.iter().enumerate().all(|(i, x)| *x == level || !seen(i)).then_some(level)
}

/// Product of what scatter between runs leaves of the low orders.
fn kept(a: &[f64; COLUMNS], b: &[f64; COLUMNS], discount: &[f64; COLUMNS]) -> f64 {
    (0..COLUMNS).map(|k| (1.0 - discount[k]) * a[k] * b[k]).sum()
}

fn products(a: &Entry, b: &Entry, run: usize, discount: &[f64; COLUMNS], noise_m2: f64) -> (f64, f64) {
    let (ca, cb) = (&a.coordinates[run], &b.coordinates[run]);
    let outside = match (a.outside.get(run), b.outside.get(run)) {
        (Some(a), Some(b)) => dot(a, b),
        _ => 0.0,
    };
    // The centre, order 1, is the operator's, not the machine's.
    let plain = ca[0] * cb[0] + (3..COLUMNS).map(|k| ca[k] * cb[k]).sum::<f64>();
    ((kept(ca, cb, discount) + outside) / noise_m2, plain + outside)
}

fn total(matrices: &[DMatrix<f64>], weights: &[f64]) -> DMatrix<f64> {
    let size = matrices.first().map_or(0, DMatrix::nrows);
    let mut sum = DMatrix::zeros(size, size);
    for (matrix, &weight) in matrices.iter().zip(weights) {
        if weight != 0.0 {
            sum.zip_apply(matrix, |s, m| *s += weight * m);
        }
    }
    sum
}
