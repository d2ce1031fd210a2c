//! Stops from constant feed: how long they are, within which limits, and that they stay on the path.
use super::{std, table};
use crate::engine::{CircleRun, Config, Engine, Output, Segment, flag};
use giotto_shared::{Direction, Plane};
use std::vec::Vec;

const DT: f64 = 1e-3;

/// Feed, radius (of a line: infinite), acceleration and jerk; SI.
type Case = [f64; 4];

/// Runs on a circle, an arc or a line and stops at constant feed; the programmed places from the last one before the stop on.
fn stopped([feed, radius, acceleration, jerk]: Case, arc: bool) -> Vec<[f64; 3]> {
    let mut config = Config::robot((1.0 / DT) as u32);
    config.motion.acceleration_m_s2 = acceleration;
    config.motion.jerk_m_s3 = jerk;
    let mut engine = Engine::new(config).unwrap();
    if radius.is_infinite() {
        engine.set_position([-1_000_000_000, 0, 0]).unwrap();
        let to_m = [0.8, 0.5, 0.1];
        engine
            .push(&Segment::Line {
                to_m,
                feed_m_s: feed,
            })
            .unwrap();
    } else if arc {
        engine.set_position([(radius * 1e9) as i32, 0, 0]).unwrap();
        let arc = Segment::Arc {
            centre_m: [0.0; 3],
            normal: [0.0, 0.0, 1.0],
            sweep_rad: 6.0,
            rise_m: 0.0,
            feed_m_s: feed,
        };
        engine.push(&arc).unwrap();
    } else {
        let circle = CircleRun {
            centre_m: [0.0; 3],
            radius_m: radius,
            feed_m_s: feed,
            plane: Plane::Xy,
            direction: Direction::Ccw,
            laps: 1,
            start_rad: 0.0,
        };
        engine.run_circle(&circle).unwrap();
    }
    let mut out: Vec<Output> = Vec::new();
    // A circle has a way to its start before it.
    let before = u32::from(!arc && radius.is_finite());
    while out.last().is_none_or(|o| o.flags & flag::CRUISE == 0)
        || engine.counters().segments < before
    {
        out.push(engine.tick());
    }
    for _ in 0..100 {
        out.push(engine.tick());
    }
    engine.stop();
    let from = out.len() - 4;
    while !engine.idle() {
        out.push(engine.tick());
    }
    let place = |o: &Output| o.nominal_nm.map(|nm| f64::from(nm) * 1e-9);
    out[from..].iter().map(place).collect()
}

fn rates(v: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let rate = |w: &[[f64; 3]]| [0, 1, 2].map(|i| (w[1][i] - w[0][i]) / DT);
    v.windows(2).map(rate).collect()
}

fn size(v: &[f64; 3]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

#[test]
fn a_stop_from_constant_feed_is_as_short_as_the_limits_let_it() {
    const LINE: f64 = f64::INFINITY;
    let cases: [Case; 10] = [
        [1.0, 1.0, 5.0, 100.0],
        [1.0, 0.7, 5.0, 100.0],
        [1.0, LINE, 5.0, 100.0],
        [0.5, 0.1, 5.0, 100.0],
        [0.3, 0.1, 5.0, 100.0],
        [0.5, 0.2, 5.0, 1000.0],
        [0.05, 0.05, 5.0, 100.0],
        [0.1, LINE, 5.0, 100.0],
        [0.2, 0.3, 0.5, 5.0],
        [0.9, 0.5, 10.0, 300.0],
    ];
    for case in cases {
        let [feed, radius, acceleration, jerk] = case;
        for arc in [false, true] {
            let places = stopped(case, arc);
            let velocity = rates(&places);
            // What the constant feed really is: a circle's is a tick's rounding below what was asked for.
            let speed = size(&velocity[0]);
            let across = speed * speed / radius;
            let what = std::format!("{case:?} arc {arc}, {speed:.4} m/s");
            assert!(speed > 0.85 * feed, "{what}");
            let way: f64 = velocity[3..].iter().map(size).sum::<f64>() * DT;
            // What the turn leaves where it is fastest; at most that, since it slows down while the braking comes. Not all of it is
            // used: the planner tries in steps.
            let braking = (acceleration * acceleration - across * across).sqrt();
            let bound = |braking: f64| {
                if speed >= braking * braking / jerk {
                    speed * speed / (2.0 * braking) + speed * braking / (2.0 * jerk)
                } else {
                    speed * (speed / jerk).sqrt()
                }
            };
            let least = bound(acceleration) - speed * DT;
            let most = bound(0.95 * braking) + 1.5 * speed * DT;
            std::println!(
                "{what}: {:.1} mm, {:.3} times v²/2a",
                way * 1e3,
                way * 2.0 * acceleration / (speed * speed)
            );
            assert!(way > least && way < most, "{what}: {least} {way} {most}");
            if feed == 1.0 {
                assert!(
                    way <= 1.3 * speed * speed / (2.0 * acceleration),
                    "{what}: {way}"
                );
            }
            // Second and third differences of whole nanometres: 4 and 8 of them.
            let acceleration_at = rates(&velocity);
            let largest = acceleration_at.iter().map(size).fold(0.0, f64::max);
            assert!(largest < acceleration + 0.005, "{what}: {largest} m/s²");
            let speeds: Vec<[f64; 3]> = velocity.iter().map(|v| [size(v), 0.0, 0.0]).collect();
            let along = rates(&rates(&speeds));
            let largest = along.iter().map(size).fold(0.0, f64::max);
            assert!(largest < 1.001 * jerk + 8.0, "{what}: {largest} m/s³");
            if radius.is_finite() {
                assert!(
                    places
                        .iter()
                        .all(|[x, y, _]| (x.hypot(*y) - radius).abs() < 3e-9)
                );
            }
        }
    }
}

/// A stop in any tick of a program, with the strongest of corrections: acceleration of the commanded path, nothing beyond the end.
#[test]
fn a_stop_in_any_tick_keeps_the_commanded_acceleration() {
    let mut worst = [0.0f64; 2];
    for radius_m in [0.05, 0.2] {
        for at in (0..1700).step_by(17) {
            let mut engine = Engine::new(Config::robot(1000)).unwrap();
            let kappa = super::motion::KAPPA;
            engine.load(Some(&table(kappa[0], kappa[1]))).unwrap();
            engine
                .set_position([(radius_m * 1e9) as i32, 0, 0])
                .unwrap();
            let arc = Segment::Arc {
                centre_m: [0.0; 3],
                normal: [0.0, 0.0, 1.0],
                sweep_rad: 0.3 / radius_m,
                rise_m: 0.0,
                feed_m_s: 0.4,
            };
            engine.push(&arc).unwrap();
            let mut out: Vec<Output> = (0..at).map(|_| engine.tick()).collect();
            engine.stop();
            while !engine.idle() {
                out.push(engine.tick());
            }
            for (worst, pick) in worst.iter_mut().zip([
                (|o: &Output| o.nominal_nm) as fn(&Output) -> [i32; 3],
                |o| o.corrected_nm,
            ]) {
                let places: Vec<_> = out
                    .iter()
                    .map(|o| pick(o).map(|nm| f64::from(nm) * 1e-9))
                    .collect();
                let largest = rates(&rates(&places)).iter().map(size).fold(0.0, f64::max);
                *worst = worst.max(largest);
            }
            for o in &out {
                let angle = f64::from(o.nominal_nm[1]).atan2(f64::from(o.nominal_nm[0]));
                let end = 0.3 / radius_m;
                let angle = if angle < -1e-9 {
                    angle + core::f64::consts::TAU
                } else {
                    angle
                };
                assert!(angle <= end + 1e-8 || end > 6.0, "beyond the end: {angle}");
            }
            let last = out.last().unwrap();
            assert_eq!(last.nominal_nm, last.corrected_nm);
        }
    }
    std::println!("programmed {:.3}, commanded {:.3} m/s²", worst[0], worst[1]);
    assert!(worst[0] < 5.005 && worst[1] < 1.1 * 5.0, "{worst:?}");
}
