//! Streams: set-points appended while the machine moves.
use super::*;

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
        Self {
            steps: Steps::from(place_nm),
            sent: 0,
            ended: false,
        }
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
    assert_eq!(
        bench.desk.append(&nothing, 0),
        Err(MotionRefusal::NoProgram)
    );
    let mut source = Source::new([0; 3]);
    // Not yet so many as were asked for: nothing moves.
    source.feed(&mut bench, 50);
    bench.ticks(100);
    assert_eq!(
        (bench.now().state, bench.now().missing_set_points),
        (MotionState::Running, 0)
    );
    let mut begun = None;
    while bench.now().state == MotionState::Running {
        source.feed(&mut bench, STREAMED);
        bench.ticks(7);
        assert!(bench.path.len() < 10_000);
        begun = begun.or((bench.now().raw_nm != [0; 3]).then_some(bench.path.len()));
    }
    bench.until_at_rest();
    let now = bench.now();
    assert_eq!(
        (now.state, now.raw_nm),
        (MotionState::Idle, streamed(STREAMED))
    );
    assert_eq!(
        (
            now.missing_set_points,
            now.late_set_points,
            now.rejected_set_points
        ),
        (0, 0, 0)
    );
    // The set-points themselves, one a tick.
    let first = bench
        .path
        .iter()
        .position(|place| *place != [0; 3])
        .unwrap();
    let offset = (0..STREAMED).position(|n| streamed(n) != [0; 3]).unwrap();
    for n in 0..STREAMED - offset {
        assert_eq!(bench.path[first + n], streamed(offset + n));
    }
    bench.desk.begin().unwrap();
    let mut at = now.raw_nm;
    append(&mut bench, &mut at, line([0.01, 0.0, 0.0]));
    bench.desk.end().unwrap();
    bench.until_at_rest();
    assert_eq!(
        (bench.now().state, bench.now().raw_nm),
        (MotionState::Idle, [10_000_000, 0, 0])
    );
}

/// Largest change of speed between ticks, m/s².
fn roughest(bench: &Bench) -> f64 {
    let velocity = |i: usize, n: usize| f64::from(bench.path[n + 1][i] - bench.path[n][i]) * 1e-6;
    let change = |n: usize| {
        (0..3)
            .map(|i| (velocity(i, n + 1) - velocity(i, n)).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    (0..bench.path.len() - 2).map(change).fold(0.0, f64::max) * 1e3
}

fn until_it_dries_up(bench: &mut Bench) {
    while bench.now().state == MotionState::Running {
        bench.ticks(1);
        assert!(bench.path.len() < 10_000);
    }
    assert_eq!(bench.now().state, MotionState::Stopping);
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
    until_it_dries_up(&mut bench);
    bench.until_at_rest();
    let now = bench.now();
    assert_eq!(
        (now.state, now.fault),
        (MotionState::Fault, Some(FaultCause::Starved))
    );
    assert_eq!(
        (now.missing_set_points, now.late_set_points, now.raw_nm),
        (6, 0, now.corrected_nm)
    );
    assert!(roughest(&bench) < 6.0, "{}", roughest(&bench));
    assert_eq!(bench.desk.begin(), Err(MotionRefusal::Fault));
}

/// A host that was held up goes on as if nothing were amiss.
#[test]
fn a_fault_ends_a_stream_and_what_comes_behind_it_is_refused() {
    let mut bench = bench();
    bench.desk.begin_stream(1.0, 60).unwrap();
    let mut source = Source::new([0; 3]);
    for _ in 0..100 {
        source.feed(&mut bench, 1000);
        bench.ticks(10);
    }
    until_it_dries_up(&mut bench);
    assert_eq!(bench.now().fault, Some(FaultCause::Starved));
    assert_eq!(bench.desk.points(&[]), Err(MotionRefusal::NoProgram));
    assert_eq!(bench.desk.end(), Err(MotionRefusal::NoProgram));
    bench.until_at_rest();
    let now = bench.now();
    assert_eq!((now.state, now.queued), (MotionState::Fault, 0));
    for _ in 0..50 {
        bench.ticks(1);
        assert_eq!(bench.desk.points(&[]), Err(MotionRefusal::NoProgram));
        let later = bench.now();
        assert_eq!(
            (later.state, later.dropped_segments),
            (MotionState::Fault, now.dropped_segments)
        );
    }
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
    assert_eq!(
        (now.state, now.raw_nm),
        (MotionState::Idle, streamed(STREAMED))
    );
    // They came in batches, and one that holds any that is still to come is used from there on.
    assert_eq!(
        (
            now.missing_set_points,
            now.late_set_points,
            now.rejected_set_points
        ),
        (4, 0, 0)
    );
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
        assert_eq!(
            bench.desk.points(&[]),
            Err(MotionRefusal::NoProgram),
            "{name}"
        );
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
        assert_eq!(
            (bench.now().raw_nm, bench.now().queued),
            (stood, 0),
            "{name}"
        );
        if fault.is_none() {
            bench.shared.set_stop_input(false);
            bench.ticks(1);
            bench.desk.begin_stream(1.0, 1).unwrap();
            bench.desk.end().unwrap();
            bench.until_at_rest();
            assert_eq!(
                (bench.now().state, bench.now().raw_nm),
                (MotionState::Idle, stood)
            );
        }
    }
}

#[test]
fn bytes_that_are_no_set_points_are_refused_and_the_stream_goes_on() {
    let mut bench = bench();
    bench.desk.begin_stream(1.0, 1000).unwrap();
    let far = [0xfe, 0xff, 0xff, 0xff, 0x0f, 0, 0];
    for bytes in [
        &[1][..],
        &[1, 2, 0x80],
        &[0; 3 * BATCH + 3],
        &[0xff; 6],
        &far,
    ] {
        assert_eq!(
            bench.desk.points(bytes),
            Err(MotionRefusal::Path(Quantity::Position)),
            "{bytes:02x?}"
        );
    }
    let mut source = Source::new([0; 3]);
    while bench.now().state == MotionState::Running {
        source.feed(&mut bench, STREAMED);
        bench.ticks(5);
    }
    bench.until_at_rest();
    assert_eq!(
        (bench.now().state, bench.now().raw_nm),
        (MotionState::Idle, streamed(STREAMED))
    );
}

/// Batches that came just before it dried up: they are thrown away, and the fault is one from the first tick of rest on.
#[test]
fn a_fault_is_a_fault_whatever_still_waits() {
    for wait in 0..4 {
        let mut bench = bench();
        bench.desk.begin_stream(1.0, 60).unwrap();
        let mut source = Source::new([0; 3]);
        for _ in 0..100 {
            source.feed(&mut bench, 1000);
            bench.ticks(10);
        }
        // A late tick ends the stream with batches in its queue.
        source.feed(&mut bench, STREAMED);
        assert!(bench.now().queued > 0);
        let output = bench.tick.tick(true);
        bench.path.push(output.nominal_nm);
        while bench.now().state == MotionState::Stopping {
            bench.ticks(1);
        }
        assert_eq!(bench.now().state, MotionState::Fault);
        bench.ticks(wait);
        assert_eq!(bench.now().state, MotionState::Fault, "{wait}");
        // Forgotten without a reset, the place is kept.
        let stood = bench.now().raw_nm;
        bench.desk.clear_fault().unwrap();
        bench.ticks(5);
        let now = bench.now();
        assert_eq!(
            (now.state, now.fault, now.raw_nm),
            (MotionState::Idle, None, stood)
        );
        bench.desk.begin().unwrap();
    }
}

/// At 1 m/s towards the end of the coordinates: refused before a stop would lead beyond them, and nothing jumps.
#[test]
fn a_stream_keeps_room_to_stop_within_the_coordinates() {
    for (axis, sign) in [(0, 1), (1, -1), (2, 1)] {
        let mut bench = bench();
        let mut start = [0; 3];
        start[axis] = sign * 1_500_000_000;
        bench.desk.declare(start).unwrap();
        bench.ticks(1);
        assert_eq!(bench.now().raw_nm, start);
        bench.path.clear();
        bench.desk.begin_stream(1.0, 60).unwrap();
        let mut steps = Steps::from(start);
        // To 1 m/s in half a second, then on and on.
        let place = |n: usize| {
            let t = n as f64 * 1e-3;
            let way = 0.5 * smoothstep((t / 0.5).min(1.0)).integral + (t - 0.5).max(0.0);
            let mut place = start;
            place[axis] += sign * (way * 1e9).round() as i32;
            place
        };
        let mut sent = 0;
        let refused = 'sending: loop {
            let (mut chunk, before, mut count) = (Chunk::new(), steps, 0);
            while count < 20 && steps.write(place(sent + count), &mut chunk) {
                count += 1;
            }
            loop {
                match bench.desk.points(&chunk) {
                    Ok(()) => break,
                    Err(MotionRefusal::QueueFull) => bench.ticks(5),
                    Err(other) => break 'sending other,
                }
            }
            sent += count;
            assert!(sent < 2000);
            let _ = before;
        };
        assert_eq!(refused, MotionRefusal::NoRoomToStop);
        // Not without need: within a tenth of a second of the last place from which it can stop.
        assert!(place(sent)[axis].abs() > 1_850_000_000, "{:?}", place(sent));
        bench.until_at_rest();
        assert_eq!(bench.now().state, MotionState::Fault);
        let largest = bench
            .path
            .windows(2)
            .map(|w| i64::from(w[1][axis]) - i64::from(w[0][axis]))
            .map(i64::abs)
            .max();
        assert!(largest < Some(1_050_000), "{largest:?}");
        assert!(roughest(&bench) < 5.1, "{}", roughest(&bench));
    }
}

/// Sends a path from near the end of the coordinates until it is refused or over, and lets it starve; what it was told last.
fn until_refused(
    start: [i32; 3],
    place: &dyn Fn(usize) -> [i32; 3],
) -> (Bench, Option<MotionRefusal>) {
    let mut bench = bench();
    bench.desk.declare(start).unwrap();
    bench.ticks(1);
    bench.path.clear();
    bench.desk.begin_stream(1.0, 20).unwrap();
    let (mut steps, mut refused) = (Steps::from(start), None);
    for n in 0..1500 {
        let mut chunk = Chunk::new();
        assert!(steps.write(place(n), &mut chunk));
        loop {
            match bench.desk.points(&chunk) {
                Ok(()) => break,
                Err(MotionRefusal::QueueFull) => bench.ticks(1),
                Err(other) => {
                    refused = Some(other);
                    break;
                }
            }
        }
        if refused.is_some() {
            break;
        }
    }
    bench.until_at_rest();
    (bench, refused)
}

/// A path that still gains speed when it is refused, or that turns outward there: carried on and braked it is faster and goes
/// farther than its last velocity says. Never held at the end.
#[test]
fn room_to_stop_counts_what_speed_and_curvature_add() {
    let near = |ahead_mm: i32| [2_100_000_000 - ahead_mm * 1_000_000, 0, 0];
    for ahead_mm in [60, 80, 100, 120, 150] {
        let start = near(ahead_mm);
        // With 2.5 m/s² to 0.9 m/s.
        let faster = |n: usize| {
            let t = n as f64 * 1e-3;
            let rising = t.min(0.36);
            let way = 1.25 * rising * rising + 0.9 * (t - rising);
            [start[0] + (way * 1e9).round() as i32, 0, 0]
        };
        let (bench, refused) = until_refused(start, &faster);
        assert_eq!(refused, Some(MotionRefusal::NoRoomToStop), "{ahead_mm}");
        assert!(roughest(&bench) < 5.15, "{ahead_mm}: {}", roughest(&bench));
    }
    for radius_mm in [60, 100, 150, 200] {
        let radius = f64::from(radius_mm) * 1e-3;
        let start = near(124);
        // From where it goes along Y, or inward, it turns outward; centripetal acceleration 4 m/s².
        for from in [0.0f64, -0.7] {
            let rate = (4.0 / radius).sqrt().min(0.95 / radius);
            let turned = |n: usize| {
                let t = n as f64 * 1e-3;
                let angle =
                    rate * (0.8 * smoothstep((t / 0.8).min(1.0)).integral + (t - 0.8).max(0.0));
                let at = |angle: f64| [radius * (1.0 - angle.cos()), radius * angle.sin()];
                let ([x, y], [x0, y0]) = (at(angle + from), at(from));
                let nm = |m: f64| (m * 1e9).round() as i32;
                [start[0] + nm(x - x0), nm(y - y0), 0]
            };
            let (bench, refused) = until_refused(start, &turned);
            if radius_mm > 100 {
                assert_eq!(refused, Some(MotionRefusal::NoRoomToStop), "{radius_mm}");
            }
            assert!(
                roughest(&bench) < 5.3,
                "{radius_mm} {from}: {}",
                roughest(&bench)
            );
        }
    }
}

/// A gap near the end of the coordinates, the path faster when it comes back than when it went: joined or braked, it never leaves them
/// nor is it held there.
#[test]
fn a_gap_near_the_end_of_the_coordinates_leaves_room_to_stop() {
    for ahead_mm in (100..500).step_by(20) {
        let start = [2_100_000_000 - ahead_mm * 1_000_000, 0, 0];
        let mut bench = bench();
        bench.desk.declare(start).unwrap();
        bench.ticks(1);
        bench.path.clear();
        bench.desk.begin_stream(1.0, 20).unwrap();
        // It sets off with 4 m/s² behind the last set-point that comes, is braked to rest and stays.
        let place = |n: usize| {
            let t = n.saturating_sub(100) as f64 * 1e-3;
            let (up, down) = (t.min(0.2), (t - 0.2).clamp(0.0, 0.2));
            let way = 2.0 * up * up + down * (0.8 - 2.0 * down);
            [start[0] + (way * 1e9).round() as i32, 0, 0]
        };
        let (mut steps, mut sent) = (Steps::from(start), 0);
        let mut send = |bench: &mut Bench, up_to: usize| {
            while sent < up_to {
                let (before, mut chunk) = (steps, Chunk::new());
                assert!(steps.write(place(sent), &mut chunk));
                match bench.desk.points(&chunk) {
                    Ok(()) => sent += 1,
                    Err(MotionRefusal::QueueFull) => {
                        steps = before;
                        return;
                    }
                    Err(_) => sent = usize::MAX,
                }
            }
        };
        // Until the last one before it sets off has been taken, and four ticks of nothing.
        while bench.now().missing_set_points < 4 {
            send(&mut bench, 101);
            bench.ticks(1);
        }
        for _ in 0..1000 {
            send(&mut bench, 1000);
            bench.ticks(1);
        }
        bench.until_at_rest();
        assert!(roughest(&bench) < 5.15, "{ahead_mm}: {}", roughest(&bench));
        assert!(bench.path.iter().all(|place| place[0] < 2_126_000_000));
    }
}
