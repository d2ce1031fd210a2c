//! A plan is worth what its runs tell: measured on the simulated machine and diagnosed again.
use super::{Limits, Options, Plan, Purpose, propose};
use crate::campaign::Campaign;
use crate::causes::Cause;
use crate::diagnosis::{Diagnosis, Options as Told, diagnose};
use crate::simulation::machine::PositionLoop;
use crate::simulation::{CircleTest, Instrument, Machine, PlannedTest, campaign};
use giotto_shared::Direction;

fn machine() -> Machine {
    Machine {
        servo: [PositionLoop {
            kv_per_s: 40.0,
            feed_forward: 0.0,
        }; 3],
        radius_offset_m: 30e-6,
        ..Machine::default()
    }
}

fn run(machine: &Machine, circles: &[(f64, f64, Direction)], seed: u64) -> Campaign {
    let plan = crate::simulation::Plan {
        name: "lab".into(),
        machine_name: "simulated".into(),
        machine: machine.clone(),
        instrument: Instrument::ballbar(),
        tests: circles
            .iter()
            .map(|&(radius_m, feed_m_s, direction)| PlannedTest {
                test: CircleTest {
                    samples: Some(400),
                    ..CircleTest::new(radius_m, feed_m_s, direction)
                },
                timed: false,
            })
            .collect(),
        shuffle: false,
    };
    campaign(&plan, seed)
}

fn one_radius() -> Vec<(f64, f64, Direction)> {
    [0.3, 0.05, 0.2, 0.1, 0.25, 0.02, 0.15]
        .into_iter()
        .flat_map(|feed| [(0.1, feed, Direction::Ccw), (0.1, feed, Direction::Cw)])
        .collect()
}

fn told(campaign: &Campaign) -> Diagnosis {
    diagnose(campaign, &Told::default()).unwrap()
}

fn options() -> Options {
    Options {
        limits: Limits::default(),
        most_runs: 12,
        seed: 7,
    }
}

fn circles(plan: &Plan) -> Vec<(f64, f64, Direction)> {
    plan.runs
        .iter()
        .map(|s| (s.radius_mm * 1e-3, s.feed_mm_s * 1e-3, s.direction))
        .collect()
}

/// Radius offset and scale error are one thing at one radius. The plan asks for other radii, and with its runs
/// the diagnosis names the right one of the two and no longer the other.
#[test]
fn one_radius_is_answered_by_others_and_then_offset_and_scale_are_told_apart() {
    let old = run(&machine(), &one_radius(), 1);
    let diagnosis = told(&old);
    let plan = propose(&old, &diagnosis, &options());
    let class = &plan.open[0].members;
    assert!(
        class.contains(&Cause::RadiusOffset) && class.contains(&Cause::ScaleError),
        "{class:?}"
    );
    assert!(
        plan.runs.iter().any(|s| (s.radius_mm - 100.0).abs() > 20.0),
        "{:?}",
        plan.runs
    );
    let pair = plan
        .separations
        .iter()
        .find(|s| s.pair.contains(&"scale_error".to_string()))
        .unwrap();
    assert!(
        pair.expected_chi2_before < 1.0 && pair.expected_chi2_after > 25.0,
        "{pair:?}"
    );

    let mut both = old.clone();
    let new = run(&machine(), &circles(&plan), 2);
    let later = 10.0
        + old
            .runs
            .iter()
            .filter_map(|r| r.started_s)
            .fold(0.0, f64::max);
    for mut run in new.runs {
        run.started_s = run.started_s.map(|s| s + later);
        both.runs.push(run);
    }
    let after = told(&both);
    let found: Vec<Cause> = after.findings.iter().map(|f| f.cause).collect();
    assert!(
        found.contains(&Cause::RadiusOffset) && !found.contains(&Cause::ScaleError),
        "{found:?}"
    );
    let offset = after
        .findings
        .iter()
        .find(|f| f.cause == Cause::RadiusOffset)
        .unwrap();
    assert!(
        !offset
            .indistinguishable_from
            .contains(&"scale_error".to_string()),
        "{offset:?}"
    );
    assert!((offset.estimate.value - 0.03).abs() < 0.003, "{offset:?}");
}

#[test]
fn the_order_is_shuffled_by_the_seed_with_a_reference_first_in_the_middle_and_last() {
    let old = run(&machine(), &one_radius(), 1);
    let diagnosis = told(&old);
    let plan = propose(&old, &diagnosis, &options());
    let reference = |s: &&super::Step| s.purpose == Purpose::Reference;
    assert_eq!(plan.runs.iter().filter(reference).count(), 3);
    let (first, last) = (plan.runs[0], plan.runs[plan.runs.len() - 1]);
    assert!(first == last && first.purpose == Purpose::Reference && first.radius_mm == 100.0);
    assert_eq!(plan, propose(&old, &diagnosis, &options()));
    // Two seeds may shuffle few runs alike; twenty do not.
    let shuffled = |seed| propose(&old, &diagnosis, &Options { seed, ..options() }).runs;
    assert!((8..28).any(|seed| shuffled(seed) != plan.runs));
    // Nothing faster or harder than what the machine has shown.
    for step in &plan.runs {
        assert!(step.feed_mm_s <= 300.0 + 1e-9);
        assert!(
            step.feed_mm_s.powi(2) / step.radius_mm <= 900.0 * (1.0 + 1e-6),
            "{step:?}"
        );
    }
}

#[test]
fn limits_are_kept_and_a_plan_without_other_radii_says_that_no_circle_tells() {
    let old = run(&machine(), &one_radius(), 1);
    let diagnosis = told(&old);
    let limits = Limits {
        radii_m: vec![0.1],
        ..Limits::default()
    };
    let plan = propose(
        &old,
        &diagnosis,
        &Options {
            limits,
            ..options()
        },
    );
    assert!(plan.runs.iter().all(|s| s.radius_mm == 100.0));
    let pair = |names: &[String; 2]| names.contains(&"scale_error".to_string());
    assert!(
        plan.line_tests.iter().any(|l| pair(&l.pair)),
        "{:?}",
        plan.line_tests
    );
}

#[test]
fn a_gain_and_a_dead_time_are_left_to_a_line_test() {
    let mut machine = Machine {
        radius_offset_m: 0.0,
        ..machine()
    };
    machine.split_lag(giotto_shared::Plane::Xy, 2e-4);
    let mut grid = one_radius();
    grid.extend(one_radius().into_iter().map(|(_, f, d)| (0.25, f, d)));
    let old = run(&machine, &grid, 3);
    let diagnosis = told(&old);
    assert_eq!(
        diagnosis.findings.first().map(|f| f.cause),
        Some(Cause::ServoMismatch)
    );
    let plan = propose(&old, &diagnosis, &options());
    assert!(
        plan.line_tests
            .iter()
            .any(|l| l.pair[1] == "dead_time_mismatch"),
        "{:?}",
        plan.line_tests
    );
}

#[test]
fn what_the_simulation_explains_asks_for_nothing_and_few_runs_ask_for_more() {
    let machine = Machine {
        radius_offset_m: 0.0,
        ..machine()
    };
    let mut grid = one_radius();
    grid.extend(one_radius().into_iter().map(|(_, f, d)| (0.25, f, d)));
    let old = run(&machine, &grid, 4);
    let plan = propose(&old, &told(&old), &options());
    assert!(plan.runs.is_empty() && plan.open.is_empty(), "{plan:?}");
    let few = run(&machine, &[(0.1, 0.1, Direction::Ccw)], 4);
    let plan = propose(&few, &told(&few), &options());
    assert!(
        plan.open[0].members.len() > 5 && plan.open[0].why.contains("one direction"),
        "{plan:?}"
    );
    let ways = |d| plan.runs.iter().any(|s| s.direction == d);
    assert!(ways(Direction::Ccw) && ways(Direction::Cw));
    let mut radii: Vec<f64> = plan.runs.iter().map(|s| s.radius_mm).collect();
    radii.sort_by(f64::total_cmp);
    radii.dedup();
    assert!(radii.len() >= 3, "{radii:?}");
}

/// The file of a plan is one that `giotto simulate` takes.
#[test]
fn the_file_is_read_by_simulate() {
    let old = run(&machine(), &one_radius(), 1);
    let plan = propose(&old, &told(&old), &options());
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("plan.toml");
    std::fs::write(&file, toml::to_string(&plan.file(&old)).unwrap()).unwrap();
    let read = crate::simulation::Plan::load(&file).unwrap();
    assert!(!read.shuffle, "the order is the plan's");
    let same = read.tests.iter().zip(&plan.runs).all(|(t, s)| {
        (t.test.radius_m * 1e3 - s.radius_mm).abs() < 1e-9 && t.test.direction == s.direction
    });
    assert!(same && read.tests.len() == plan.runs.len());
}
