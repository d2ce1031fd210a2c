//! Patterns that the data themselves suggest.
use super::basis::ORDERS;
use super::explained::{Explained, residual, samples};
use super::item::{Item, Kind};
use super::material::smallest_pattern_m;
use super::pattern::Pattern;
use super::places::{PLACES, bump_weights, place_means};
use super::search::columns_of;
use super::survey::Prepared;
use rayon::prelude::*;

type Harmonics = [[f64; 2]; ORDERS + 1];

/// How many of the most promising patterns join the search each time.
const PROMISING: usize = 6;

/// Looks at what is left of the harmonics and of the places, and lets the best patterns compete.
pub fn propose_patterns(found: &mut Explained, runs: &[Prepared]) {
    let left = residual(found);
    let noise = found.spread.noise_m2;
    let columns = columns_of(&found.nuisance, &found.items, &found.chosen);
    let amount = |column: usize| {
        let at = columns.iter().position(|&c| c == column);
        at.map_or(0.0, |at| found.solution.coefficients[at])
    };
    // Of what is left, and also beside each chosen cause as if it were not there: a pattern may describe its data better.
    let view = |with: &[usize]| -> Vec<Harmonics> {
        let terms: Vec<(f64, usize)> =
            columns.iter().filter(|column| !with.contains(column)).map(|&c| (amount(c), c)).collect();
        let of = |(run, prepared): (usize, &Prepared)| {
            let mut coordinates = found.ledger.coordinates(0)[run];
            for &(amount, column) in &terms {
                for (own, other) in coordinates.iter_mut().zip(&found.ledger.coordinates(column)[run]) {
                    *own -= amount * other;
                }
            }
            prepared.basis.harmonics_of(coordinates)
        };
        runs.iter().enumerate().map(of).collect()
    };
    let listed = found.chosen.iter().filter(|&&item| found.items[item].listed());
    let views: Vec<Vec<Harmonics>> =
        std::iter::once(view(&[])).chain(listed.map(|&item| view(&found.items[item].columns))).collect();
    let candidates: Vec<(usize, Pattern)> = (0..views.len())
        .flat_map(|view| Pattern::harmonics(ORDERS).into_iter().map(move |p| (view, p)))
        .collect();
    let mut ranked: Vec<(f64, f64, Pattern)> = candidates
        .into_par_iter()
        .map(|(view, pattern)| {
            let harmonics = &views[view];
            let Pattern::Harmonic { order, odd, machine, .. } = pattern else { return (0.0, 0.0, pattern) };
            let (mut re, mut im, mut own, mut energy) = (0.0, 0.0, 0.0, 0.0);
            for (run, harmonics) in runs.iter().zip(harmonics) {
                let between = found.spread.order_m2[order];
                let variance = between + 2.0 * noise / run.deviation_m.len() as f64;
                let size = pattern.size(run) * if odd { run.view.sign } else { 1.0 };
                let turn = if machine { order as f64 * run.turned_rad } else { 0.0 };
                let (sin, cos) = turn.sin_cos();
                let [c, s] = harmonics[order];
                re += size * (c * cos + s * sin) / variance;
                im += size * (s * cos - c * sin) / variance;
                own += size * size / variance;
                energy += 0.5 * run.deviation_m.len() as f64 * size * size;
            }
            if own > 0.0 {
                ((re * re + im * im) / own, energy * (re * re + im * im) / (own * own), pattern)
            } else {
                (0.0, 0.0, pattern)
            }
        })
        .collect();
    let places = place_means(runs, &left);
    ranked.par_extend(Pattern::bumps().into_par_iter().map(|pattern| {
        let Pattern::Bump { centre_rad, width_rad, odd, .. } = pattern else { return (0.0, 0.0, pattern) };
        let weights = bump_weights(centre_rad, width_rad);
        let (mut sum, mut own) = (0.0, 0.0);
        for (run, means) in runs.iter().zip(&places) {
            let variance = noise * PLACES as f64 / run.deviation_m.len() as f64;
            let size = pattern.size(run) * if odd { run.view.sign } else { 1.0 };
            for (weight, mean) in weights.iter().zip(means) {
                sum += size * weight * mean / variance;
                own += (size * weight).powi(2) / variance;
            }
        }
        // What takes χ² off white samples takes noise²·χ² of energy.
        let gain = if own > 0.0 { sum * sum / own } else { 0.0 };
        (gain, gain * noise, pattern)
    }));
    let count = samples(found.ledger.samples(0));
    let smallest_m = smallest_pattern_m(found);
    ranked.retain(|(gain, energy, pattern)| {
        let kind = Kind::Pattern(*pattern);
        let rms = (energy / count).sqrt();
        *gain > kind.price(1) && rms > 0.3 * smallest_m && !found.items.iter().any(|item| item.kind == kind)
    });
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (_, _, pattern) in ranked.into_iter().take(PROMISING) {
        let kind = Kind::Pattern(pattern);
        let columns = (0..kind.columns()).map(|i| found.ledger.push(runs, kind.samples(i, runs))).collect();
        found.items.push(Item { price: kind.price(1), columns, kind, fitted_beside: None });
    }
}
