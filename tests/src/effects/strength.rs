//! How much an effect shows: its misfit once the baseline has been fitted again.
use super::Effect;
use crate::machine::{Machine, Plan, Test, simulate};

/// Every which test is looked at when a size is searched for: enough of all radii, feeds and directions.
const EVERY: usize = 3;
/// The search stops within this share of the wanted misfit.
const CLOSE: f64 = 0.02;

/// Noise-free radial deviations of a machine on a set of tests.
fn profiles(machine: &Machine, tests: &[&Test], campaign_s: f64) -> Vec<Vec<f64>> {
    tests
        .iter()
        .map(|test| {
            let lap = simulate(machine, test, campaign_s, 0.7);
            lap.position_m.iter().map(|p| p[0].hypot(p[1]) - test.radius_m).collect()
        })
        .collect()
}

/// Tests in a fair order: by radius, feed, direction.
fn in_order(plan: &Plan) -> Vec<&Test> {
    let mut tests: Vec<&Test> = plan.tests.iter().collect();
    let key = |t: &Test| (t.radius_m, t.feed_m_s, t.sign());
    tests.sort_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal));
    tests
}

/// Root mean square over all samples, m, by which `machine` differs from `base` after each run's centre
/// has been taken off and one servo lag has been fitted again over all runs. The plan's slow and fast,
/// small and large circles count alike; every third test is looked at unless `whole`.
pub fn misfit_m(machine: &Machine, base: &Machine, plan: &Plan, whole: bool) -> f64 {
    let tests: Vec<&Test> = in_order(plan).into_iter().step_by(if whole { 1 } else { EVERY }).collect();
    let with = profiles(machine, &tests, plan.length_s);
    let without = profiles(base, &tests, plan.length_s);
    let lag_s = base.axes[0].lag_s;
    let mut centred = Vec::new();
    let (mut on_lag, mut lag_square) = (0.0, 0.0);
    for ((a, b), test) in with.iter().zip(&without).zip(&tests) {
        let n = a.len() as f64;
        let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
        let (mut cos, mut sin, mut mean) = (0.0, 0.0, 0.0);
        for (k, x) in difference.iter().enumerate() {
            let (s, c) = (2.0 * std::f64::consts::PI * k as f64 / n).sin_cos();
            cos += 2.0 * x * c / n;
            sin += 2.0 * x * s / n;
            mean += x / n;
        }
        // ∂ΔR/∂(1/kv²) of R·(1/√(1+ω²/kv²) − 1).
        let w2 = (test.feed_m_s / test.radius_m).powi(2);
        let slope = -0.5 * test.radius_m * w2 * (1.0 + w2 * lag_s * lag_s).powf(-1.5);
        on_lag += n * mean * slope;
        lag_square += n * slope * slope;
        let square: f64 = difference
            .iter()
            .enumerate()
            .map(|(k, x)| {
                let (s, c) = (2.0 * std::f64::consts::PI * k as f64 / n).sin_cos();
                (x - cos * c - sin * s - mean).powi(2)
            })
            .sum();
        centred.push((n, mean, slope, square));
    }
    let share = on_lag / lag_square;
    let (mut sum, mut count) = (0.0, 0.0);
    for (n, mean, slope, square) in centred {
        sum += square + n * (mean - share * slope).powi(2);
        count += n;
    }
    (sum / count).sqrt()
}

/// `base` with `effect` in it, sized so that its misfit is `wanted_m`; and the misfit reached, m.
pub fn scaled(effect: &Effect, base: &Machine, plan: &Plan, wanted_m: f64) -> (Machine, f64) {
    let build = |size: f64| {
        let mut machine = base.clone();
        (effect.apply)(&mut machine, size);
        machine
    };
    let mut size = effect.first;
    let mut best = (build(size), f64::MAX);
    let mut before: Option<(f64, f64)> = None;
    for _ in 0..16 {
        let machine = build(size);
        let reached = misfit_m(&machine, base, plan, false);
        let off = |m: f64| (m / wanted_m).ln().abs();
        if off(reached) < off(best.1) {
            best = (machine, reached);
        }
        if off(reached) < CLOSE {
            break;
        }
        if reached < 1e-3 * wanted_m {
            // Not felt yet (a clamp above every run): grow until it is.
            size *= 1.5;
            continue;
        }
        let point = (size.ln(), reached.ln());
        let slope = before
            .map(|b: (f64, f64)| (point.1 - b.1) / (point.0 - b.0))
            .filter(|s| s.is_finite() && *s > 0.2)
            .map_or(1.0, |s| s.min(8.0));
        before = Some(point);
        size = (point.0 + ((wanted_m.ln() - point.1) / slope).clamp(-2.0, 2.0)).exp();
    }
    best
}
