//! Waves of what is left, order by order, beyond those that may scatter: for the tests of everything that is left.
use super::survey::Prepared;
use rayon::prelude::*;

/// Highest order that is looked at.
pub const HIGHEST: usize = 40;

/// Complex amplitudes of one run about its recorded angle, by order: the wave is Re(z·e^{inθ}).
#[derive(Clone, Debug, PartialEq)]
pub struct Waves {
    /// Cosine and minus sine of each order, m; empty where the run is no whole turn.
    pub of_order: Vec<[f64; 2]>,
}

/// Share of a turn below which a run is an arc, whose waves cannot be told apart.
const WHOLE_TURN: f64 = 0.97;

/// Whether the samples go once around, none of them hidden.
pub fn is_whole(run: &Prepared) -> bool {
    let angles = &run.view.psi_rad;
    let n = angles.len() as f64;
    let span = match (angles.first(), angles.last()) {
        (Some(first), Some(last)) => (last - first).abs() * n / (n - 1.0).max(1.0),
        _ => 0.0,
    };
    let turns = span / std::f64::consts::TAU;
    turns > WHOLE_TURN && run.visible() as f64 > WHOLE_TURN * n
}

/// Orders that a run resolves: four samples a wave at least.
pub fn resolved(run: &Prepared) -> usize {
    (run.deviation_m.len() / 4).min(HIGHEST)
}

/// The waves of each run; `samples` holds what is left of it.
pub fn waves(runs: &[Prepared], samples: &[Vec<f64>]) -> Vec<Waves> {
    runs.par_iter()
        .zip(samples)
        .map(|(run, samples)| of_run(run, samples))
        .collect()
}

fn of_run(run: &Prepared, samples: &[f64]) -> Waves {
    if !is_whole(run) {
        return Waves {
            of_order: Vec::new(),
        };
    }
    let highest = resolved(run);
    let mut sums = vec![[0.0; 2]; highest + 1];
    for (psi, value) in run.view.psi_rad.iter().zip(samples) {
        let (sin, cos) = (psi + run.turned_rad).sin_cos();
        let (mut c, mut s) = (1.0, 0.0);
        for sum in &mut sums {
            sum[0] += value * c;
            sum[1] -= value * s;
            (c, s) = (c * cos - s * sin, s * cos + c * sin);
        }
    }
    let scale = 2.0 / samples.len().max(1) as f64;
    sums.iter_mut().flatten().for_each(|x| *x *= scale);
    sums[0] = sums[0].map(|x| 0.5 * x);
    Waves { of_order: sums }
}

/// Median of values, which it reorders; 0 of none.
pub fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Orders by whose level the noise is judged.
const LEVEL_FROM: usize = 9;
/// Fewest of them that have a median.
const FEWEST: usize = 8;
/// Below, the level is that of white noise: a median over so many waves scatters by less.
const WHITE: f64 = 1.4;

/// Variance of the noise at the orders of the search over that of one sample: 1 for white noise, more where the noise
/// is correlated along the turn. `left` is what a model leaves, so that it holds no steps or spikes.
pub fn colour(runs: &[Prepared], left: &[Vec<f64>], noise_m2: f64) -> f64 {
    let mut levels: Vec<f64> = waves(runs, left)
        .iter()
        .zip(runs)
        .filter(|(waves, _)| waves.of_order.len() >= LEVEL_FROM + FEWEST)
        .map(|(waves, run)| {
            let mut squares: Vec<f64> = waves.of_order[LEVEL_FROM..]
                .iter()
                .map(|[a, b]| a * a + b * b)
                .collect();
            // |z|² of noise is exponential, of mean 4σ²/n and median ln 2 of that.
            median(&mut squares) / std::f64::consts::LN_2 * 0.25 * run.deviation_m.len() as f64
        })
        .collect();
    let ratio = median(&mut levels) / noise_m2;
    if ratio > WHITE { ratio } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_three() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&mut []), 0.0);
    }
}
