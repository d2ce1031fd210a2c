//! A plan: which circles, on which machine, with which instrument; and the campaign that comes of it.
use super::circle::{CircleTest, circle};
use super::instrument::Instrument;
use super::machine::Machine;
use crate::campaign::{Campaign, Run};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Feed-in, feed-out and the approach add this share of a turn to each run of a plan without times.
const TURNS_PER_RUN: f64 = 1.5;
/// Pause between the runs of a plan without times, s.
const PAUSE_S: f64 = 20.0;

/// A campaign to be simulated.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Name of the campaign.
    pub name: String,
    /// Name of the machine.
    pub machine_name: String,
    /// The machine.
    pub machine: Machine,
    /// The instrument.
    pub instrument: Instrument,
    /// The circles.
    pub tests: Vec<PlannedTest>,
    /// Whether the tests are shuffled (by the seed) before times are given.
    pub shuffle: bool,
}

/// One circle of a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlannedTest {
    /// The circle; its `started_s` counts only where `timed`.
    pub test: CircleTest,
    /// Whether the start was given; else the run follows the one before.
    pub timed: bool,
}

/// Random draws of a purpose: one stream for the order, one for every run.
fn draws(seed: u64, stream: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream);
    rng
}

/// Runs a plan. The same plan and seed give the same campaign, whatever the number of threads.
///
/// ```
/// use giotto::simulation::{Plan, campaign};
/// # use std::path::Path;
/// let plan = Plan::parse(
///     "[instrument]\nnoise_um = 1.0\n[grid]\nradii_mm = [100.0]\nfeeds_mm_s = [50.0]\nrepeats = 3",
///     Path::new("plan.toml"),
/// )?;
/// // Both directions, three times; one seed is one campaign.
/// assert_eq!(campaign(&plan, 1).runs.len(), 6);
/// assert_eq!(campaign(&plan, 1), campaign(&plan, 1));
/// assert_ne!(campaign(&plan, 1), campaign(&plan, 2));
/// # Ok::<(), giotto::toml_file::TomlFileError>(())
/// ```
pub fn campaign(plan: &Plan, seed: u64) -> Campaign {
    let mut tests = plan.tests.clone();
    if plan.shuffle {
        tests.shuffle(&mut draws(seed, 0));
    }
    let mut clock_s = 0.0;
    for planned in &mut tests {
        if !planned.timed {
            planned.test.started_s = clock_s;
        }
        let turn_s = TAU * planned.test.radius_m / planned.test.feed_m_s;
        // Tenths of a second, as a person would note them.
        clock_s =
            ((planned.test.started_s + TURNS_PER_RUN * turn_s + PAUSE_S) * 10.0).round() / 10.0;
    }
    let run = |(index, planned): (usize, &PlannedTest)| {
        let test = &planned.test;
        let trace = circle(&plan.machine, test);
        let samples = plan
            .instrument
            .record(test, &trace, &mut draws(seed, index as u64 + 1));
        Run {
            file: format!("run{index:03}.csv"),
            radius_m: test.radius_m,
            feed_m_s: test.feed_m_s,
            direction: test.direction,
            start_angle_rad: test.start_angle_rad,
            started_s: Some(test.started_s),
            temperature_c: None,
            centre_m: (test.centre_m != [0.0; 3]).then_some(test.centre_m),
            frame: test.frame,
            setup: None,
            samples,
        }
    };
    Campaign {
        name: plan.name.clone(),
        machine: plan.machine_name.clone(),
        repeatability_m: None,
        table: None,
        kinematics: plan.machine.arm.as_ref().map(|arm| arm.kinematics),
        runs: tests.par_iter().enumerate().map(run).collect(),
    }
}
