//! The misfit, seen: what the baseline leaves, by kind.
use super::angular_bins::{BINS, bin_means};
use super::design_column::Column;
use super::explained::{Explained, residual};
use super::low_orders::{COLUMNS, ORDERS};
use super::roughness;
use super::spread::WHOLE;
use super::survey::Prepared;
use super::tone::Tone;
use super::vector::dot;
use crate::causes::Harmonics;
use serde::Serialize;

/// Root mean squares over all samples, µm.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Misfit {
    /// All of it, the centre free.
    pub total_um: f64,
    /// Size of the circles.
    pub size_um: f64,
    /// Of the size: what follows campaign time.
    pub drift_um: f64,
    /// Harmonics 2 to 8 that are the same in both directions.
    pub harmonics_even_um: f64,
    /// Harmonics 2 to 8 that flip with the direction.
    pub harmonics_odd_um: f64,
    /// Beyond these, what sits at fixed places, teeth of stick–slip among it.
    pub localised_um: f64,
    /// Periodic in time.
    pub periodic_um: f64,
    /// The rest: noise, and what no kind above catches.
    pub random_um: f64,
}

/// Root mean square of what the found model leaves in sample, µm.
pub fn rms_um(found: &Explained) -> f64 {
    let left = residual(found);
    let sum: f64 = energies_m2(found, &left).iter().sum();
    (sum / found.gram.samples(&found.all()).max(1.0))
        .max(0.0)
        .sqrt()
        * 1e6
}

/// Sum of squares of a column in each run, the centre free, m².
fn energies_m2(found: &Explained, column: &Column) -> Vec<f64> {
    let energy = |(index, run): (usize, &Prepared)| {
        let (low, outside) = (&column.low()[index], column.outside(run));
        let low = low[0] * low[0] + (3..COLUMNS).map(|k| low[k] * low[k]).sum::<f64>();
        low + dot(outside, outside)
    };
    found.runs.iter().enumerate().map(energy).collect()
}

/// The baseline's misfit with its own coefficient fitted, by least squares of the samples; and the coefficient.
pub fn of_baseline(found: &Explained) -> (Column, f64) {
    let (data, own) = (found.gram.column(0), found.gram.column(found.nuisance[0]));
    let (mut up, mut down) = (0.0, 0.0);
    for (index, run) in found.runs.iter().enumerate() {
        let (y, x) = (&data.low()[index], &own.low()[index]);
        up += dot(y, x) + dot(data.outside(run), own.outside(run));
        down += dot(x, x) + dot(own.outside(run), own.outside(run));
    }
    let amount = if down > 0.0 { up / down } else { 0.0 };
    let mut left = data.clone();
    left.add(-amount, own);
    (left, amount)
}

/// Splits what the baseline leaves. The kinds are orthogonal but for drift, which is a part of size.
pub fn split(found: &Explained) -> Misfit {
    let count = found.gram.samples(&found.all()).max(1.0);
    let (left, _) = of_baseline(found);
    // Of a circle that teeth hide for the most part no harmonics are read.
    let seen = |run: &Prepared| run.visible() as f64 > WHOLE * run.deviation_m.len() as f64;
    let harmonics: Vec<Harmonics> = found
        .runs
        .iter()
        .zip(left.low())
        .map(|(run, low)| {
            if seen(run) {
                run.basis.harmonics_of(low)
            } else {
                Harmonics::default()
            }
        })
        .collect();
    let whole: f64 = energies_m2(found, &left).iter().sum();
    let size: f64 = found
        .runs
        .iter()
        .zip(&harmonics)
        .map(|(run, waves)| run.place.len() as f64 * waves.0[0][0].powi(2))
        .sum();
    let [even, odd] = parity(found, &harmonics);
    let places = localised(&bin_means(&found.runs, &left), count);
    let tone: f64 = found.tones.iter().map(Tone::whole_energy_m2).sum();
    let teeth: f64 = found
        .teeth
        .iter()
        .map(|teeth| roughness::energy_m2(teeth, &found.runs))
        .sum();
    let rms = |energy: f64| (energy / count).max(0.0).sqrt() * 1e6;
    Misfit {
        total_um: rms(whole + tone + teeth),
        size_um: rms(size),
        drift_um: drift_um(found, &harmonics),
        harmonics_even_um: rms(even),
        harmonics_odd_um: rms(odd),
        localised_um: rms(places + teeth),
        periodic_um: rms(tone),
        random_um: rms(whole - size - even - odd - places),
    }
}

/// Energy of the harmonics 2 to 8 that is the same in both directions, and that flips: by pairs of runs of one
/// radius and speed. A run without a twin counts half to each.
fn parity(found: &Explained, harmonics: &[Harmonics]) -> [f64; 2] {
    let mut energy = [0.0; 2];
    for (run, own) in found.runs.iter().zip(harmonics) {
        let same = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-6;
        let twin = found.runs.iter().position(|other| {
            other.view.sign != run.view.sign
                && same(other.view.radius_m, run.view.radius_m)
                && same(other.programmed_m_s, run.programmed_m_s)
        });
        let half = 0.5 * run.deviation_m.len() as f64;
        for order in 2..=ORDERS {
            for part in 0..2 {
                let here = own.0[order][part];
                match twin {
                    Some(twin) => {
                        let there = harmonics[twin].0[order][part];
                        energy[0] += half * (0.5 * (here + there)).powi(2);
                        energy[1] += half * (0.5 * (here - there)).powi(2);
                    }
                    None => {
                        energy[0] += 0.5 * half * here * here;
                        energy[1] += 0.5 * half * here * here;
                    }
                }
            }
        }
    }
    energy
}

/// Energy at fixed places beyond the eighth harmonic.
fn localised(places: &[[f64; BINS]], count: f64) -> f64 {
    let runs = places.len().max(1) as f64;
    let mut mean = [0.0; BINS];
    for run in places {
        for (mean, value) in mean.iter_mut().zip(run) {
            *mean += value / runs;
        }
    }
    let angle = |bin: usize| std::f64::consts::TAU * (bin as f64 + 0.5) / BINS as f64;
    let n = BINS as f64;
    for order in 1..=ORDERS {
        let wave = |bin: usize| (order as f64 * angle(bin)).sin_cos();
        let (s, c) = (0..BINS).fold((0.0, 0.0), |(s, c), bin| {
            let (sin, cos) = wave(bin);
            (s + 2.0 / n * mean[bin] * sin, c + 2.0 / n * mean[bin] * cos)
        });
        for (bin, value) in mean.iter_mut().enumerate() {
            let (sin, cos) = wave(bin);
            *value -= s * sin + c * cos;
        }
    }
    count / n * mean.iter().map(|m| m * m).sum::<f64>()
}

/// Part of the size that a straight line over campaign time explains, µm rms.
fn drift_um(found: &Explained, harmonics: &[Harmonics]) -> f64 {
    let n = found.runs.len().max(1) as f64;
    let mean_t = found.runs.iter().map(|run| run.view.elapsed).sum::<f64>() / n;
    let mean_y = harmonics.iter().map(|h| h.0[0][0]).sum::<f64>() / n;
    let (mut ty, mut tt) = (0.0, 0.0);
    for (run, h) in found.runs.iter().zip(harmonics) {
        let t = run.view.elapsed - mean_t;
        ty += t * (h.0[0][0] - mean_y);
        tt += t * t;
    }
    if tt > 0.0 {
        (ty * ty / tt / n).sqrt() * 1e6
    } else {
        0.0
    }
}
