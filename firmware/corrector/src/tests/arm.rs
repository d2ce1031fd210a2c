//! A robot behind the corrector: its joints lag by themselves, and what they draw is measured at the tool.
use super::*;
use giotto_shared::circle;
use giotto_shared::kinematics::{IRB1600, Kinematics, PAPER_CENTRE_M as CENTRE_M};
use giotto_shared::table::Arm;
use std::f64::consts::TAU;

const TICK_S: f64 = 0.004;
const LAP_S: f64 = 1.6;
const REST_TICKS: f64 = 200.0;

fn irb1600() -> Kinematics<f64> {
    Kinematics::Opw(IRB1600)
}

/// A table whose arm it is told, or not.
fn image(terms: &[Term<f32>], told: bool) -> Vec<u8> {
    let zone = Zone {
        place_m: None,
        radius_m: [0.02, 0.2],
        feed_m_s: [0.02, 0.7],
        travel: Travel::Both,
        cumulants: cumulants(),
        terms: terms.iter().copied().filter(|_| told).collect(),
    };
    let table = Table {
        machine: "robot".try_into().unwrap(),
        zones: [zone].into_iter().collect(),
        limits: Limits {
            offset_m: 0.005,
            slew_m_s: 0.1,
        },
        arm: told.then(|| Arm {
            kinematics: irb1600().map(|value| value as f32),
            home_m: Some(CENTRE_M.map(|m| m as f32)),
        }),
    };
    let mut bytes = std::vec![0; MAX_IMAGE_BYTES];
    let length = image::encode(&table, &mut bytes).unwrap();
    bytes.truncate(length);
    bytes
}

/// Out-of-roundness and radius error of the third lap, m; joint 2 has so many ticks of dead time.
fn measured(image: Option<&[u8]>, late_ticks: usize, lead_s: Option<f64>) -> [f64; 2] {
    let mut settings = Settings::new(3, "XYZ", 1.0).unwrap();
    settings.lead_s = lead_s;
    let mut corrector = Box::new(Corrector::new(settings));
    if let Some(image) = image {
        corrector.load(image).unwrap();
    }
    let arm = irb1600();
    let mut joints: Option<Vec<Joint>> = None;
    let mut late = VecDeque::new();
    let mut drawn = Vec::new();
    let lap = (LAP_S / TICK_S).round() as usize;
    let mut feedback = [0.0; JOINTS];
    for tick in 0..4 * lap {
        // At rest at first, then slowly up to speed over a lap.
        let t = ((tick as f64 - REST_TICKS) * TICK_S / LAP_S).max(0.0);
        let turns = if t < 1.0 { t * t / 2.0 } else { t - 0.5 };
        let (sin, cos) = (TAU * turns).sin_cos();
        let place_mm = [0.1 * cos, 0.1 * sin, 0.0]
            .into_iter()
            .zip(CENTRE_M)
            .map(|(a, c)| (a + c) * 1e3);
        let mut command = [0.0; JOINTS];
        for (command, place) in command.iter_mut().zip(place_mm) {
            *command = place;
        }
        let mut input = input(command, feedback);
        input.enable = image.is_some();
        let out = corrector.tick(&input, TICK_S);
        feedback = out.command;
        let mut place = [0.0; 3];
        for k in 0..3 {
            place[k] = out.command[k] * 1e-3;
        }
        let q = arm.angles(place).unwrap();
        let state = joints
            .get_or_insert_with(|| q.iter().map(|q| Joint::new(*q, TICK_S, [0.0; 2])).collect());
        let mut now = [0.0; 6];
        for k in 0..6 {
            // The drive goes on where the closed form begins a new turn.
            let way = q[k] - state[k].driven;
            let goal = state[k].driven + way - TAU * (way / TAU).round();
            now[k] = state[k].tick(goal, TICK_S);
        }
        late.push_back(now[1]);
        if late.len() > late_ticks {
            now[1] = late.pop_front().unwrap();
        }
        if tick >= 3 * lap {
            let [x, y, _] = arm.place(&now);
            drawn.push([x, y]);
        }
    }
    let fit = circle::fit(drawn.as_slice()).unwrap().circle;
    let [cx, cy] = fit.centre;
    let radii = drawn.iter().map(|p| (p[0] - cx).hypot(p[1] - cy));
    let (low, high) = radii.fold((f64::MAX, f64::MIN), |(low, high), r| {
        (r.min(low), r.max(high))
    });
    [0.5 * (high - low), fit.radius - 0.1]
}

#[test]
fn a_robot_is_corrected_through_its_joints() {
    let lag = Term::JointLag {
        actuator: Actuator::Joint2,
        delta_tau_s: 8e-3,
        delta_kappa2_s2: 0.0,
    };
    // Ahead of a robot the path is foreseen along its circle; the third derivative, which does not show on it, is left out.
    for (name, late_ticks, terms) in [("no defect", 0, &[][..]), ("joint 2 is late", 2, &[lag])] {
        for (mode, lead_s, most) in [("delayed", None, 0.03), ("ahead", Some(0.008), 0.12)] {
            let [round, size] = measured(None, late_ticks, lead_s);
            let [blind, _] = measured(Some(&image(terms, false)), late_ticks, lead_s);
            let [round_after, size_after] = measured(Some(&image(terms, true)), late_ticks, lead_s);
            std::println!(
                "{name}, {mode}: {:.1} {:.1} um, by the place alone {:.1}, by joints {:.2} {:.2}",
                round * 1e6,
                size * 1e6,
                blind * 1e6,
                round_after * 1e6,
                size_after * 1e6
            );
            assert!(
                round_after < most * round && blind > 0.5 * round,
                "{name} {mode}"
            );
            assert!(size_after.abs() < 0.02 * size.abs(), "{name} {mode}");
        }
    }
}
