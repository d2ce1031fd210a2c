//! How streams come to rest: from any moment of lines, circles and changes of speed.
extern crate std;
use super::tests::{plan_with, sample_at};
use super::*;
use giotto_shared::law::Operator;
use giotto_shared::path::smoothstep;
use std::vec::Vec;

const DT: f64 = 1e-3;
const ACCELERATION: f64 = 5.0;
const JERK: f64 = 100.0;

/// Length of the path after `t` s: up to a feed within the limits in a second, then steady.
fn length(t: f64, feed: f64) -> f64 {
    let s = smoothstep((t / 1.2).clamp(0.0, 1.0));
    feed * (1.2 * s.integral + (t - 1.2).max(0.0))
}

fn on_line(t: f64) -> [f64; 3] {
    let way = length(t, 1.0);
    [0.6 * way, -0.8 * way, 0.0]
}

fn on_circle(t: f64) -> [f64; 3] {
    let angle = length(t, 0.5) / 0.1;
    [0.1 * angle.cos() - 0.1, 0.0, 0.1 * angle.sin()]
}

fn nm(place: [f64; 3]) -> [i32; 3] {
    place.map(|m| (m * 1e9).round() as i32)
}

fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| a[i] - b[i])
}

fn size(v: [f64; 3]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// The paper's robot.
const ROBOT: Operator<f32> = Operator {
    second_s2: -23.29e-6,
    fourth_s4: 0.23e-6,
};

/// Programmed places, m, from the first on; the stream is stopped, or dies, after `at` of them.
fn stopped(path: fn(f64) -> [f64; 3], at: usize, dies: bool) -> Vec<[f64; 3]> {
    let plan = plan_with(ROBOT);
    let mut stream: Stream = Stream::new(&plan, [0; 3], 0, true);
    let mut out = Vec::new();
    for n in 0..at {
        out.push(stream.tick(Some(sample_at(n, nm(path(n as f64 * DT))))));
    }
    if !dies {
        stream.stop();
    }
    while !stream.over() {
        out.push(stream.tick(None));
        assert!(out.len() < 20_000);
    }
    out.iter()
        .map(|o| o.nominal_nm.map(|nm| f64::from(nm) * 1e-9))
        .collect()
}

/// Speed at the end of `at` ticks, m/s, and how it grew, m/s².
fn speed_at(path: fn(f64) -> [f64; 3], at: usize) -> [f64; 2] {
    let speed = |n: usize| size(difference(path(n as f64 * DT), path((n - 1) as f64 * DT))) / DT;
    [speed(at - 1), (speed(at - 1) - speed(at - 2)) / DT]
}

/// Longest way to rest that the limits leave, m: from a speed, which grows by its acceleration for so many ticks (a stream that
/// died is bridged) and then until that is taken back at the limit of jerk; v²/2a at what the curvature leaves of the
/// acceleration; and v·a/2j, since the deceleration itself comes and goes at the limit of jerk.
fn longest_way(speed: f64, growth: f64, curvature: f64, bridged: f64) -> f64 {
    let growth = growth.max(0.0);
    let after = speed + growth * bridged * DT;
    let taken_back = growth / JERK * (after + growth * growth / (3.0 * JERK));
    let top = after + growth * growth / (2.0 * JERK);
    let [limit, _] = plan_with(ROBOT)
        .limits()
        .map(|nm| f64::from(nm) * 1e-9 / (DT * DT));
    let across = curvature * top * top;
    let along = (limit * limit - across * across).max(0.0).sqrt();
    let along = along.max(0.3 * limit);
    let braked = 0.5 * top * (top / along + along / JERK);
    (bridged + 1.0) * DT * after + taken_back + braked
}

#[test]
fn every_stop_keeps_the_limits_and_the_distance() {
    for (name, path, curvature) in [
        ("line", on_line as fn(f64) -> [f64; 3], 0.0),
        ("circle", on_circle, 10.0),
    ] {
        for at in (20..2000).step_by(33) {
            for dies in [false, true] {
                let places = stopped(path, at, dies);
                let what = std::format!("{name} stopped after {at} ticks, died {dies}");
                within_limits(&places, name == "circle", &what);
                let [speed, growth] = speed_at(path, at);
                // A stream that died has gone on for five ticks.
                let bridged = if dies { 5.0 } else { 0.0 };
                // The filter is late by two strides: what is programmed from the stop on is what came out after the last
                // set-point that came.
                let from = path((at - 1) as f64 * DT);
                let begin = places
                    .iter()
                    .position(|p| size(difference(*p, from)) < 2e-9);
                let way: f64 = places[begin.unwrap()..]
                    .windows(2)
                    .map(|w| size(difference(w[1], w[0])))
                    .sum();
                let bar = longest_way(speed, growth, curvature, bridged);
                assert!(way < 1.01 * bar + 1e-6, "{what}: {way} of {bar} m");
                // The bar of a machine at 1 m/s, 5 m/s² and 100 m/s³; slower, v·a/2j is a larger share of the way.
                if speed > 0.999 && !dies {
                    assert!(
                        way < 1.3 * speed * speed / (2.0 * ACCELERATION),
                        "{what}: {way} m"
                    );
                }
            }
        }
    }
}

/// Largest acceleration, m/s², and jerk, m/s³.
fn largest(places: &[[f64; 3]]) -> [f64; 2] {
    let rates = |places: &[[f64; 3]]| -> Vec<_> {
        let rate = |w: &[[f64; 3]]| difference(w[1], w[0]).map(|d| d / DT);
        places.windows(2).map(rate).collect()
    };
    let acceleration = rates(&rates(places));
    let most = |v: &[[f64; 3]]| v.iter().copied().map(size).fold(0.0, f64::max);
    [most(&acceleration), most(&rates(&acceleration))]
}

fn within_limits(places: &[[f64; 3]], curved: bool, what: &str) {
    let [acceleration, jerk] = largest(places);
    // Rounding to nanometres: 4 nm of a second difference, 8 of a third.
    assert!(
        acceleration < ACCELERATION + 0.01,
        "{what}: {acceleration} m/s²"
    );
    // That of the curvature comes on top.
    let bar = if curved { 1.25 } else { 1.02 };
    assert!(jerk < JERK * bar + 10.0, "{what}: {jerk} m/s³");
}

/// On the circle until it stands, to a few micrometres.
#[test]
fn a_stop_follows_the_curvature() {
    for at in [700, 1300, 1700] {
        let places = stopped(on_circle, at, false);
        let [speed, _] = speed_at(on_circle, at);
        let off = places
            .iter()
            .map(|[x, y, z]| ((x + 0.1).hypot(*z) - 0.1).abs().max(y.abs()))
            .fold(0.0, f64::max);
        let way: f64 = places[at - 1..]
            .windows(2)
            .map(|w| size(difference(w[1], w[0])))
            .sum();
        std::println!(
            "stop from {speed:.3} m/s: {way:.4} m, {:.2} um off",
            off * 1e6
        );
        assert!(off < 10e-6, "{off}");
        // Along the tangent it would be half a millimetre at least.
        assert!(way * way / 0.2 > 3e-4);
    }
}

/// A swing to and fro across a steady feed: dying where it turns back, it is carried on ever faster out of its sharpest turn.
#[test]
fn a_brake_out_of_a_sharp_turn_keeps_the_acceleration() {
    fn swing(t: f64) -> [f64; 3] {
        let faded = smoothstep((t / 0.5).min(1.0)).value;
        [
            length(t, 0.02),
            faded * 0.01 * (1.0 - (15.0 * t).cos()),
            0.0,
        ]
    }
    let mut most = 0.0f64;
    for at in (600..1100).step_by(3) {
        for dies in [false, true] {
            let places = stopped(swing, at, dies);
            most = most.max(largest(&places)[0]);
        }
    }
    std::println!("{most} m/s² at most");
    assert!(most < ACCELERATION, "{most}");
}

/// A sender that goes to and fro at the largest feed, or starts at it at once, and dies or is stopped.
#[test]
fn however_rough_the_set_points_no_step_is_longer_than_the_feed() {
    let plan = plan_with(Operator::default());
    for period in [1, 2, 3, 5, 40] {
        for at in 30..60 {
            for dies in [false, true] {
                let mut stream: Stream = Stream::new(&plan, [0; 3], 0, true);
                let (mut place, mut last) = ([0; 3], [0; 3]);
                for n in 0..4000 {
                    let forth = if n / period % 2 == 0 { 1 } else { -1 };
                    let came = n < at;
                    if came && n > 25 {
                        place[0] += 1_000_000 * forth;
                        place[1] -= 900_000 * forth;
                    }
                    if n == at && !dies {
                        stream.stop();
                    }
                    let out = stream.tick(came.then(|| sample_at(n, place)));
                    let step = [0, 1].map(|axis| f64::from(out.nominal_nm[axis] - last[axis]));
                    let step = step[0].hypot(step[1]);
                    // What a set-point may be away from the one before, on both axes; and what a tick of jerk adds.
                    let most = 1_050_000.0 * 2f64.sqrt() + 50.0 + 2.0;
                    assert!(step <= most, "{period} {at} {dies} {n}: {step}");
                    last = out.nominal_nm;
                }
                assert!(stream.over());
            }
        }
    }
}

/// What has room stops within the coordinates, whatever way it goes and turns, also when the brake begins a tick later.
#[test]
fn what_has_room_stops_within_the_coordinates() {
    let limits = plan_with(Operator::default()).limits;
    let outward = [1.0, 0.0, 0.0];
    let mut rooms = [0; 2];
    for place in (1_400..2_126).step_by(20) {
        for speed in (0..=1_000_000).step_by(125_000) {
            for [out, up] in [[1.0, 0.0], [0.6, 0.8], [0.0, 1.0], [-0.8, 0.6], [-1.0, 0.0]] {
                for [x, y] in [[0, 0], [4000, 0], [0, 4000], [-3000, 3000], [5000, 0]] {
                    let velocity = [out, up, 0.0].map(|part| (part * f64::from(speed)) as i32);
                    let place_nm = place * 1_000_000;
                    let change = [x, y, 0];
                    let room = brake::has_room(limits, [place_nm, 0, 0], velocity, change);
                    rooms[usize::from(room)] += 1;
                    let later = [0, 1, 2].map(|i| (velocity[i] + change[i]) as f32);
                    let change = change.map(|nm| nm as f32);
                    let accelerations = [limits.acceleration, limits.jerk];
                    let way = farthest_nm(accelerations, later, change, outward);
                    let end = f64::from(place_nm) + f64::from(later[0].max(0.0) + way);
                    assert!(
                        !room || end <= f64::from(FARTHEST_NM),
                        "{place} {velocity:?} {change:?}: {end}"
                    );
                }
            }
        }
    }
    assert!(rooms.iter().all(|count| *count > 500), "{rooms:?}");
}
