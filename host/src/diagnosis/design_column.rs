//! What an explanation does to every run, or the data: the low orders of each run by their coordinates, and the samples of
//! what lies outside them. Most explanations are a few waves a turn and have no such samples at all.
use super::low_orders::{COLUMNS, Low};
use super::survey::Prepared;
use super::vector::{axpy, dot};
use rayon::prelude::*;

/// A column lies within the low orders below this share of its energy outside.
const WITHIN: f64 = 1e-20;

/// One vector over the samples of all runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    low: Vec<Low>,
    /// Coordinates beyond so many are 0 in every run.
    reach: usize,
    /// All runs, one behind the other; empty: nothing.
    outside: Vec<f64>,
}

impl Column {
    /// Nothing, in so many runs.
    pub fn zero(runs: usize) -> Self {
        Self::within(vec![[0.0; COLUMNS]; runs])
    }

    /// Within the low orders.
    pub fn within(low: Vec<Low>) -> Self {
        let reach = |low: &Low| {
            low.iter()
                .rposition(|x| *x != 0.0)
                .map_or(0, |last| last + 1)
        };
        Self {
            reach: low.iter().map(reach).max().unwrap_or(0),
            low,
            outside: Vec::new(),
        }
    }

    /// So many columns from the samples of each run, which `fill` writes; what a run hides does not count.
    pub fn split(
        runs: &[Prepared],
        columns: usize,
        fill: impl Fn(&Prepared, &mut [&mut [f64]]) + Sync,
    ) -> Vec<Self> {
        let mut outsides = vec![vec![0.0; runs.last().map_or(0, |run| run.place.end)]; columns];
        let parts: Vec<Vec<(Low, [f64; 2])>> = each(runs, &mut outsides)
            .into_par_iter()
            .map(|(run, mut columns)| {
                fill(run, &mut columns);
                let part = |samples: &mut &mut [f64]| {
                    run.mask(samples);
                    let whole = dot(samples, samples);
                    let low = run.basis.take_out(samples);
                    (low, [dot(samples, samples), whole])
                };
                columns.iter_mut().map(part).collect()
            })
            .collect();
        let column = |(at, outside): (usize, Vec<f64>)| {
            let energy = |which: usize| parts.iter().map(|parts| parts[at].1[which]).sum::<f64>();
            let outside = if energy(0) > WITHIN * energy(1) {
                outside
            } else {
                Vec::new()
            };
            Self {
                low: parts.iter().map(|parts| parts[at].0).collect(),
                reach: COLUMNS,
                outside,
            }
        };
        outsides.into_iter().enumerate().map(column).collect()
    }

    /// Coordinates in the low orders, run by run.
    pub fn low(&self) -> &[Low] {
        &self.low
    }

    /// Multiplies the coordinates by factors of each run.
    pub fn scale_low(&mut self, factors: impl Iterator<Item = Low>) {
        for (low, factors) in self.low.iter_mut().zip(factors) {
            for (low, factor) in low.iter_mut().zip(factors) {
                *low *= factor;
            }
        }
    }

    /// Samples of one run outside the low orders; empty: nothing.
    pub fn outside(&self, run: &Prepared) -> &[f64] {
        self.outside.get(run.place.clone()).unwrap_or(&[])
    }

    /// Coordinates beyond so many are 0 in every run.
    pub const fn reach(&self) -> usize {
        self.reach
    }

    /// Adds another column, so many times.
    pub fn add(&mut self, amount: f64, other: &Self) {
        self.reach = self.reach.max(other.reach);
        for (low, other) in self.low.iter_mut().zip(&other.low) {
            axpy(amount, other, low);
        }
        if self.outside.is_empty() && !other.outside.is_empty() {
            self.outside = vec![0.0; other.outside.len()];
        }
        axpy(amount, &other.outside, &mut self.outside);
    }

    /// Its samples in one run.
    pub fn samples(&self, run: &Prepared, index: usize) -> Vec<f64> {
        let mut out = vec![0.0; run.deviation_m.len()];
        axpy(1.0, self.outside(run), &mut out);
        run.basis.add(&self.low[index], &mut out);
        out
    }

    /// Its samples in every run.
    pub fn all_samples(&self, runs: &[Prepared]) -> Vec<Vec<f64>> {
        runs.par_iter()
            .enumerate()
            .map(|(index, run)| self.samples(run, index))
            .collect()
    }

    /// Product of what two columns have outside the low orders of one run.
    pub fn product_outside(&self, other: &Self, place: &std::ops::Range<usize>) -> f64 {
        match (
            self.outside.get(place.clone()),
            other.outside.get(place.clone()),
        ) {
            (Some(a), Some(b)) => dot(a, b),
            _ => 0.0,
        }
    }
}

/// Each run with its own part of vectors over all samples.
fn each<'a>(
    runs: &'a [Prepared],
    vectors: &'a mut [Vec<f64>],
) -> Vec<(&'a Prepared, Vec<&'a mut [f64]>)> {
    let mut left: Vec<&mut [f64]> = vectors.iter_mut().map(Vec::as_mut_slice).collect();
    let mut take = |length: usize| -> Vec<&'a mut [f64]> {
        left.iter_mut()
            .map(|samples| {
                let (own, rest) = std::mem::take(samples).split_at_mut(length);
                *samples = rest;
                own
            })
            .collect()
    };
    runs.iter()
        .map(|run| (run, take(run.place.len())))
        .collect()
}
