//! As `remedies`, on an arm: what a finding says of a joint or a link is turned on the tests' own arm, whose faults are
//! put in by hand, and its circles must come nearer to those of the sound arm.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of a test fail as the test does"
)]
use giotto::diagnosis::{Finding, Options, diagnose};
use giotto_tests::arm::{Arm, Gear, Kinematics, simulate};
use giotto_tests::effects::Hidden;
use giotto_tests::files;
use giotto_tests::machine::plan::Grid;
use giotto_tests::machine::{AxisChain, Friction, Instrument, Plan, Plane, Spread};
use rayon::prelude::*;

/// Where the circles lie, m: one place for what moves, all for what only the place shows.
const PLACES: [[f64; 3]; 4] = [
    [-0.290, 0.987, 0.615],
    [0.750, 0.250, 0.450],
    [0.350, -0.850, 0.800],
    [0.900, -0.350, 0.700],
];

struct Fault {
    cause: &'static str,
    /// From 0.
    joint: usize,
    places: usize,
    arm: Arm,
}

fn sound() -> Arm {
    let chain = AxisChain {
        lag_s: 0.007,
        dead_time_s: 0.002,
        ..AxisChain::default()
    };
    Arm::sound(Kinematics::irb1600(), chain)
}

fn fault(cause: &'static str, joint: usize, places: usize, put: impl Fn(&mut Arm)) -> Fault {
    let mut arm = sound();
    put(&mut arm);
    Fault {
        cause,
        joint,
        places,
        arm,
    }
}

/// The upper arm turns with joint 2, the forearm with joint 3.
fn link(kinematics: &mut Kinematics, joint: usize) -> &mut f64 {
    match kinematics {
        Kinematics::Six { c2_m, c3_m, .. } => match joint {
            1 => c2_m,
            2 => c3_m,
            _ => panic!("no length behind joint {}", joint + 1),
        },
        Kinematics::Scara { .. } => panic!("not this arm"),
    }
}

fn faults(sign: f64) -> Vec<Fault> {
    let mut out = Vec::new();
    for joint in 0..3 {
        out.push(fault("joint_lag_mismatch", joint, 1, |a| {
            a.joints[joint].chain.lag_s += sign * 4e-4;
        }));
        out.push(fault("joint_backlash", joint, 1, |a| {
            a.joints[joint].chain.backlash_m = sign * 8e-5;
        }));
        // Friction that is compensated too much, a negative peak, is not named: that of no joint.
        if sign > 0.0 {
            out.push(fault("joint_reversal", joint, 1, |a| {
                a.joints[joint].chain.friction = Some(Friction {
                    peak_m: 8e-5,
                    decay_s: 0.04,
                    rise_s: 0.004,
                    presliding_m: 1e-5,
                });
            }));
            out.push(fault("joint_cyclic_error", joint, 1, |a| {
                a.joints[joint].gear = Some(Gear {
                    amplitude_rad: 3e-5,
                    waves: 121.0,
                    phase_rad: 0.7,
                });
            }));
        }
    }
    for joint in 1..3 {
        out.push(fault("joint_zero", joint, 4, |a| {
            a.joints[joint].zero_rad = sign * 5e-4;
        }));
        out.push(fault("link_length", joint, 4, |a| {
            *link(&mut a.real, joint) += sign * 3e-4;
        }));
    }
    out
}

/// A size in words, SI: the first number that a unit follows.
fn size(words: &str) -> f64 {
    let tokens: Vec<&str> = words
        .split([' ', ',', ':'])
        .filter(|t| !t.is_empty())
        .collect();
    let unit = |text: &str| {
        Some(match text {
            "µs" | "µm" | "µrad" => 1e-6,
            "ms" | "mm" | "mrad" => 1e-3,
            _ => return None,
        })
    };
    let found = tokens.windows(2).find_map(|pair| {
        let number: f64 = pair[0].parse().ok()?;
        Some(number * unit(pair[1])?)
    });
    found.unwrap_or_else(|| panic!("no size in: {words}"))
}

/// The joint that the words name, from 0.
fn joint_of(words: &str) -> usize {
    let rest = words
        .split_once("joint ")
        .unwrap_or_else(|| panic!("no joint in: {words}"))
        .1;
    let number: usize = rest[..1].parse().unwrap();
    number - 1
}

fn turn(arm: &mut Arm, words: &str) {
    let (says, size, joint) = (
        |part: &str| words.contains(part),
        size(words),
        joint_of(words),
    );
    let chain = &mut arm.joints[joint].chain;
    if says("later than the joints on average: raise its gain") {
        chain.lag_s -= size;
    } else if says("earlier than the joints on average: lower its gain") {
        chain.lag_s += size;
    } else if says("of play: take it up") {
        chain.backlash_m -= size;
    } else if says("lower its backlash compensation by") {
        chain.backlash_m += size;
    } else if says("raise its friction compensation") || says("lower its friction compensation") {
        // The size is one at the tool: the compensation is turned by most of what it lacks.
        let friction = chain.friction.as_mut().unwrap();
        let way = if says("raise") { 1.0 } else { -1.0 };
        friction.peak_m -= way * 0.8 * friction.peak_m.abs();
    } else if says("within each turn of its input: map it") {
        arm.joints[joint].gear.as_mut().unwrap().amplitude_rad -= size;
    } else if says("further than its controller reads") {
        arm.joints[joint].zero_rad -= size;
    } else if says("less far than its controller reads") {
        arm.joints[joint].zero_rad += size;
    } else if says("longer than the controller has it: enter its calibrated length") {
        *link(&mut arm.believed, joint) += size;
    } else if says("shorter than the controller has it: enter its calibrated length") {
        *link(&mut arm.believed, joint) -= size;
    } else {
        panic!("nothing to turn in: {words}");
    }
}

fn plan(places: usize) -> Plan {
    let grid = Grid {
        radii_m: vec![0.1, 0.15, 0.3],
        feeds_m_s: vec![0.02, 0.1, 0.3, 0.5, 0.7],
        samples: 360,
        ..Grid::paper()
    };
    let mut tests = Vec::new();
    for (centre, seed) in PLACES.iter().zip(0..places as u64) {
        let begun_s = tests
            .last()
            .map_or(0.0, |t: &giotto_tests::machine::Test| t.started_s + 120.0);
        for mut test in grid.plan(seed).tests {
            test.centre_m = *centre;
            test.plane = Plane::XY;
            test.started_s += begun_s;
            tests.push(test);
        }
    }
    let length_s = tests.last().map_or(0.0, |t| t.started_s + 60.0);
    Plan { tests, length_s }
}

/// Root mean square of the arm's circles less those of the sound one, m.
fn misfit_m(arm: &Arm, plan: &Plan) -> f64 {
    let sound = sound();
    let (mut sum, mut count) = (0.0, 0.0);
    // Every third circle holds all radii, feeds and places.
    for test in plan.tests.iter().step_by(3) {
        let [a, b] = [arm, &sound].map(|arm| {
            let places = simulate(arm, test).unwrap().position_m;
            let radii = places.into_iter().map(|p| test.plane.radius(p));
            radii.collect::<Vec<f64>>()
        });
        sum += a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        count += a.len() as f64;
    }
    (sum / count).sqrt()
}

fn wrong(fault: &Fault, seed: u64) -> Option<String> {
    let instrument = Instrument {
        noise_m: 1e-6,
        spread: Spread {
            radius_m: 1e-6,
            ..Instrument::perfect().spread
        },
        offset_m: [3e-5, -2e-5],
        sees_angle: true,
        tick_s: 1e-3,
        ..Instrument::perfect()
    };
    let plan = plan(fault.places);
    let hidden = Hidden {
        name: fault.cause.to_owned(),
        seed,
        strength: 1.0,
        noise_m: instrument.noise_m,
        scatter_m: instrument.spread.radius_m,
        truth: Vec::new(),
        campaign: instrument.watch(&plan, seed, |test, _| simulate(&fault.arm, test).unwrap()),
        perfect_um: None,
        model: None,
        kinematics: Some(sound().believed.block()),
        spoilt: None,
    };
    let folder = tempfile::tempdir().unwrap();
    files::write(&hidden, folder.path()).unwrap();
    let campaign = giotto::campaign::read(folder.path()).unwrap();
    let found = diagnose(&campaign, &Options::default()).unwrap();
    let joint = format!("joint{}", fault.joint + 1);
    let named =
        |f: &&Finding| f.cause.id() == fault.cause && f.actuators.iter().any(|a| a.name() == joint);
    let what = format!("{} of {joint}, seed {seed}", fault.cause);
    let Some(finding) = found.findings.iter().find(named) else {
        let all: Vec<String> = found.findings.iter().map(Finding::title).collect();
        return Some(format!("{what}: found is {all:?}"));
    };
    let before = misfit_m(&fault.arm, &plan);
    let mut turned = fault.arm.clone();
    turn(&mut turned, &finding.remedy);
    let after = misfit_m(&turned, &plan);
    // Written so that a misfit that is no number fails.
    let fell = before > 0.5e-6 && after < 0.4 * before;
    (!fell).then(|| {
        let [before, after] = [before, after].map(|m| m * 1e6);
        format!("{what}: {before:.2} -> {after:.2} µm: {}", finding.remedy)
    })
}

#[test]
fn turned_as_the_finding_says_the_arm_comes_nearer_to_a_sound_one() {
    let all: Vec<Fault> = [1.0, -1.0].into_iter().flat_map(faults).collect();
    let joints = giotto::causes::ALL.iter().map(|model| model.words().id);
    for id in joints.filter(|id| id.starts_with("joint_") || *id == "link_length") {
        assert!(all.iter().any(|f| f.cause == id), "{id} is not turned");
    }
    let wrong: Vec<String> = all
        .par_iter()
        .enumerate()
        .filter_map(|(seed, fault)| wrong(fault, 40 + seed as u64))
        .collect();
    assert!(
        wrong.is_empty(),
        "{} of {}: {wrong:#?}",
        wrong.len(),
        all.len()
    );
}
