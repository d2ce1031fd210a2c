//! The machine of the hidden-effect tests in other planes than XY: what a slide does is seen where that slide moves,
//! by the closed forms of the plane's own two axes, and nowhere else.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of a test fail as the test does"
)]
use giotto::campaign::Direction;
use giotto_tests::effects::{Case, Kind, Seat, Slides};
use giotto_tests::files;
use giotto_tests::machine::base::{Lab, Variety};
use giotto_tests::machine::{Instrument, Machine, Plane, Test, simulate};
use std::f64::consts::PI;

const N: usize = 720;

fn test(plane: Plane, radius_m: f64, feed_m_s: f64, direction: Direction) -> Test {
    Test {
        radius_m,
        feed_m_s,
        direction,
        start_angle_rad: 0.0,
        started_s: 0.0,
        samples: N,
        plane,
        centre_m: [0.0; 3],
        from_rest: false,
    }
}

/// Mean, cosine and sine of 2θ, m.
fn oval(machine: &Machine, test: &Test) -> [f64; 3] {
    let lap = simulate(machine, test, 1000.0, 0.0);
    let mut out = [0.0; 3];
    for (k, p) in lap.position_m.iter().enumerate() {
        let r = test.plane.radius(*p) - test.radius_m;
        let (s, c) = (2.0 * test.sign() * 2.0 * PI * k as f64 / N as f64).sin_cos();
        for (sum, weight) in out.iter_mut().zip([1.0, 2.0 * c, 2.0 * s]) {
            *sum += r * weight / N as f64;
        }
    }
    out
}

fn near(got: f64, want: f64, within: f64, what: &str) {
    assert!(
        (got - want).abs() <= within,
        "{what}: {got:e}, not {want:e}"
    );
}

/// Three scales and three right angles, each in the two planes or the one that shows it.
#[test]
fn scales_and_right_angles_are_seen_in_their_planes() {
    let mut m = Machine::default();
    let (scale, square) = ([30e-6, -20e-6, 50e-6], [40e-6, -10e-6, 25e-6]);
    (m.geometry.scale, m.geometry.squareness_rad) = (scale, square);
    let r = 0.2;
    for (plane, [a, b]) in Plane::ALL.into_iter().zip(Plane::PAIRS) {
        for direction in [Direction::Ccw, Direction::Cw] {
            let [mean, cos, sin] = oval(&m, &test(plane, r, 0.1, direction));
            near(mean, 0.5 * r * (scale[a] + scale[b]), 4e-9, "½R(sa+sb)");
            near(cos, 0.5 * r * (scale[a] - scale[b]), 4e-9, "½R(sa−sb)cos2θ");
            near(sin, 0.5 * r * square[a], 4e-9, "½εR·sin2θ");
        }
    }
}

/// In a tilted plane the same errors are a quadratic form of the direction: r = R·n̂ᵀEn̂.
#[test]
fn a_tilted_circle_sees_a_share_of_each_slide() {
    let mut m = Machine::default();
    m.geometry.scale = [30e-6, -20e-6, 50e-6];
    m.geometry.squareness_rad = [40e-6, -10e-6, 25e-6];
    let e = m.geometry;
    let t = test(Plane::tilted([0.3, -0.5, 0.8]), 0.15, 0.1, Direction::Ccw);
    let lap = simulate(&m, &t, 1000.0, 0.0);
    for (k, p) in lap.position_m.iter().enumerate() {
        let (s, c) = (2.0 * PI * k as f64 / N as f64).sin_cos();
        let n = t.plane.lift([c, s]);
        let form: f64 = (0..3)
            .map(|i| e.scale[i] * n[i] * n[i] + e.squareness_rad[i] * n[i] * n[(i + 1) % 3])
            .sum();
        near(t.plane.radius(*p) - 0.15, 0.15 * form, 4e-9, "R·nᵀEn");
    }
}

/// Backlash of Z: a step at Z's reversals in ZX and in YZ, nothing in XY.
#[test]
fn what_z_does_is_nowhere_in_xy() {
    let mut m = Machine::default();
    m.axes[2].backlash_m = 8e-6;
    m.lateral_play_m[2][0] = 0.0;
    for (plane, [a, b]) in Plane::ALL.into_iter().zip(Plane::PAIRS) {
        let t = test(plane, 0.1, 0.1, Direction::Ccw);
        let lap = simulate(&m, &t, 1000.0, 0.0);
        for (k, p) in lap.position_m.iter().enumerate() {
            let (s, c) = (2.0 * PI * k as f64 / N as f64).sin_cos();
            let (speed, want) = match (a, b) {
                (2, _) => (s, 4e-6 * s.signum() * c),
                (_, 2) => (c, -4e-6 * c.signum() * s),
                _ => (1.0, 0.0),
            };
            if speed.abs() > 0.03 {
                near(plane.radius(*p) - 0.1, want, 1e-9, "d(B/2)·sgn·lever");
            }
        }
    }
}

/// Sideways play keeps its sense: in every plane of two slides the mean moves against the direction.
#[test]
fn lateral_play_of_any_pair_moves_the_mean_by_the_same_rule() {
    for (plane, [a, b]) in Plane::ALL.into_iter().zip(Plane::PAIRS) {
        for (mover, moved) in [(a, b), (b, a)] {
            let mut m = Machine::default();
            m.lateral_play_m[mover][moved] = 5e-6;
            for direction in [Direction::Ccw, Direction::Cw] {
                let t = test(plane, 0.15, 0.1, direction);
                near(oval(&m, &t)[0], -t.sign() * 5e-6 / PI, 2e-8, "−dL/π");
            }
            for other in Plane::ALL.into_iter().filter(|p| *p != plane) {
                let t = test(other, 0.15, 0.1, Direction::Ccw);
                near(oval(&m, &t)[0], 0.0, 1e-10, "another plane");
            }
        }
    }
}

/// Away from the origin a bowed guide is out of square as well: at the centre c a bow K·x² has the slope 2Kc.
#[test]
fn a_bow_away_from_the_origin_is_out_of_square_too() {
    let mut m = Machine::default();
    m.geometry.bow_per_m[0][1] = 1e-4;
    let mut t = test(Plane::XY, 0.1, 0.1, Direction::Ccw);
    near(oval(&m, &t)[2], 0.0, 1e-10, "over the origin");
    t.centre_m = [0.4, -0.2, 0.1];
    near(
        oval(&m, &t)[2],
        0.5 * 0.1 * 2.0 * 1e-4 * 0.4,
        4e-9,
        "½R·2Kc",
    );
}

/// What is written is read back in its plane: by name for a ballbar, from the points of a tracker.
#[test]
fn campaigns_of_several_planes_come_back_from_their_files() {
    let planes = [
        Plane::XY,
        Plane::YZ,
        Plane::ZX,
        Plane::tilted([0.2, 0.5, 0.9]),
    ];
    for sees_angle in [false, true] {
        let mut lab = Lab::drawn(3, Variety::Small);
        lab.grid.planes = planes.to_vec();
        lab.grid.radii_m = vec![0.1];
        lab.grid.feeds_m_s = vec![0.1, 0.3];
        lab.instrument = Instrument {
            sees_angle,
            ..lab.instrument
        };
        let kind = Kind::Effects(vec!["backlash".into()]);
        let slides = Slides {
            pair: [2, 0],
            axis: Some(2),
        };
        let case = Case::on(&kind, 3.0, 3, lab, &[slides]).unwrap();
        assert_eq!(case.truth[0].seat, Seat::Slide(2));
        let dir = tempfile::tempdir().unwrap();
        files::write(&case.hidden(), dir.path()).unwrap();
        let read = giotto::campaign::read(dir.path()).unwrap();
        assert_eq!(read.runs.len(), 16);
        for (run, written) in read.runs.iter().zip(&case.campaign.runs) {
            let (got, want) = (run.frame, written.frame);
            for k in 0..3 {
                // A plane from points is as good as the points.
                near(got.first()[k], want.first()[k], 1e-3, &run.file);
                near(got.second()[k], want.second()[k], 1e-3, &run.file);
            }
            // Where points are read in is a matter of their centre: form and size are compared.
            let rms = |r: &giotto::campaign::Run| {
                let (d, n) = (&r.samples.deviation_m, r.samples.deviation_m.len() as f64);
                let wave = |f: fn(f64) -> f64| {
                    let sum: f64 = d
                        .iter()
                        .zip(&r.samples.angle_rad)
                        .map(|(x, a)| x * f(*a))
                        .sum();
                    2.0 * sum / n
                };
                let (c, s) = (wave(f64::cos), wave(f64::sin));
                let all: f64 = d.iter().map(|x| x * x).sum::<f64>() / n;
                (all - 0.5 * (c * c + s * s)).sqrt()
            };
            near(rms(run), rms(written), 0.05 * rms(written), &run.file);
        }
    }
}
