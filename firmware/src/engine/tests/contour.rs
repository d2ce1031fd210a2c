//! Contour error through a simulated machine, with the correction and without it.
//!
//! The machine is a position loop (lag 20 ms) behind a moving average (40 ms), the same on both axes, in `f64` and
//! exactly discretised: it shares nothing with the engine but the two cumulants.
//!
//! The third cumulant, which no circle gives, shows where the feed changes on a curve; the planner assumes that of the
//! lag and the average that have the table's cumulants, and that is what this machine is. How far the assumption carries
//! is seen on another machine, of two lags. The ramps here are gentle (0.5 m/s², 5 m/s³) for a machine whose answer
//! is 23 ms wide; the circle is judged at constant feed, its ramps (as fast as `Config::robot` allows) are printed beside.
use super::{run_out, std, table};
use crate::engine::{
    CircleRun, Config, Engine, Output, PLACES, Planner, Segment, Stream, StreamSample, flag,
};
use core::f64::consts::PI;
use giotto_shared::Direction;
use giotto_shared::path::smoothstep;
use std::vec::Vec;

const DT: f64 = 1e-3;
/// The machine of the bars, and another with two lags.
const LAG_S: [f64; 1] = [0.02];
const TWO_LAGS_S: [f64; 2] = [0.016, 0.01];
const AVERAGE_TICKS: usize = 40;

/// κ2 and κ4 of lags and average.
fn kappa(lags_s: &[f64]) -> [f32; 2] {
    let t = AVERAGE_TICKS as f64 * DT;
    let sum = |n: i32| lags_s.iter().map(|lag| lag.powi(n)).sum::<f64>();
    [
        (sum(2) + t * t / 12.0) as f32,
        (6.0 * sum(4) - t.powi(4) / 120.0) as f32,
    ]
}

/// The path of the machine with these lags, m, for set-points joined by straight lines.
fn machine(set_points: &[[f64; 2]], lags_s: &[f64]) -> Vec<[f64; 2]> {
    let mut path = lag(&average(set_points), lags_s[0]);
    for further in &lags_s[1..] {
        path = lag(&path, *further);
    }
    path.iter().step_by(FINE).copied().collect()
}

/// Steps in a tick.
const FINE: usize = 10;

fn lag(path: &[[f64; 2]], lag_s: f64) -> Vec<[f64; 2]> {
    let keep = (-DT / FINE as f64 / lag_s).exp();
    let mut lagged = path[0];
    path.iter()
        .map(|p| {
            for i in 0..2 {
                lagged[i] = lagged[i] * keep + (1.0 - keep) * p[i];
            }
            lagged
        })
        .collect()
}

fn average(set_points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut fine = Vec::new();
    for pair in set_points.windows(2) {
        for k in 0..FINE {
            let w = (k as f64 + 0.5) / FINE as f64;
            fine.push([0, 1].map(|i| pair[0][i] * (1.0 - w) + pair[1][i] * w));
        }
    }
    let width = AVERAGE_TICKS * FINE;
    let mut sum = fine[0].map(|p| p * width as f64);
    (0..fine.len())
        .map(|n| {
            let out = if n >= width { fine[n - width] } else { fine[0] };
            for i in 0..2 {
                sum[i] += fine[n][i] - out[i];
            }
            sum.map(|s| s / width as f64)
        })
        .collect()
}

/// Largest distance, m, of the machine's path from the programmed curve.
fn contour_error(
    set_points: &[[f64; 2]],
    lags_s: &[f64],
    distance: &dyn Fn([f64; 2]) -> f64,
    from: usize,
    to: usize,
) -> f64 {
    machine(set_points, lags_s)[from..to]
        .iter()
        .map(|&p| distance(p).abs())
        .fold(0.0, f64::max)
}

/// (corrected, not corrected), each an error in m.
fn both(out: &[Output], lags_s: &[f64], distance: &dyn Fn([f64; 2]) -> f64) -> (f64, f64) {
    let metres = |p: [i32; 3]| [f64::from(p[0]) * 1e-9, f64::from(p[1]) * 1e-9];
    let mut corrected: Vec<[f64; 2]> = out.iter().map(|o| metres(o.corrected_nm)).collect();
    let mut nominal: Vec<[f64; 2]> = out.iter().map(|o| metres(o.nominal_nm)).collect();
    // The machine comes to rest after the last set-point.
    for path in [&mut corrected, &mut nominal] {
        let last = path[path.len() - 1];
        path.extend([last; 400]);
    }
    let end = nominal.len() - 1;
    let error = |path: &[[f64; 2]]| contour_error(path, lags_s, distance, 0, end);
    (error(&corrected), error(&nominal))
}

fn engine(lags_s: &[f64], acceleration_m_s2: f64, jerk_m_s3: f64) -> Engine {
    let mut config = Config::robot(1000);
    (config.motion.acceleration_m_s2, config.motion.jerk_m_s3) = (acceleration_m_s2, jerk_m_s3);
    let mut engine = Engine::new(config).unwrap();
    let [k2, k4] = kappa(lags_s);
    engine.load(Some(&table(k2, k4))).unwrap();
    engine
}

fn report(name: &str, (corrected, not): (f64, f64), bar: f64) {
    std::println!(
        "{name}: {:.2} µm corrected, {:.1} µm not: {:.3} %",
        corrected * 1e6,
        not * 1e6,
        100.0 * corrected / not
    );
    assert!(not > 20e-6 && corrected <= bar * not, "{name}");
}

/// Distance from a polyline of many points, m.
fn from_polyline(points: &[[f64; 2]], p: [f64; 2]) -> f64 {
    points
        .windows(2)
        .map(|w| {
            let (a, b) = (w[0], [w[1][0] - w[0][0], w[1][1] - w[0][1]]);
            let length2 = b[0] * b[0] + b[1] * b[1];
            let t = (((p[0] - a[0]) * b[0] + (p[1] - a[1]) * b[1]) / length2.max(1e-30))
                .clamp(0.0, 1.0);
            (p[0] - a[0] - t * b[0]).hypot(p[1] - a[1] - t * b[1])
        })
        .fold(f64::INFINITY, f64::min)
}

#[test]
fn circle_with_entry_and_exit() {
    let mut engine = engine(&LAG_S, 5.0, 100.0);
    engine.set_position([100_000_000, 0, 0]).unwrap();
    let direction = Direction::Ccw;
    let run = CircleRun {
        centre_m: [0.05, 0.0, 0.0],
        radius_m: 0.05,
        feed_m_s: 0.3,
        plane: giotto_shared::Plane::Xy,
        direction,
        laps: 2,
        start_rad: 0.0,
    };
    engine.run_circle(&run).unwrap();
    let out = run_out(&mut engine);
    let first = out
        .iter()
        .rposition(|o| o.flags & flag::SETTLING != 0)
        .unwrap();
    let distance = |p: [f64; 2]| (p[0] - 0.05).hypot(p[1]) - 0.05;
    report(
        "circle R50 f300, ramps and all",
        both(&out[first..], &LAG_S, &distance),
        1.0,
    );
    // The machine has forgotten the entry when its longest memory has passed ten times.
    let begin = out
        .iter()
        .rposition(|o| o.flags & flag::CRUISE == 0 && o.flags & flag::SETTLING != 0)
        .unwrap();
    let cruise: Vec<usize> = (begin..out.len())
        .filter(|&n| out[n].flags & flag::CRUISE != 0)
        .collect();
    let path = |pick: &dyn Fn(&Output) -> [i32; 3]| -> Vec<[f64; 2]> {
        out[begin..]
            .iter()
            .map(pick)
            .map(|p| [f64::from(p[0]) * 1e-9, f64::from(p[1]) * 1e-9])
            .collect()
    };
    let (from, to) = (cruise[0] - begin + 400, cruise[cruise.len() - 1] - begin);
    let error = |set_points: &[[f64; 2]]| contour_error(set_points, &LAG_S, &distance, from, to);
    report(
        "circle R50 f300",
        (
            error(&path(&|o| o.corrected_nm)),
            error(&path(&|o| o.nominal_nm)),
        ),
        0.01,
    );
}

#[test]
fn arc_between_lines_and_rounded_rectangle() {
    arcs_with_joints(&LAG_S, 0.05);
}

/// Two lags are not the lag that the planner assumes: its κ3 is 94 % of theirs.
#[test]
fn arc_between_lines_and_rounded_rectangle_on_a_machine_of_two_lags() {
    arcs_with_joints(&TWO_LAGS_S, 0.05);
}

fn arcs_with_joints(lags_s: &[f64], bar: f64) {
    let mut engine = engine(lags_s, 0.5, 5.0);
    let feed_m_s = 0.2;
    let quarter = |centre: [f64; 2]| Segment::Arc {
        centre_m: [centre[0], centre[1], 0.0],
        normal: [0.0, 0.0, 1.0],
        sweep_rad: PI / 2.0,
        rise_m: 0.0,
        feed_m_s,
    };
    let line = |to: [f64; 2]| Segment::Line {
        to_m: [to[0], to[1], 0.0],
        feed_m_s,
    };
    let mut out = Vec::new();
    for segment in [line([0.08, 0.0]), quarter([0.08, 0.03]), line([0.11, 0.09])] {
        engine.push(&segment).unwrap();
        out.extend(run_out(&mut engine));
    }
    let distance = |p: [f64; 2]| {
        if p[0] <= 0.08 {
            p[1]
        } else if p[1] >= 0.03 {
            p[0] - 0.11
        } else {
            (p[0] - 0.08).hypot(p[1] - 0.03) - 0.03
        }
    };
    // Every arc here is ramps from end to end, so κ3 shows.
    report("arc between lines", both(&out, lags_s, &distance), bar);

    let (w, h, r) = (0.1, 0.06, 0.015);
    let mut engine = self::engine(lags_s, 0.5, 5.0);
    engine.set_position([15_000_000, 0, 0]).unwrap();
    let pieces = [
        line([w - r, 0.0]),
        quarter([w - r, r]),
        line([w, h - r]),
        quarter([w - r, h - r]),
        line([r, h]),
        quarter([r, h - r]),
        line([0.0, r]),
        quarter([r, r]),
    ];
    let mut out = Vec::new();
    for segment in pieces {
        engine.push(&segment).unwrap();
        out.extend(run_out(&mut engine));
    }
    let distance = |p: [f64; 2]| {
        let dx = (p[0] - w / 2.0).abs() - (w / 2.0 - r);
        let dy = (p[1] - h / 2.0).abs() - (h / 2.0 - r);
        if dx > 0.0 && dy > 0.0 {
            dx.hypot(dy) - r
        } else {
            dx.max(dy) - r
        }
    };
    report("rounded rectangle", both(&out, lags_s, &distance), bar);
}

/// A closed curve streamed twice round, started and ended smoothly.
fn streamed(curve: &dyn Fn(f64) -> [f64; 2], rate: f64) -> Vec<Output> {
    let nm = |p: [f64; 2]| [(p[0] * 1e9).round() as i32, (p[1] * 1e9).round() as i32, 0];
    let start = 3.0;
    let laps = 2.0 * 2.0 * PI / rate;
    let at = |n: usize| {
        let t = n as f64 * DT;
        let up = start * smoothstep(t / start).integral + (t - start).max(0.0);
        let down = t - laps;
        let lost = start * smoothstep(down / start).integral + (down - start).max(0.0);
        curve(rate * (up - if down > 0.0 { lost } else { 0.0 }))
    };
    let config = Config::robot(1000);
    let mut planner = Planner::new(&config, nm(at(0)));
    let [k2, k4] = kappa(&LAG_S);
    planner.set_table(Some(&table(k2, k4))).unwrap();
    let plan = planner.stream(1.0, PLACES).unwrap();
    let mut stream: Stream = Stream::new(&plan, nm(at(0)), 0, false);
    let ticks = ((laps + start) / DT) as usize + 300;
    (0..ticks)
        .map(|n| {
            stream.tick(Some(StreamSample {
                sequence: n as u16,
                position_nm: nm(at(n)),
            }))
        })
        .collect()
}

#[test]
fn streamed_ellipse_and_figure_of_eight() {
    let ellipse = |u: f64| [0.05 * u.cos(), 0.03 * u.sin()];
    let eight = |u: f64| [0.05 * u.sin(), 0.03 * (2.0 * u).sin()];
    #[allow(clippy::type_complexity, reason = "a table of curves, read once")]
    let shapes: [(&str, &dyn Fn(f64) -> [f64; 2], f64, f64); 2] = [
        ("ellipse", &ellipse, 5.0, 0.02),
        ("figure of eight", &eight, 4.0, 0.05),
    ];
    for (name, curve, rate, bar) in shapes {
        let out = streamed(curve, rate);
        let points: Vec<[f64; 2]> = (0..=1500)
            .map(|i| curve(2.0 * PI * f64::from(i) / 1500.0))
            .collect();
        report(
            name,
            both(&out, &LAG_S, &|p| from_polyline(&points, p)),
            bar,
        );
    }
}
