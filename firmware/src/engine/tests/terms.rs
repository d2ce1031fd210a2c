//! Each profile term: what is left on a circle when the machine has the error and the controller its opposite.
use super::{run_out, std, table};
use crate::engine::{Config, Engine, Output, Segment, flag};
use giotto_shared::term::Term;
use giotto_shared::{Actuator, Direction, Frame, Plane};
use std::vec::Vec;

const RADIUS: f64 = 0.1;
const CENTRE: [f64; 3] = [0.03, -0.05, 0.2];
const DT: f64 = 1e-3;

/// A path of the machine and what is known of it.
struct Motion<'a> {
    frame: &'a Frame,
    path: &'a [[f64; 3]],
    /// Says in which sense each slide travels and when it turns: what friction makes of the micrometres of a correction is
    /// beyond the terms.
    programmed: &'a [[f64; 3]],
}

/// The machine's error at each set-point, m, written down from the docs of [`Term`] with each slide's velocity and
/// acceleration taken from the path by central differences.
fn error(term: &Term<f32>, motion: &Motion<'_>) -> Vec<[f64; 3]> {
    let last = motion.path.len() as isize - 1;
    let at = |path: &[[f64; 3]], n: isize| path[n.clamp(0, last) as usize];
    let mut turned = [0usize; 3];
    let mut senses = [0.0; 3];
    (0..=last)
        .map(|n| {
            let step = |i: usize| at(motion.programmed, n + 1)[i] - at(motion.programmed, n - 1)[i];
            for i in 0..3 {
                let sense = if step(i).abs() < 2.5e-9 {
                    senses[i]
                } else {
                    step(i).signum()
                };
                if sense != senses[i] {
                    (turned[i], senses[i]) = (n as usize, sense);
                }
            }
            let since_s = turned.map(|turned| (n as usize - turned) as f64 * DT);
            error_at(
                term,
                motion.frame,
                |k| at(motion.path, n + k),
                senses,
                since_s,
            )
        })
        .collect()
}

/// At one set-point: the path so many ticks away, senses of the slides, and the time since each turned.
fn error_at(
    term: &Term<f32>,
    frame: &Frame,
    path: impl Fn(isize) -> [f64; 3],
    senses: [f64; 3],
    since_s: [f64; 3],
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
            e[i] = -0.5 * w(step_m) * senses[i];
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
            e[across.index()] = half * senses[actuator.index()];
        }
        Term::ReversalSpike {
            actuator,
            peak_m,
            decay_s,
        } => {
            let i = actuator.index();
            e[i] = -w(peak_m) * (-since_s[i] / w(decay_s)).exp() * senses[i];
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
        Term::JointLag { .. }
        | Term::JointBacklash { .. }
        | Term::JointReversal { .. }
        | Term::JointCyclic { .. }
        | Term::JointZero { .. }
        | Term::LinkLength { .. } => {
            panic!("{term:?}: terms of joints are tested through their arm")
        }
    }
    e
}

/// What to run about [`CENTRE`].
#[derive(Clone, Copy, Debug)]
enum Course {
    /// Two turns, the second of which is looked at, counter-clockwise or clockwise in its frame.
    Circle(Frame, Direction),
    /// The same with a rise along the normal, m.
    Helix(Frame, f64),
    /// From one corner of a box to the other.
    Line([f64; 3]),
}

impl Course {
    fn frame(&self) -> Frame {
        match self {
            Self::Circle(frame, _) | Self::Helix(frame, _) => *frame,
            Self::Line(_) => Frame::default(),
        }
    }

    fn start(&self) -> [f64; 3] {
        let frame = self.frame();
        let (sin, cos) = 0.4f64.sin_cos();
        match self {
            Self::Circle(..) | Self::Helix(..) => [0, 1, 2]
                .map(|i| CENTRE[i] + RADIUS * (cos * frame.first()[i] + sin * frame.second()[i])),
            Self::Line(half) => [0, 1, 2].map(|i| CENTRE[i] - half[i]),
        }
    }

    fn segment(&self) -> Segment {
        let feed_m_s = 0.1;
        let arc = |sweep_rad, rise_m| Segment::Arc {
            centre_m: CENTRE,
            normal: self.frame().normal(),
            sweep_rad,
            rise_m,
            feed_m_s,
        };
        let turns = 2.2 * core::f64::consts::TAU;
        match self {
            Self::Circle(_, direction) => arc(f64::from(direction.sign()) * turns, 0.0),
            Self::Helix(_, rise_m) => arc(turns, *rise_m),
            Self::Line(half) => Segment::Line {
                to_m: [0, 1, 2].map(|i| CENTRE[i] + half[i]),
                feed_m_s,
            },
        }
    }
}

/// Programmed and commanded positions of a course, and which of them are at constant feed.
fn run(course: &Course, terms: &[Term<f32>]) -> (Vec<[f64; 3]>, Vec<[f64; 3]>, Vec<usize>) {
    let mut config = Config::robot(1000);
    config.offset_m = 0.05;
    let mut engine = Engine::new(config).unwrap();
    let mut table = table(0.0, 0.0);
    let corner = |by: f64| CENTRE.map(|c| (c + by) as f32);
    table.zones[0].place_m = Some([corner(-1.0), corner(1.0)]);
    table.zones[0].terms.extend(terms.iter().copied());
    engine.load(Some(&table)).unwrap();
    let start = course.start().map(|m| (m * 1e9).round() as i32);
    engine.set_position(start).unwrap();
    engine.push(&course.segment()).unwrap();
    let out = run_out(&mut engine);
    let counters = engine.counters();
    assert_eq!(counters.offset_cuts + counters.slew_cuts, 0, "{course:?}");
    assert_eq!(counters.uncorrected, 0, "{course:?}");
    super::no_jump(&out, 0.1 * DT + 20e-6);
    let metres = |pick: fn(&Output) -> [i32; 3]| -> Vec<[f64; 3]> {
        let all = out.iter().map(pick);
        all.map(|nm| nm.map(|nm| f64::from(nm) * 1e-9)).collect()
    };
    let cruise: Vec<usize> = (0..out.len())
        .filter(|&n| out[n].flags & flag::CRUISE != 0)
        .collect();
    // The second half: by then each slide of a circle has turned. Differences over ten ticks reach into the ramp.
    let looked_at = cruise[cruise.len() / 2..cruise.len() - 12].to_vec();
    (
        metres(|o| o.nominal_nm),
        metres(|o| o.corrected_nm),
        looked_at,
    )
}

/// Root mean square distances from the programmed positions, µm.
#[derive(Debug)]
struct Residual {
    uncorrected: f64,
    corrected: f64,
    /// Without the take-ups: more than 10 ticks from a reversal of any slide.
    settled: f64,
}

/// The machine's error applied to the programmed path, and to the corrected one.
fn residual(terms: &[Term<f32>], course: &Course) -> Residual {
    let (nominal, corrected, looked_at) = run(course, terms);
    let step = |n: usize, i: usize| nominal[n + 1][i] - nominal[n][i];
    let moves = [0, 1, 2].map(|i| {
        let steps = (0..nominal.len() - 1).step_by(97).map(|n| step(n, i).abs());
        steps.fold(0.0, f64::max) > 5e-9
    });
    let distances = |path: &[[f64; 3]]| -> Vec<f64> {
        let mut error = std::vec![[0.0; 3]; path.len()];
        let motion = Motion {
            frame: &course.frame(),
            path,
            programmed: &nominal,
        };
        for term in terms {
            for (sum, e) in error.iter_mut().zip(self::error(term, &motion)) {
                *sum = [0, 1, 2].map(|i| sum[i] + e[i]);
            }
        }
        (0..path.len())
            .map(|n| {
                let off = [0, 1, 2].map(|i| path[n][i] + error[n][i] - nominal[n][i]);
                off.iter().map(|o| o * o).sum::<f64>().sqrt() * 1e6
            })
            .collect()
    };
    let turns = |n: usize| {
        let (early, late) = (n.saturating_sub(11), (n + 10).min(nominal.len() - 2));
        (0..3).any(|i| moves[i] && step(early, i) * step(late, i) <= 0.0)
    };
    let mean = |distances: &[f64], pick: &dyn Fn(usize) -> bool| {
        let picked: Vec<f64> = looked_at
            .iter()
            .filter(|&&n| pick(n))
            .map(|&n| distances[n] * distances[n])
            .collect();
        (picked.iter().sum::<f64>() / picked.len() as f64).sqrt()
    };
    let (without, with) = (distances(&nominal), distances(&corrected));
    Residual {
        uncorrected: mean(&without, &|_| true),
        corrected: mean(&with, &|_| true),
        settled: mean(&with, &|n| !turns(n)),
    }
}

/// Terms of one slide.
fn of_slide(actuator: Actuator) -> [Term<f32>; 4] {
    [
        Term::AxisScale {
            actuator,
            relative: 200e-6,
        },
        Term::Backlash {
            actuator,
            step_m: 20e-6,
        },
        Term::ReversalSpike {
            actuator,
            peak_m: 15e-6,
            decay_s: 0.1,
        },
        Term::Cyclic {
            actuator,
            amplitude_m: 5e-6,
            pitch_m: 0.01,
            phase_rad: 0.7,
        },
    ]
}

/// Terms of two slides.
fn of_plane(plane: Plane) -> Vec<Term<f32>> {
    let [first, second] = plane.axes();
    let mut terms = [
        Term::ScaleMismatch {
            plane,
            relative: 200e-6,
        },
        Term::Squareness {
            plane,
            shear_rad: -200e-6,
        },
        Term::ServoMismatch {
            plane,
            delta_tau_s: 200e-6,
        },
        Term::BandwidthMismatch {
            plane,
            delta_kappa2_s2: 500e-6,
        },
    ]
    .to_vec();
    for (actuator, across) in [(first, second), (second, first)] {
        terms.push(Term::LateralPlay {
            actuator,
            across,
            shift_m: 20e-6,
        });
        terms.push(Term::Straightness {
            actuator,
            across,
            curvature_per_m: 1e-3,
        });
    }
    terms
}

fn all_terms() -> Vec<Term<f32>> {
    let mut terms = [
        Term::RadiusOffset { offset_m: 30e-6 },
        Term::ScaleError { relative: 200e-6 },
    ]
    .to_vec();
    terms.extend(Actuator::SLIDES.into_iter().flat_map(of_slide));
    terms.extend(Plane::ALL.into_iter().flat_map(of_plane));
    terms
}

/// Largest share left with the take-ups, and outside of them. A step leaves that of 8 ms of each reversal, a pulse its onset
/// as well.
fn bars(term: &Term<f32>) -> [f64; 2] {
    match term {
        Term::Backlash { .. } | Term::LateralPlay { .. } => [0.1, 0.01],
        Term::ReversalSpike { .. } => [0.25, 0.01],
        _ => [0.01, 0.01],
    }
}

impl Residual {
    fn within(&self, [whole, settled]: [f64; 2]) -> bool {
        self.corrected <= whole * self.uncorrected && self.settled <= settled * self.uncorrected
    }
}

/// Planes by name, and tilted ones: by much, by little, and one in which X and Y turn at the same time.
fn frames() -> Vec<Frame> {
    let tilted = [[0.5, -0.4, 0.7], [0.02, 1.0, -0.01], [1.0, 1.0, 0.3]];
    let tilted = tilted.map(|normal| Frame::across(normal).unwrap());
    Plane::ALL
        .map(Frame::of)
        .into_iter()
        .chain(tilted)
        .collect()
}

#[test]
fn each_term_is_undone_in_every_plane_by_the_slide_that_moves() {
    let mut seen = 0;
    for frame in frames() {
        for term in all_terms() {
            for direction in [Direction::Ccw, Direction::Cw] {
                let course = Course::Circle(frame, direction);
                let left = residual(&[term], &course);
                if left.uncorrected < 1.0 {
                    // Of a slide that the plane does not move: nothing may be done either.
                    assert!(left.corrected < 1.0, "{term:?} {course:?} {left:?}");
                    continue;
                }
                seen += 1;
                assert!(left.within(bars(&term)), "{term:?} {course:?}: {left:?}");
            }
        }
    }
    // 2 of the radius, 4 of each slide, 8 of each pair; what a coordinate plane does not move is not seen in it.
    assert!(seen > 300, "{seen}");
}

#[test]
fn eight_terms_at_once_are_undone_in_every_plane() {
    let (x, y, z) = (Actuator::X, Actuator::Y, Actuator::Z);
    let [_, backlash_z, spike_z, cyclic_z] = of_slide(z);
    let terms = [
        backlash_z,
        spike_z,
        cyclic_z,
        of_slide(x)[3],
        of_slide(y)[1],
        of_plane(Plane::Zx)[1],
        of_plane(Plane::Yz)[2],
        Term::Straightness {
            actuator: x,
            across: z,
            curvature_per_m: 1e-3,
        },
    ];
    for frame in frames() {
        for direction in [Direction::Ccw, Direction::Cw] {
            let left = residual(&terms, &Course::Circle(frame, direction));
            assert!(
                left.uncorrected > 5.0 && left.within([0.1, 0.01]),
                "{frame:?} {direction:?}: {left:?}"
            );
        }
    }
}

/// A slide that travels one way along a line or a helix is corrected as it travels.
#[test]
fn terms_are_undone_on_helices_and_lines() {
    let level = Frame::default();
    let tilted = Frame::across([0.5, -0.4, 0.7]).unwrap();
    let courses = [
        Course::Helix(level, 0.05),
        Course::Helix(level, -0.05),
        Course::Helix(tilted, 0.05),
        Course::Line([0.0, 0.0, 0.1]),
        Course::Line([0.08, -0.05, -0.06]),
    ];
    let mut seen = 0;
    for course in courses {
        for term in all_terms() {
            // The radius of a line, and the bow of a guide beyond a circle, are not defined.
            if matches!(term, Term::Straightness { .. } | Term::RadiusOffset { .. }) {
                continue;
            }
            // At constant feed a line has no acceleration, and nothing to correct.
            let left = residual(&[term], &course);
            if left.uncorrected < 0.5 {
                assert!(left.corrected < 0.5, "{term:?} {course:?} {left:?}");
                continue;
            }
            seen += 1;
            assert!(left.within(bars(&term)), "{term:?} {course:?}: {left:?}");
        }
    }
    assert!(seen > 60, "{seen}");
}
