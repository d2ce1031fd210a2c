//! From a campaign to the set of explanations: prepare, search, refine, and again about the better model.
use super::basis::{ORDERS, axpy};
use super::ledger::{Ledger, Samples};
use super::linear::{Solution, solve};
use super::pattern::Pattern;
use super::roughness::{self, Teeth};
use super::search::{Item, Kind, PRICE, PRICE_OF_PATTERN, PRICE_OF_PHASE, columns_of, select};
use super::shape;
use super::spread::{self, Spread};
use super::survey::{self, Lag, Prepared, Response};
use super::tone::{self, Tone};
use crate::campaign::Campaign;
use crate::causes::{ALL, Cause, Evidence};
use rayon::prelude::*;

/// What the search found, with all that is needed to refit it.
#[derive(Clone, Debug)]
pub struct Explained {
    /// The runs, ready.
    pub runs: Vec<Prepared>,
    /// Shared response, as refined.
    pub response: Response,
    /// Lag of the machine behind the command.
    pub lag: Lag,
    /// Noise and scatter.
    pub spread: Spread,
    /// Products of all columns.
    pub ledger: Ledger,
    /// Columns of the model's own parameters: always free.
    pub nuisance: Vec<usize>,
    /// Every explanation considered.
    pub items: Vec<Item>,
    /// The chosen ones.
    pub chosen: Vec<usize>,
    /// The fit of nuisance and chosen.
    pub solution: Solution,
    /// Axes that stick at low speed.
    pub teeth: Vec<Teeth>,
    /// A tone in time, if there is one.
    pub tone: Option<Tone>,
    /// Energy of what was taken out before the search, teeth and tone, m².
    pub apart_m2: f64,
}

/// What stands before the search.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Response of the baseline.
    pub response: Response,
    /// Whether the baseline has a fourth-order coefficient of its own (then `higher_order_dynamics` is in it).
    pub own_fourth_order: bool,
}

const PASSES: usize = 5;

/// What is taken out of the samples before the search.
#[derive(Clone, Debug, Default)]
struct Seen {
    tone: Option<Tone>,
    teeth: Vec<Teeth>,
}

/// The data before any explanation.
fn first_look(found: &Explained) -> Samples {
    found.ledger.samples(0).clone()
}

/// Searches the explanations of a campaign.
pub fn explain(campaign: &Campaign, start: &Start) -> Explained {
    let mut response = start.response;
    let mut tone: Option<Tone> = None;
    let mut teeth: Option<Vec<Teeth>> = None;
    let mut kinds: Vec<Kind> = Vec::new();
    let mut found = pass(campaign, start, response, &Seen::default(), &kinds, None);
    for _ in 1..PASSES {
        let before = (chosen_kinds(&found).len(), tone.is_some());
        if teeth.is_none() {
            // Before anything else is believed: teeth would look like everything.
            teeth = Some(roughness::find(&found.runs, &first_look(&found), &found.spread));
        }
        if tone.is_none() && teeth.as_ref().is_none_or(Vec::is_empty) {
            tone = tone::find(&found.runs, &residual(&found), &found.spread)
                .filter(|tone| material(&found, tone));
        }
        kinds = if teeth.as_ref().is_some_and(|t| !t.is_empty()) && found.teeth.is_empty() {
            // What was found with the teeth in sight is not to be trusted.
            Vec::new()
        } else {
            chosen_kinds(&found)
        };
        let seen = Seen { tone: tone.clone(), teeth: teeth.clone().unwrap_or_default() };
        let refined = refined_response(&found, response);
        let settled = (refined.a_s2 - response.a_s2).abs() < 1e-4 * response.a_s2.abs()
            && (refined.b_s4 - response.b_s4).abs() < 1e-3 * refined.b_s4.abs();
        response = refined;
        let left = residual(&found);
        let next = pass(campaign, start, response, &seen, &kinds, Some(&left));
        let same = chosen_kinds(&next).len() == before.0 && tone.is_some() == before.1;
        found = next;
        if settled && same {
            break;
        }
    }
    found.tone = tone;
    found
}

/// What nuisance and chosen explanations leave, run by run.
pub fn residual(found: &Explained) -> Samples {
    let mut left = found.ledger.samples(0).clone();
    let columns = columns_of(&found.nuisance, &found.items, &found.chosen);
    for (&column, &amount) in columns.iter().zip(&found.solution.coefficients) {
        for (left, samples) in left.iter_mut().zip(found.ledger.samples(column)) {
            axpy(-amount, samples, left);
        }
    }
    left
}

fn chosen_kinds(found: &Explained) -> Vec<Kind> {
    found.chosen.iter().map(|&i| found.items[i].kind.clone()).collect()
}

/// Response with the fitted corrections of its own coefficients and of the fourth order.
fn refined_response(found: &Explained, response: Response) -> Response {
    let mut refined = response;
    let columns = columns_of(&found.nuisance, &found.items, &found.chosen);
    for (&column, &amount) in columns.iter().zip(&found.solution.coefficients) {
        if column == found.nuisance[0] {
            refined.a_s2 += amount;
        } else if found.nuisance.get(1) == Some(&column) {
            refined.b_s4 -= 2.0 * amount;
        }
    }
    for &item in &found.chosen {
        let Kind::Cause { cause: Cause::HigherOrderDynamics, .. } = found.items[item].kind else { continue };
        if let Some(at) = columns.iter().position(|&c| c == found.items[item].columns[0]) {
            refined.b_s4 = -2.0 * found.solution.coefficients[at];
        }
    }
    let fastest = found.runs.iter().map(|run| run.view.omega_rad_s).fold(0.0, f64::max);
    let w2 = fastest * fastest;
    // A response that would blow up within the measured range is no response.
    if 1.0 + refined.a_s2 * w2 + refined.b_s4 * w2 * w2 > 0.1 { refined } else { response }
}

/// Samples of one column of an explanation.
pub fn column(kind: &Kind, index: usize, runs: &[Prepared]) -> Samples {
    runs.par_iter()
        .map(|run| {
            let mut out = vec![0.0; run.deviation_m.len()];
            match kind {
                Kind::Cause { cause, axis, shape } => {
                    cause.model().signature(*axis, shape, index, &run.view, &mut out);
                }
                Kind::Pattern(pattern) => pattern.samples(index, run, &mut out),
            }
            run.mask(&mut out);
            out
        })
        .collect()
}

/// Number of columns of an explanation.
pub fn width(kind: &Kind) -> usize {
    match kind {
        Kind::Cause { cause, .. } => cause.model().columns(),
        Kind::Pattern(pattern) => pattern.columns(),
    }
}

fn price(kind: &Kind, shapes: usize) -> f64 {
    let phase = PRICE_OF_PHASE * (width(kind) - 1) as f64;
    match kind {
        Kind::Cause { .. } => PRICE + phase + 2.0 * (shapes.max(1) as f64).ln(),
        Kind::Pattern(_) => PRICE + PRICE_OF_PATTERN + phase,
    }
}

fn pass(
    campaign: &Campaign,
    start: &Start,
    response: Response,
    seen: &Seen,
    kinds: &[Kind],
    left: Option<&Samples>,
) -> Explained {
    let (mut runs, lag) = survey::prepare(campaign, &response);
    if let Some(tone) = &seen.tone {
        tone.remove(&mut runs);
    }
    if !seen.teeth.is_empty() {
        for run in &mut runs {
            let hidden =
                (0..run.deviation_m.len()).map(|i| seen.teeth.iter().any(|t| t.covers(run, i))).collect();
            run.hide(hidden);
        }
    }
    let data: Samples = runs
        .iter()
        .map(|run| {
            let shrink = run.view.radius_m * (run.view.gain - 1.0);
            let mut out: Vec<f64> = run.deviation_m.iter().map(|deviation| deviation - shrink).collect();
            run.mask(&mut out);
            out
        })
        .collect();
    // Once there is a model, what it leaves shows the scatter better than the data do.
    let spread = spread::measure(&runs, left.unwrap_or(&data));
    let mut ledger = Ledger::open(&runs, &spread, data);
    // ∂ΔR/∂a about the response.
    let own: Samples = runs
        .iter()
        .map(|run| {
            let (w, g) = (run.view.omega_rad_s, run.view.gain);
            let mut out = vec![-0.5 * run.view.radius_m * w * w * g.powi(3); run.deviation_m.len()];
            run.mask(&mut out);
            out
        })
        .collect();
    let mut nuisance = vec![ledger.push(&runs, own)];
    let mut items: Vec<Item> = Vec::new();
    let add = |ledger: &mut Ledger, items: &mut Vec<Item>, kind: Kind, shapes: usize| -> usize {
        let columns = (0..width(&kind)).map(|i| ledger.push(&runs, column(&kind, i, &runs))).collect();
        items.push(Item { price: price(&kind, shapes), columns, kind, fitted_beside: None });
        items.len() - 1
    };
    let mut chosen = Vec::new();
    for kind in kinds {
        chosen.push(add(&mut ledger, &mut items, kind.clone(), shape::count(kind, &runs)));
    }
    // The data no longer hold what the response has taken in; its column still does.
    if start.own_fourth_order {
        let fourth = Kind::Cause { cause: Cause::HigherOrderDynamics, axis: None, shape: Vec::new() };
        nuisance.push(ledger.push(&runs, column(&fourth, 0, &runs)));
    } else if response.b_s4 != 0.0 {
        restore_fourth_order(&runs, &mut ledger, &response);
    }
    for model in ALL {
        if model.evidence() != Evidence::Signature
            || (start.own_fourth_order && model.cause() == Cause::HigherOrderDynamics)
        {
            continue;
        }
        let views: Vec<_> = runs.iter().map(|run| run.view.clone()).collect();
        let shapes = model.shapes(&views);
        for &axis in model.axes() {
            let known = kinds.iter().any(
                |kind| matches!(kind, Kind::Cause { cause, axis: at, .. } if *cause == model.cause() && *at == axis),
            );
            if let (false, Some(first)) = (known, shapes.first()) {
                let kind = Kind::Cause { cause: model.cause(), axis, shape: first.clone() };
                add(&mut ledger, &mut items, kind, shapes.len());
            }
        }
    }
    for pattern in Pattern::sizes() {
        let kind = Kind::Pattern(pattern);
        if !kinds.contains(&kind) {
            add(&mut ledger, &mut items, kind, 1);
        }
    }
    let all = vec![1.0; runs.len()];
    let apart_m2 = seen.tone.iter().flat_map(|tone| &tone.energy_m2).sum::<f64>()
        + seen.teeth.iter().map(|teeth| roughness::energy_m2(teeth, &runs)).sum::<f64>();
    let mut found = Explained {
        apart_m2,
        solution: Solution {
            coefficients: Vec::new(),
            covariance: nalgebra::DMatrix::zeros(0, 0),
            gain: 0.0,
        },
        runs: Vec::new(),
        response,
        lag,
        spread,
        ledger,
        nuisance,
        items,
        chosen,
        tone: None,
        teeth: seen.teeth.clone(),
    };
    let mut barred: Vec<usize> = Vec::new();
    for _ in 0..6 {
        let before: Vec<Kind> = chosen_kinds(&found);
        refit(&mut found, &runs, &all);
        shape::improve(&mut found, &runs);
        refit(&mut found, &runs, &all);
        propose_patterns(&mut found, &runs);
        let products = found.ledger.white(&all);
        found.chosen = select(&products, &found.nuisance, &found.items, &found.chosen, &barred);
        found.chosen = prune(&found, &all, found.chosen.clone(), &mut barred);
        if chosen_kinds(&found) == before {
            break;
        }
    }
    refit(&mut found, &runs, &all);
    found.runs = runs;
    found
}

/// The response holds a fourth-order part that the search may still reject: give it back to the data, to first
/// order exactly as its column would take it.
fn restore_fourth_order(runs: &[Prepared], ledger: &mut Ledger, response: &Response) {
    let mut data = ledger.samples(0).clone();
    for (run, data) in runs.iter().zip(&mut data) {
        let shift =
            -0.5 * response.b_s4 * run.view.radius_m * run.view.omega_rad_s.powi(4) * run.view.gain.powi(3);
        data.iter_mut().for_each(|y| *y += shift);
        run.mask(data);
    }
    ledger.replace(runs, 0, data);
}

fn refit(found: &mut Explained, _runs: &[Prepared], weights: &[f64]) {
    let products = found.ledger.white(weights);
    let columns = columns_of(&found.nuisance, &found.items, &found.chosen);
    if let Some(solution) = solve(&products, &columns) {
        found.solution = solution;
    }
}

/// Root mean square below which an explanation is of no interest, as a share of the noise of a sample.
const SMALLEST_OF_NOISE: f64 = 0.12;
/// … and of all that is explained: below, it may be the error of another signature. Causes, patterns.
const SMALLEST_OF_EXPLAINED: [f64; 2] = [0.045, 0.07];

/// Whether a tone is large enough to be of interest.
fn material(found: &Explained, tone: &Tone) -> bool {
    let (_, explained) = energies(found, &vec![1.0; found.runs.len()]);
    let count = samples(&found.runs);
    let rms = (tone.energy_m2.iter().sum::<f64>().max(0.0) / count).sqrt();
    rms > 2.0 * SMALLEST_OF_NOISE * found.spread.noise_m()
        && rms > SMALLEST_OF_EXPLAINED[1] * (explained / count).sqrt()
}

/// Energy (sum of squares, m²) that each chosen explanation alone accounts for, and all of them.
pub fn energies(found: &Explained, weights: &[f64]) -> (Vec<f64>, f64) {
    energies_of(found, weights, &found.chosen)
}

fn energies_of(found: &Explained, weights: &[f64], set: &[usize]) -> (Vec<f64>, f64) {
    let products = found.ledger.plain(weights);
    let gain = |set: &[usize]| {
        solve(&products, &columns_of(&found.nuisance, &found.items, set))
            .map_or(0.0, |solution| solution.gain)
    };
    let whole = gain(set);
    let each = (0..set.len())
        .map(|at| {
            let rest: Vec<usize> =
                set.iter().enumerate().filter(|(i, _)| *i != at).map(|(_, c)| *c).collect();
            (whole - gain(&rest)).max(0.0)
        })
        .collect();
    (each, (whole - gain(&[])).max(0.0))
}

/// Drops from a set what is real perhaps but of no interest, the smallest first, and bars it from coming back.
pub fn prune(found: &Explained, weights: &[f64], mut set: Vec<usize>, barred: &mut Vec<usize>) -> Vec<usize> {
    let count: f64 = found.ledger.samples(0).iter().zip(weights).map(|(run, w)| w * run.len() as f64).sum();
    loop {
        let (each, whole) = energies_of(found, weights, &set);
        // Beside what was taken out before, too, the search's own may be the error of another's form.
        let whole = whole + found.apart_m2 * weights.iter().sum::<f64>() / weights.len().max(1) as f64;
        let smallest = each
            .iter()
            .enumerate()
            .filter(|(at, energy)| {
                let share = SMALLEST_OF_EXPLAINED[usize::from(!found.items[set[*at]].listed())];
                let rms = (*energy / count).sqrt();
                rms < SMALLEST_OF_NOISE * found.spread.noise_m() || rms < share * (whole / count).sqrt()
            })
            .min_by(|a, b| a.1.total_cmp(b.1));
        let Some((at, _)) = smallest else { return set };
        barred.push(set.remove(at));
    }
}

fn samples(runs: &[Prepared]) -> f64 {
    runs.iter().map(|run| run.deviation_m.len() as f64).sum()
}

/// How many of the most promising patterns join the search each time.
const PROMISING: usize = 6;

/// Looks at what is left of the harmonics and of the places, and lets the best patterns compete.
fn propose_patterns(found: &mut Explained, runs: &[Prepared]) {
    let left = residual(found);
    let noise = found.spread.noise_m2;
    let harmonics: Vec<_> = runs.par_iter().zip(&left).map(|(run, left)| run.basis.harmonics(left)).collect();
    // Also beside each chosen cause as if it were not there: a pattern may describe its data better.
    let mut views = vec![harmonics.clone()];
    let columns = columns_of(&found.nuisance, &found.items, &found.chosen);
    for &item in found.chosen.iter().filter(|&&item| found.items[item].listed()) {
        let mut with = harmonics.clone();
        for &column in &found.items[item].columns {
            let at = columns.iter().position(|&c| c == column);
            let amount = at.map_or(0.0, |at| found.solution.coefficients[at]);
            with.par_iter_mut().zip(runs).zip(found.ledger.samples(column)).for_each(
                |((with, run), samples)| {
                    for (with, own) in with.iter_mut().zip(run.basis.harmonics(samples)) {
                        with[0] += amount * own[0];
                        with[1] += amount * own[1];
                    }
                },
            );
        }
        views.push(with);
    }
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
    let (_, whole) = energies(found, &vec![1.0; runs.len()]);
    let count = samples(runs);
    let smallest =
        (SMALLEST_OF_NOISE * found.spread.noise_m()).max(SMALLEST_OF_EXPLAINED[1] * (whole / count).sqrt());
    ranked.retain(|(gain, energy, pattern)| {
        let kind = Kind::Pattern(*pattern);
        let rms = (energy / count).sqrt();
        *gain > price(&kind, 1) && rms > 0.3 * smallest && !found.items.iter().any(|item| item.kind == kind)
    });
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (_, _, pattern) in ranked.into_iter().take(PROMISING) {
        let kind = Kind::Pattern(pattern);
        let columns = (0..width(&kind)).map(|i| found.ledger.push(runs, column(&kind, i, runs))).collect();
        found.items.push(Item { price: price(&kind, 1), columns, kind, fitted_beside: None });
    }
}

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
fn bump_weights(centre_rad: f64, width_rad: f64) -> [f64; PLACES] {
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
