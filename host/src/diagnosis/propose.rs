//! Patterns that the data themselves suggest.
use super::angular_bins::{BINS, bin_means, bump_weights};
use super::explained::{Explained, residual};
use super::hypothesis::{Kind, scarcity};
use super::low_orders::{Low, ORDERS};
use super::material::smallest_pattern_m;
use super::pattern::{LAWS, Law, Pattern};
use super::search::columns_of;
use super::spread::is_arc;
use super::survey::Prepared;
use super::vector::axpy;
use crate::causes::Harmonics;
use rayon::prelude::*;
use std::sync::Arc;

/// How many of the most promising patterns join the search each time.
const PROMISING: usize = 6;

/// A pattern that may be worth while.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    pattern: Pattern,
    /// What it would take off χ².
    gain: f64,
    /// Energy that it would take, m².
    energy_m2: f64,
}

/// Looks at what is left of the harmonics and of the places, and lets the best patterns compete.
pub fn propose_patterns(found: &mut Explained) {
    let runs = Arc::clone(&found.runs);
    let sizes = Sizes::new(&runs);
    let mut ranked = harmonics(found, &sizes);
    ranked.extend(bumps(found, &sizes));
    let count = found.gram.samples(&found.all());
    let smallest_m = smallest_pattern_m(found);
    let scarcity = scarcity(runs.len());
    ranked.retain(|candidate| {
        let kind = Kind::Pattern(candidate.pattern);
        let rms_m = (candidate.energy_m2 / count).sqrt();
        candidate.gain > kind.price(1, scarcity)
            && rms_m > 0.3 * smallest_m
            && !found.items.iter().any(|item| item.kind == kind)
    });
    ranked.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let mut new: Vec<Pattern> = Vec::with_capacity(PROMISING);
    for candidate in ranked {
        if new.len() < PROMISING && !new.contains(&candidate.pattern) {
            new.push(candidate.pattern);
        }
    }
    found.enter(
        new.into_iter()
            .map(|pattern| (Kind::Pattern(pattern), 1))
            .collect(),
    );
}

/// The laws that patterns go by, in every run.
struct Sizes {
    sign: Vec<f64>,
    by_law: Vec<Vec<f64>>,
}

impl Sizes {
    fn new(runs: &[Prepared]) -> Self {
        let by_law = LAWS
            .iter()
            .map(|law| runs.iter().map(|run| law.at(run)).collect())
            .collect();
        Self {
            sign: runs.iter().map(|run| run.view.sign).collect(),
            by_law,
        }
    }

    /// Run by run; every pattern goes by one of the laws.
    fn of(&self, law: Law, odd: bool) -> impl Iterator<Item = f64> {
        let at = LAWS.iter().position(|other| *other == law);
        let sizes = at.map_or(&[][..], |at| &self.by_law[at]);
        sizes
            .iter()
            .zip(&self.sign)
            .map(move |(size, sign)| if odd { size * sign } else { *size })
    }
}

/// Of what is left, and also beside each chosen cause as if it were not there: a pattern may describe its data better.
fn views(found: &Explained) -> Vec<Vec<Harmonics>> {
    let columns = columns_of(&found.nuisance, &found.items, &found.chosen);
    let left = residual(found);
    let view = |without: &[usize]| -> Vec<Harmonics> {
        let mut low: Vec<Low> = left.low().to_vec();
        for (column, amount) in columns.iter().zip(&found.solution.coefficients) {
            if without.contains(column) {
                for (own, other) in low.iter_mut().zip(found.gram.column(*column).low()) {
                    axpy(*amount, other, own);
                }
            }
        }
        found
            .runs
            .iter()
            .zip(&low)
            .map(|(run, low)| run.basis.harmonics_of(low))
            .collect()
    };
    let listed = found
        .chosen
        .iter()
        .filter(|&&item| found.items[item].listed());
    std::iter::once(view(&[]))
        .chain(listed.map(|&item| view(&found.items[item].columns)))
        .collect()
}

fn harmonics(found: &Explained, sizes: &Sizes) -> Vec<Candidate> {
    let runs = &found.runs;
    // Waves that an arc cannot hold are not read from it.
    if runs.iter().any(is_arc) {
        return Vec::new();
    }
    let patterns = Pattern::all_harmonics(ORDERS);
    let one_view = |by_clock: Vec<Harmonics>| -> Vec<Candidate> {
        let turned = |(run, waves): (&Prepared, &Harmonics)| waves.seen_from(-run.turned_rad);
        let by_machine: Vec<Harmonics> = runs.iter().zip(&by_clock).map(turned).collect();
        let candidate = |pattern: &Pattern| {
            let Pattern::Harmonic {
                order,
                odd,
                machine,
                law,
            } = *pattern
            else {
                return None;
            };
            let waves = if machine { &by_machine } else { &by_clock };
            let (mut re, mut im, mut own, mut energy) = (0.0, 0.0, 0.0, 0.0);
            for ((run, waves), size) in runs.iter().zip(waves).zip(sizes.of(law, odd)) {
                let samples = run.deviation_m.len() as f64;
                let variance = found.spread.order_m2[order] + 2.0 * found.spread.noise_m2 / samples;
                let [c, s] = waves.0[order];
                re += size * c / variance;
                im += size * s / variance;
                own += size * size / variance;
                energy += 0.5 * samples * size * size;
            }
            let pull = re * re + im * im;
            (own > 0.0).then(|| Candidate {
                pattern: *pattern,
                gain: pull / own,
                energy_m2: energy * pull / (own * own),
            })
        };
        patterns.iter().filter_map(candidate).collect()
    };
    views(found)
        .into_par_iter()
        .flat_map_iter(one_view)
        .collect()
}

fn bumps(found: &Explained, sizes: &Sizes) -> Vec<Candidate> {
    let noise_m2 = found.spread.noise_m2;
    let places = bin_means(&found.runs, &residual(found));
    // Pull at each place and weight of all runs together, for each law and parity.
    let laws: Vec<(Law, bool, [f64; BINS], f64)> = Pattern::laws_of_bumps()
        .map(|(law, odd)| {
            let (mut pulls, mut own) = ([0.0; BINS], 0.0);
            for ((run, means), size) in found.runs.iter().zip(&places).zip(sizes.of(law, odd)) {
                let variance = noise_m2 * BINS as f64 / run.deviation_m.len() as f64;
                axpy(size / variance, means, &mut pulls);
                own += size * size / variance;
            }
            (law, odd, pulls, own)
        })
        .collect();
    let mut out = Vec::new();
    for (centre_rad, width_rad) in Pattern::places_of_bumps() {
        let weights = bump_weights(centre_rad, width_rad);
        let square: f64 = weights.iter().map(|weight| weight * weight).sum();
        for (law, odd, pulls, own) in &laws {
            let sum: f64 = weights
                .iter()
                .zip(pulls)
                .map(|(weight, pull)| weight * pull)
                .sum();
            let own = own * square;
            if own > 0.0 {
                // What takes χ² off white samples takes noise²·χ² of energy.
                let gain = sum * sum / own;
                let pattern = Pattern::Bump {
                    centre_rad,
                    width_rad,
                    odd: *odd,
                    law: *law,
                };
                out.push(Candidate {
                    pattern,
                    gain,
                    energy_m2: gain * noise_m2,
                });
            }
        }
    }
    out
}
