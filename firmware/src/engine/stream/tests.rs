//! Streams: law, latency, bypass, gaps.
extern crate std;
use super::super::arm::ArmPlan;
use super::*;
use giotto_shared::law::Operator;
use giotto_shared::path::smoothstep;
use std::vec::Vec;

const DT: f64 = 1e-3;
/// Lag 20 ms and moving average 40 ms.
const KAPPA: [f64; 2] = [4e-4 + 1.6e-3 / 12.0, 6.0 * 1.6e-7 - 2.56e-6 / 120.0];

fn plan() -> StreamPlan {
    let fourth_s4 = KAPPA[0] * KAPPA[0] / 8.0 - KAPPA[1] / 24.0;
    plan_with(Operator {
        second_s2: (-KAPPA[0] / 2.0) as f32,
        fourth_s4: fourth_s4 as f32,
    })
}

pub(super) fn plan_with(operator: Operator<f32>) -> StreamPlan {
    StreamPlan::build(&StreamNeeds {
        epoch: 0,
        longest: PLACES as u32,
        arm: ArmPlan::default(),
        operator: Some(operator),
        rate_hz: 1000.0,
        window_s: 0.015,
        feed_m_s: 1.0,
        acceleration_m_s2: 5.0,
        jerk_m_s3: 100.0,
        hold_ticks: 5,
        engage_ticks: 100,
        bounds_nm: (20_000_000, [200_000; 3]),
    })
    .unwrap()
}

/// An ellipse, started smoothly over half a second, then at constant angular rate.
fn ellipse(n: i32) -> [i32; 3] {
    let (t, rate, start) = ((f64::from(n) * DT).max(0.0), 6.0, 0.5);
    let theta = rate * (start * smoothstep(t / start).integral + (t - start).max(0.0));
    [
        (0.05 * theta.cos() * 1e9).round() as i32,
        (0.03 * theta.sin() * 1e9).round() as i32,
        7,
    ]
}

pub(super) fn sample_at(n: usize, position_nm: [i32; 3]) -> StreamSample {
    StreamSample {
        sequence: n as u16,
        position_nm,
    }
}

fn sample(n: i32) -> StreamSample {
    StreamSample {
        sequence: n as u16,
        position_nm: ellipse(n),
    }
}

#[test]
fn nominal_is_the_input_late_and_so_is_bypass_bit_for_bit() {
    let plan = plan();
    let latency = plan.latency() as i32;
    assert_eq!(latency, 2 * 15);
    let mut active: Stream = Stream::new(&plan, ellipse(0), 0, false);
    let mut bypass: Stream = Stream::new(&plan, ellipse(0), 0, true);
    let mut moved = 0;
    for n in 0..3000 {
        let (a, b) = (active.tick(Some(sample(n))), bypass.tick(Some(sample(n))));
        assert_eq!(a.nominal_nm, ellipse(n - latency));
        assert_eq!(
            (b.nominal_nm, b.corrected_nm),
            (ellipse(n - latency), ellipse(n - latency))
        );
        moved += i32::from(a.corrected_nm != a.nominal_nm);
    }
    assert!(moved > 2000);
}

#[test]
fn the_correction_is_the_operator() {
    let plan = plan();
    let mut stream: Stream = Stream::new(&plan, ellipse(0), 0, false);
    let mut worst = 0.0f64;
    for n in 0..4000 {
        let out = stream.tick(Some(sample(n)));
        if n > 700 {
            // Constant rate 6 rad/s: p″ = −36 p, p⁗ = 1296 p.
            let gain =
                KAPPA[0] / 2.0 * 36.0 + (KAPPA[0] * KAPPA[0] / 8.0 - KAPPA[1] / 24.0) * 1296.0;
            for axis in 0..2 {
                let offset = f64::from(out.corrected_nm[axis] - out.nominal_nm[axis]);
                worst = worst.max((offset - gain * f64::from(out.nominal_nm[axis])).abs());
            }
        }
    }
    std::println!(
        "largest error of the streamed correction {worst:.1} nm of {:.0} nm",
        0.05e9 * 36.0 * KAPPA[0] / 2.0
    );
    // The set-points' own rounding, seen through the differentiator, and the (hs)⁶ that it leaves.
    assert!(worst < 10.0, "{worst} nm");
}

#[test]
fn noise_comes_out_as_often_as_stated() {
    let plan = plan();
    let mut stream: Stream = Stream::new(&plan, [0; 3], 0, false);
    let (mut state, mut noise, mut offset) = (1u32, 0.0, 0.0);
    for n in 0..100_000u32 {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let x = (state >> 16) as i32 - (1 << 15);
        let out = stream.tick(Some(StreamSample {
            sequence: n as u16,
            position_nm: [x, 0, 0],
        }));
        noise += f64::from(x).powi(2);
        offset += f64::from(out.corrected_nm[0] - out.nominal_nm[0]).powi(2);
    }
    let (measured, stated) = ((offset / noise).sqrt(), plan.noise_gain());
    std::println!("noise gain {measured:.3}, stated {stated:.3}");
    assert!((measured / stated - 1.0).abs() < 0.02);
}

fn largest_steps(out: &[Output]) -> (f64, f64) {
    let mut speed = 0.0f64;
    let mut acceleration = 0.0f64;
    for w in out.windows(3) {
        for axis in 0..3 {
            let p = |i: usize| f64::from(w[i].corrected_nm[axis]) * 1e-9;
            speed = speed.max((p(2) - p(1)).abs() / DT);
            acceleration = acceleration.max((p(2) - 2.0 * p(1) + p(0)).abs() / (DT * DT));
        }
    }
    (speed, acceleration)
}

#[test]
fn a_short_gap_is_bridged_and_joined_without_a_jump() {
    let plan = plan();
    let run = |lost: &dyn Fn(i32) -> bool| {
        let mut stream: Stream = Stream::new(&plan, ellipse(0), 0, false);
        let out: Vec<Output> = (0..3000)
            .map(|n| stream.tick((!lost(n)).then(|| sample(n))))
            .collect();
        (out, *stream.counters(), stream.state())
    };
    let (whole, _, _) = run(&|_| false);
    let (gapped, counters, state) = run(&|n| (1500..1504).contains(&n) || n == 2000);
    assert_eq!((counters.missing, state), (5, StreamState::Running));
    let (v0, a0) = largest_steps(&whole);
    let (v1, a1) = largest_steps(&gapped);
    std::println!("whole {v0:.4} m/s {a0:.3} m/s²; gapped {v1:.4} m/s {a1:.3} m/s²");
    assert!(v1 < v0 + 0.02 && a1 < a0 + 0.7);
    assert_eq!(whole[2900..], gapped[2900..]);
    assert_ne!(whole[1540], gapped[1540]);
}

/// A path that sets off at once, with the acceleration that was to come in the gap: when its set-points are there again they are
/// somewhere else, and fast. Where they are joined neither place nor velocity may jump.
#[test]
fn set_points_that_went_another_way_in_a_gap_are_joined_within_the_acceleration() {
    const MOST: f64 = 5.0;
    for lost in 1..=5 {
        for across in [0.0, 2.5] {
            let path = |n: i32| {
                let t = f64::from(n - 100).max(0.0) * DT;
                [2.0, across, 0.0].map(|a| (0.5 * a * t * t * 1e9).round() as i32)
            };
            let mut stream: Stream = Stream::new(&plan(), path(0), 0, true);
            let out: Vec<Output> = (0..400)
                .map(|n| {
                    let sample = sample_at(n as usize, path(n));
                    stream.tick((!(100..100 + lost).contains(&n)).then_some(sample))
                })
                .collect();
            let (speed, acceleration) = largest_steps(&out);
            std::println!("{lost} lost: {speed:.4} m/s {acceleration:.3} m/s²");
            assert_eq!(stream.state(), StreamState::Running);
            assert!(acceleration < 2.5 + MOST / 8.0 + 0.01, "{acceleration}");
            let latency = plan().latency() as i32;
            assert_eq!(out[399].nominal_nm, path(399 - latency));
        }
    }
}

#[test]
fn late_doubled_and_wild_set_points_are_counted_and_do_no_harm() {
    let plan = plan();
    let mut stream: Stream = Stream::new(&plan, ellipse(0), 0, false);
    let mut out = Vec::new();
    for n in 0..3000 {
        let given = match n {
            1500 => sample(1499),
            1600 => StreamSample {
                position_nm: [900_000_000, 0, 0],
                ..sample(n)
            },
            1700 => StreamSample {
                position_nm: [i32::MIN; 3],
                ..sample(n)
            },
            _ => sample(n),
        };
        out.push(stream.tick(Some(given)));
    }
    let c = stream.counters();
    assert_eq!((c.late, c.rejected, c.missing), (1, 2, 3));
    let (v, a) = largest_steps(&out);
    assert!(v < 0.5 && a < 10.0, "{v} {a}");
}

/// The feed, 1 mm a tick, and 5 % for the rounding of whoever planned it.
#[test]
fn a_set_point_may_be_as_far_as_the_feed_and_no_farther() {
    for (share, rejected) in [(1.0, 0), (1.04, 0), (1.06, 1), (2.0, 1)] {
        let mut stream: Stream = Stream::new(&plan(), [0; 3], 0, false);
        for (sequence, x) in [(0, 0.0), (1, share * 1e6)] {
            stream.tick(Some(StreamSample {
                sequence,
                position_nm: [x as i32, 0, 0],
            }));
        }
        assert_eq!(stream.counters().rejected, rejected, "{share} of the feed");
    }
}

#[test]
fn a_lost_stream_comes_to_rest_ramps_out_and_faults() {
    let plan = plan();
    let mut stream: Stream = Stream::new(&plan, ellipse(0), 0, false);
    let mut out = Vec::new();
    for n in 0..1500 {
        out.push(stream.tick(Some(sample(n))));
    }
    let mut n = 0;
    while stream.state() != StreamState::Fault {
        out.push(stream.tick(None));
        n += 1;
        assert!(n < 20_000);
    }
    let (v, a) = largest_steps(&out);
    std::println!("rest after {n} ticks; {v:.3} m/s, {a:.2} m/s²");
    assert!(v < 0.5 && a < 10.0, "{v} {a}");
    let end = *out.last().unwrap();
    assert_eq!(end.nominal_nm, end.corrected_nm);
    // Nothing moves any more, whatever comes.
    for n in 0..100 {
        assert_eq!(stream.tick(Some(sample(n))).corrected_nm, end.corrected_nm);
    }
}

#[test]
fn finishing_keeps_the_machine_where_it_was_going() {
    let plan = plan();
    let mut stream: Stream = Stream::new(&plan, [5, 6, 7], 9, false);
    for n in 0..50 {
        stream.tick(Some(StreamSample {
            sequence: 9 + n,
            position_nm: [5, 6, 7],
        }));
    }
    stream.finish();
    assert_eq!(stream.tick(None).corrected_nm, [5, 6, 7]);
    assert_eq!(stream.state(), StreamState::Ended);
}

/// In full motion, with half the memory that the others have.
#[test]
fn a_stop_slows_down_along_the_tangent_and_is_over_when_nothing_moves() {
    let plan = plan();
    let mut stream = Stream::<16>::new(&plan, ellipse(0), 0, false);
    let mut out: Vec<Output> = (0..1500).map(|n| stream.tick(Some(sample(n)))).collect();
    assert_eq!(stream.expected(), 1500);
    stream.stop();
    assert!(!stream.takes() && !stream.over());
    while !stream.over() {
        out.push(stream.tick(Some(sample(0))));
        assert!(out.len() < 10_000);
    }
    let (v, a) = largest_steps(&out);
    assert!(v < 0.4 && a < 6.0, "{v} {a}");
    let end = *out.last().unwrap();
    assert_eq!(
        (end.nominal_nm, end.corrected_nm),
        (stream.last_nm(), stream.last_nm())
    );
    // A second one, from there.
    stream.start(&plan, end.nominal_nm, 7, false);
    assert_eq!((stream.expected(), stream.takes()), (7, true));
    assert_eq!(stream.tick(None).corrected_nm, end.nominal_nm);
    assert_eq!(stream.counters().missing, 1);
}
