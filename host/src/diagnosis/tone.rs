//! Ripples of a fixed frequency in time: vibration, or the polygon of a slow interpolator.
//!
//! Each run has a phase of its own, so power is added, not amplitude; a run counts for at most `CAP`, so
//! that the sharp harmonics of a few runs cannot pose as a tone that all share.
use super::design_column::Column;
use super::spectrum::{FEWEST_WAVES, Spectrum, padded};
use super::spread::Spread;
use super::survey::Prepared;
use super::vector::{axpy, dot, wave_sum};
use crate::causes::Amplitude;
use giotto_shared::Actuator;
use rayon::prelude::*;
use rustfft::{Fft, FftPlanner};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A tone shared by the runs.
#[derive(Clone, Debug)]
pub struct Tone {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Its standard error, Hz.
    pub se_hz: f64,
    /// Axis along which it swings; `None`: along the radius.
    pub axis: Option<Actuator>,
    /// Law of the amplitude.
    pub amplitude: Amplitude,
    /// Root mean square amplitude over the runs that show it, m.
    pub amplitude_m: f64,
    /// Log-evidence for the chosen law of the amplitude against the other.
    pub law_evidence: f64,
    /// What it takes off χ².
    pub gain: f64,
    /// Energy that it takes off each run (sum of squares, m²).
    pub energy_m2: Vec<f64>,
}

/// Largest power that one run may add, in units of χ²₂.
const CAP: f64 = 40.0;
/// Longest turn used, s: longer ones would need a grid too fine for what they add.
const LONGEST_TURN_S: f64 = 12.0;
/// Share of a frequency within which it is the same, or a whole multiple.
const SAME: f64 = 0.03;
/// Standard errors above both noise and floor that make a tone.
const SIGNIFICANT: f64 = 8.0;
/// Share of the runs that is nearly every one.
const NEARLY_EVERY: f64 = 0.8;

/// Power above which a run shows a tone, in units of χ²₂: 1/1000 of noise is louder.
const LOUD: f64 = 14.0;
/// Fewest turn times of runs that show a tone: waves of the machine's place, loud in the fastest runs alone, have one frequency
/// for each radius.
const FEWEST_TURN_TIMES: u32 = 4;
/// Turn times that differ by less are one.
const SAME_TURN: f64 = 0.02;

/// Which of the different turn times each run has, as a bit; beyond 127 of them they share the last.
struct TurnTimes(Vec<u128>);

impl TurnTimes {
    fn of(spectra: &[Spectrum]) -> Self {
        let mut different: Vec<f64> = spectra.iter().map(|s| s.turn_s).collect();
        different.sort_by(f64::total_cmp);
        different.dedup_by(|longer, kept| *longer < *kept * (1.0 + SAME_TURN));
        let bit = |s: &Spectrum| {
            let longer = different.partition_point(|turn_s| *turn_s <= s.turn_s);
            1 << longer.saturating_sub(1).min(127)
        };
        Self(spectra.iter().map(bit).collect())
    }
}

/// What a run leaves outside its low orders.
struct Clean<'a> {
    run: &'a Prepared,
    samples: &'a [f64],
    turn_s: f64,
}

/// The spectrum of each run.
fn spectra(clean: &[Clean<'_>], spread: &Spread) -> Vec<Spectrum> {
    let mut planner = FftPlanner::new();
    let transforms: BTreeMap<usize, Arc<dyn Fft<f64>>> = clean
        .iter()
        .map(|clean| padded(clean.samples.len()))
        .map(|length| (length, planner.plan_fft_forward(length)))
        .collect();
    clean
        .par_iter()
        .filter_map(|clean| {
            let transform = transforms.get(&padded(clean.samples.len()))?;
            Some(Spectrum::of(
                clean.samples,
                clean.turn_s,
                transform,
                spread.noise_m2,
            ))
        })
        .collect()
}

/// Looks for a tone in what the other explanations leave.
pub fn find(runs: &[Prepared], residual: &Column, spread: &Spread) -> Option<Tone> {
    let clean: Vec<Clean<'_>> = runs
        .iter()
        .map(|run| Clean {
            run,
            samples: residual.outside(run),
            turn_s: std::f64::consts::TAU / run.view.omega_rad_s,
        })
        .filter(|clean| clean.turn_s <= LONGEST_TURN_S && clean.samples.len() >= 64)
        .collect();
    let spectra = spectra(&clean, spread);
    let longest = spectra.iter().map(|s| s.turn_s).fold(0.0, f64::max);
    let highest = spectra.iter().map(|s| s.nyquist_hz).fold(0.0, f64::max);
    if spectra.len() < 4 || longest <= 0.0 {
        return None;
    }
    let turns = TurnTimes::of(&spectra);
    let step = 0.25 / longest;
    let points = ((highest / step) as usize).min(200_000);
    let grid: Vec<(f64, f64, usize, bool)> = (1..points)
        .into_par_iter()
        .filter_map(|i| {
            let frequency = i as f64 * step;
            let (mut sum, mut count, mut loud) = (0.0, 0usize, 0usize);
            let (mut seeing, mut showing) = (0u128, 0u128);
            for (s, kind) in spectra.iter().zip(&turns.0) {
                if s.sees(frequency) {
                    let power = s.at(frequency);
                    sum += power.min(CAP);
                    count += 1;
                    seeing |= kind;
                    if power > LOUD {
                        loud += 1;
                        showing |= kind;
                    }
                }
            }
            let shared = loud >= 4.max(count / 6)
                && showing.count_ones() >= FEWEST_TURN_TIMES.min(seeing.count_ones());
            (count >= 4).then(|| (frequency, sum / count as f64, count, shared))
        })
        .collect();
    let mut levels: Vec<f64> = grid.iter().map(|g| g.1).collect();
    if levels.len() < 100 {
        return None;
    }
    let (middle, high) = (levels.len() / 2, levels.len() * 84 / 100);
    let floor = *levels.select_nth_unstable_by(middle, f64::total_cmp).1;
    let width = (*levels.select_nth_unstable_by(high, f64::total_cmp).1 - floor).max(1e-9);
    // Where much else is rough, a capped mean is never far above it: a tone that nearly every run shows is one all the same.
    let shown = |hz: f64, count: usize| {
        let those = spectra
            .iter()
            .filter(|s| s.sees(hz) && s.stands_out(hz))
            .count();
        those as f64 > NEARLY_EVERY * count as f64
    };
    let best = grid
        .iter()
        .filter(|(frequency, mean, count, shared)| {
            let expected = 2.0 / (*count as f64).sqrt();
            (mean - 2.0) / expected > SIGNIFICANT
                && *shared
                && ((mean - floor) / width > SIGNIFICANT
                    || (*mean > NEARLY_EVERY * CAP && shown(*frequency, *count)))
        })
        .max_by(|a, b| (a.1 * (a.2 as f64).sqrt()).total_cmp(&(b.1 * (b.2 as f64).sqrt())))?;
    refine(runs, &clean, spread, best.0, step, residual)
}

fn refine(
    runs: &[Prepared],
    clean: &[Clean<'_>],
    spread: &Spread,
    start_hz: f64,
    step_hz: f64,
    residual: &Column,
) -> Option<Tone> {
    let heard = Heard {
        runs: clean
            .iter()
            .filter(|clean| {
                start_hz < 0.47 * clean.samples.len() as f64 / clean.turn_s
                    && start_hz * clean.turn_s > FEWEST_WAVES
            })
            .collect(),
        noise_m2: spread.noise_m2,
    };
    let (axis, start_hz) = heard.loudest(runs, start_hz, step_hz)?;
    let swung = heard.swung(axis);
    let total = |hz: f64| heard.sum_at(&swung, axis, hz);
    let frequency_hz = highest(&total, start_hz, step_hz)?;
    let powers = heard.powers(&swung, axis, frequency_hz);
    let constant = amplitude_law(&powers, &|_| 1.0);
    let centripetal = amplitude_law(&powers, &|x| x);
    let amplitude = if constant <= centripetal {
        Amplitude::Constant
    } else {
        Amplitude::Centripetal
    };
    let mean_square: f64 = powers
        .iter()
        .map(|(power, unit, _)| (power - 2.0) / unit)
        .sum::<f64>()
        / powers.len() as f64;
    let mut tone = Tone {
        frequency_hz,
        se_hz: width(&total, frequency_hz, step_hz),
        axis,
        amplitude,
        amplitude_m: mean_square.max(0.0).sqrt(),
        law_evidence: 0.5 * (constant - centripetal).abs(),
        gain: total(frequency_hz),
        energy_m2: Vec::new(),
    };
    // A tone without its low orders takes nothing from the low orders.
    tone.energy_m2 = runs
        .par_iter()
        .map(|run| {
            let left = residual.outside(run);
            let mut without = left.to_vec();
            tone.remove_from(run, &mut without);
            dot(left, left) - dot(&without, &without)
        })
        .collect();
    Some(tone)
}

/// The runs that are sampled finely and last long enough for a frequency.
struct Heard<'a> {
    runs: Vec<&'a Clean<'a>>,
    noise_m2: f64,
}

impl Heard<'_> {
    /// The samples of each run, weighed as a swing along an axis would show.
    fn swung(&self, axis: Option<Actuator>) -> Vec<Vec<f64>> {
        self.runs
            .par_iter()
            .map(|clean| swing(clean.run, clean.samples, axis))
            .collect()
    }

    /// Power of all runs at a frequency.
    fn sum_at(&self, swung: &[Vec<f64>], axis: Option<Actuator>, hz: f64) -> f64 {
        self.runs
            .iter()
            .zip(swung)
            .map(|(clean, samples)| {
                power(samples, clean.turn_s, hz, self.noise_m2) * loudness(axis)
            })
            .sum()
    }

    /// The axis, or none, and the frequency near `start_hz` at which the power is highest. A swing along an axis shows on
    /// the circle as two sidebands, one turn below and above.
    fn loudest(
        &self,
        runs: &[Prepared],
        start_hz: f64,
        step_hz: f64,
    ) -> Option<(Option<Actuator>, f64)> {
        std::iter::once(None)
            .chain(moved(runs).map(Some))
            .collect::<Vec<_>>()
            .into_iter()
            .flat_map(|axis| {
                let swung = self.swung(axis);
                let sums: Vec<(f64, Option<Actuator>, f64)> = (-24..=24)
                    .into_par_iter()
                    .map(|i| start_hz + step_hz * f64::from(i))
                    .map(|hz| (self.sum_at(&swung, axis, hz), axis, hz))
                    .collect();
                sums
            })
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, axis, hz)| (axis, hz))
    }

    /// Of each run its power, what a square metre of amplitude would add to it, and its acceleration f²/R: the power is χ²₂
    /// with non-centrality n·A²/(2σ²).
    fn powers(&self, swung: &[Vec<f64>], axis: Option<Actuator>, hz: f64) -> Vec<(f64, f64, f64)> {
        self.runs
            .iter()
            .zip(swung)
            .map(|(clean, swung)| {
                let view = &clean.run.view;
                (
                    power(swung, clean.turn_s, hz, self.noise_m2) * loudness(axis),
                    swung.len() as f64 / (2.0 * self.noise_m2 * loudness(axis)),
                    view.feed_m_s.powi(2) / view.radius_m,
                )
            })
            .collect()
    }
}

/// The frequency of the highest power within a step of `start_hz`, by grids that halve.
fn highest(total: &(dyn Fn(f64) -> f64 + Sync), start_hz: f64, step_hz: f64) -> Option<f64> {
    let mut centre = start_hz;
    let mut half = step_hz;
    for _ in 0..12 {
        let values: Vec<(f64, f64)> = (-3..=3)
            .into_par_iter()
            .map(|i| {
                let hz = centre + half * f64::from(i) / 3.0;
                (total(hz), hz)
            })
            .collect();
        centre = values.iter().max_by(|a, b| a.0.total_cmp(&b.0))?.1;
        half *= 0.5;
    }
    Some(centre)
}

/// Standard error of a frequency by the bend of the power there, Hz.
fn width(total: &dyn Fn(f64) -> f64, centre: f64, step_hz: f64) -> f64 {
    let h = 0.02 * step_hz;
    let bend = (total(centre + h) - 2.0 * total(centre) + total(centre - h)) / (h * h);
    if bend < 0.0 {
        (2.0 / -bend).sqrt()
    } else {
        step_hz
    }
}

/// Deviance of the powers under amplitudes that are `weight` of the acceleration, times the best scale.
fn amplitude_law(powers: &[(f64, f64, f64)], weight: &dyn Fn(f64) -> f64) -> f64 {
    let misfit = |scale: f64| -> f64 {
        powers
            .iter()
            .map(|(power, unit, x)| rice_deviance(*power, unit * (scale * weight(*x)).powi(2)))
            .sum()
    };
    let start = (powers.iter().map(|p| (p.0 - 2.0).max(0.0)).sum::<f64>()
        / powers
            .iter()
            .map(|p| p.1 * weight(p.2).powi(2))
            .sum::<f64>())
    .sqrt();
    (-40..=40)
        .map(|i| misfit(start * 1.05_f64.powi(i)))
        .fold(
            misfit(start),
            |best, value| {
                if value < best { value } else { best }
            },
        )
}

/// −2·log-likelihood of a χ²₂ power with non-centrality λ, in the Gaussian approximation of its amplitude:
/// √P has mean √(λ + 1) and variance 1. A floor keeps one odd run from deciding.
fn rice_deviance(power: f64, lambda: f64) -> f64 {
    let off = power.sqrt() - (lambda + 1.0).sqrt();
    // Amplitudes of real tones vary by some percent from run to run.
    let variance = 1.0 + 0.01 * lambda;
    (off * off / variance).min(50.0) + variance.ln()
}

impl Tone {
    /// What it takes off all runs (sum of squares, m²).
    pub fn whole_energy_m2(&self) -> f64 {
        self.energy_m2.iter().sum::<f64>().max(0.0)
    }

    /// Whether it is none of the others, nor an overtone of one.
    pub fn is_new(&self, others: &[Self]) -> bool {
        others.iter().all(|other| {
            let waves = self.frequency_hz / other.frequency_hz;
            let whole = waves.round().max(1.0);
            (waves / whole - 1.0).abs() > SAME
        })
    }

    /// Takes the tone out of the runs' deviations.
    pub fn remove(&self, runs: &mut [Prepared]) {
        runs.par_iter_mut().for_each(|run| {
            let mut deviation = std::mem::take(&mut run.deviation_m);
            self.remove_from(run, &mut deviation);
            run.deviation_m = deviation;
        });
    }

    fn remove_from(&self, run: &Prepared, samples: &mut [f64]) {
        let n = samples.len();
        let turn_s = std::f64::consts::TAU / run.view.omega_rad_s;
        let overtones = if self.amplitude == Amplitude::Centripetal {
            3
        } else {
            1
        };
        for overtone in 1..=overtones {
            let hz = self.frequency_hz * f64::from(overtone);
            let wave = std::f64::consts::TAU * hz * turn_s / n as f64;
            let swing = |i: usize| {
                self.axis
                    .map_or(1.0, |axis| run.view.direction[i][axis.index()])
            };
            let mut columns: [Vec<f64>; 2] = [
                (0..n).map(|i| swing(i) * (wave * i as f64).cos()).collect(),
                (0..n).map(|i| swing(i) * (wave * i as f64).sin()).collect(),
            ];
            for column in &mut columns {
                run.basis.take_out(column);
            }
            let [cos, sin] = &mut columns;
            let length = dot(cos, cos);
            if length < 0.05 * n as f64 {
                continue;
            }
            let mix = dot(cos, sin) / length;
            axpy(-mix, cos, sin);
            for column in [&*cos, &*sin] {
                let own = dot(column, column);
                if own > 0.05 * n as f64 {
                    axpy(-dot(column, samples) / own, column, samples);
                }
            }
        }
    }
}

/// The slides that move in any run.
fn moved(runs: &[Prepared]) -> impl Iterator<Item = Actuator> {
    Actuator::SLIDES
        .into_iter()
        .filter(|axis| runs.iter().any(|run| run.view.moves(*axis)))
}

/// Samples times the direction cosine of the axis.
fn swing(run: &Prepared, samples: &[f64], axis: Option<Actuator>) -> Vec<f64> {
    match axis {
        None => samples.to_vec(),
        Some(axis) => samples
            .iter()
            .zip(run.view.direction.iter())
            .map(|(x, d)| x * d[axis.index()])
            .collect(),
    }
}

/// Mean square of 1 over that of the direction cosine: 2 for a swing along an axis.
fn loudness(axis: Option<Actuator>) -> f64 {
    if axis.is_some() { 2.0 } else { 1.0 }
}

/// Power at one frequency, in units of χ²₂.
fn power(samples: &[f64], turn_s: f64, hz: f64, noise_m2: f64) -> f64 {
    let [re, im] = wave_sum(
        samples,
        std::f64::consts::TAU * hz * turn_s / samples.len() as f64,
    );
    2.0 * (re * re + im * im) / (samples.len() as f64 * noise_m2)
}
