//! The ring closed on the tests' own arm: a campaign is measured, diagnosed, its table run by the controller's engine, and circles
//! that were never measured are drawn through the arm's own joints, at the same place and at another.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of a test fail as the test does"
)]
use giotto::diagnosis::{Options, diagnose};
use giotto::table_from_model::table_from_model;
use giotto_firmware::engine::{CircleRun, Config, Engine, Output, flag};
use giotto_shared::circle;
use giotto_shared::table::Table;
use giotto_shared::{Direction, Plane};
use giotto_tests::arm::{ARM_EFFECTS, Arm, Setting, follow, hidden_arm};
use giotto_tests::files;
use rayon::prelude::*;
use std::f64::consts::TAU;

const TICK_S: f64 = 1e-3;

/// The set-points of two laps, and where the last lap lies among them.
fn drawn(run: &CircleRun, table: Option<&Table>) -> (Vec<Output>, std::ops::Range<usize>) {
    let mut config = Config::robot((1.0 / TICK_S) as u32);
    config.motion.acceleration_m_s2 = 12.0;
    let mut engine = Engine::new(config).unwrap();
    engine.load(table).unwrap();
    let start = run.centre_m.map(|m| (m * 1e9) as i32);
    engine.set_position(start).unwrap();
    engine.run_circle(run).unwrap();
    let mut out = Vec::new();
    while !engine.idle() {
        out.push(engine.tick());
    }
    let end = out
        .iter()
        .rposition(|o| o.flags & flag::CRUISE != 0)
        .unwrap();
    let lap = (TAU * run.radius_m / run.feed_m_s / TICK_S).round() as usize;
    (out, end - lap..end)
}

/// Radius error and out-of-roundness (half of highest less lowest), m, of a circle drawn with a table or without.
fn errors(arm: &Arm, run: &CircleRun, table: Option<&Table>) -> [f64; 2] {
    let (out, lap) = drawn(run, table);
    let metres = |nm: i32| f64::from(nm) * 1e-9;
    let set_points: Vec<_> = out.iter().map(|o| o.corrected_nm.map(metres)).collect();
    let places = follow(arm, &set_points, TICK_S).unwrap();
    let [a, b] = run.plane.axes().map(giotto_shared::Actuator::index);
    let points: Vec<[f64; 2]> = places[lap].iter().map(|p| [p[a], p[b]]).collect();
    let fit = circle::fit(points.as_slice()).unwrap().circle;
    let radii = points
        .iter()
        .map(|p| (p[0] - fit.centre[0]).hypot(p[1] - fit.centre[1]));
    let (low, high) = radii.fold((f64::MAX, f64::MIN), |(low, high), r| {
        (r.min(low), r.max(high))
    });
    [fit.radius - run.radius_m, 0.5 * (high - low)]
}

/// Shares of radius error and roundness that six circles have left, root mean square over root mean square: at the place that was
/// measured, and at another.
fn left(setting: &Setting, seed: u64) -> Option<[[f64; 2]; 2]> {
    let (case, arm) = hidden_arm(setting, seed)?;
    let dir = tempfile::tempdir().unwrap();
    files::write(&case, dir.path()).unwrap();
    let campaign = giotto::campaign::read(dir.path()).unwrap();
    let found = diagnose(&campaign, &Options::default()).unwrap();
    let table = table_from_model(&found.model).unwrap().table;
    let places = if setting.six {
        [[-0.290, 0.987, 0.615], [0.650, 0.450, 0.550]]
    } else {
        [[0.42, 0.12, 0.0], [0.15, 0.45, 0.0]]
    };
    let circles = if setting.six {
        [
            (0.12, 0.25),
            (0.12, 0.45),
            (0.2, 0.4),
            (0.2, 0.6),
            (0.25, 0.3),
            (0.25, 0.65),
        ]
    } else {
        [
            (0.06, 0.1),
            (0.06, 0.25),
            (0.07, 0.3),
            (0.09, 0.15),
            (0.09, 0.4),
            (0.1, 0.45),
        ]
    };
    Some(places.map(|centre_m| {
        let mut sums = [[0.0; 2]; 2];
        for (k, (radius_m, feed_m_s)) in circles.into_iter().enumerate() {
            let run = CircleRun {
                centre_m,
                radius_m,
                feed_m_s,
                plane: Plane::Xy,
                direction: if k % 2 == 0 {
                    Direction::Ccw
                } else {
                    Direction::Cw
                },
                laps: 2,
                start_rad: 0.5,
            };
            for (sums, table) in sums.iter_mut().zip([None, Some(&table)]) {
                for (sum, error) in sums.iter_mut().zip(errors(&arm, &run, table)) {
                    *sum += error * error;
                }
            }
        }
        let [before, after] = sums;
        [0, 1].map(|k: usize| (after[k] / before[k]).sqrt())
    }))
}

fn setting(six: bool, effects: &[&str], places: usize) -> Setting {
    Setting {
        six,
        effects: effects.iter().map(|e| (*e).to_owned()).collect(),
        strength: 5.0,
        places,
        robot: false,
        given: true,
    }
}

/// Shares left, by setting and seed, worst first printed; the medians are what the bars are for.
fn study(seeds: std::ops::Range<u64>) -> [[f64; 2]; 2] {
    let mut settings: Vec<Setting> = Vec::new();
    for six in [false, true] {
        settings.push(setting(six, &[], 1));
        for name in ARM_EFFECTS {
            settings.push(setting(six, &[name], 1));
        }
    }
    let cases: Vec<(Setting, u64)> = settings
        .iter()
        .flat_map(|s| seeds.clone().map(|seed| (s.clone(), seed)))
        .collect();
    let shares: Vec<[[f64; 2]; 2]> = cases
        .par_iter()
        .filter_map(|(setting, seed)| {
            let left = left(setting, *seed)?;
            println!(
                "six {} {:?} seed {seed}: same place {:.3} {:.3}, other {:.3} {:.3}",
                setting.six, setting.effects, left[0][0], left[0][1], left[1][0], left[1][1]
            );
            Some(left)
        })
        .collect();
    let median = |place: usize, kind: usize| {
        let mut all: Vec<f64> = shares.iter().map(|s| s[place][kind]).collect();
        all.sort_by(f64::total_cmp);
        all[all.len() / 2]
    };
    [0, 1].map(|place| [0, 1].map(|kind| median(place, kind)))
}

#[test]
fn circles_never_measured_become_true() {
    let [[radius, round], [radius_there, round_there]] = study(900..901);
    println!(
        "median left: same place {radius:.3} {round:.3}, other {radius_there:.3} {round_there:.3}"
    );
    assert!(radius < 0.05 && round < 0.4, "same place: {radius} {round}");
    assert!(
        radius_there < 0.2 && round_there < 0.6,
        "other place: {radius_there} {round_there}"
    );
}

/// `cargo test --release -p giotto-tests --test arm_closed_loop -- --ignored --nocapture`.
#[test]
#[ignore = "minutes"]
fn many_arms() {
    let [same, other] = study(1000..1010);
    println!("median left: same place {same:?}, other {other:?}");
    assert!(same[0] < 0.05 && same[1] < 0.4 && other[0] < 0.2 && other[1] < 0.6);
}
