//! Tick and desk with the queues of a board between them: stop command, stop input, silent host, late ticks.
mod pause;
mod programs;
mod soft_limits;
mod streams;

use super::*;
use crate::engine::{Config, Executor, Planner};
use crate::server::{Motion, Snapshot, TimedSetPoint};
use core::f64::consts::PI;
use giotto_shared::Direction;
use giotto_shared::path::{CircleRun, ExactArc, ExactSegment, Quantity, Segment, smoothstep};
use giotto_shared::wire::{Chunk, FaultCause, MotionRefusal, MotionState, Steps};
use heapless_spsc::spsc::{Consumer, Producer, Queue};
use std::boxed::Box;
use std::vec::Vec;

type BenchTick = Tick<
    &'static Shared,
    Consumer<'static, Job, 4>,
    Producer<'static, TimedSetPoint, { SET_POINTS + 1 }>,
>;
type BenchDesk = Desk<
    Box<Planner>,
    &'static Shared,
    Producer<'static, Job, 4>,
    Consumer<'static, TimedSetPoint, { SET_POINTS + 1 }>,
>;

struct Bench {
    desk: BenchDesk,
    tick: BenchTick,
    shared: &'static Shared,
    config: Config,
    /// Programmed positions so far, nm.
    path: Vec<[i32; 3]>,
}

fn bench() -> Bench {
    let config = Config::robot(1000);
    // Leaked: the ends of a board's queues live for ever, too.
    let shared: &'static Shared = Box::leak(Box::new(Shared::new()));
    let segments: &'static mut Queue<Job, 4> = Box::leak(Box::new(Queue::new()));
    let points: &'static mut Queue<TimedSetPoint, { SET_POINTS + 1 }> =
        Box::leak(Box::new(Queue::new()));
    let (segments_in, segments_out) = segments.split();
    let (points_in, points_out) = points.split();
    let executor = Executor::new([0; 3], config.engage_ticks(), true);
    let planner = Box::new(Planner::new(&config, [0; 3]));
    Bench {
        desk: Desk::new(planner, shared, segments_in, points_out),
        tick: Tick::new(executor, shared, segments_out, points_in),
        shared,
        config,
        path: Vec::new(),
    }
}

impl Bench {
    fn circle(&mut self, radius_m: f64) -> Result<(), MotionRefusal> {
        let run = CircleRun {
            centre_m: [0.0; 3],
            radius_m,
            feed_m_s: 0.3,
            plane: giotto_shared::Plane::Xy,
            direction: Direction::Ccw,
            laps: 1,
            start_rad: 0.0,
        };
        self.desk.run_circle(&run.exact().unwrap())
    }

    fn ticks(&mut self, count: usize) {
        for _ in 0..count {
            let output = self.tick.tick(false);
            self.path.push(output.nominal_nm);
        }
    }

    fn now(&self) -> Snapshot {
        self.desk.snapshot()
    }

    /// Ticks until it stands, at most 100 s.
    fn until_at_rest(&mut self) {
        for _ in 0..100_000 {
            self.ticks(1);
            if matches!(self.now().state, MotionState::Idle | MotionState::Fault) {
                return;
            }
        }
        panic!("never at rest");
    }

    /// Speed along the path between ticks, m/s.
    fn speeds(&self) -> Vec<f64> {
        let way = |pair: &[[i32; 3]]| {
            let d = [0, 1, 2].map(|axis| f64::from(pair[1][axis] - pair[0][axis]));
            (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt() * 1e-9 * f64::from(self.config.rate_hz)
        };
        self.path.windows(2).map(way).collect()
    }
}

/// Slows from the very next tick on, never faster than the limits allow, and comes to rest.
fn stops_within_limits(bench: &mut Bench) {
    let before = bench.path.len();
    let top = *bench.speeds().last().unwrap();
    bench.ticks(1);
    assert_eq!(bench.now().state, MotionState::Stopping);
    bench.until_at_rest();
    let speeds = bench.speeds();
    let falling = &speeds[before - 1..];
    let rate = f64::from(bench.config.rate_hz);
    // A position is rounded to 1 nm: 1e-6 m/s a tick.
    let limit = bench.config.motion.acceleration_m_s2 / rate + 4e-6;
    for pair in falling.windows(2) {
        assert!(
            pair[1] <= pair[0] + 4e-6 && pair[0] - pair[1] <= limit,
            "{pair:?}"
        );
    }
    let ticks_to_half = falling.iter().position(|speed| *speed < top / 2.0).unwrap();
    assert!(
        ticks_to_half < bench.config.rate_hz as usize / 2,
        "{ticks_to_half}"
    );
    assert!(falling.last().unwrap() < &1e-5);
}

#[test]
fn the_stop_command_acts_in_the_next_tick() {
    let mut bench = bench();
    bench.circle(0.1).unwrap();
    bench.ticks(2500);
    assert_eq!(bench.now().state, MotionState::Running);
    bench.desk.stop();
    stops_within_limits(&mut bench);
    let now = bench.now();
    assert_eq!(
        (now.state, now.stops, now.stop_input),
        (MotionState::Idle, 1, false)
    );
    bench.circle(0.1).unwrap();
}

#[test]
fn the_stop_input_acts_in_the_next_tick_and_nothing_starts_while_it_is_active() {
    let mut bench = bench();
    bench.circle(0.1).unwrap();
    bench.ticks(2500);
    bench.shared.set_stop_input(true);
    stops_within_limits(&mut bench);
    let stood = bench.now().raw_nm;
    assert!(bench.now().stop_input);
    assert_eq!(bench.circle(0.1), Err(MotionRefusal::StopInput));
    bench.ticks(100);
    assert_eq!((bench.now().stops, bench.now().raw_nm), (1, stood));
    bench.shared.set_stop_input(false);
    bench.ticks(1);
    bench.circle(0.1).unwrap();
    bench.until_at_rest();
    assert!(on_circle(bench.now().raw_nm));
}

/// 100 mm from the origin.
fn on_circle([x, y, z]: [i32; 3]) -> bool {
    z == 0 && (f64::from(x).hypot(f64::from(y)) - 1e8).abs() < 3.0
}

/// Pressed after a run was accepted and before the tick has seen it.
#[test]
fn the_stop_input_wins_a_race_with_a_run() {
    let mut bench = bench();
    bench.circle(0.1).unwrap();
    bench.shared.set_stop_input(true);
    bench.ticks(2000);
    let now = bench.now();
    assert_eq!((now.state, now.raw_nm), (MotionState::Idle, [0; 3]));
    assert!(now.dropped_segments > 0);
}

#[test]
fn held_the_segment_in_hand_finishes_and_nothing_else_starts() {
    let mut bench = bench();
    bench.circle(0.1).unwrap();
    bench.ticks(100);
    bench.desk.hold();
    bench.until_at_rest();
    // The approach, a line from the origin, ends where the circle would have begun.
    let now = bench.now();
    assert_eq!((now.state, now.dropped_segments), (MotionState::Idle, 1));
    assert!(on_circle(now.raw_nm));
    let [ex, ey, _] = now.raw_nm.map(f64::from);
    let aside = |[x, y, _]: &[i32; 3]| (f64::from(*x) * ey - f64::from(*y) * ex).abs() / 1e8;
    assert!(bench.path.iter().all(|place| aside(place) < 3.0));
    // A new program is accepted, and held in its turn: the turn in hand is finished.
    bench.circle(0.1).unwrap();
    bench.ticks(100);
    bench.desk.hold();
    bench.until_at_rest();
    assert_eq!(bench.now().dropped_segments, 1);
    assert!(bench.path.iter().any(|[x, ..]| *x < -99_000_000));
    assert!(on_circle(*bench.path.last().unwrap()));
}

#[test]
fn a_late_tick_is_counted_stops_the_run_and_leads_to_fault() {
    let mut bench = bench();
    bench.circle(0.1).unwrap();
    bench.ticks(2500);
    let output = bench.tick.tick(true);
    bench.path.push(output.nominal_nm);
    stops_within_limits(&mut bench);
    let now = bench.now();
    assert_eq!((now.state, now.tick_overruns), (MotionState::Fault, 1));
    assert_eq!(now.fault, Some(FaultCause::Overrun));
    assert_eq!(bench.circle(0.1), Err(MotionRefusal::Fault));
    let stood = bench.now().raw_nm;
    bench.ticks(100);
    assert_eq!(bench.now().raw_nm, stood);
}

/// An erased sector of a flash that the core runs from: 1.7 s in which nothing is fetched.
#[test]
fn time_in_which_the_core_stood_still_has_passed() {
    let mut bench = bench();
    bench.ticks(100);
    let before = bench.now();
    bench.shared.lose(1700);
    assert_eq!(bench.now().tick, before.tick + 1700, "at once");
    bench.ticks(1);
    let after = bench.now();
    assert_eq!(after.tick, before.tick + 1701);
    assert_eq!((after.raw_nm, after.tick_overruns), (before.raw_nm, 0));
    bench.ticks(10);
    assert_eq!(bench.now().tick, before.tick + 1711, "once");
}

#[test]
fn lines_tell_what_the_tick_does() {
    let mut bench = bench();
    bench
        .shared
        .stands([5, 6, 7], giotto_shared::wire::PositionState::Unknown);
    let tick = |bench: &mut Bench, late: bool| {
        let output = bench.tick.tick(late);
        let lines = bench.tick.lines(&output);
        (lines.enable, lines.in_position, lines.fault)
    };
    assert_eq!(tick(&mut bench, false), (false, true, false));
    bench.desk.declare([0; 3]).unwrap();
    assert!(!bench.tick.placed());
    assert_eq!(tick(&mut bench, false), (true, true, false));
    assert!(bench.tick.placed() && !bench.tick.placed());
    bench.circle(0.1).unwrap();
    bench.ticks(500);
    assert_eq!(tick(&mut bench, false), (true, false, false));
    assert_eq!(tick(&mut bench, true), (true, false, true));
    bench.until_at_rest();
    assert_eq!(tick(&mut bench, false), (true, true, true));
    bench.desk.clear_fault().unwrap();
    assert_eq!(tick(&mut bench, false), (true, true, false));
}

#[test]
fn counts_are_those_of_the_tick() {
    let mut bench = bench();
    bench.desk.subscribe(1);
    bench.circle(0.1).unwrap();
    // Nobody takes the set-points: the queue fills up, the rest is counted.
    bench.ticks(500);
    assert_eq!(bench.now().dropped_set_points, 500 - SET_POINTS as u32);
}

/// Appends a segment from where the program stands; waits for room.
fn append(bench: &mut Bench, at: &mut [i32; 3], segment: Segment) {
    let exact = segment.exact(*at).unwrap();
    loop {
        match bench.desk.append(&exact, 0) {
            Ok(()) => break,
            Err(MotionRefusal::QueueFull) => bench.ticks(10),
            Err(other) => panic!("{other}"),
        }
    }
    *at = exact.end_nm(*at);
}

fn line(to_m: [f64; 3]) -> Segment {
    Segment::Line {
        to_m,
        feed_m_s: 0.2,
    }
}

fn quarter(centre_m: [f64; 3]) -> Segment {
    Segment::Arc {
        centre_m,
        normal: [0.0, 0.0, 1.0],
        sweep_rad: PI / 2.0,
        rise_m: 0.01,
        feed_m_s: 0.2,
    }
}

type Stop = fn(&mut Bench);

fn late(bench: &mut Bench) {
    let output = bench.tick.tick(true);
    bench.path.push(output.nominal_nm);
}
