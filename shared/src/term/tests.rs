//! What each term leaves on a circle, against the radial deviations that its file states; reach, merging.
use super::*;
use crate::Frame;
use std::vec::Vec;

const RADIUS_M: f64 = 0.1;
const FEED_M_S: f64 = 0.2;

/// Error of the machine at one place of a path: q from the reference point and its derivatives, X, Y, Z; `since_s` the
/// time since each slide reversed.
fn error(profile: &Profile<f64>, q: [[f64; 3]; 3], arm: [f64; 3], since_s: [f64; 3]) -> [f64; 3] {
    let [place, velocity, acceleration] = q;
    core::array::from_fn(|j| {
        let mut e =
            profile.velocity_s[j] * velocity[j] + profile.acceleration_s2[j] * acceleration[j];
        for k in 0..3 {
            let sense = if velocity[k].abs() < 1e-9 {
                0.0
            } else {
                velocity[k].signum()
            };
            e += profile.position[j][k] * place[k];
            e -= 0.5 * profile.play_m[k][j] * sense;
            e += profile.bow_per_m[k][j] * arm[k] * arm[k];
        }
        let spike = profile.spike[j];
        if spike.peak_m != 0.0 {
            e -= spike.peak_m * (-since_s[j] / spike.decay_s).exp() * velocity[j].signum();
        }
        for c in profile
            .cyclic
            .iter()
            .filter(|c| c.slide == j && c.amplitude_m != 0.0)
        {
            e +=
                c.amplitude_m * (core::f64::consts::TAU * place[j] / c.pitch_m + c.phase_rad).sin();
        }
        e
    })
}

/// Radial deviation of a circle about the reference point at polar angle θ.
fn radial(terms: &[Term<f64>], frame: &Frame, d: f64, theta: f64) -> f64 {
    let profile = merged(terms).unwrap();
    let (sin, cos) = theta.sin_cos();
    let omega = d * FEED_M_S / RADIUS_M;
    let (first, second) = (frame.first(), frame.second());
    let along =
        |c: f64, s: f64| core::array::from_fn(|k| RADIUS_M * (c * first[k] + s * second[k]));
    let place = along(cos, sin);
    let velocity = along(-sin * omega, cos * omega);
    let acceleration = along(-cos * omega * omega, -sin * omega * omega);
    // A slide with the shares (a, b) of the frame reverses where −a·sinθ + b·cosθ = 0.
    let since_s = core::array::from_fn(|k| {
        let reversal = second[k].atan2(first[k]);
        ((theta - reversal) * d).rem_euclid(core::f64::consts::PI) / omega.abs()
    });
    let e = error(&profile, [place, velocity, acceleration], place, since_s);
    let normal: [f64; 3] = along(cos / RADIUS_M, sin / RADIUS_M);
    e.iter().zip(normal).map(|(e, n)| e * n).sum::<f64>() + profile.radius_offset_m
}

/// Each term in a plane, with its r(θ) as `physics` has it, for the first and the second slide in turn.
type Expected = (Term<f64>, fn(f64, f64) -> f64);

fn stated(plane: Plane) -> Vec<Expected> {
    let [first, second] = plane.axes();
    const V: f64 = 1e-5;
    let cyclic = |actuator| Term::Cyclic {
        actuator,
        amplitude_m: V,
        pitch_m: 0.01,
        phase_rad: 0.3,
    };
    let spike = |actuator| Term::ReversalSpike {
        actuator,
        peak_m: V,
        decay_s: 0.02,
    };
    fn wave(u: f64) -> f64 {
        V * (core::f64::consts::TAU * RADIUS_M * u / 0.01 + 0.3).sin()
    }
    fn pulse(angle: f64) -> f64 {
        V * (-angle * RADIUS_M / FEED_M_S / 0.02).exp()
    }
    [
        (
            Term::RadiusOffset { offset_m: V },
            (|_, _| V) as fn(f64, f64) -> f64,
        ),
        (Term::ScaleError { relative: V }, |_, _| RADIUS_M * V),
        (
            Term::AxisScale {
                actuator: first,
                relative: V,
            },
            |_, t| RADIUS_M * V * t.cos().powi(2),
        ),
        (
            Term::AxisScale {
                actuator: second,
                relative: V,
            },
            |_, t| RADIUS_M * V * t.sin().powi(2),
        ),
        (Term::ScaleMismatch { plane, relative: V }, |_, t| {
            0.5 * RADIUS_M * V * (2.0 * t).cos()
        }),
        (
            Term::Squareness {
                plane,
                shear_rad: V,
            },
            |_, t| 0.5 * RADIUS_M * V * (2.0 * t).sin(),
        ),
        (
            Term::ServoMismatch {
                plane,
                delta_tau_s: V,
            },
            |d, t| d * 0.5 * FEED_M_S * V * (2.0 * t).sin(),
        ),
        (
            Term::BandwidthMismatch {
                plane,
                delta_kappa2_s2: V,
            },
            |_, t| -0.25 * V * FEED_M_S * FEED_M_S / RADIUS_M * (2.0 * t).cos(),
        ),
        (
            Term::Backlash {
                actuator: first,
                step_m: V,
            },
            |d, t| d * 0.5 * V * t.sin().signum() * t.cos(),
        ),
        (
            Term::Backlash {
                actuator: second,
                step_m: V,
            },
            |d, t| -d * 0.5 * V * t.cos().signum() * t.sin(),
        ),
        (
            Term::LateralPlay {
                actuator: first,
                across: second,
                shift_m: V,
            },
            |d, t| -d * 0.5 * V * t.sin().abs(),
        ),
        (
            Term::LateralPlay {
                actuator: second,
                across: first,
                shift_m: V,
            },
            |d, t| -d * 0.5 * V * t.cos().abs(),
        ),
        (spike(first), |d, t| {
            // Outward just behind the reversal; the sign turns with the side of the circle.
            let since = (t * d).rem_euclid(core::f64::consts::PI);
            let side = (t.sin() * d).signum() * t.cos();
            pulse(since) * side
        }),
        (spike(second), |d, t| {
            let since = ((t - core::f64::consts::FRAC_PI_2) * d).rem_euclid(core::f64::consts::PI);
            pulse(since) * -d * t.cos().signum() * t.sin()
        }),
        (cyclic(first), |_, t| wave(t.cos()) * t.cos()),
        (cyclic(second), |_, t| wave(t.sin()) * t.sin()),
        (
            Term::Straightness {
                actuator: first,
                across: second,
                curvature_per_m: V,
            },
            |_, t| V * RADIUS_M * RADIUS_M / 4.0 * (t.sin() + (3.0 * t).sin()),
        ),
        (
            Term::Straightness {
                actuator: second,
                across: first,
                curvature_per_m: V,
            },
            |_, t| V * RADIUS_M * RADIUS_M / 4.0 * (t.cos() - (3.0 * t).cos()),
        ),
    ]
    .to_vec()
}

#[test]
fn each_term_leaves_its_radial_deviation_in_each_plane() {
    for plane in Plane::ALL {
        let frame = Frame::of(plane);
        for (term, expected) in stated(plane) {
            for d in [1.0, -1.0] {
                for i in 0..36 {
                    let theta = (10.0 * f64::from(i) + 3.0).to_radians();
                    let (got, expected) = (radial(&[term], &frame, d, theta), expected(d, theta));
                    assert!(
                        (got - expected).abs() < 1e-13,
                        "{term:?} in {plane} at {theta}: {got} {expected}"
                    );
                }
            }
        }
    }
}

/// No term of one plane is seen along its normal.
#[test]
fn a_term_moves_only_the_slides_that_it_names() {
    for plane in Plane::ALL {
        let normal = plane.normal().index();
        for (term, _) in stated(plane) {
            if matches!(term, Term::ScaleError { .. }) {
                continue;
            }
            let profile = merged(&[term]).unwrap();
            let q = [[0.03, -0.05, 0.07], [0.1, -0.2, 0.3], [1.0, 2.0, -3.0]];
            let e = error(&profile, q, [0.01, 0.02, 0.03], [0.01; 3]);
            assert_eq!(e[normal], 0.0, "{term:?}");
            let named = e.iter().any(|e| *e != 0.0) || profile.radius_offset_m != 0.0;
            assert!(named, "{term:?}");
        }
    }
}

#[test]
fn no_deviation_is_beyond_the_reach() {
    let omega_rad_s = FEED_M_S / RADIUS_M;
    for plane in Plane::ALL {
        for (term, _) in stated(plane) {
            let reach = term.reach(&Extent {
                radius_m: RADIUS_M,
                feed_m_s: FEED_M_S,
                omega_rad_s,
            });
            assert_eq!(
                term.reach_m(RADIUS_M, FEED_M_S, omega_rad_s),
                reach.offset_m
            );
            let at = |degrees: f64| radial(&[term], &Frame::of(plane), 1.0, degrees.to_radians());
            let largest = (0..3600).map(|i| at(f64::from(i) * 0.1 + 0.05).abs());
            let largest = largest.fold(0.0, f64::max);
            assert!(
                largest <= reach.offset_m * 1.0001 && reach.offset_m <= 3.0 * largest,
                "{term:?}: {largest} {reach:?}"
            );
            assert!(reach.slew_m_s > 0.0, "{term:?}");
        }
    }
}

#[test]
fn terms_of_a_kind_add_and_what_cannot_be_undone_is_named() {
    let backlash = |actuator, step_m| Term::Backlash { actuator, step_m };
    let both = merged(&[backlash(Actuator::Z, 1e-5), backlash(Actuator::Z, 2e-5)]).unwrap();
    assert!((both.play_m[2][2] - 3e-5).abs() < 1e-18);
    let refused = |terms: &[Term<f64>]| merged(terms).unwrap_err();
    let at = |index, reason| ProfileError { index, reason };
    assert_eq!(
        refused(&[
            backlash(Actuator::X, 1e-5),
            backlash(Actuator::Joint1, 1e-5)
        ]),
        at(1, Unmergeable::Actuator)
    );
    assert_eq!(
        refused(&[backlash(Actuator::X, f64::NAN)]),
        at(0, Unmergeable::Value)
    );
    let spike = |decay_s| Term::ReversalSpike {
        actuator: Actuator::Y,
        peak_m: 1e-6,
        decay_s,
    };
    assert_eq!(
        refused(&[spike(0.02), spike(0.03)]),
        at(1, Unmergeable::TooMany)
    );
    assert_eq!(refused(&[spike(0.0)]), at(0, Unmergeable::Value));
    let cyclic = Term::Cyclic {
        actuator: Actuator::X,
        amplitude_m: 1e-6,
        pitch_m: 0.01,
        phase_rad: 0.0,
    };
    assert_eq!(
        refused(&[cyclic; crate::law::MAX_CYCLIC + 1]),
        at(crate::law::MAX_CYCLIC, Unmergeable::TooMany)
    );
    let same = Term::LateralPlay {
        actuator: Actuator::X,
        across: Actuator::X,
        shift_m: 1e-5,
    };
    assert_eq!(refused(&[same]), at(0, Unmergeable::Actuator));
}
