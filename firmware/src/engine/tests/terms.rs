//! Each profile term: what is left on a circle when the machine has the error and the controller its opposite.
use super::{run_out, std, table};
use crate::engine::{CircleRun, Config, Engine, Output, flag};
use giotto_shared::term::Term;
use giotto_shared::{Actuator, Direction, Frame, Plane};
use std::vec::Vec;

const RADIUS: f64 = 0.1;
const CENTRE: [f64; 3] = [0.03, -0.05, 0.2];
const DT: f64 = 1e-3;

/// The machine's error at each set-point, m, written down from the docs of [`Term`] with each slide's velocity and
/// acceleration taken from the path by central differences.
fn error(term: &Term<f32>, frame: &Frame, path: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut turned = [0usize; 3];
    let at = |n: isize| path[n.clamp(0, path.len() as isize - 1) as usize];
    (0..path.len() as isize)
        .map(|n| {
            let here = at(n);
            for (i, turned) in turned.iter_mut().enumerate() {
                if (here[i] - at(n - 1)[i]) * (at(n - 1)[i] - at(n - 2)[i]) < 0.0 {
                    *turned = n as usize;
                }
            }
            error_at(
                term,
                frame,
                |k| at(n + k),
                |i| (n as usize - turned[i]) as f64 * DT,
            )
        })
        .collect()
}

/// At one set-point: the path so many ticks away, and the time since each slide reversed.
fn error_at(
    term: &Term<f32>,
    frame: &Frame,
    path: impl Fn(isize) -> [f64; 3],
    since_s: impl Fn(usize) -> f64,
) -> [f64; 3] {
    let w = f64::from;
    let velocity = |i: usize| (path(1)[i] - path(-1)[i]) / (2.0 * DT);
    // Ten ticks apart: the set-points' nanometre would be 1e-3 m/s² from one tick to the next.
    let acceleration =
        |i: usize| (path(10)[i] - 2.0 * path(0)[i] + path(-10)[i]) / (100.0 * DT * DT);
    let rel = |i: usize| path(0)[i] - CENTRE[i];
    let mut e = [0.0; 3];
    let pair = |plane: Plane| plane.axes().map(Actuator::index);
    match *term {
        Term::RadiusOffset { offset_m } => {
            let along = |axis: [f64; 3]| (0..3).map(|i| axis[i] * rel(i)).sum::<f64>();
            let (u, v) = (along(frame.first()), along(frame.second()));
            let r = u.hypot(v);
            e = [0, 1, 2].map(|i| w(offset_m) * (u * frame.first()[i] + v * frame.second()[i]) / r);
        }
        Term::ScaleError { relative } => e = [0, 1, 2].map(|i| w(relative) * rel(i)),
        Term::AxisScale { actuator, relative } => {
            let i = actuator.index();
            e[i] = w(relative) * rel(i);
        }
        Term::ScaleMismatch { plane, relative } => {
            let [a, b] = pair(plane);
            (e[a], e[b]) = (0.5 * w(relative) * rel(a), -0.5 * w(relative) * rel(b));
        }
        Term::Squareness { plane, shear_rad } => {
            let [a, b] = pair(plane);
            (e[a], e[b]) = (0.5 * w(shear_rad) * rel(b), 0.5 * w(shear_rad) * rel(a));
        }
        Term::ServoMismatch { plane, delta_tau_s } => {
            let [a, b] = pair(plane);
            let k = 0.5 * w(delta_tau_s);
            (e[a], e[b]) = (-k * velocity(a), k * velocity(b));
        }
        Term::BandwidthMismatch {
            plane,
            delta_kappa2_s2,
        } => {
            let [a, b] = pair(plane);
            let k = 0.25 * w(delta_kappa2_s2);
            (e[a], e[b]) = (k * acceleration(a), -k * acceleration(b));
        }
        Term::Backlash { actuator, step_m } => {
            let i = actuator.index();
            e[i] = -0.5 * w(step_m) * velocity(i).signum();
        }
        Term::LateralPlay {
            actuator,
            across,
            shift_m,
        } => {
            let forward = Plane::ALL
                .iter()
                .any(|plane| plane.axes() == [actuator, across]);
            let half = if forward { 0.5 } else { -0.5 } * w(shift_m);
            e[across.index()] = half * velocity(actuator.index()).signum();
        }
        Term::ReversalSpike {
            actuator,
            peak_m,
            decay_s,
        } => {
            let i = actuator.index();
            e[i] = -w(peak_m) * (-since_s(i) / w(decay_s)).exp() * velocity(i).signum();
        }
        Term::Cyclic {
            actuator,
            amplitude_m,
            pitch_m,
            phase_rad,
        } => {
            let i = actuator.index();
            let angle = core::f64::consts::TAU * path(0)[i] / w(pitch_m) + w(phase_rad);
            e[i] = w(amplitude_m) * angle.sin();
        }
        Term::Straightness {
            actuator,
            across,
            curvature_per_m,
        } => e[across.index()] = w(curvature_per_m) * rel(actuator.index()).powi(2),
    }
    e
}

/// Root mean square radial deviation at constant feed, µm, uncorrected and corrected.
fn residual(term: Term<f32>, feed_m_s: f64, direction: Direction) -> (f64, f64) {
    let radial = |correct: bool| {
        let mut config = Config::robot(1000);
        config.offset_m = 0.05;
        let mut engine = Engine::new(config).unwrap();
        let mut table = table(0.0, 0.0);
        if correct {
            table.zones[0].terms.push(term).unwrap();
        }
        engine.load(Some(&table)).unwrap();
        let run = CircleRun {
            centre_m: CENTRE,
            radius_m: RADIUS,
            feed_m_s,
            direction,
            laps: 2,
            start_rad: 0.4,
        };
        engine.run_circle(&run).unwrap();
        let out = run_out(&mut engine);
        assert_eq!(
            engine.counters().offset_cuts + engine.counters().slew_cuts,
            0
        );
        super::no_jump(&out, 1.01 * feed_m_s.max(0.5) * DT + 20e-6);
        let path: Vec<[f64; 3]> = out
            .iter()
            .map(|o: &Output| o.corrected_nm.map(|nm| f64::from(nm) * 1e-9))
            .collect();
        let error = error(&term, &Frame::default(), &path);
        let first = out
            .iter()
            .rposition(|o| o.flags & flag::SETTLING != 0)
            .unwrap();
        // The second lap: by then each axis has turned.
        let cruise: Vec<usize> = (first..out.len())
            .filter(|&n| out[n].flags & flag::CRUISE != 0)
            .collect();
        let deviations: Vec<f64> = cruise[cruise.len() / 2..]
            .iter()
            .map(|&n| {
                let at = [0, 1].map(|i| path[n][i] + error[n][i] - CENTRE[i]);
                (at[0].hypot(at[1]) - RADIUS) * 1e6
            })
            .collect();
        (deviations.iter().map(|d| d * d).sum::<f64>() / deviations.len() as f64).sqrt()
    };
    (radial(false), radial(true))
}

#[test]
fn each_term_is_undone() {
    let plane = Plane::Xy;
    let [x, y] = plane.axes();
    // (term, largest share left). Linear and smooth terms leave their second order and the nanometre; a step leaves
    // its take-up, 8 ms of each reversal; the bound of a spike is that of its onset.
    let cases = [
        (Term::RadiusOffset { offset_m: 30e-6 }, 0.001),
        (Term::ScaleError { relative: 200e-6 }, 0.001),
        (
            Term::ScaleMismatch {
                plane,
                relative: 200e-6,
            },
            0.001,
        ),
        (
            Term::Squareness {
                plane,
                shear_rad: 200e-6,
            },
            0.001,
        ),
        (
            Term::ServoMismatch {
                plane,
                delta_tau_s: 200e-6,
            },
            0.002,
        ),
        (
            Term::BandwidthMismatch {
                plane,
                delta_kappa2_s2: 500e-6,
            },
            0.01,
        ),
        (
            Term::Backlash {
                actuator: x,
                step_m: 20e-6,
            },
            0.1,
        ),
        (
            Term::Backlash {
                actuator: y,
                step_m: -20e-6,
            },
            0.1,
        ),
        (
            Term::LateralPlay {
                actuator: x,
                across: y,
                shift_m: 20e-6,
            },
            0.05,
        ),
        (
            Term::LateralPlay {
                actuator: y,
                across: x,
                shift_m: 20e-6,
            },
            0.05,
        ),
        (
            Term::ReversalSpike {
                actuator: x,
                peak_m: 15e-6,
                decay_s: 0.1,
            },
            0.2,
        ),
        (
            Term::ReversalSpike {
                actuator: y,
                peak_m: 15e-6,
                decay_s: 0.1,
            },
            0.2,
        ),
        (
            Term::Cyclic {
                actuator: x,
                amplitude_m: 5e-6,
                pitch_m: 0.01,
                phase_rad: 0.7,
            },
            0.005,
        ),
        (
            Term::Cyclic {
                actuator: y,
                amplitude_m: 5e-6,
                pitch_m: 0.007,
                phase_rad: -2.0,
            },
            0.005,
        ),
        (
            Term::Straightness {
                actuator: x,
                across: y,
                curvature_per_m: 1e-3,
            },
            0.002,
        ),
        (
            Term::Straightness {
                actuator: y,
                across: x,
                curvature_per_m: -1e-3,
            },
            0.002,
        ),
    ];
    for (term, bar) in cases {
        for direction in [Direction::Ccw, Direction::Cw] {
            let (without, with) = residual(term, 0.1, direction);
            std::println!(
                "{:.4} of {without:.3} µm left: {term:?} {direction:?}",
                with / without
            );
            assert!(
                without > 1.0 && with <= bar * without,
                "{term:?} {direction:?}: {with} of {without} µm"
            );
        }
    }
}
