//! Programs: segments appended while the machine moves.
use super::*;

#[test]
fn a_program_runs_through_the_queue_and_ends_where_the_host_says() {
    let mut bench = bench();
    let mut at = bench.now().raw_nm;
    let nothing = line([0.1; 3]).exact(at).unwrap();
    assert_eq!(
        bench.desk.append(&nothing, 0),
        Err(MotionRefusal::NoProgram)
    );
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
    assert_eq!(
        (now.state, now.raw_nm, now.segments, now.queued),
        (MotionState::Idle, at, 6, 0)
    );
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
        assert_eq!(
            (bench.now().state, bench.now().raw_nm),
            (MotionState::Running, at)
        );
    }
    assert_eq!(lasts, 0);
    bench.desk.end().unwrap();
    bench.ticks(1);
    assert!(bench.desk.next_set_point().unwrap().last);
    assert_eq!(bench.now().state, MotionState::Idle);
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
        // In fault it is at rest before what waits is thrown away.
        bench.ticks(3);
        let now = bench.now();
        assert_eq!(now.dropped_segments, 2, "{name}");
        // Held, the segment in hand is finished.
        assert_eq!(
            now.raw_nm[0] == 100_000_000,
            name == "hold",
            "{name} {now:?}"
        );
        assert_eq!(
            bench.desk.append(&further, 0),
            Err(MotionRefusal::NoProgram),
            "{name}"
        );
        match name {
            "late" => {
                assert_eq!(
                    (now.state, bench.desk.begin()),
                    (MotionState::Fault, Err(MotionRefusal::Fault))
                )
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
    let ExactSegment::Arc(good) = quarter([0.05, 0.02, 0.0]).exact(at).unwrap() else {
        panic!()
    };
    let far = ExactArc {
        centre_nm: [50_000_100, 20_000_000, 0],
        ..good
    };
    let oval = ExactArc {
        v_half_nm: [good.v_half_nm[0] / 2, 0, 0],
        ..good
    };
    let askew = ExactArc {
        v_half_nm: [good.v_half_nm[0], good.v_half_nm[0] / 100, 0],
        ..good
    };
    let sideways = ExactArc {
        rise_nm: [1_000_000, 0, 0],
        ..good
    };
    let bad = [
        (far, Quantity::Gap),
        (oval, Quantity::Plane),
        (askew, Quantity::Plane),
        (sideways, Quantity::Plane),
        (
            ExactArc {
                u_half_nm: [0; 3],
                v_half_nm: [0; 3],
                ..good
            },
            Quantity::Radius,
        ),
        (
            ExactArc {
                u_half_nm: [i32::MIN; 3],
                ..good
            },
            Quantity::Radius,
        ),
        (
            ExactArc {
                turns: u32::MAX,
                ..good
            },
            Quantity::Sweep,
        ),
        (
            ExactArc {
                fraction: 0,
                turns: 0,
                ..good
            },
            Quantity::Sweep,
        ),
        (
            ExactArc {
                rise_nm: [0, 0, i32::MIN],
                ..good
            },
            Quantity::Rise,
        ),
        (
            ExactArc {
                centre_nm: [i32::MIN; 3],
                ..good
            },
            Quantity::Centre,
        ),
        (
            ExactArc {
                feed_m_s: f32::NAN,
                ..good
            },
            Quantity::Feed,
        ),
        (
            ExactArc {
                turns: 900,
                rise_nm: [0, 0, 2_000_000_000],
                ..good
            },
            Quantity::Position,
        ),
        (
            ExactArc {
                turns: 1,
                rise_nm: [0, 0, 2_000_000_000],
                ..good
            },
            Quantity::Position,
        ),
    ];
    for (arc, quantity) in bad {
        let refused = bench.desk.append(&ExactSegment::Arc(arc), 0);
        assert_eq!(refused, Err(MotionRefusal::Path(quantity)), "{arc:?}");
    }
    append(&mut bench, &mut at, quarter([0.05, 0.02, 0.0]));
    bench.desk.end().unwrap();
    bench.until_at_rest();
    assert_eq!(
        (bench.now().state, bench.now().raw_nm),
        (MotionState::Idle, at)
    );
}
