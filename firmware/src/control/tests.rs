//! Tick and desk with the queues of a board between them: stop command, stop input, silent host, late ticks.
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

type BenchTick =
    Tick<&'static Shared, Consumer<'static, Job, 4>, Producer<'static, TimedSetPoint, { SET_POINTS + 1 }>>;
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
    let points: &'static mut Queue<TimedSetPoint, { SET_POINTS + 1 }> = Box::leak(Box::new(Queue::new()));
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
        assert!(pair[1] <= pair[0] + 4e-6 && pair[0] - pair[1] <= limit, "{pair:?}");
    }
    let ticks_to_half = falling.iter().position(|speed| *speed < top / 2.0).unwrap();
    assert!(ticks_to_half < bench.config.rate_hz as usize / 2, "{ticks_to_half}");
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
    assert_eq!((now.state, now.stops, now.stop_input), (MotionState::Idle, 1, false));
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
    Segment::Line { to_m, feed_m_s: 0.2 }
}

fn quarter(centre_m: [f64; 3]) -> Segment {
    Segment::Arc { centre_m, normal: [0.0, 0.0, 1.0], sweep_rad: PI / 2.0, rise_m: 0.01, feed_m_s: 0.2 }
}

#[test]
fn a_program_runs_through_the_queue_and_ends_where_the_host_says() {
    let mut bench = bench();
    let mut at = bench.now().raw_nm;
    let nothing = line([0.1; 3]).exact(at).unwrap();
    assert_eq!(bench.desk.append(&nothing, 0), Err(MotionRefusal::NoProgram));
    assert_eq!(bench.desk.end(), Err(MotionRefusal::NoProgram));
    bench.desk.begin().unwrap();
    assert_eq!(bench.desk.begin(), Err(MotionRefusal::Busy));
    let pieces = [
        line([0.05, 0.0, 0.0]),
        quarter([0.05, 0.02, 0.0]),
        Segment::Dwell { time_s: 0.05 },
        line([0.07, 0.06, 0.01]),
        quarter([0.04, 0.06, 0.01]),
        line([0.0; 3]),
    ];
    let (mut full, mut most) = (0, 0);
    for piece in pieces {
        let exact = piece.exact(at).unwrap();
        while bench.desk.append(&exact, 0) == Err(MotionRefusal::QueueFull) {
            full += 1;
            bench.ticks(10);
        }
        at = exact.end_nm(at);
        most = most.max(bench.now().queued);
    }
    assert!(full > 0 && usize::from(most) == SEGMENTS, "{full} {most}");
    bench.desk.end().unwrap();
    bench.until_at_rest();
    let now = bench.now();
    assert_eq!((now.state, now.raw_nm, now.segments, now.queued), (MotionState::Idle, at, 6, 0));
    assert_eq!(at, [0; 3]);
    // No step in velocity anywhere: at most the acceleration of one tick.
    for pair in bench.speeds().windows(2) {
        assert!((pair[1] - pair[0]).abs() < 5.0 / 1000.0 + 1e-5, "{pair:?}");
    }
}

#[test]
fn a_program_that_has_run_dry_is_still_the_same_run() {
    let mut bench = bench();
    bench.desk.subscribe(1);
    let mut at = [0; 3];
    bench.desk.begin().unwrap();
    let mut lasts = 0;
    for x in [0.01, 0.02, 0.03] {
        append(&mut bench, &mut at, line([x, 0.0, 0.0]));
        for _ in 0..2000 {
            bench.ticks(1);
            lasts += usize::from(bench.desk.next_set_point().is_some_and(|point| point.last));
        }
        assert_eq!((bench.now().state, bench.now().raw_nm), (MotionState::Running, at));
    }
    assert_eq!(lasts, 0);
    bench.desk.end().unwrap();
    bench.ticks(1);
    assert!(bench.desk.next_set_point().unwrap().last);
    assert_eq!(bench.now().state, MotionState::Idle);
}

type Stop = fn(&mut Bench);

fn late(bench: &mut Bench) {
    let output = bench.tick.tick(true);
    bench.path.push(output.nominal_nm);
}

#[test]
fn whatever_stops_a_program_ends_it() {
    let stops: [(&str, Stop); 4] = [
        ("stop", |bench| bench.desk.stop()),
        ("input", |bench| bench.shared.set_stop_input(true)),
        ("hold", |bench| bench.desk.hold()),
        ("late", late),
    ];
    let refusal = MotionRefusal::NoProgram;
    for (name, stop) in stops {
        let mut bench = bench();
        let mut at = [0; 3];
        bench.desk.begin().unwrap();
        for x in [0.1, 0.2, 0.3] {
            append(&mut bench, &mut at, line([x, 0.0, 0.0]));
        }
        bench.ticks(300);
        stop(&mut bench);
        bench.ticks(1);
        let further = line([0.4, 0.0, 0.0]).exact(at).unwrap();
        assert_eq!(bench.desk.append(&further, 0), Err(refusal), "{name}");
        bench.until_at_rest();
        let now = bench.now();
        assert_eq!(now.dropped_segments, 2, "{name}");
        // Held, the segment in hand is finished.
        assert_eq!(now.raw_nm[0] == 100_000_000, name == "hold", "{name} {now:?}");
        assert_eq!(bench.desk.append(&further, 0), Err(MotionRefusal::NoProgram), "{name}");
        match name {
            "late" => {
                assert_eq!((now.state, bench.desk.begin()), (MotionState::Fault, Err(MotionRefusal::Fault)))
            }
            "input" => assert_eq!(bench.desk.begin(), Err(MotionRefusal::StopInput)),
            _ => bench.desk.begin().unwrap(),
        }
    }
}

#[test]
fn arcs_that_are_none_are_refused_and_the_program_goes_on() {
    let mut bench = bench();
    let mut at = [0; 3];
    bench.desk.begin().unwrap();
    append(&mut bench, &mut at, line([0.05, 0.0, 0.0]));
    let ExactSegment::Arc(good) = quarter([0.05, 0.02, 0.0]).exact(at).unwrap() else { panic!() };
    let far = ExactArc { centre_nm: [50_000_100, 20_000_000, 0], ..good };
    let oval = ExactArc { v_half_nm: [good.v_half_nm[0] / 2, 0, 0], ..good };
    let askew = ExactArc { v_half_nm: [good.v_half_nm[0], good.v_half_nm[0] / 100, 0], ..good };
    let sideways = ExactArc { rise_nm: [1_000_000, 0, 0], ..good };
    let bad = [
        (far, Quantity::Gap),
        (oval, Quantity::Plane),
        (askew, Quantity::Plane),
        (sideways, Quantity::Plane),
        (ExactArc { u_half_nm: [0; 3], v_half_nm: [0; 3], ..good }, Quantity::Radius),
        (ExactArc { u_half_nm: [i32::MIN; 3], ..good }, Quantity::Radius),
        (ExactArc { turns: u32::MAX, ..good }, Quantity::Sweep),
        (ExactArc { fraction: 0, turns: 0, ..good }, Quantity::Sweep),
        (ExactArc { rise_nm: [0, 0, i32::MIN], ..good }, Quantity::Rise),
        (ExactArc { centre_nm: [i32::MIN; 3], ..good }, Quantity::Centre),
        (ExactArc { feed_m_s: f32::NAN, ..good }, Quantity::Feed),
        (ExactArc { turns: 900, rise_nm: [0, 0, 2_000_000_000], ..good }, Quantity::Position),
        (ExactArc { turns: 1, rise_nm: [0, 0, 2_000_000_000], ..good }, Quantity::Position),
    ];
    for (arc, quantity) in bad {
        let refused = bench.desk.append(&ExactSegment::Arc(arc), 0);
        assert_eq!(refused, Err(MotionRefusal::Path(quantity)), "{arc:?}");
    }
    append(&mut bench, &mut at, quarter([0.05, 0.02, 0.0]));
    bench.desk.end().unwrap();
    bench.until_at_rest();
    assert_eq!((bench.now().state, bench.now().raw_nm), (MotionState::Idle, at));
}

/// A circle of 50 mm that starts and ends smoothly at the machine's origin; `n` beyond its end stays there.
fn streamed(n: usize) -> [i32; 3] {
    let (t, start, turn) = (n as f64 * 1e-3, 0.6, 2.0);
    let s = |t: f64| start * smoothstep(t / start).integral + (t - start).max(0.0);
    let angle = 2.0 * PI / turn * (s(t.max(0.0)) - s((t - turn).max(0.0)));
    [0.05 * (angle.cos() - 1.0), 0.05 * angle.sin(), 0.0].map(|m| (m * 1e9).round() as i32)
}

/// Ticks of that stream.
const STREAMED: usize = 2700;

/// A host that sends as many set-points as there is room for.
struct Source {
    steps: Steps,
    sent: usize,
    ended: bool,
}

impl Source {
    fn new(place_nm: [i32; 3]) -> Self {
        Self { steps: Steps::from(place_nm), sent: 0, ended: false }
    }

    fn feed(&mut self, bench: &mut Bench, up_to: usize) {
        while self.sent < up_to {
            let mut chunk = Chunk::new();
            let (before, mut count) = (self.steps, 0);
            while count < BATCH
                && self.sent + count < up_to
                && self.steps.write(streamed(self.sent + count), &mut chunk)
            {
                count += 1;
            }
            match bench.desk.points(&chunk) {
                Ok(()) => self.sent += count,
                Err(MotionRefusal::QueueFull) => {
                    self.steps = before;
                    return;
                }
                Err(other) => panic!("{other}"),
            }
        }
        if up_to >= STREAMED && !self.ended {
            self.ended = bench.desk.end().is_ok();
        }
    }
}

#[test]
fn a_stream_is_followed_to_its_end_and_a_program_goes_on_from_there() {
    let mut bench = bench();
    assert_eq!(bench.desk.points(&[]), Err(MotionRefusal::NoProgram));
    bench.desk.begin_stream(1.0, 60).unwrap();
    assert_eq!(bench.desk.begin(), Err(MotionRefusal::Busy));
    let nothing = line([0.1; 3]).exact([0; 3]).unwrap();
    assert_eq!(bench.desk.append(&nothing, 0), Err(MotionRefusal::NoProgram));
    let mut source = Source::new([0; 3]);
    // Not yet so many as were asked for: nothing moves.
    source.feed(&mut bench, 50);
    bench.ticks(100);
    assert_eq!((bench.now().state, bench.now().missing_set_points), (MotionState::Running, 0));
    let mut begun = None;
    while bench.now().state == MotionState::Running {
        source.feed(&mut bench, STREAMED);
        bench.ticks(7);
        assert!(bench.path.len() < 10_000);
        begun = begun.or((bench.now().raw_nm != [0; 3]).then_some(bench.path.len()));
    }
    bench.until_at_rest();
    let now = bench.now();
    assert_eq!((now.state, now.raw_nm), (MotionState::Idle, streamed(STREAMED)));
    assert_eq!((now.missing_set_points, now.late_set_points, now.rejected_set_points), (0, 0, 0));
    // The set-points themselves, one a tick.
    let first = bench.path.iter().position(|place| *place != [0; 3]).unwrap();
    let offset = (0..STREAMED).position(|n| streamed(n) != [0; 3]).unwrap();
    for n in 0..STREAMED - offset {
        assert_eq!(bench.path[first + n], streamed(offset + n));
    }
    bench.desk.begin().unwrap();
    let mut at = now.raw_nm;
    append(&mut bench, &mut at, line([0.01, 0.0, 0.0]));
    bench.desk.end().unwrap();
    bench.until_at_rest();
    assert_eq!((bench.now().state, bench.now().raw_nm), (MotionState::Idle, [10_000_000, 0, 0]));
}

/// Largest change of speed between ticks, m/s².
fn roughest(bench: &Bench) -> f64 {
    let velocity = |i: usize, n: usize| f64::from(bench.path[n + 1][i] - bench.path[n][i]) * 1e-6;
    let change = |n: usize| (0..3).map(|i| (velocity(i, n + 1) - velocity(i, n)).powi(2)).sum::<f64>().sqrt();
    (0..bench.path.len() - 2).map(change).fold(0.0, f64::max) * 1e3
}

#[test]
fn a_stream_that_dries_up_comes_to_rest_and_faults() {
    let mut bench = bench();
    bench.desk.begin_stream(1.0, 60).unwrap();
    let mut source = Source::new([0; 3]);
    for _ in 0..100 {
        source.feed(&mut bench, 1000);
        bench.ticks(10);
    }
    assert_eq!(bench.now().state, MotionState::Running);
    bench.ticks(1100);
    assert_eq!(bench.now().state, MotionState::Stopping);
    bench.until_at_rest();
    let now = bench.now();
    assert_eq!((now.state, now.fault), (MotionState::Fault, Some(FaultCause::Starved)));
    assert_eq!((now.missing_set_points, now.late_set_points, now.raw_nm), (6, 0, now.corrected_nm));
    assert!(roughest(&bench) < 6.0, "{}", roughest(&bench));
    assert_eq!(bench.desk.begin(), Err(MotionRefusal::Fault));
}

#[test]
fn set_points_that_come_late_are_left_out_and_the_stream_keeps_its_time() {
    let mut bench = bench();
    bench.desk.begin_stream(1.0, 60).unwrap();
    let mut source = Source::new([0; 3]);
    while source.sent < 1000 {
        source.feed(&mut bench, 1000);
        bench.ticks(1);
    }
    // Until the last one has been taken, and four ticks of nothing.
    while bench.now().missing_set_points < 4 {
        bench.ticks(1);
    }
    while bench.now().state == MotionState::Running {
        source.feed(&mut bench, STREAMED);
        bench.ticks(1);
    }
    bench.until_at_rest();
    let now = bench.now();
    assert_eq!((now.state, now.raw_nm), (MotionState::Idle, streamed(STREAMED)));
    // They came in batches, and one that holds any that is still to come is used from there on.
    assert_eq!((now.missing_set_points, now.late_set_points, now.rejected_set_points), (4, 0, 0));
    assert!(roughest(&bench) < 6.0, "{}", roughest(&bench));
}

#[test]
fn whatever_stops_a_stream_slows_it_down_within_limits() {
    let stops: [(&str, Stop); 4] = [
        ("stop", |bench| bench.desk.stop()),
        ("input", |bench| bench.shared.set_stop_input(true)),
        ("late", late),
        ("hold", |bench| bench.desk.hold()),
    ];
    for (name, stop) in stops {
        let mut bench = bench();
        bench.desk.begin_stream(1.0, 60).unwrap();
        let mut source = Source::new([0; 3]);
        for _ in 0..100 {
            source.feed(&mut bench, STREAMED);
            bench.ticks(10);
        }
        stop(&mut bench);
        bench.ticks(1);
        assert_eq!(bench.desk.points(&[]), Err(MotionRefusal::NoProgram), "{name}");
        bench.until_at_rest();
        let now = bench.now();
        // A dead link sends nothing: what has come is followed, and then there is no more.
        let fault = match name {
            "late" => Some(FaultCause::Overrun),
            "hold" => Some(FaultCause::Starved),
            _ => None,
        };
        assert_eq!(now.fault, fault, "{name}");
        assert_eq!(now.stops, u32::from(name != "hold"), "{name}");
        assert!(roughest(&bench) < 6.0, "{name}: {}", roughest(&bench));
        // What was still in the queue moves nothing.
        let stood = now.raw_nm;
        bench.ticks(200);
        assert_eq!((bench.now().raw_nm, bench.now().queued), (stood, 0), "{name}");
        if fault.is_none() {
            bench.shared.set_stop_input(false);
            bench.ticks(1);
            bench.desk.begin_stream(1.0, 1).unwrap();
            bench.desk.end().unwrap();
            bench.until_at_rest();
            assert_eq!((bench.now().state, bench.now().raw_nm), (MotionState::Idle, stood));
        }
    }
}

#[test]
fn bytes_that_are_no_set_points_are_refused_and_the_stream_goes_on() {
    let mut bench = bench();
    bench.desk.begin_stream(1.0, 1000).unwrap();
    let far = [0xfe, 0xff, 0xff, 0xff, 0x0f, 0, 0];
    for bytes in [&[1][..], &[1, 2, 0x80], &[0; 3 * BATCH + 3], &[0xff; 6], &far] {
        assert_eq!(bench.desk.points(bytes), Err(MotionRefusal::Path(Quantity::Position)), "{bytes:02x?}");
    }
    let mut source = Source::new([0; 3]);
    while bench.now().state == MotionState::Running {
        source.feed(&mut bench, STREAMED);
        bench.ticks(5);
    }
    bench.until_at_rest();
    assert_eq!((bench.now().state, bench.now().raw_nm), (MotionState::Idle, streamed(STREAMED)));
}
