//! Fitting what bends a signature: pitch, time constants, play.
//!
//! A coarse scan on a stratified part of the runs, then a simplex on all of them; each trial costs one column,
//! not one refit of everything.
use super::explained::{Explained, residual};
use super::item::Kind;
use super::ledger::{Samples, Trial};
use super::linear::Factor;
use super::pitch;
use super::search::columns_of;
use super::survey::Prepared;
use crate::causes::{Bend, Cause, RunView};
use nalgebra::DMatrix;
use rayon::prelude::*;

/// Runs of the coarse scan.
const SCAN_RUNS: usize = 16;
/// χ² within which a simplex has arrived.
const CLOSE: f64 = 0.5;
/// A scan is worth refining above this share of its price.
const PROMISING: f64 = 0.6;

/// Number of starting shapes of an explanation: the more, the higher its price.
pub fn count(kind: &Kind, runs: &[Prepared]) -> usize {
    match kind {
        Kind::Cause { cause, .. } => cause.model().shapes(&views(runs)).len(),
        Kind::Pattern(_) => 1,
    }
}

fn views(runs: &[Prepared]) -> Vec<RunView> {
    runs.iter().map(|run| run.view.clone()).collect()
}

/// Gives every shaped cause its best shape beside the other chosen explanations.
pub fn improve(found: &mut Explained, runs: &[Prepared]) {
    let views = views(runs);
    let sample = stratified(runs);
    let all: Vec<usize> = (0..runs.len()).collect();
    let whitened = whitened_residual(found, runs);
    for item in 0..found.items.len() {
        let Kind::Cause { cause, axis, shape } = found.items[item].kind.clone() else { continue };
        let model = cause.model();
        if model.shape_names().is_empty() {
            continue;
        }
        // What is chosen and has a slope is climbed beside all others (see `tangent`).
        let slope = |which: usize| matches!(model.bend(which, shape[which], 1.0), Bend::Amount(_));
        if found.chosen.contains(&item) && (0..shape.len()).all(slope) {
            continue;
        }
        let others: Vec<usize> = found.chosen.iter().copied().filter(|&i| i != item).collect();
        let with = columns_of(&found.nuisance, &found.items, &others);
        if found.items[item].fitted_beside.as_ref() == Some(&with) {
            continue;
        }
        found.items[item].fitted_beside = Some(with.clone());
        let score = |shape: &[f64], over: &[usize]| -> f64 {
            let kind = Kind::Cause { cause, axis, shape: shape.to_vec() };
            gain(found, runs, &kind, &with, over)
        };
        let best_of = |candidates: Vec<Vec<f64>>, over: &[usize]| {
            candidates
                .into_par_iter()
                .map(|shape| (score(&shape, over), shape))
                .max_by(|a, b| a.0.total_cmp(&b.0))
        };
        let start = if found.chosen.contains(&item) {
            shape.clone()
        } else {
            // A scan of a part of the runs sees that part of the gain.
            let share = runs.len() as f64 / sample.len().max(1) as f64;
            let best = match (cause, axis) {
                (Cause::CyclicError, Some(axis)) => {
                    let finest = crate::causes::cyclic_error::finest_wave_per_m(&views);
                    pitch::scan(runs, &whitened, found.spread.noise_m2, axis, finest)
                        .map(|found| (found.gain / share, vec![found.pitch_m]))
                }
                _ => best_of(model.shapes(&views), &sample),
            };
            match best {
                Some((coarse, start)) if coarse * share > PROMISING * found.items[item].price => start,
                _ => continue,
            }
        };
        let choice =
            (0..start.len()).any(|which| matches!(model.bend(which, start[which], 1.0), Bend::Choice(_)));
        let polished = if choice {
            best_of(model.shapes(&views), &all).map_or(start, |(_, shape)| shape)
        } else {
            let first_step = if cause == Cause::CyclicError {
                // A pitch lives on a narrow peak: neighbours fall out of step over the diameter.
                0.1 * start[0] / (2.0 * views.iter().map(|view| view.radius_m).fold(1e-3, f64::max))
            } else {
                0.15
            };
            let near = simplex(&start, first_step, 40, |shape| score(shape, &sample));
            if found.chosen.contains(&item) {
                simplex(&near, 0.2 * first_step, 20, |shape| score(shape, &all))
            } else {
                near
            }
        };
        let mut polished = polished;
        model.tidy(&mut polished);
        if polished != shape {
            let kind = Kind::Cause { cause, axis, shape: polished };
            for (index, &at) in found.items[item].columns.clone().iter().enumerate() {
                found.ledger.replace(runs, at, kind.samples(index, runs));
            }
            found.items[item].kind = kind;
        }
    }
}

/// V⁻¹ times what the chosen explanations leave: its product with a column is that column's pull.
fn whitened_residual(found: &Explained, runs: &[Prepared]) -> Samples {
    let mut left = residual(found);
    left.par_iter_mut().zip(runs).for_each(|(left, run)| {
        let discounts = found.spread.discounts(run.visible());
        let coordinates = run.basis.coordinates(left);
        for (k, (amount, discount)) in coordinates.iter().zip(discounts).enumerate() {
            run.basis.add(k, -amount * discount, left);
        }
        left.iter_mut().for_each(|x| *x /= found.spread.noise_m2);
    });
    left
}

/// Every so many runs in the order of radius and feed.
fn stratified(runs: &[Prepared]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..runs.len()).collect();
    order.sort_by(|&a, &b| {
        let key = |i: usize| (runs[i].view.radius_m, runs[i].view.feed_m_s, runs[i].view.sign);
        let (a, b) = (key(a), key(b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.total_cmp(&b.2))
    });
    let step = (runs.len() as f64 / SCAN_RUNS as f64).max(1.0);
    (0..SCAN_RUNS.min(runs.len())).map(|i| order[((i as f64 + 0.5) * step) as usize % order.len()]).collect()
}

/// What the explanation takes off χ² beside the columns `with`, over some runs.
fn gain(found: &Explained, runs: &[Prepared], kind: &Kind, with: &[usize], over: &[usize]) -> f64 {
    let mut weights = vec![0.0; runs.len()];
    for &run in over {
        weights[run] = 1.0;
    }
    let known = with.len() + 1;
    let wide = kind.columns();
    let mut products = DMatrix::zeros(known + wide, known + wide);
    let base: Vec<usize> = std::iter::once(0).chain(with.iter().copied()).collect();
    for &run in over {
        let white = found.ledger.white_of(run);
        for (i, &a) in base.iter().enumerate() {
            for (j, &b) in base.iter().enumerate() {
                products[(i, j)] += white[(a, b)];
            }
        }
    }
    let mut trials: Vec<Trial> = Vec::with_capacity(wide);
    for index in 0..wide {
        let samples: Samples = over.iter().map(|&run| kind.samples_of(index, &runs[run])).collect();
        let trial = found.ledger.trial(runs, over, samples);
        let (cross, own) = found.ledger.probe(&trial, &base, over);
        for (i, value) in cross.iter().enumerate() {
            products[(i, known + index)] = *value;
            products[(known + index, i)] = *value;
        }
        products[(known + index, known + index)] = own;
        for (earlier, other) in trials.iter().enumerate() {
            let value = found.ledger.between(other, &trial, over);
            products[(known + earlier, known + index)] = value;
            products[(known + index, known + earlier)] = value;
        }
        trials.push(trial);
    }
    let (without, further): (Vec<usize>, Vec<usize>) =
        ((1..known).collect(), (known..known + wide).collect());
    let gain = |mut factor: Factor<'_>| Some(factor.gain_with(&further)? - factor.gain());
    Factor::new(&products, &without).and_then(gain).unwrap_or(0.0)
}

/// Nelder–Mead upwards; each parameter first moves by a share of itself, or by 1 ms (or mm) from zero.
fn simplex(start: &[f64], first_step: f64, most: usize, score: impl Fn(&[f64]) -> f64) -> Vec<f64> {
    let n = start.len();
    let mut points: Vec<(f64, Vec<f64>)> = vec![(score(start), start.to_vec())];
    for axis in 0..n {
        let mut moved = start.to_vec();
        moved[axis] += if moved[axis].abs() > 1e-9 { first_step * moved[axis] } else { 1e-3 };
        points.push((score(&moved), moved));
    }
    for _ in 0..most {
        points.sort_by(|a, b| b.0.total_cmp(&a.0));
        let worst = points[n].clone();
        let centre: Vec<f64> =
            (0..n).map(|k| points[..n].iter().map(|(_, p)| p[k]).sum::<f64>() / n as f64).collect();
        let towards = |factor: f64| -> (f64, Vec<f64>) {
            let point: Vec<f64> = centre.iter().zip(&worst.1).map(|(c, w)| c + factor * (w - c)).collect();
            (score(&point), point)
        };
        let reflected = towards(-1.0);
        points[n] = if reflected.0 > points[0].0 {
            let expanded = towards(-2.0);
            if expanded.0 > reflected.0 { expanded } else { reflected }
        } else if reflected.0 > points[n - 1].0 {
            reflected
        } else {
            let drawn = towards(0.5);
            if drawn.0 > worst.0 {
                drawn
            } else {
                let best = points[0].1.clone();
                for point in points.iter_mut().skip(1) {
                    point.1 = point.1.iter().zip(&best).map(|(p, b)| 0.5 * (p + b)).collect();
                    point.0 = score(&point.1);
                }
                points[n].clone()
            }
        };
        let spread = points.iter().map(|p| p.0).fold(f64::NEG_INFINITY, f64::max)
            - points.iter().map(|p| p.0).fold(f64::INFINITY, f64::min);
        if spread.abs() < CLOSE {
            break;
        }
    }
    points.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).map_or_else(|| start.to_vec(), |(_, point)| point)
}
