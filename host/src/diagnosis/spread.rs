//! How much runs differ for no reason: noise within a run, scatter of each low order between runs.
//!
//! Both are measured before any cause is assumed: the noise from second differences of neighbouring samples,
//! the scatter from what is left of each run's harmonics when any dependence on R, direction, f, f²/R and
//! time has been taken out. Tests against the noise within a run alone would make everything significant.
use super::footing::FEWEST_RUNS;
use super::linear;
use super::low_orders::{COLUMNS, Low, ORDERS, order_of};
use super::residual_waves;
use super::survey::Prepared;
use crate::causes::Harmonics;
use rayon::prelude::*;

/// Variance components, SI (m²).
#[derive(Clone, Debug, PartialEq)]
pub struct Spread {
    /// Variance of one sample.
    pub sample_m2: f64,
    /// Variance of white noise that is as loud at the orders of the search: more than that of a sample where the noise
    /// is correlated along the turn.
    pub noise_m2: f64,
    /// Variance between runs of the mean (order 0) and of each coefficient of the orders 2….
    pub order_m2: [f64; ORDERS + 1],
}

impl Spread {
    /// Standard deviation of one sample, m.
    pub fn noise_m(&self) -> f64 {
        self.sample_m2.sqrt()
    }

    /// The same with the scatter of the size between runs, at least, that a person knows of or that is assumed, m; a
    /// low order scatters by a share of it.
    pub fn at_least(mut self, repeatability_m: f64) -> Self {
        for (order, variance) in self.order_m2.iter_mut().enumerate() {
            let share = match order {
                0 => 1.0,
                1 => 0.0,
                _ => OF_SIZE / order as f64,
            };
            *variance = variance.max((share * repeatability_m).powi(2));
        }
        self
    }

    /// Share of a basis column that scatter between runs takes away from `samples` samples that are seen: 0 nothing, 1 all.
    pub fn discounts(&self, samples: usize) -> Low {
        let mut out = [0.0; COLUMNS];
        for (column, out) in out.iter_mut().enumerate() {
            *out = match order_of(column) {
                1 => 1.0,
                order => {
                    let weight = samples as f64 * if order == 0 { 1.0 } else { 0.5 };
                    let between = self.order_m2[order] * weight;
                    between / (between + self.noise_m2)
                }
            };
        }
        out
    }
}

/// Scatter of the second order, each of cosine and sine, as a share of that of the size where nothing is known of it.
const OF_SIZE: f64 = 0.6;

/// Share of a circle that has to be seen for its harmonics to be read.
pub const WHOLE: f64 = 0.7;

/// Measures noise and scatter. `residual` holds, run by run, what the current model leaves; `modelled`: it holds no more
/// steps and spikes, so that its colour is that of the noise.
pub fn measure(runs: &[Prepared], residual: &[Vec<f64>], modelled: bool) -> Spread {
    let sample_m2 = noise(residual);
    let colour = if modelled {
        residual_waves::colour(runs, residual, sample_m2)
    } else {
        1.0
    };
    let noise_m2 = colour * sample_m2;
    let mut order_m2 = [0.0; ORDERS + 1];
    // Of a circle that is hidden for the most part nothing low can be read.
    let seen = |run: &Prepared| run.visible() as f64 > WHOLE * run.deviation_m.len() as f64;
    let arcs = runs.iter().any(is_arc);
    let (runs, harmonics): (Vec<&Prepared>, Vec<Harmonics>) = runs
        .par_iter()
        .zip(residual)
        .filter(|(run, _)| seen(run))
        .map(|(run, left)| {
            let waves = if arcs {
                columns_as_waves(run, left)
            } else {
                // Waves of the machine angle, as the signatures are.
                run.basis.harmonics(left).seen_from(-run.turned_rad)
            };
            (run, waves)
        })
        .unzip();
    for (order, slot) in order_m2.iter_mut().enumerate() {
        if order == 1 {
            continue;
        }
        let within = noise_m2 * mean_inverse_samples(&runs) * if order == 0 { 1.0 } else { 2.0 };
        let parts = if order == 0 { 1 } else { 2 };
        let total: f64 = (0..parts)
            .map(|part| {
                pure_error(
                    &runs,
                    &harmonics
                        .iter()
                        .map(|h| h.0[order][part])
                        .collect::<Vec<_>>(),
                )
            })
            .sum();
        *slot = (total / parts as f64 - within).max(0.0);
    }
    Spread {
        sample_m2,
        noise_m2,
        order_m2,
    }
}

/// Whether a run covers so little of the turn that its waves cannot be told apart.
pub fn is_arc(run: &Prepared) -> bool {
    let angles = &run.view.psi_rad;
    match (angles.first(), angles.last()) {
        (Some(first), Some(last)) => (last - first).abs() < ARC * std::f64::consts::TAU,
        _ => true,
    }
}

/// Share of a turn below which a run is an arc.
const ARC: f64 = 0.95;

/// The coordinates of an arc's orthonormal columns on the scale of waves of a whole turn: waves of an arc are read with
/// errors far beyond what they do to it, its columns are not.
fn columns_as_waves(run: &Prepared, left: &[f64]) -> Harmonics {
    let low = run.basis.coordinates(left);
    let samples = run.visible().max(1) as f64;
    let (mean, wave) = (samples.sqrt().recip(), (2.0 / samples).sqrt());
    let mut out = Harmonics::mean(low[0] * mean);
    for order in 1..=ORDERS {
        out.0[order] = [low[2 * order - 1] * wave, low[2 * order] * wave];
    }
    out
}

fn mean_inverse_samples(runs: &[&Prepared]) -> f64 {
    runs.iter()
        .map(|run| 1.0 / run.visible().max(1) as f64)
        .sum::<f64>()
        / runs.len().max(1) as f64
}

/// Variance of a sample, m², by what a model leaves of each run.
pub fn sample_noise_m2(residual: &[Vec<f64>]) -> f64 {
    noise(residual)
}

/// Variance of a sample from second differences: smooth effects cancel, and the median over the runs ignores
/// those that shake.
fn noise(residual: &[Vec<f64>]) -> f64 {
    let mut variances: Vec<f64> = residual
        .par_iter()
        .filter(|run| run.len() >= 16)
        .map(|run| {
            let mut squares: Vec<f64> = run
                .windows(3)
                .map(|w| (w[0] - 2.0 * w[1] + w[2]).powi(2) / 6.0)
                .collect();
            // Mean of the smaller 90 %, scaled to the mean of χ²₁: robust to steps and spikes.
            let keep = squares.len() * 9 / 10;
            squares.select_nth_unstable_by(keep, f64::total_cmp);
            squares[..keep].iter().sum::<f64>() / keep as f64 / TRIMMED_MEAN_OF_CHI2
        })
        .collect();
    if variances.is_empty() {
        return 1e-14;
    }
    let middle = variances.len() / 2;
    variances.select_nth_unstable_by(middle, f64::total_cmp);
    // A resolution of 0.1 µm leaves 0.03 µm: the floor.
    variances[middle].max(1e-15)
}

/// E[χ²₁ | χ²₁ below its 90 % point]: (0.9 − 2zφ(z))/0.9 at z = 1.644854.
const TRIMMED_MEAN_OF_CHI2: f64 = 0.623_015;

/// Variance that no function of radius, direction, speed and time explains.
fn pure_error(runs: &[&Prepared], values: &[f64]) -> f64 {
    if runs.len() < FEWEST_RUNS {
        return of_repeats(runs, values);
    }
    let mut radii: Vec<f64> = runs.iter().map(|run| run.view.radius_m).collect();
    radii.sort_by(f64::total_cmp);
    radii.dedup_by(|a, b| (*a - *b).abs() < 1e-6 * *b);
    let most = (values.len() / 3).max(1);
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut add = |value: &dyn Fn(&Prepared) -> f64| {
        if columns.len() < most {
            columns.push(runs.iter().map(|run| value(run)).collect());
        }
    };
    let x = |run: &Prepared| run.view.feed_m_s.powi(2) / run.view.radius_m;
    add(&|_| 1.0);
    add(&x);
    add(&|run| run.view.sign * run.view.feed_m_s);
    add(&|run| run.view.sign);
    add(&|run| run.view.feed_m_s);
    add(&|run| x(run).powi(2) / run.view.radius_m);
    add(&|run| run.view.elapsed * run.view.radius_m);
    add(&|run| run.view.omega_rad_s);
    add(&|run| run.view.sign * x(run));
    for radius in radii.iter().skip(1).take(5) {
        let here = |run: &Prepared| f64::from((run.view.radius_m - radius).abs() < 1e-6 * radius);
        add(&here);
        add(&|run| here(run) * run.view.sign);
    }
    linear::residual_variance(&columns, values)
}

/// Variance between runs of one circle, all that a few runs can show of their scatter: what makes a circle one way round differ
/// from one the other way is not scatter. 0 without repeats.
fn of_repeats(runs: &[&Prepared], values: &[f64]) -> f64 {
    let same = |a: &Prepared, b: &Prepared| {
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-6 * a.abs().max(b.abs());
        a.view.sign == b.view.sign
            && near(a.view.radius_m, b.view.radius_m)
            && near(a.programmed_m_s, b.programmed_m_s)
    };
    let (mut squares, mut free) = (0.0, 0.0);
    for (at, run) in runs.iter().enumerate() {
        if runs[..at].iter().any(|before| same(before, run)) {
            continue;
        }
        let those: Vec<f64> = runs
            .iter()
            .zip(values)
            .filter(|(other, _)| same(run, other))
            .map(|(_, value)| *value)
            .collect();
        let mean = those.iter().sum::<f64>() / those.len() as f64;
        squares += those.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        free += those.len() as f64 - 1.0;
    }
    if free > 0.0 { squares / free } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};

    #[test]
    fn noise_of_white_samples_is_unbiased_and_blind_to_a_slow_oval() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let normal = Normal::new(0.0, 1e-6).unwrap();
        let runs: Vec<Vec<f64>> = (0..40)
            .map(|_| {
                (0..1000)
                    .map(|i| 50e-6 * (f64::from(i) * 0.0126).cos() + normal.sample(&mut rng))
                    .collect()
            })
            .collect();
        let sd = noise(&runs).sqrt();
        assert!((sd / 1e-6 - 1.0).abs() < 0.02, "{sd}");
    }
}
