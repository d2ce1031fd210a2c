//! Soft limits: what is accepted stays within them to the end, what leaves them is refused before it moves.
use super::*;
use giotto_shared::{Actuator, Plane};
use proptest::prelude::*;

/// What single precision may carry an arc over a limit that it touches, nm.
const SLACK_NM: i32 = 400;
const SOFT_NM: [[i32; 2]; 3] = [
    [-80_000_000, 120_000_000],
    [-150_000_000, 60_000_000],
    [-30_000_000, 90_000_000],
];

fn limited() -> Bench {
    let mut bench = bench();
    let config = Config {
        soft_nm: SOFT_NM,
        ..bench.config
    };
    bench.desk.configure(&config).unwrap();
    bench
}

/// By how much a place is outside, nm; negative: inside.
fn outside(place_nm: [i32; 3]) -> i32 {
    place_nm
        .into_iter()
        .zip(SOFT_NM)
        .map(|(nm, [least, most])| (least - nm).max(nm - most))
        .max()
        .unwrap()
}

fn metres(nm: [i32; 3]) -> [f64; 3] {
    nm.map(|nm| f64::from(nm) * 1e-9)
}

/// The farthest place of a path in double precision, by how much it is outside, nm.
fn farthest(place_m: impl Fn(f64) -> [f64; 3]) -> i32 {
    (0..=20_000)
        .map(|n| outside(place_m(f64::from(n) / 20_000.0).map(|m| (m * 1e9).round() as i32)))
        .max()
        .unwrap()
}

/// Refused if it leaves the limits, with nothing moved; otherwise it stays within them in every tick.
/// A helix is taken for as far as its circle and its rise together may reach: `exact` is not for one.
fn holds(bench: &mut Bench, farthest_nm: i32, exact: bool, said: Result<(), MotionRefusal>) {
    match said {
        Err(MotionRefusal::SoftLimit { .. }) => {
            assert!(
                farthest_nm > -SLACK_NM || !exact,
                "refused, and inside by {farthest_nm}"
            );
            bench.desk.stop();
            bench.ticks(50);
            assert!(
                bench.path.iter().all(|place| *place == bench.path[0]),
                "it moved"
            );
        }
        Err(other) => panic!("{other}"),
        Ok(()) => {
            assert!(
                farthest_nm < SLACK_NM,
                "taken, and outside by {farthest_nm}"
            );
            bench.until_at_rest();
            let worst = bench.path.iter().copied().map(outside).max().unwrap();
            assert!(worst < SLACK_NM, "went outside by {worst}");
        }
    }
}

fn plane() -> impl Strategy<Value = Plane> {
    prop_oneof![Just(Plane::Xy), Just(Plane::Yz), Just(Plane::Zx)]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]

    #[test]
    fn circles_in_every_plane(plane in plane(), radius_m in 0.01..0.09_f64, x in -0.1..0.1_f64, y in -0.1..0.1_f64,
                              z in -0.05..0.1_f64) {
        let centre_m = [x, y, z];
        let run = CircleRun {
            centre_m,
            radius_m,
            feed_m_s: 0.5,
            plane,
            direction: Direction::Ccw,
            laps: 1,
            start_rad: 0.3,
        };
        let mut bench = limited();
        bench.ticks(1);
        let said = bench.desk.run_circle(&run.exact().unwrap());
        let arms = plane.axes();
        let far = farthest(|share| {
            let (s, c) = (2.0 * PI * share).sin_cos();
            let along = |slide: Actuator| {
                if slide == arms[0] { c } else if slide == arms[1] { s } else { 0.0 }
            };
            let [ax, ay, az] = Actuator::SLIDES.map(along);
            [x + radius_m * ax, y + radius_m * ay, z + radius_m * az]
        });
        holds(&mut bench, far, true, said);
    }

    #[test]
    fn lines_and_helices_in_any_plane(x in -0.1..0.14_f64, y in -0.2..0.1_f64, z in -0.05..0.12_f64, nx in -1.0..1.0_f64,
                                      ny in -1.0..1.0_f64, turns in 0.1..1.7_f64, rise_m in -0.06..0.06_f64, flat: bool) {
        let rise_m = if flat { 0.0 } else { rise_m };
        let mut bench = limited();
        bench.ticks(1);
        bench.desk.begin().unwrap();
        let to_m = [x, y, z];
        let exact = line(to_m).exact([0; 3]).unwrap();
        let said = bench.desk.append(&exact, 0);
        bench.desk.end().unwrap();
        holds(&mut bench, farthest(|share| to_m.map(|m| m * share)), true, said);

        // A helix from the origin about a centre in a tilted plane through it.
        let normal = [nx, ny, 0.7];
        let arm = [0.04, -0.03, (0.03 * ny - 0.04 * nx) / 0.7];
        let helix = Segment::Arc {
            centre_m: arm,
            normal,
            sweep_rad: turns * 2.0 * PI,
            rise_m,
            feed_m_s: 0.3,
        };
        let mut bench = limited();
        bench.ticks(1);
        bench.desk.begin().unwrap();
        let exact = helix.exact([0; 3]).unwrap();
        let said = bench.desk.append(&exact, 0);
        bench.desk.end().unwrap();
        let size = |v: [f64; 3]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        let unit = normal.map(|n| n / size(normal));
        let far = farthest(|share| {
            // Rodrigues: from the centre back to the origin, turned about the normal.
            let (s, c) = (turns * 2.0 * PI * share).sin_cos();
            let [a, b, d] = arm.map(|m| -m);
            let [u, v, w] = unit;
            let cross = [v * d - w * b, w * a - u * d, u * b - v * a];
            let mut place = arm;
            for (k, place) in place.iter_mut().enumerate() {
                *place += [a, b, d][k] * c + cross[k] * s + unit[k] * rise_m * share;
            }
            place
        });
        holds(&mut bench, far, flat, said);
    }
}

/// Set-points are looked at one by one: the batch with the first one outside is refused, and the machine comes to rest.
#[test]
fn a_stream_that_leaves_the_limits_is_refused_there() {
    let mut bench = limited();
    bench.desk.begin_stream(1.0, 4).unwrap();
    let mut steps = Steps::from([0; 3]);
    let mut refused = None;
    'all: for batch in 0..400 {
        let mut bytes = Chunk::new();
        for n in 0..8 {
            let t = f64::from(batch * 8 + n) * 1e-3;
            let y = -0.2 * smoothstep((t / 2.0).min(1.0)).value;
            assert!(steps.write([0, (y * 1e9) as i32, 0], &mut bytes));
        }
        loop {
            match bench.desk.points(&bytes) {
                Ok(()) => break,
                Err(MotionRefusal::QueueFull) => bench.ticks(8),
                Err(other) => {
                    refused = Some(other);
                    break 'all;
                }
            }
        }
    }
    assert_eq!(refused, Some(MotionRefusal::SoftLimit { axis: 1 }));
    let taken = metres(bench.now().raw_nm);
    assert!(taken[1] > -0.15, "{taken:?}");
}
