//! Polar samples as points of the plane, computed on each walk.
use crate::fit::simd_sums;
use giotto_shared::circle::{BLOCK, Merge, Part, Points, Walk};
use rayon::prelude::*;

/// Blocks that one task sums: long runs are walked in parallel, in the same order of summation whatever
/// the number of threads.
const BLOCKS_A_TASK: usize = 64;

/// Samples of one or more runs about the nominal centre.
#[derive(Clone, Debug)]
pub struct Polar<'a> {
    /// Programmed radius, m.
    pub radius_m: f64,
    /// Angle (rad) and deviation (m) of each run; equal lengths in each pair.
    pub parts: Vec<(&'a [f64], &'a [f64])>,
}

impl<'a> Polar<'a> {
    /// One run.
    pub fn new(radius_m: f64, angle_rad: &'a [f64], deviation_m: &'a [f64]) -> Self {
        Self {
            radius_m,
            parts: vec![(angle_rad, deviation_m)],
        }
    }

    /// Means of equal numbers of neighbours, at most `sectors` of them; `None` if there are no more samples than that.
    pub(super) fn sector_means(&self, sectors: usize) -> Option<(Vec<f64>, Vec<f64>)> {
        let [(angle, deviation)] = self.parts.as_slice() else {
            return None;
        };
        if angle.len() <= sectors {
            return None;
        }
        let size = angle.len().div_ceil(sectors);
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        let means = |v: &[f64]| v.par_chunks(size).map(mean).collect();
        Some((means(angle), means(deviation)))
    }

    fn block<P: Part>(&self, angle: &[f64], deviation: &[f64], part: &P) -> P::Sum {
        let (mut x, mut y) = ([0.0; BLOCK], [0.0; BLOCK]);
        let n = angle.len();
        for (k, (a, v)) in angle.iter().zip(deviation).enumerate() {
            let ((sin, cos), r) = (a.sin_cos(), self.radius_m + v);
            (x[k], y[k]) = (r * cos, r * sin);
        }
        simd_sums::sum(part, Walk::ALL, &x[..n], &y[..n])
    }

    /// Sums over blocks of (angle, deviation), in order.
    pub fn fold<S: Merge>(&self, part: impl Fn(&[f64], &[f64]) -> S + Sync) -> S {
        self.fold_walk(Walk::ALL, part)
    }

    fn fold_walk<S: Merge>(&self, walk: Walk, part: impl Fn(&[f64], &[f64]) -> S + Sync) -> S {
        let mut total = S::default();
        for (angle, deviation) in &self.parts {
            let task = |(a, v): (&[f64], &[f64])| {
                let mut sum = S::default();
                walk.blocks(a, v).for_each(|(a, v)| sum.merge(&part(a, v)));
                sum
            };
            let size = BLOCKS_A_TASK * walk.stride();
            if angle.len() <= size {
                total.merge(&task((angle, deviation)));
            } else {
                let sums: Vec<S> = angle
                    .par_chunks(size)
                    .zip(deviation.par_chunks(size))
                    .map(task)
                    .collect();
                sums.iter().for_each(|s| total.merge(s));
            }
        }
        total
    }
}

impl Points for Polar<'_> {
    fn count(&self) -> usize {
        self.parts.iter().map(|(a, _)| a.len()).sum()
    }

    fn sum<P: Part>(&self, walk: Walk, part: &P) -> P::Sum {
        self.fold_walk(walk, |angle, deviation| self.block(angle, deviation, part))
    }
}
