//! Each profile term: what is left on a circle when the machine has the error and the controller its opposite.
use super::{run_out, std, table};
use crate::engine::{CircleRun, Config, Engine, Output, flag};
use giotto_shared::term::Term;
use giotto_shared::{Axis, Direction};
use std::vec::Vec;

const RADIUS: f64 = 0.1;
const CENTRE: [f64; 3] = [0.03, -0.05, 0.2];
const DT: f64 = 1e-3;

/// The machine's error at each set-point, m, written down from the docs of [`Term`] with axis velocity and
/// acceleration taken from the path by central differences.
fn error(term: &Term<f32>, path: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let w = f64::from;
    let mut turned = [0usize; 2];
    (0..path.len())
        .map(|n| {
            let (before, here, after) = (
                path[n.saturating_sub(1)],
                path[n],
                path[(n + 1).min(path.len() - 1)],
            );
            let velocity = |i: usize| (after[i] - before[i]) / (2.0 * DT);
            // Ten ticks apart: the set-points' nanometre would be 1e-3 m/s² from one tick to the next.
            let (early, late) = (
                path[n.saturating_sub(10)],
                path[(n + 10).min(path.len() - 1)],
            );
            let acceleration = |i: usize| (late[i] - 2.0 * here[i] + early[i]) / (100.0 * DT * DT);
            let rel = |i: usize| here[i] - CENTRE[i];
            for i in 0..2 {
                if n > 1 && (here[i] - before[i]) * (before[i] - path[n - 2][i]) < 0.0 {
                    turned[i] = n;
                }
            }
            let mut e = [0.0; 2];
            match *term {
                Term::RadiusOffset { offset_m } => {
                    let r = (rel(0).powi(2) + rel(1).powi(2)).sqrt();
                    e = [w(offset_m) * rel(0) / r, w(offset_m) * rel(1) / r];
                }
                Term::ScaleError { relative } => e = [w(relative) * rel(0), w(relative) * rel(1)],
                Term::ScaleMismatch { relative } => {
                    e = [0.5 * w(relative) * rel(0), -0.5 * w(relative) * rel(1)];
                }
                Term::Squareness { shear_rad } => {
                    e = [0.5 * w(shear_rad) * rel(1), 0.5 * w(shear_rad) * rel(0)]
                }
                Term::ServoMismatch { delta_tau_s } => {
                    e = [
                        -0.5 * w(delta_tau_s) * velocity(0),
                        0.5 * w(delta_tau_s) * velocity(1),
                    ];
                }
                Term::BandwidthMismatch { delta_kappa2_s2 } => {
                    let k = 0.25 * w(delta_kappa2_s2);
                    e = [k * acceleration(0), -k * acceleration(1)];
                }
                Term::Backlash { axis, step_m } => {
                    let i = axis.index();
                    e[i] = -0.5 * w(step_m) * velocity(i).signum();
                }
                Term::LateralPlay {
                    axis: Axis::X,
                    shift_m,
                } => e[1] = 0.5 * w(shift_m) * velocity(0).signum(),
                Term::LateralPlay {
                    axis: Axis::Y,
                    shift_m,
                } => e[0] = -0.5 * w(shift_m) * velocity(1).signum(),
                Term::ReversalSpike {
                    axis,
                    peak_m,
                    decay_s,
                } => {
                    let i = axis.index();
                    let since = (n - turned[i]) as f64 * DT;
                    e[i] = -w(peak_m) * (-since / w(decay_s)).exp() * velocity(i).signum();
                }
                Term::Cyclic {
                    axis,
                    amplitude_m,
                    pitch_m,
                    phase_rad,
                } => {
                    let at =
                        core::f64::consts::TAU * here[axis.index()] / w(pitch_m) + w(phase_rad);
                    e[axis.index()] = w(amplitude_m) * at.sin();
                }
                Term::Straightness {
                    axis,
                    curvature_per_m,
                } => {
                    let i = axis.index();
                    e[1 - i] = w(curvature_per_m) * rel(i) * rel(i);
                }
                _ => unreachable!("a new term needs its oracle here"),
            }
            e
        })
        .collect()
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
        let metres = |p: [i32; 3]| [f64::from(p[0]) * 1e-9, f64::from(p[1]) * 1e-9];
        let path: Vec<[f64; 2]> = out
            .iter()
            .map(|o: &Output| metres(o.corrected_nm))
            .collect();
        let error = error(&term, &path);
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
    let (x, y) = (Axis::X, Axis::Y);
    // (term, largest share left). Linear and smooth terms leave their second order and the nanometre; a step leaves
    // its take-up, 8 ms of each reversal; the bound of a spike is that of its onset.
    let cases = [
        (Term::RadiusOffset { offset_m: 30e-6 }, 0.001),
        (Term::ScaleError { relative: 200e-6 }, 0.001),
        (Term::ScaleMismatch { relative: 200e-6 }, 0.001),
        (Term::Squareness { shear_rad: 200e-6 }, 0.001),
        (
            Term::ServoMismatch {
                delta_tau_s: 200e-6,
            },
            0.002,
        ),
        (
            Term::BandwidthMismatch {
                delta_kappa2_s2: 500e-6,
            },
            0.01,
        ),
        (
            Term::Backlash {
                axis: x,
                step_m: 20e-6,
            },
            0.1,
        ),
        (
            Term::Backlash {
                axis: y,
                step_m: -20e-6,
            },
            0.1,
        ),
        (
            Term::LateralPlay {
                axis: x,
                shift_m: 20e-6,
            },
            0.05,
        ),
        (
            Term::LateralPlay {
                axis: y,
                shift_m: 20e-6,
            },
            0.05,
        ),
        (
            Term::ReversalSpike {
                axis: x,
                peak_m: 15e-6,
                decay_s: 0.1,
            },
            0.2,
        ),
        (
            Term::ReversalSpike {
                axis: y,
                peak_m: 15e-6,
                decay_s: 0.1,
            },
            0.2,
        ),
        (
            Term::Cyclic {
                axis: x,
                amplitude_m: 5e-6,
                pitch_m: 0.01,
                phase_rad: 0.7,
            },
            0.005,
        ),
        (
            Term::Cyclic {
                axis: y,
                amplitude_m: 5e-6,
                pitch_m: 0.007,
                phase_rad: -2.0,
            },
            0.005,
        ),
        (
            Term::Straightness {
                axis: x,
                curvature_per_m: 1e-3,
            },
            0.002,
        ),
        (
            Term::Straightness {
                axis: y,
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
