//! The law against a machine in the time domain: joints that lag, with play, gears and wrong lengths, stepped in small steps.
use super::*;
use crate::Actuator;
use crate::circle;
use crate::kinematics::{IRB1600, PAPER_CENTRE_M as CENTRE, path};
use crate::model::{Cumulants, Element};
use crate::term::{Term, merged};
use core::f64::consts::TAU;
use std::vec::Vec;

const TICK_S: f64 = 1e-3;
const PACE: Pace<f64> = Pace {
    tick_s: TICK_S,
    turn_s: 8e-3,
};
const KV: f64 = 50.0;
const TURN_TICKS: usize = 1570;
const OMEGA: f64 = TAU / (TURN_TICKS as f64 * TICK_S);

fn arm() -> Kinematics<f64> {
    Kinematics::Opw(IRB1600)
}

/// R 100 mm from +X on, with its derivatives; a negative rate is clockwise.
fn circle(omega: f64, time_s: f64) -> [[f64; 3]; 5] {
    core::array::from_fn(|order| {
        let (sin, cos) = (omega * time_s).sin_cos();
        let size = 0.1 * omega.powi(order as i32);
        let [x, y] = [
            [cos, sin],
            [-sin, cos],
            [-cos, -sin],
            [sin, -cos],
            [cos, sin],
        ][order];
        let [cx, cy, cz] = if order == 0 { CENTRE } else { [0.0; 3] };
        [cx + size * x, cy + size * y, cz]
    })
}

/// A joint: first-order lag, then play.
#[derive(Clone, Copy)]
struct Joint {
    follower: f64,
    played: f64,
}

/// Out-of-roundness (half of highest less lowest) and radius error over the last of two turns, m: the plant knows nothing of
/// the law.
fn run(errors: &ArmErrors<f64>, law: Option<&ArmLaw<f64>>, omega: f64) -> [f64; 2] {
    let kinematics = arm();
    let operator = Operator::new(&Element::Lag { kv_per_s: KV }.cumulants());
    let actual = kinematics.with_links(&errors.longer_m);
    let mut sides = JointSides::default();
    let mut joints: Option<[Joint; 6]> = None;
    let ticks = 2 * TURN_TICKS;
    let mut places: Vec<[f64; 2]> = Vec::new();
    for tick in 0..ticks {
        let derivatives = circle(omega, tick as f64 * TICK_S);
        let [mut command, _, second, _, fourth] = derivatives;
        if let Some(law) = law {
            let offset = law.offset(&path(&derivatives), &mut sides).unwrap();
            for axis in 0..3 {
                command[axis] += operator.offset(second[axis], fourth[axis]) + offset[axis];
            }
        }
        let q = kinematics.angles(command).unwrap();
        let state = joints.get_or_insert_with(|| {
            q.map(|q| Joint {
                follower: q,
                played: q,
            })
        });
        let mut out = [0.0; 6];
        for (k, (joint, wrong)) in state.iter_mut().zip(&errors.joint).enumerate() {
            let tau = 1.0 / KV + wrong.lag_s;
            // The drive goes on where the closed form begins a new turn.
            let way = q[k] - joint.follower;
            let way = way - TAU * (way / TAU).round();
            joint.follower += way * (1.0 - (-TICK_S / tau).exp());
            let half = 0.5 * wrong.play_rad;
            let follower = joint.follower;
            joint.played = joint.played.clamp(follower - half, follower + half);
            let gear = wrong.gear[0];
            let wave = gear.amplitude_rad * (gear.waves * joint.played + gear.phase_rad).sin();
            out[k] = joint.played + wrong.zero_rad + wave;
        }
        if tick >= ticks / 2 {
            let [x, y, _] = actual.place(&out);
            places.push([x, y]);
        }
    }
    let fit = circle::fit(places.as_slice()).unwrap().circle;
    let [cx, cy] = fit.centre;
    let radii = places.iter().map(|p| (p[0] - cx).hypot(p[1] - cy));
    let (low, high) = radii.fold((f64::MAX, f64::MIN), |(low, high), r| {
        (r.min(low), r.max(high))
    });
    [0.5 * (high - low), fit.radius - 0.1]
}

fn law(errors: &ArmErrors<f64>) -> ArmLaw<f64> {
    let cumulants: Cumulants<f64> = Element::Lag { kv_per_s: KV }.cumulants();
    ArmLaw::new(arm(), Common::new(&cumulants), *errors, Some(CENTRE), &PACE).unwrap()
}

fn errors(terms: &[Term<f64>]) -> ArmErrors<f64> {
    merged(terms).unwrap().arm
}

/// Errors with the share of roundness that they may leave.
fn cases() -> [(&'static str, ArmErrors<f64>, f64); 6] {
    let [base, shoulder, elbow, ..] = Actuator::JOINTS;
    let lag = Term::JointLag {
        actuator: shoulder,
        delta_tau_s: 2e-3,
        delta_kappa2_s2: 2.0 * 2e-3 / KV,
    };
    let zero = Term::JointZero {
        actuator: elbow,
        offset_rad: 1e-3,
    };
    let length = Term::LinkLength {
        actuator: shoulder,
        longer_m: 1e-3,
    };
    let play = Term::JointBacklash {
        actuator: base,
        play_rad: 4e-4,
        loop_s: 1.0 / KV,
    };
    let gear = Term::JointCyclic {
        actuator: shoulder,
        amplitude_rad: 1e-4,
        waves: 100.0,
        phase_rad: 0.3,
    };
    [
        ("no defect", errors(&[]), 0.02),
        ("lag", errors(&[lag]), 0.05),
        ("zero", errors(&[zero]), 0.05),
        ("length", errors(&[length]), 0.05),
        ("play", errors(&[play]), 0.1),
        ("gear", errors(&[gear]), 0.3),
    ]
}

#[test]
fn what_is_wrong_with_a_joint_is_undone_through_the_joint() {
    for (name, errors, left) in cases() {
        for omega in [OMEGA, -OMEGA] {
            let [round, size] = run(&errors, None, omega);
            let [round_after, size_after] = run(&errors, Some(&law(&errors)), omega);
            std::println!("{name} {omega}: {round:e} {size:e} -> {round_after:e} {size_after:e}");
            assert!(round_after < left * round + 0.5e-6, "{name} {omega}");
            assert!(size_after.abs() < 0.05 * size.abs(), "{name} {omega}");
        }
    }
}

/// The operator alone knows no joints: an arm without defect keeps its ovals.
#[test]
fn the_operator_alone_leaves_the_ovals_of_an_arm() {
    let none = ArmErrors::default();
    let blind = ArmLaw::new(arm(), Common::default(), none, None, &PACE).unwrap();
    let [before, _] = run(&none, None, OMEGA);
    let [blind, _] = run(&none, Some(&blind), OMEGA);
    let [knowing, _] = run(&none, Some(&law(&none)), OMEGA);
    assert!(
        blind > 0.5 * before && knowing < 0.02 * before,
        "{before} {blind} {knowing}"
    );
}
