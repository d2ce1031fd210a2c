//! The arm of the hidden-effect tests against closed forms that it does not know, and its campaigns as files.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of a test fail as the test does"
)]
use giotto::campaign::Direction;
use giotto_tests::arm::{ARM_EFFECTS, Arm, Gear, Kinematics, Setting, hidden, simulate};
use giotto_tests::effects::Hidden;
use giotto_tests::files;
use giotto_tests::machine::{AxisChain, Plane, Test};
use giotto_tests::study::{Outcome, judge};
use rayon::prelude::*;
use std::f64::consts::PI;

const N: usize = 720;

fn test(radius_m: f64, feed_m_s: f64, direction: Direction, centre_m: [f64; 3]) -> Test {
    Test {
        radius_m,
        feed_m_s,
        direction,
        start_angle_rad: 0.0,
        started_s: 0.0,
        samples: N,
        plane: Plane::XY,
        centre_m,
        from_rest: false,
    }
}

fn scara() -> Kinematics {
    Kinematics::Scara {
        l1_m: 0.4,
        l2_m: 0.35,
        positive: true,
    }
}

/// Radii about the mean place, m: the centre of a turned or shifted circle does not count.
fn radii(arm: &Arm, t: &Test) -> Vec<f64> {
    let lap = simulate(arm, t).unwrap();
    let n = lap.position_m.len() as f64;
    let centre = [0, 1, 2].map(|k| lap.position_m.iter().map(|p| p[k]).sum::<f64>() / n);
    lap.position_m
        .iter()
        .map(|p| t.plane.radius([0, 1, 2].map(|k| p[k] - centre[k])))
        .collect()
}

fn mean(r: &[f64]) -> f64 {
    r.iter().sum::<f64>() / r.len() as f64
}

/// Own inverse, own forward: an arm that follows its command draws the circle, late or not.
#[test]
fn a_perfect_arm_draws_perfect_circles() {
    for (kinematics, centre) in [
        (scara(), [0.42, 0.12, 0.0]),
        (Kinematics::irb1600(), [-0.29, 0.987, 0.615]),
    ] {
        let arm = Arm::sound(kinematics.clone(), AxisChain::default());
        let delayed = Arm::sound(
            kinematics,
            AxisChain {
                dead_time_s: 0.004,
                ..AxisChain::default()
            },
        );
        let t = test(0.1, 0.5, Direction::Cw, centre);
        for arm in [arm, delayed] {
            for r in radii(&arm, &t) {
                assert!((r - 0.1).abs() < 2e-9, "{r}");
            }
        }
    }
}

/// Joints that lag unequally move the mean radius by −½·f·d·(A12 − A21), A = J·diag(τ)·J⁻¹, at any radius.
#[test]
fn unequal_lags_move_the_mean_as_the_jacobian_says() {
    let tau = [3e-4, 0.0];
    let mut arm = Arm::sound(scara(), AxisChain::default());
    for (joint, tau) in arm.joints.iter_mut().zip(tau) {
        joint.chain.dead_time_s = tau;
    }
    let centre = [0.42, 0.12, 0.0];
    let q = arm.believed.inverse(centre).unwrap();
    let [a, b] = [0, 1].map(|k| arm.believed.lever(&q, k));
    let det = a[0] * b[1] - b[0] * a[1];
    // A = τ1·a·(row 1 of J⁻¹) with τ2 = 0.
    let a12 = tau[0] * a[0] * -b[0] / det;
    let a21 = tau[0] * a[1] * b[1] / det;
    for (radius, feed) in [(0.02, 0.1), (0.02, 0.2), (0.04, 0.2)] {
        let mean_of = |direction| mean(&radii(&arm, &test(radius, feed, direction, centre)));
        let odd = 0.5 * (mean_of(Direction::Ccw) - mean_of(Direction::Cw));
        let want = -0.5 * feed * (a12 - a21);
        assert!((odd - want).abs() < 0.03 * want.abs(), "{odd:e} {want:e}");
    }
}

/// A gear's error is a chirp in the joint's angle, seen through the lever of the joint.
#[test]
fn a_gear_error_is_a_chirp_of_the_joints_angle() {
    let mut arm = Arm::sound(scara(), AxisChain::default());
    let gear = Gear {
        amplitude_rad: 2e-5,
        waves: 100.0,
        phase_rad: 0.4,
    };
    arm.joints[1].gear = Some(gear);
    let t = test(0.1, 0.2, Direction::Ccw, [0.42, 0.12, 0.0]);
    let lap = simulate(&arm, &t).unwrap();
    for (k, p) in lap.position_m.iter().enumerate() {
        let (s, c) = (2.0 * PI * k as f64 / N as f64).sin_cos();
        let place = [0.42 + 0.1 * c, 0.12 + 0.1 * s, 0.0];
        let q = arm.believed.inverse(place).unwrap();
        let lever = arm.believed.lever(&q, 1);
        let error = gear.amplitude_rad * (gear.waves * q[1] + gear.phase_rad).sin();
        let want = error * (c * lever[0] + s * lever[1]);
        let got = p[0].hypot(p[1]) - 0.1;
        assert!((got - want).abs() < 5e-9, "{k}: {got:e} {want:e}");
    }
}

/// Play shows a step where the joint turns, not where a coordinate does.
#[test]
fn play_steps_where_the_joint_reverses() {
    let mut arm = Arm::sound(scara(), AxisChain::default());
    arm.joints[0].chain.backlash_m = 1e-4;
    let t = test(0.1, 0.05, Direction::Ccw, [0.42, 0.12, 0.0]);
    let lap = simulate(&arm, &t).unwrap();
    let angle = |k: usize| {
        let (s, c) = (2.0 * PI * k as f64 / N as f64).sin_cos();
        arm.believed
            .inverse([0.42 + 0.1 * c, 0.12 + 0.1 * s, 0.0])
            .unwrap()
    };
    for (k, p) in lap.position_m.iter().enumerate() {
        let q = angle(k);
        let speed = angle((k + 1) % N)[0] - angle((k + N - 1) % N)[0];
        if speed.abs() < 4e-4 {
            continue;
        }
        // Taken back by half the gap behind the motion.
        let (s, c) = (2.0 * PI * k as f64 / N as f64).sin_cos();
        let lever = arm.believed.lever(&q, 0);
        let want = -0.5e-4 * speed.signum() * (c * lever[0] + s * lever[1]);
        let got = p[0].hypot(p[1]) - 0.1;
        assert!((got - want).abs() < 5e-8, "{k}: {got:e} {want:e}");
    }
}

fn setting(six: bool, effects: &[&str], places: usize) -> Setting {
    Setting {
        six,
        effects: effects.iter().map(|s| (*s).to_owned()).collect(),
        strength: 3.0,
        places,
        robot: false,
        given: true,
    }
}

/// Sizes reach the misfit that was asked for, and files carry the kinematics and the places.
#[test]
fn campaigns_of_arms_have_their_misfit_and_their_block() {
    let cases: Vec<(bool, &str)> = [false, true]
        .iter()
        .flat_map(|six| ARM_EFFECTS.map(|name| (*six, name)))
        .collect();
    cases.par_iter().for_each(|(six, name)| {
        let case = hidden(&setting(*six, &[name], 1), 21).unwrap();
        let wanted = 3.0 * case.noise_m.hypot(case.scatter_m);
        let reached = case.truth[0].misfit_m / wanted;
        assert!((reached - 1.0).abs() < 0.1, "{name}: {reached}");
        let left = case.perfect_um.unwrap() * 1e-6;
        assert!(
            left < 1.6 * wanted / 3.0,
            "{name}: {left:e} is more than all noise"
        );
    });
    let case = hidden(&setting(true, &["joint_backlash"], 4), 22).unwrap();
    let dir = tempfile::tempdir().unwrap();
    files::write(&case, dir.path()).unwrap();
    let toml = std::fs::read_to_string(dir.path().join("campaign.toml")).unwrap();
    assert!(toml.contains("[kinematics]\nmodel = \"opw\"\na1_mm = 150.0"));
    assert!(toml.contains("centre_mm = [-290.0, 987.0, 615.0]"));
    assert_eq!(toml.matches("[[run]]").count(), 120);
}

fn answer(case: &Hidden) -> Outcome {
    let dir = tempfile::tempdir().unwrap();
    files::write(case, dir.path()).unwrap();
    Outcome::of(dir.path()).unwrap()
}

/// What came out wrong of these settings, one seed each.
fn wrong(settings: &[Setting], from: u64) -> Vec<String> {
    settings
        .par_iter()
        .enumerate()
        .filter_map(|(row, setting)| {
            let case = hidden(setting, from + row as u64).unwrap();
            let v = judge(&case, &answer(&case));
            let right = v.exact && v.axis.iter().all(|a| *a);
            (!right || (case.truth.is_empty() && v.unexplained))
                .then(|| format!("{}, seed {}: {}", case.name, case.seed, v.said))
        })
        .collect()
}

#[test]
fn nothing_is_found_in_a_sound_arm() {
    let wrong = wrong(&[setting(false, &[], 1), setting(true, &[], 1)], 700);
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn single_effects_of_joints_are_named_with_their_joint() {
    let all: Vec<Setting> = [false, true]
        .iter()
        .flat_map(|six| ARM_EFFECTS.map(|name| setting(*six, &[name], 1)))
        .collect();
    let wrong = wrong(&all, 710);
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn four_places_tell_a_zero_from_a_link() {
    let all: Vec<Setting> = [false, true]
        .iter()
        .flat_map(|six| ["joint_zero", "link_length"].map(|name| setting(*six, &[name], 4)))
        .collect();
    let wrong = wrong(&all, 730);
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn pairs_of_joint_effects_are_taken_apart() {
    let all = [
        setting(false, &["joint_backlash", "joint_lag_mismatch"], 1),
        setting(true, &["joint_reversal", "joint_cyclic_error"], 1),
    ];
    let wrong = wrong(&all, 740);
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn an_arm_without_kinematics_gets_no_slides_cause() {
    let all: Vec<Setting> = [false, true]
        .map(|six| Setting {
            given: false,
            ..setting(six, &[], 1)
        })
        .to_vec();
    let named: Vec<String> = all
        .iter()
        .zip(750_u64..)
        .filter_map(|(setting, seed)| {
            let case = hidden(setting, seed).unwrap();
            let v = judge(&case, &answer(&case));
            (!v.false_findings.is_empty()).then(|| format!("{}: {}", case.name, v.said))
        })
        .collect();
    assert!(named.is_empty(), "{named:#?}");
}
