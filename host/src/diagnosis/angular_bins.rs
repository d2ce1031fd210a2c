//! The circle in bins of the machine angle.
use super::design_column::Column;
use super::survey::Prepared;
use super::vector::axpy;
use rayon::prelude::*;

/// Bins of the machine angle in which what is left is averaged.
pub const BINS: usize = 72;

/// Mean of a column in each bin of the machine angle, with the mean and the centre of each run taken off.
pub fn bin_means(runs: &[Prepared], column: &Column) -> Vec<[f64; BINS]> {
    let means = |(index, run): (usize, &Prepared)| {
        let mut low = column.low()[index];
        low[..3].fill(0.0);
        let mut clean = vec![0.0; run.deviation_m.len()];
        axpy(1.0, column.outside(run), &mut clean);
        run.basis.add(&low, &mut clean);
        let (mut sums, mut counts) = ([0.0; BINS], [0.0; BINS]);
        for (value, psi) in clean.iter().zip(run.view.psi_rad.iter()) {
            let turns = psi * (1.0 / std::f64::consts::TAU);
            // Less its floor, which is a call on some processors.
            let share = turns - (turns as i64 - i64::from(turns < 0.0)) as f64;
            let bin = ((share * BINS as f64) as usize).min(BINS - 1);
            sums[bin] += value;
            counts[bin] += 1.0;
        }
        std::array::from_fn(|bin| {
            if counts[bin] > 0.0 {
                sums[bin] / counts[bin]
            } else {
                0.0
            }
        })
    };
    runs.par_iter().enumerate().map(means).collect()
}

/// A bump over the bins, free of mean and first harmonic.
pub fn bump_weights(centre_rad: f64, width_rad: f64) -> [f64; BINS] {
    let turn = std::f64::consts::TAU;
    let angle = |bin: usize| turn * (bin as f64 + 0.5) / BINS as f64;
    let mut weights: [f64; BINS] = std::array::from_fn(|bin| {
        let off = (angle(bin) - centre_rad + 0.5 * turn).rem_euclid(turn) - 0.5 * turn;
        (-0.5 * (off / width_rad).powi(2)).exp()
    });
    let n = BINS as f64;
    let mean = weights.iter().sum::<f64>() / n;
    let cos = weights
        .iter()
        .enumerate()
        .map(|(b, w)| w * angle(b).cos())
        .sum::<f64>()
        * 2.0
        / n;
    let sin = weights
        .iter()
        .enumerate()
        .map(|(b, w)| w * angle(b).sin())
        .sum::<f64>()
        * 2.0
        / n;
    for (bin, weight) in weights.iter_mut().enumerate() {
        *weight -= mean + cos * angle(bin).cos() + sin * angle(bin).sin();
    }
    weights
}
