//! How much an effect shows: its misfit once the baseline has been fitted again.
use super::Effect;
use crate::machine::{Machine, Plan, Test, simulate};
use std::f64::consts::PI;

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
            lap.position_m
                .iter()
                .map(|p| test.plane.radius(*p) - test.radius_m)
                .collect()
        })
        .collect()
}

/// Tests in a fair order: by radius, feed, direction.
fn in_order(plan: &Plan) -> Vec<&Test> {
    let mut tests: Vec<&Test> = plan.tests.iter().collect();
    let key = |t: &Test| (t.radius_m, t.feed_m_s, t.sign());
    tests.sort_by(|a, b| {
        key(a)
            .partial_cmp(&key(b))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    tests
}

/// Root mean square over all samples, m, of what is left of `machine`'s noise-free circles once each run's
/// centre has been taken off and one servo lag has been fitted over all runs. Every third test (by radius,
/// feed, direction) is looked at unless `whole`.
pub fn misfit_m(machine: &Machine, plan: &Plan, whole: bool) -> f64 {
    let tests: Vec<&Test> = in_order(plan)
        .into_iter()
        .step_by(if whole { 1 } else { EVERY })
        .collect();
    let mut runs = Vec::new();
    let mut within = 0.0;
    for (test, profile) in tests.iter().zip(profiles(machine, &tests, plan.length_s)) {
        let n = profile.len() as f64;
        let mean = profile.iter().sum::<f64>() / n;
        let wave = |k: usize| (2.0 * PI * k as f64 / n).sin_cos();
        let (mut cos, mut sin) = (0.0, 0.0);
        for (k, x) in profile.iter().enumerate() {
            let (s, c) = wave(k);
            cos += 2.0 * x * c / n;
            sin += 2.0 * x * s / n;
        }
        within += profile
            .iter()
            .enumerate()
            .map(|(k, x)| {
                let (s, c) = wave(k);
                (x - mean - cos * c - sin * s).powi(2)
            })
            .sum::<f64>();
        runs.push((
            n,
            test.radius_m,
            (test.feed_m_s / test.radius_m).powi(2),
            mean,
        ));
    }
    let between = |lag2: f64| -> f64 {
        runs.iter()
            .map(|&(n, radius, w2, mean)| {
                n * (mean - radius * ((1.0 + w2 * lag2).powf(-0.5) - 1.0)).powi(2)
            })
            .sum()
    };
    let count: f64 = runs.iter().map(|r| r.0).sum();
    ((within + least(between)) / count).sqrt()
}

/// Least value of a function of τ² over 0…(0.2 s)², by golden section in τ.
fn least(f: impl Fn(f64) -> f64) -> f64 {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut a, mut b) = (0.0_f64, 0.2_f64);
    for _ in 0..60 {
        let (c, d) = (b - golden * (b - a), a + golden * (b - a));
        if f(c * c) < f(d * d) {
            b = d;
        } else {
            a = c;
        }
    }
    let middle = 0.5 * (a + b);
    f(middle * middle).min(f(0.0))
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
    // The misfit grows with the size: keep a bracket, guess by the slope in logarithms.
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut before: Option<[f64; 2]> = None;
    for _ in 0..24 {
        let machine = build(size);
        let reached = misfit_m(&machine, plan, false);
        let off = |m: f64| (m / wanted_m).ln().abs();
        if off(reached) < off(best.1) {
            best = (machine, reached);
        }
        if off(reached) < CLOSE {
            break;
        }
        let at = size.ln();
        if reached < wanted_m {
            low = low.max(at);
        } else {
            high = high.min(at);
        }
        let felt = reached > 1e-3 * wanted_m;
        let slope = before
            .filter(|_| felt)
            .map(|b| (reached.ln() - b[1]) / (at - b[0]))
            .filter(|s| s.is_finite() && *s > 0.2)
            .map_or(1.0, |s| s.min(20.0));
        // A clamp above every run is not felt at all: a small step then, so as not to jump over the onset.
        let step = if felt {
            ((wanted_m.ln() - reached.ln()) / slope).clamp(-2.0, 2.0)
        } else {
            0.2
        };
        before = felt.then_some([at, reached.ln()]);
        let mut next = at + step;
        if low.is_finite() && high.is_finite() && (next <= low || next >= high) {
            next = 0.5 * (low + high);
        }
        size = next.exp();
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{LISTED, UNLISTED, listed, unlisted};
    use crate::machine::base::{Lab, Variety};

    /// The third of the tests that sizes are searched on speaks for all of them.
    #[test]
    fn effects_reach_their_misfit_on_the_whole_plan() {
        for (seed, name) in (1_u64..).zip(LISTED.iter().chain(&UNLISTED)) {
            let lab = Lab::drawn(seed, Variety::Usual);
            let plan = lab.grid.plan(seed);
            let effect = listed(name, seed).or_else(|| unlisted(name, seed)).unwrap();
            let (machine, reached_m) = scaled(&effect, &lab.machine, &plan, 3e-6);
            assert!((reached_m / 3e-6 - 1.0).abs() < 0.05, "{name}: {reached_m}");
            let whole = misfit_m(&machine, &plan, true);
            assert!(
                (whole / 3e-6 - 1.0).abs() < 0.25,
                "{name}: {whole} over all tests"
            );
            assert!(
                misfit_m(&lab.machine, &plan, true) < 2e-8,
                "{name}: the bare machine is one lag"
            );
        }
    }
}
