//! The next measurement: the few runs that would best tell apart what a diagnosis could not.
//!
//! | file | holds |
//! |---|---|
//! | `question` | which explanations compete, and which of them no circle can tell apart |
//! | `grid` | the circles that may be run |
//! | `information` | what a circle would tell of every explanation, by the causes' own signatures |
//! | `design` | the choice: Ds-optimality, greedy and then by exchange; what it is worth |
//! | `program` | the plan as a program for the machine, in RS-274 and RAPID |
//! | `sequence` | the order: shuffled, a reference run repeated, a warm-up before |
mod design;
mod grid;
mod information;
mod program;
mod question;
mod sequence;
#[cfg(test)]
mod tests;

pub use design::Separation;
pub use grid::Limits;
pub use question::{Class, LineTest};
pub use sequence::{Purpose, Step};

use crate::campaign::Campaign;
use crate::diagnosis::Diagnosis;
use crate::simulation::plan_file::{Names, PlanFile, RunSpec};
use serde::Serialize;

/// What the planner may be told.
#[derive(Clone, Debug)]
pub struct Options {
    /// What the machine and the instrument allow.
    pub limits: Limits,
    /// Most runs beside the reference runs.
    pub most_runs: usize,
    /// Seed of the order.
    pub seed: u64,
}

/// A plan, in the form of `giotto plan --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Plan {
    /// Classes of explanations that these runs cannot tell apart.
    pub open: Vec<Class>,
    /// What no circle can tell, with the test that can.
    pub line_tests: Vec<LineTest>,
    /// The runs in the order to be run; empty where circles have nothing more to tell.
    pub runs: Vec<Step>,
    /// What the runs are expected to be worth, pair by pair.
    pub separations: Vec<Separation>,
    /// Turns of the reference circle to run before the first measurement.
    pub warm_up_turns: usize,
    /// Expected duration with feed-in, feed-out and a pause of 20 s a run, s.
    pub duration_s: f64,
    /// Seed of the order.
    pub seed: u64,
}

/// Plans the next measurement.
///
/// ```
/// use giotto::planning::{Options, propose};
/// use giotto::simulation::{self, Plan};
/// use giotto::diagnosis;
/// # use std::path::Path;
/// // Circles of one radius cannot tell a ball that is too large from a scale that is too long.
/// let plan = Plan::parse(
///     "[machine]\nboth = { kv_per_s = 50.0 }\nradius_offset_um = 30.0\n[grid]\nradii_mm = [100.0]\n\
///      feeds_mm_s = [20.0, 50.0, 100.0, 200.0, 300.0, 400.0]\nrepeats = 2",
///     Path::new("plan.toml"),
/// )?;
/// let campaign = simulation::campaign(&plan, 1);
/// let diagnosis = diagnosis::diagnose(&campaign, &Default::default())?;
/// let options = Options { limits: Default::default(), most_runs: 8, seed: 1 };
/// let next = propose(&campaign, &diagnosis, &options);
/// // A second radius would tell, and none is proposed that the machine has not shown to bear.
/// assert_eq!(next.open.len(), 1);
/// assert!(next.runs.iter().any(|run| run.radius_mm < 60.0));
/// assert!(next.runs.iter().all(|run| run.feed_mm_s <= 400.0 && run.radius_mm <= 100.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn propose(campaign: &Campaign, diagnosis: &Diagnosis, options: &Options) -> Plan {
    let question = question::of(diagnosis);
    let chosen = if question.classes.is_empty() {
        design::Chosen::default()
    } else {
        let circles = grid::circles(campaign, &options.limits);
        design::choose(campaign, diagnosis, &question, &circles, options.most_runs)
    };
    let mut line_tests = question.line_tests;
    line_tests.extend(
        chosen
            .separations
            .iter()
            .filter(|s| !s.told())
            .map(|s| LineTest {
                pair: s.pair.clone(),
                test: s.test.clone(),
                why: "no circle within the limits of radius and feed tells them apart".into(),
            }),
    );
    let (runs, warm_up_turns, duration_s) =
        sequence::sequence(campaign, &chosen.circles, options.seed);
    Plan {
        open: question.classes,
        line_tests,
        runs,
        separations: chosen.separations,
        warm_up_turns,
        duration_s,
        seed: options.seed,
    }
}

impl Plan {
    /// The runs as a file that `giotto simulate` reads and a person can follow. The machine in it is perfect:
    /// put `model = "…"` or a `[machine]` there to simulate another.
    pub fn file(&self, campaign: &Campaign) -> PlanFile {
        PlanFile {
            campaign: Names {
                name: format!("{}, next", campaign.name),
                machine: campaign.machine.clone(),
            },
            runs: self
                .runs
                .iter()
                .map(|step| RunSpec {
                    radius_mm: step.radius_mm,
                    feed_mm_s: step.feed_mm_s,
                    direction: step.direction,
                    start_angle_deg: 0.0,
                    started_s: None,
                    centre_mm: None,
                    plane: step.plane,
                })
                .collect(),
            ..PlanFile::default()
        }
    }
}
