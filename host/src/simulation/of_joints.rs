//! Signatures of joints against the arm in motion: every cause of a joint, on every joint that it can have.
use super::{Arm, CircleTest, Machine, circle};
use crate::campaign::{Campaign, Run, Samples};
use crate::causes::{ALL, Cause, Effect, RunView, Site};
use crate::diagnosis::survey::{Response, Survey};
use crate::kinematics::{Branch, Elbow, Kinematics, Robot, Scara};
use crate::simulation::machine::PositionLoop;
use giotto_shared::{Direction, Frame};
use std::f64::consts::TAU;

const SAMPLES: usize = 720;

fn arms() -> [(Kinematics, [f64; 3], f64); 2] {
    let two = Kinematics::Scara(Scara {
        l1_m: 0.475,
        l2_m: 0.720,
        elbow: Elbow::Positive,
    });
    let robot = Robot::named("abb-irb1600-6-1.45").unwrap();
    let six = robot.with([0.0, 0.065, 0.149], [0.0, 0.0, 1.0, 0.0], Branch::ElbowUp);
    [
        (two, [0.76, 0.25, 0.6], 0.1),
        (Kinematics::Opw(six), [-0.29, 0.987, 0.615], 0.15),
    ]
}

fn test(centre_m: [f64; 3], radius_m: f64, feed_m_s: f64, direction: Direction) -> CircleTest {
    CircleTest {
        centre_m,
        samples: Some(SAMPLES),
        ..CircleTest::new(radius_m, feed_m_s, direction)
    }
}

/// The arm with a common lag and one effect.
fn machine(kinematics: Kinematics, kv_per_s: f64, effect: Option<&Effect>) -> Machine {
    let servo = PositionLoop {
        kv_per_s,
        feed_forward: 0.0,
    };
    let mut machine = Machine {
        servo: [servo; 3],
        arm: Some(Arm::sound(kinematics)),
        ..Machine::default()
    };
    if let Some(effect) = effect {
        effect.cause().model().apply(effect, &mut machine);
    }
    machine.check().unwrap();
    machine
}

/// The view of one circle, its machine angle behind the command by the lag of the loop.
fn view(kinematics: Kinematics, test: &CircleTest, kv_per_s: f64) -> RunView {
    let sign = f64::from(test.direction.sign());
    let angle_rad: Vec<f64> = (0..SAMPLES)
        .map(|k| sign * TAU * k as f64 / SAMPLES as f64)
        .collect();
    let run = Run {
        file: "r.csv".to_owned(),
        radius_m: test.radius_m,
        feed_m_s: test.feed_m_s,
        direction: test.direction,
        start_angle_rad: 0.0,
        started_s: Some(0.0),
        temperature_c: None,
        centre_m: Some(test.centre_m),
        frame: Frame::default(),
        setup: None,
        samples: Samples {
            deviation_m: vec![0.0; SAMPLES],
            time_s: None,
            angle_inferred: true,
            angle_rad,
        },
    };
    let campaign = Campaign {
        kinematics: Some(kinematics),
        runs: vec![run],
        ..Campaign::default()
    };
    let response = Response {
        a_s2: kv_per_s.powi(-2),
        b_s4: 0.0,
    };
    let (mut runs, _) = Survey::new(&campaign).prepare(&response, 0.0);
    runs.remove(0).view
}

fn energy(values: impl Iterator<Item = f64>) -> f64 {
    (values.map(|v| v * v).sum::<f64>() / SAMPLES as f64).sqrt()
}

/// Without mean-free harmonics of order 1: the centre is the operator's.
fn centred(values: &[f64]) -> Vec<f64> {
    let n = values.len() as f64;
    let wave = |k: usize| (TAU * k as f64 / n).sin_cos();
    let (mut s, mut c) = (0.0, 0.0);
    for (k, v) in values.iter().enumerate() {
        let (sin, cos) = wave(k);
        s += 2.0 / n * v * sin;
        c += 2.0 / n * v * cos;
    }
    values
        .iter()
        .enumerate()
        .map(|(k, v)| v - s * wave(k).0 - c * wave(k).1)
        .collect()
}

/// The baseline is what the arm in motion does when all its joints lag alike: to a hundredth of what slides would miss.
#[test]
fn equal_joints_are_the_baseline() {
    for (kinematics, centre, radius) in arms() {
        for direction in [Direction::Ccw, Direction::Cw] {
            let test = test(centre, radius, 0.7, direction);
            let kv = 120.0;
            let moved = circle(&machine(kinematics, kv, None), &test).deviation_m;
            let view = view(kinematics, &test, kv);
            let arm = view.arm.as_ref().unwrap();
            let common: Vec<f64> = view.psi_rad.iter().map(|psi| arm.common.at(*psi)).collect();
            let off = energy(moved.iter().zip(&common).map(|(a, b)| a - b));
            let mean = arm.common.0[0][0];
            let shape = energy(moved.iter().map(|m| m - mean));
            assert!(off < 0.01 * shape, "{kinematics:?}: {off:e} of {shape:e}");
            assert!(off < 2e-7, "{off:e}");
        }
    }
}

/// An effect of some tens of micrometres, the shape of its signature, and the share of it that the closed form may miss.
fn example(cause: Cause, site: Site) -> Option<(Effect, Vec<f64>, f64)> {
    let (value, params, shape, share): (f64, Vec<(&str, f64)>, Vec<f64>, f64) = match cause {
        Cause::JointLagMismatch => (2e-4, vec![("turned", 1.0)], vec![1.0], 2e-2),
        Cause::BandwidthMismatch => (2e-5, vec![], vec![], 2e-2),
        Cause::JointReversal => (
            40.0,
            vec![
                ("decay_s", 0.05),
                ("rise_s", 0.006),
                ("presliding_mrad", 0.01),
                ("arm_mm", 500.0),
            ],
            vec![0.05, 0.006, 1e-5],
            6e-2,
        ),
        Cause::JointBacklash => (0.1, vec![("smoothed_s", 0.008)], vec![1e-4, 0.008], 5e-2),
        Cause::JointCyclicError => (
            0.05,
            vec![("ratio", 121.0), ("phase_rad", 0.7)],
            vec![121.0],
            2e-2,
        ),
        // Small: what shifts the circle by e also changes its mean by e²/(4R), which no signature has.
        Cause::JointZero | Cause::LinkLength => (0.1, vec![], vec![], 1e-2),
        _ => return None,
    };
    let effect = Effect::new(cause, site, value, [value; 2], params).unwrap();
    Some((effect, shape, share))
}

#[test]
fn every_joint_shows_its_causes_as_its_signatures_say() {
    let kv = 150.0;
    let mut seen = 0;
    for (kinematics, centre, radius) in arms() {
        for direction in [Direction::Ccw, Direction::Cw] {
            let test = test(centre, radius, 0.2, direction);
            let view = view(kinematics, &test, kv);
            let sound = circle(&machine(kinematics, kv, None), &test).deviation_m;
            for model in ALL {
                for site in model.sites(std::slice::from_ref(&view)) {
                    let Some((effect, shape, share)) = example(model.cause(), site) else {
                        continue;
                    };
                    seen += 1;
                    let moved = circle(&machine(kinematics, kv, Some(&effect)), &test).deviation_m;
                    let added: Vec<f64> = moved.iter().zip(&sound).map(|(a, b)| a - b).collect();
                    let mut columns = vec![vec![0.0; SAMPLES]; model.columns()];
                    for (at, column) in columns.iter_mut().enumerate() {
                        model.signature(site, &shape, at, &view, column);
                    }
                    let mut value = effect.value();
                    if let (Cause::JointReversal, Site::One(joint)) = (model.cause(), site) {
                        // Stated at another distance than that of this circle.
                        value *= view.arm.as_ref().unwrap().arms_m[joint.index()] / 0.5;
                    }
                    let amounts = match columns.len() {
                        2 => [value * 0.7f64.cos(), value * 0.7f64.sin()],
                        _ => [value, 0.0],
                    };
                    let stated: Vec<f64> = (0..SAMPLES)
                        .map(|i| columns.iter().zip(amounts).map(|(c, a)| a * c[i]).sum())
                        .collect();
                    let (stated, added) = (centred(&stated), centred(&added));
                    let whole = energy(stated.iter().copied());
                    let off = energy(stated.iter().zip(&added).map(|(a, b)| a - b));
                    assert!(
                        off < share * whole || off < 2e-8,
                        "{} at {site:?}, {direction:?}: {off:e} of {whole:e}",
                        model.words().id
                    );
                }
            }
        }
    }
    // Two links: lag, bandwidth, and up to 2 of the other five; six joints: up to 6 of each.
    assert!(seen > 2 * (2 + 5 + 6 * 4), "{seen}");
}
