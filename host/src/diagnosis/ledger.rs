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
        let discounts = runs.iter().map(|run| spread.discounts(run.deviation_m.len())).collect();
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

    /// White products of a column outside the ledger with the columns `with`, and with itself, over `over` runs.
    pub fn probe(
        &self,
        runs: &[Prepared],
        column: &[Vec<f64>],
        with: &[usize],
        over: &[usize],
    ) -> (Vec<f64>, f64) {
        let mut out = vec![0.0; with.len()];
        let mut own = 0.0;
        for (samples, &run) in column.iter().zip(over) {
            let coordinates = runs[run].basis.coordinates(samples);
            let discount = &self.discounts[run];
            let discounted = |other: &[f64; COLUMNS]| -> f64 {
                (0..COLUMNS).map(|k| discount[k] * coordinates[k] * other[k]).sum()
            };
            own += (dot(samples, samples) - discounted(&coordinates)) / self.noise_m2;
            for (out, &at) in out.iter_mut().zip(with) {
                let entry = &self.entries[at];
                *out +=
                    (dot(samples, &entry.samples[run]) - discounted(&entry.coordinates[run])) / self.noise_m2;
            }
        }
        (out, own)
    }

    /// White product of two columns outside the ledger, over `over` runs.
    pub fn outside(&self, runs: &[Prepared], a: &[Vec<f64>], b: &[Vec<f64>], over: &[usize]) -> f64 {
        a.iter()
            .zip(b)
            .zip(over)
            .map(|((a, b), &run)| {
                let (ca, cb) = (runs[run].basis.coordinates(a), runs[run].basis.coordinates(b));
                let discount = &self.discounts[run];
                let scatter: f64 = (0..COLUMNS).map(|k| discount[k] * ca[k] * cb[k]).sum();
                (dot(a, b) - scatter) / self.noise_m2
            })
            .sum()
    }
}

fn entry(runs: &[Prepared], samples: Samples) -> Entry {
    let coordinates = runs.par_iter().zip(&samples).map(|(run, s)| run.basis.coordinates(s)).collect();
    Entry { samples, coordinates }
}

fn products(a: &Entry, b: &Entry, run: usize, discount: &[f64; COLUMNS], noise_m2: f64) -> (f64, f64) {
    let whole = dot(&a.samples[run], &b.samples[run]);
    let (ca, cb) = (&a.coordinates[run], &b.coordinates[run]);
    let scatter: f64 = (0..COLUMNS).map(|k| discount[k] * ca[k] * cb[k]).sum();
    // The centre is the operator's, not the machine's.
    let centre = ca[1] * cb[1] + ca[2] * cb[2];
    ((whole - scatter) / noise_m2, whole - centre)
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
