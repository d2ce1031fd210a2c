use super::*;
use giotto_shared::{Frame, Plane};
use rustfft::num_complex::Complex;
use std::f64::consts::{FRAC_PI_2, TAU};

fn scara(elbow: Elbow) -> Kinematics {
    Kinematics::Scara(Scara {
        l1_m: 0.475,
        l2_m: 0.720,
        elbow,
    })
}

/// The paper's robot with its tool, pointing down.
fn paper(branch: Branch) -> Kinematics {
    let robot = Robot::named("abb-irb1600-6-1.45").unwrap();
    Kinematics::Opw(robot.with([0.0, 0.065, 0.149], [0.0, 0.0, 1.0, 0.0], branch))
}

/// An arm with every length, a tool out of line and no right angle anywhere.
fn crooked(branch: Branch) -> Kinematics {
    let norm = (0.1_f64 * 0.1 + 0.3 * 0.3 + 0.9 * 0.9 + 0.2 * 0.2).sqrt();
    Kinematics::Opw(Opw {
        a1_m: 0.12,
        a2_m: -0.08,
        b_m: 0.05,
        c1_m: 0.41,
        c2_m: 0.62,
        c3_m: 0.55,
        c4_m: 0.09,
        tool_m: [0.03, -0.04, 0.12],
        orientation: [0.1, 0.3, 0.9, -0.2].map(|v| v / norm),
        branch,
    })
}

fn all() -> Vec<(Kinematics, Vec<[f64; 3]>)> {
    let six = || vec![[-0.29, 0.987, 0.615], [0.75, 0.25, 0.45], [0.6, -0.5, 0.7]];
    let mut out = vec![
        (
            scara(Elbow::Positive),
            vec![[0.76, 0.25, 0.6], [-0.3, 0.7, 0.0]],
        ),
        (
            scara(Elbow::Negative),
            vec![[0.76, 0.25, 0.6], [-0.3, 0.7, 0.0]],
        ),
    ];
    for (branch, _) in Branch::ALL {
        out.push((paper(branch), six()));
        out.push((crooked(branch), vec![[0.55, 0.35, 0.6], [-0.4, 0.5, 0.5]]));
    }
    out
}

#[test]
fn angles_lead_back_to_the_place() {
    let mut seen = 0;
    for (arm, places) in all() {
        for place in places {
            // On some branch a place may have a stretched wrist.
            let Ok(q) = arm.angles(place) else { continue };
            seen += 1;
            let back = arm.place(&q);
            for k in 0..3 {
                assert!(
                    (back[k] - place[k]).abs() < 1e-12,
                    "{arm:?} {place:?} {back:?}"
                );
            }
        }
    }
    assert!(seen >= 22, "{seen}");
}

/// At zero the arm stands upright; with the third joint at a right angle it is the drawing of ABB's.
#[test]
fn the_six_joints_are_those_of_the_drawing() {
    let robot = Robot::named("abb-irb1600-6-1.45").unwrap();
    let bare = Kinematics::Opw(robot.with([0.0; 3], [1.0, 0.0, 0.0, 0.0], Branch::ElbowUp));
    let place = bare.place(&[0.0, 0.0, FRAC_PI_2, 0.0, 0.0, 0.0]);
    for (got, want) in place
        .iter()
        .zip([0.150 + 0.600 + 0.065, 0.0, 0.4865 + 0.700])
    {
        assert!((got - want).abs() < 1e-12, "{place:?}");
    }
    // ABB's tool0 there: Z forward, X down.
    let tool = Kinematics::Opw(robot.with([0.1, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], Branch::ElbowUp));
    let lower = tool.place(&[0.0, 0.0, FRAC_PI_2, 0.0, 0.0, 0.0]);
    assert!((place[2] - lower[2] - 0.1).abs() < 1e-12);
}

/// The orientation is kept: a longer tool along the flange's Z moves the point along that Z.
#[test]
fn the_hand_points_where_it_is_told_to() {
    for (branch, _) in Branch::ALL {
        let Kinematics::Opw(arm) = crooked(branch) else {
            unreachable!()
        };
        let q = Kinematics::Opw(arm).angles([0.55, 0.35, 0.6]).unwrap();
        // As nalgebra has it.
        let [w, x, y, z] = arm.orientation;
        let turned = nalgebra::UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z));
        let matrix: [[f64; 3]; 3] = turned.to_rotation_matrix().into_inner().transpose().into();
        for axis in 0..3 {
            let mut longer = arm;
            longer.tool_m[axis] += 0.1;
            let moved = Kinematics::Opw(longer).place(&q);
            let from = Kinematics::Opw(arm).place(&q);
            for (k, row) in matrix.iter().enumerate() {
                let want = 0.1 * row[axis];
                assert!((moved[k] - from[k] - want).abs() < 1e-12, "{branch:?}");
            }
        }
    }
}

#[test]
fn levers_are_the_differences_of_the_place() {
    let mut seen = 0;
    const STEP: f64 = 1e-6;
    for (arm, places) in all() {
        for place in places {
            let Ok(q) = arm.angles(place) else { continue };
            seen += 1;
            let levers = arm.levers(&q);
            for joint in 0..6 {
                let at = |by: f64| {
                    let mut q = q;
                    q[joint] += by;
                    arm.place(&q)
                };
                let (more, less) = (at(STEP), at(-STEP));
                for k in 0..3 {
                    let want = (more[k] - less[k]) / (2.0 * STEP);
                    assert!(
                        (levers[joint][k] - want).abs() < 1e-9,
                        "{arm:?} joint {joint}"
                    );
                }
            }
        }
    }
    assert!(seen >= 22, "{seen}");
}

#[test]
fn links_are_the_differences_of_the_place() {
    const STEP: f64 = 1e-6;
    for (arm, places) in all() {
        let q = arm.angles(places[0]).unwrap();
        let mut links = 0;
        for joint in 0..6 {
            let Some(along) = arm.along_link(joint, &q) else {
                continue;
            };
            links += 1;
            let longer = |by: f64| {
                let mut lengths = [0.0; 6];
                lengths[joint] = by;
                arm.with_links(&lengths).place(&q)
            };
            let (more, less) = (longer(STEP), longer(-STEP));
            for k in 0..3 {
                let want = (more[k] - less[k]) / (2.0 * STEP);
                assert!((along[k] - want).abs() < 1e-9, "{arm:?} joint {joint}");
            }
        }
        assert_eq!(links, 2);
    }
}

#[test]
fn what_cannot_be_reached_is_refused() {
    let two = scara(Elbow::Positive);
    assert_eq!(two.angles([1.3, 0.0, 0.0]), Err(ReachError::OutOfReach));
    assert_eq!(two.angles([0.1, 0.0, 0.0]), Err(ReachError::OutOfReach));
    assert_eq!(two.angles([1.1949, 0.0, 0.0]), Err(ReachError::Elbow));
    let six = paper(Branch::ElbowUp);
    assert_eq!(six.angles([2.0, 0.0, 0.5]), Err(ReachError::OutOfReach));
    assert_eq!(six.angles([0.0, 0.065, 0.9]), Err(ReachError::Shoulder));
    // The forearm hangs straight down: axes 4 and 6 on one line.
    let straight = Kinematics::Opw(Robot::named("abb-irb1600-6-1.45").unwrap().with(
        [0.0; 3],
        [0.0, 0.0, 1.0, 0.0],
        Branch::ElbowUp,
    ));
    let wrist_above = [0.15 + 0.7, 0.0, 0.4865 - 0.6 - 0.065];
    assert_eq!(straight.angles(wrist_above), Err(ReachError::Wrist));
    let around = Orbit::new(&two, [0.0; 3], Frame::of(Plane::Xy), 0.5);
    assert_eq!(around.unwrap_err().1, ReachError::Around);
}

/// Tables and waves against the kinematics itself, between the nodes.
#[test]
fn a_circle_is_that_of_its_joints() {
    for (arm, places) in all() {
        let frame = Frame::across([0.1, -0.2, 1.0]).unwrap();
        let Ok(orbit) = Orbit::new(&arm, places[0], frame, 0.08) else {
            panic!("{arm:?}");
        };
        for angle in [0.1_f64, 1.7, 4.4] {
            let (sin, cos) = angle.sin_cos();
            let place = [0, 1, 2]
                .map(|k| places[0][k] + 0.08 * (cos * frame.first()[k] + sin * frame.second()[k]));
            let q = arm.angles(place).unwrap();
            for (joint, &truth) in q.iter().enumerate().take(arm.turning()) {
                let [got, ..] = orbit.at(joint, angle);
                assert!(short_way(got, truth).abs() < 1e-6);
                let waves = orbit.waves(joint).iter().enumerate();
                let sum: Complex<f64> = waves
                    .map(|(n, wave)| wave * Complex::cis(n as f64 * angle))
                    .sum();
                assert!(short_way(sum.re, truth).abs() < 1e-6, "{arm:?} {joint}");
            }
        }
        for joint in 0..arm.turning() {
            for reversal in orbit.reversals(joint) {
                let [_, rate, _] = orbit.at(joint, reversal.angle_rad);
                assert!(rate.abs() < 1e-9);
                let [_, after, _] = orbit.at(joint, reversal.angle_rad + 0.01);
                assert!(after * reversal.bend > 0.0);
            }
        }
    }
}

/// The same delay of all joints turns the circle and nothing else; a common gain of slides shrinks it.
#[test]
fn what_all_joints_do_alike() {
    let orbit = Orbit::new(
        &paper(Branch::ElbowUp),
        [-0.29, 0.987, 0.615],
        Frame::of(Plane::Xy),
        0.1,
    )
    .unwrap();
    let delay: [Complex<f64>; WAVES] = std::array::from_fn(|n| Complex::cis(-0.05 * n as f64));
    for error in orbit.common(&delay) {
        assert!(error.abs() < 1e-9, "{error:e}");
    }
    let slides = Orbit::new(
        &Kinematics::Slides,
        [0.1, 0.2, 0.3],
        Frame::of(Plane::Zx),
        0.1,
    )
    .unwrap();
    let mut shrunk = [Complex::new(1.0, 0.0); WAVES];
    shrunk[1] = Complex::new(0.99, 0.0);
    for error in slides.common(&shrunk) {
        assert!((error + 0.001).abs() < 1e-12, "{error:e}");
    }
}

/// An independent program: `rs-opw-kinematics`.
#[test]
fn places_are_those_of_another_program() {
    use rs_opw_kinematics::kinematic_traits::Kinematics as _;
    use rs_opw_kinematics::kinematics_impl::OPWKinematics;
    use rs_opw_kinematics::parameters::opw_kinematics::Parameters;
    for branch in [Branch::ElbowUp, Branch::ElbowDown] {
        let Kinematics::Opw(arm) = crooked(branch) else {
            unreachable!()
        };
        let other = OPWKinematics::new(Parameters {
            a1: arm.a1_m,
            a2: arm.a2_m,
            b: arm.b_m,
            c1: arm.c1_m,
            c2: arm.c2_m,
            c3: arm.c3_m,
            c4: arm.c4_m,
            ..Parameters::new()
        });
        let bare = Kinematics::Opw(Opw {
            tool_m: [0.0; 3],
            ..arm
        });
        for step in 0..20 {
            let angle = |k: usize| ((step * 7 + k * 5) as f64 * 0.37) % TAU - 3.0;
            let q: Angles = std::array::from_fn(angle);
            let theirs = other.forward(&q).translation;
            let ours = bare.place(&q);
            for (a, b) in ours.iter().zip([theirs.x, theirs.y, theirs.z]) {
                assert!((a - b).abs() < 1e-9, "{q:?}: {ours:?} {theirs:?}");
            }
        }
    }
}
