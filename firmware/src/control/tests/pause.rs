//! Feed hold and override of the feed.
use super::*;

/// Largest change of speed between ticks, m/s², of the path so far.
fn roughest(bench: &Bench) -> f64 {
    let speeds = |w: &[[i32; 3]]| [0, 1, 2].map(|i| f64::from(w[1][i] - w[0][i]) * 1e-6);
    let velocity: Vec<_> = bench.path.windows(2).map(speeds).collect();
    let change = |w: &[[f64; 3]]| {
        let d = [0, 1, 2].map(|i| w[1][i] - w[0][i]);
        (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt() * 1e3
    };
    velocity.windows(2).map(change).fold(0.0, f64::max)
}

fn until_paused(bench: &mut Bench) {
    for _ in 0..2000 {
        bench.ticks(1);
        if bench.now().state == MotionState::Paused {
            return;
        }
    }
    panic!("never held: {:?}", bench.now().state);
}

/// Held again and again, at any moment, a circle, a helix and a line still end where they would have, having been nowhere
/// else, and as fast as the limits allow.
#[test]
fn held_again_and_again_a_path_ends_where_it_was_planned_to() {
    let helix = Segment::Arc {
        centre_m: [0.0, 0.05, 0.0],
        normal: [0.0, 0.0, 1.0],
        sweep_rad: 30.0,
        rise_m: 0.2,
        feed_m_s: 0.3,
    };
    let far = line([0.3, -0.2, 0.1]);
    for (name, segment) in [("helix", helix), ("line", far)] {
        let ends = |holds: &[usize]| {
            let mut bench = bench();
            let mut at = [0; 3];
            bench.desk.begin().unwrap();
            append(&mut bench, &mut at, segment);
            append(&mut bench, &mut at, line([0.0; 3]));
            bench.desk.end().unwrap();
            for &run in holds {
                bench.ticks(run);
                if bench.desk.pause(true).is_err() {
                    break;
                }
                until_paused(&mut bench);
                let stood = bench.now().raw_nm;
                bench.ticks(50);
                assert_eq!(bench.now().raw_nm, stood, "{name}");
                assert_eq!(bench.desk.begin(), Err(MotionRefusal::Busy));
                bench.desk.pause(false).unwrap();
            }
            bench.until_at_rest();
            let now = bench.now();
            assert_eq!(
                (now.state, now.segments, now.stops),
                (MotionState::Idle, 2, 0)
            );
            assert_eq!((now.raw_nm, now.dropped_segments), ([0; 3], 0), "{name}");
            let rough = roughest(&bench);
            assert!(rough < 5.01, "{name}: {rough} m/s²");
            bench.path
        };
        let whole = ends(&[]);
        for holds in [&[1][..], &[37], &[400, 3, 250, 700], &[600; 5], &[1200, 1]] {
            let held = ends(holds);
            assert!(held.len() > whole.len());
            // Every place of the one is near one of the other: the same path.
            let near = |a: &[i32; 3], b: &[i32; 3]| (0..3).all(|i| (a[i] - b[i]).abs() < 400_000);
            for place in held.iter().step_by(29) {
                assert!(
                    whole.iter().any(|other| near(place, other)),
                    "{name} {place:?}"
                );
            }
        }
    }
}

#[test]
fn a_held_circle_stays_on_its_circle_and_can_be_stopped() {
    let mut bench = bench();
    assert_eq!(bench.desk.pause(true), Err(MotionRefusal::NotHeld));
    let turns = CircleRun {
        centre_m: [0.0; 3],
        radius_m: 0.1,
        feed_m_s: 0.3,
        direction: Direction::Ccw,
        plane: giotto_shared::Plane::Xy,
        laps: 20,
        start_rad: 0.0,
    };
    bench.desk.run_circle(&turns.exact().unwrap()).unwrap();
    bench.ticks(2500);
    bench.desk.pause(true).unwrap();
    until_paused(&mut bench);
    assert!(on_circle(bench.now().raw_nm));
    bench.desk.pause(false).unwrap();
    bench.ticks(300);
    bench.desk.pause(true).unwrap();
    until_paused(&mut bench);
    bench.desk.stop();
    bench.ticks(2);
    assert_eq!(bench.now().state, MotionState::Idle);
    bench.circle(0.1).unwrap();
    bench.until_at_rest();
    assert!(on_circle(bench.now().raw_nm));
}

/// On the way to a hold a stop wins: nothing goes on.
#[test]
fn a_stop_in_a_hold_ends_it() {
    let mut bench = bench();
    bench.circle(0.1).unwrap();
    bench.ticks(2500);
    bench.desk.pause(true).unwrap();
    bench.ticks(20);
    bench.desk.stop();
    bench.until_at_rest();
    bench.ticks(20);
    let now = bench.now();
    assert_eq!((now.state, now.stops), (MotionState::Idle, 1));
}

#[test]
fn an_override_scales_the_feed_and_never_beyond_the_machine() {
    let fastest = |percent, feed_m_s| {
        let mut bench = bench();
        bench.desk.set_override(percent);
        let mut at = [0; 3];
        bench.desk.begin().unwrap();
        let to_m = [1.5, 0.0, 0.0];
        append(&mut bench, &mut at, Segment::Line { to_m, feed_m_s });
        bench.desk.end().unwrap();
        bench.until_at_rest();
        assert_eq!(bench.now().raw_nm, at);
        bench.speeds().into_iter().fold(0.0, f64::max)
    };
    for (percent, asked, gets) in [
        (100, 0.5, 0.5),
        (20, 0.5, 0.1),
        (120, 0.5, 0.6),
        (120, 0.95, 1.0),
    ] {
        let is = fastest(percent, asked);
        assert!(
            (is / gets - 1.0).abs() < 1e-3,
            "{percent} % of {asked}: {is}"
        );
    }
}

/// A late tick while a held path is still on its way to rest, with more behind it: that it is held does not hide the fault.
#[test]
fn a_fault_in_a_feed_hold_is_a_fault() {
    let mut bench = bench();
    let mut at = [0; 3];
    bench.desk.begin().unwrap();
    append(&mut bench, &mut at, line([0.05, 0.0, 0.0]));
    append(&mut bench, &mut at, line([0.0; 3]));
    bench.ticks(300);
    bench.desk.pause(true).unwrap();
    bench.ticks(1);
    let output = bench.tick.tick(true);
    bench.path.push(output.nominal_nm);
    bench.ticks(1500);
    let now = bench.now();
    assert_eq!((now.state, now.fault.is_some()), (MotionState::Fault, true));
    // What waited is of the program that the fault ended.
    bench.desk.clear_fault().unwrap();
    bench.ticks(5);
    let stood = bench.now().raw_nm;
    let _ = bench.desk.pause(false);
    bench.ticks(500);
    assert_eq!(
        (bench.now().state, bench.now().raw_nm),
        (MotionState::Idle, stood)
    );
}
