//! Jets against differences, single against double precision.
use super::*;
use core::f64::consts::TAU;

fn irb1600() -> Kinematics<f64> {
    Kinematics::Opw(IRB1600)
}

const OMEGA: f64 = 7.0;

/// The paper's circle at a time, with its derivatives.
fn circle(time_s: f64) -> [[f64; 3]; 5] {
    core::array::from_fn(|order| {
        let angle = OMEGA * time_s + TAU / 4.0 * order as f64;
        let size = 0.1 * OMEGA.powi(order as i32);
        let centre = if order == 0 { PAPER_CENTRE_M } else { [0.0; 3] };
        [
            centre[0] + size * angle.cos(),
            centre[1] + size * angle.sin(),
            centre[2],
        ]
    })
}

#[test]
fn jets_are_the_derivatives_of_the_angles() {
    let scara = Kinematics::Scara(Scara {
        l1_m: 0.7,
        l2_m: 0.6,
        elbow: Elbow::Negative,
    });
    for arm in [irb1600(), scara] {
        let at = |time_s: f64| arm.angles(circle(time_s)[0]).unwrap();
        // Central differences of fourth order in h; what they leave is measured by halving h elsewhere.
        let h = 4e-3;
        for step in 0..40 {
            let time_s = 0.02 * f64::from(step);
            let jets = arm.angles(path(&circle(time_s))).unwrap();
            let q: [[f64; 6]; 7] = core::array::from_fn(|k| at(time_s + h * (k as f64 - 3.0)));
            for joint in 0..arm.turning() {
                let f = |k: usize| q[k][joint];
                let [value, first, second, _, fourth] = jets[joint].derivatives();
                let d1 = (8.0 * (f(4) - f(2)) - (f(5) - f(1))) / (12.0 * h);
                let d2 = (16.0 * (f(4) + f(2)) - (f(5) + f(1)) - 30.0 * f(3)) / (12.0 * h * h);
                let inner = f(4) + f(2) - 2.0 * f(3);
                let outer = f(5) + f(1) - 2.0 * f(3);
                let far = f(6) + f(0) - 2.0 * f(3);
                let d4 = (12.0 * outer - 39.0 * inner - far) / (6.0 * h.powi(4));
                assert!((value - f(3)).abs() < 1e-13);
                assert!((first - d1).abs() < 1e-4, "{joint}: {first} {d1}");
                assert!((second - d2).abs() < 1e-3, "{joint}: {second} {d2}");
                assert!(
                    (fourth - d4).abs() < 0.02 * OMEGA.powi(4),
                    "{joint}: {fourth} {d4}"
                );
            }
        }
    }
}

/// What a tick in single precision sees of place and derivatives.
#[test]
fn single_precision_is_enough_for_rates() {
    let (exact, single) = (irb1600(), irb1600().map(|v| v as f32));
    let mut worst = [0.0f64; 5];
    for step in 0..200 {
        let derivatives = circle(0.0045 * f64::from(step));
        let rounded = derivatives.map(|d| d.map(|v| v as f32));
        let (a, b) = (
            exact.angles(path(&derivatives)).unwrap(),
            single.angles(path(&rounded)).unwrap(),
        );
        for (a, b) in a.into_iter().zip(b) {
            let pairs = a.derivatives().into_iter().zip(b.derivatives());
            for ((exact, single), worst) in pairs.zip(&mut worst) {
                *worst = worst.max((exact - f64::from(single)).abs());
            }
        }
    }
    // Relative to rates of 1 rad/s, 10 rad/s², 1000 rad/s⁴.
    let [angle, first, second, _, fourth] = worst;
    assert!(
        angle < 1e-6 && first < 1e-5 && second < 1e-4 && fourth < 2e-2,
        "{worst:?}"
    );
}

#[test]
fn no_place_beyond_reach_gives_numbers() {
    for arm in [
        irb1600(),
        Kinematics::Scara(Scara {
            l1_m: 0.4,
            l2_m: 0.3,
            elbow: Elbow::Positive,
        }),
    ] {
        for place in [[f64::NAN; 3], [9.0, 0.0, 0.0], [f64::INFINITY; 3]] {
            assert!(arm.angles(place).is_err(), "{place:?}");
        }
    }
}

#[test]
fn angles_lead_to_their_place_and_levers_are_differences() {
    for branch in Branch::ALL {
        let arm = Kinematics::Opw(Opw {
            branch: branch.0,
            ..IRB1600
        });
        for step in 0..20 {
            let [p, ..] = circle(0.045 * f64::from(step));
            let q = arm.angles(p).unwrap();
            for (a, b) in arm.place(&q).into_iter().zip(p) {
                assert!((a - b).abs() < 1e-12, "{}", branch.1);
            }
            for joint in 0..6 {
                let mut beside = [q; 2];
                beside[0][joint] -= 1e-6;
                beside[1][joint] += 1e-6;
                let [a, b] = beside.map(|q| arm.place(&q));
                for axis in 0..3 {
                    let lever = (b[axis] - a[axis]) / 2e-6;
                    assert!((lever - arm.levers(&q)[joint][axis]).abs() < 1e-8);
                }
            }
        }
    }
}
