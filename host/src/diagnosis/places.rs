//! The circle in bins of the machine angle.
use super::survey::Prepared;
use rayon::prelude::*;

/// Bins of the machine angle in which what is left is averaged.
pub const PLACES: usize = 72;

/// Mean residual in each bin of the machine angle with the mean and the centre of the run taken off.
pub fn place_means(runs: &[Prepared], left: &[Vec<f64>]) -> Vec<[f64; PLACES]> {
    runs.par_iter()
        .zip(left)
        .map(|(run, left)| {
            let mut clean = left.clone();
            let coordinates = run.basis.coordinates(left);
            for (k, amount) in coordinates.iter().enumerate().take(3) {
                run.basis.add(k, -amount, &mut clean);
            }
            let (mut sums, mut counts) = ([0.0; PLACES], [0.0; PLACES]);
            for (value, psi) in clean.iter().zip(&run.view.psi_rad) {
                let share = (psi / std::f64::consts::TAU).rem_euclid(1.0);
                let bin = ((share * PLACES as f64) as usize).min(PLACES - 1);
                sums[bin] += value;
                counts[bin] += 1.0;
            }
            std::array::from_fn(|bin| if counts[bin] > 0.0 { sums[bin] / counts[bin] } else { 0.0 })
        })
        .collect()
}

/// A bump over the bins, free of mean and first harmonic.
pub fn bump_weights(centre_rad: f64, width_rad: f64) -> [f64; PLACES] {
    let turn = std::f64::consts::TAU;
    let angle = |bin: usize| turn * (bin as f64 + 0.5) / PLACES as f64;
    let mut weights: [f64; PLACES] = std::array::from_fn(|bin| {
        let off = (angle(bin) - centre_rad + 0.5 * turn).rem_euclid(turn) - 0.5 * turn;
        (-0.5 * (off / width_rad).powi(2)).exp()
    });
    let n = PLACES as f64;
    let mean = weights.iter().sum::<f64>() / n;
    let cos = weights.iter().enumerate().map(|(b, w)| w * angle(b).cos()).sum::<f64>() * 2.0 / n;
    let sin = weights.iter().enumerate().map(|(b, w)| w * angle(b).sin()).sum::<f64>() * 2.0 / n;
    for (bin, weight) in weights.iter_mut().enumerate() {
        *weight -= mean + cos * angle(bin).cos() + sin * angle(bin).sin();
    }
    weights
}
