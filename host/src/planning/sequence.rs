//! The order of the runs: shuffled, so that drift does not pass for an effect of speed; one circle of the old
//! campaign first, in the middle and last, so that drift is seen; turns before all of it to warm up.
use super::grid::{self, Circle};
use crate::campaign::{Campaign, Direction, Plane};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use std::f64::consts::TAU;

/// What a run is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Purpose {
    /// To tell explanations apart.
    Test,
    /// To see drift, and whether the machine is still that of the campaign.
    Reference,
}

/// One run of the plan.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Step {
    /// Radius, mm.
    pub radius_mm: f64,
    /// Feed, mm/s.
    pub feed_mm_s: f64,
    /// Direction.
    pub direction: Direction,
    /// Plane of the circle.
    pub plane: Plane,
    /// What it is for.
    pub purpose: Purpose,
}

/// Feed-in, feed-out and the turn itself.
const TURNS_PER_RUN: f64 = 1.5;
/// Pause between runs, s.
const PAUSE_S: f64 = 20.0;
/// Time to warm up, s.
const WARM_UP_S: f64 = 600.0;

fn step(circle: &Circle, purpose: Purpose) -> Step {
    // Micrometres: what was programmed in mm comes back as it was.
    let mm = |m: f64| (m * 1e6).round() / 1e3;
    Step {
        radius_mm: mm(circle.radius_m),
        feed_mm_s: mm(circle.feed_m_s),
        direction: circle.direction,
        plane: circle.plane,
        purpose,
    }
}

/// Runs in order, turns of the reference circle to warm up, and the time it all takes, s.
pub fn sequence(campaign: &Campaign, circles: &[Circle], seed: u64) -> (Vec<Step>, usize, f64) {
    let mut order = campaign.runs.iter().collect::<Vec<_>>();
    order.sort_by(|a, b| (a.feed_m_s / a.radius_m).total_cmp(&(b.feed_m_s / b.radius_m)));
    // Neither the slowest nor the fastest: least of all effects of its own.
    let (Some(reference), false) = (order.get(order.len() / 2), circles.is_empty()) else {
        return (Vec::new(), 0, 0.0);
    };
    let reference = Circle {
        radius_m: reference.radius_m,
        feed_m_s: reference.feed_m_s,
        direction: reference.direction,
        plane: grid::plane_of(reference),
    };
    let mut tests = circles.to_vec();
    tests.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    let (early, late) = tests.split_at(tests.len() / 2);
    let mut steps = vec![step(&reference, Purpose::Reference)];
    steps.extend(early.iter().map(|c| step(c, Purpose::Test)));
    steps.push(step(&reference, Purpose::Reference));
    steps.extend(late.iter().map(|c| step(c, Purpose::Test)));
    steps.push(step(&reference, Purpose::Reference));
    let turn_s = TAU * reference.radius_m / reference.feed_m_s;
    let warm_up = (WARM_UP_S / turn_s).ceil().clamp(1.0, 500.0) as usize;
    let runs_s: f64 = steps
        .iter()
        .map(|s| TURNS_PER_RUN * TAU * s.radius_mm / s.feed_mm_s + PAUSE_S)
        .sum();
    (steps, warm_up, warm_up as f64 * turn_s + runs_s)
}
