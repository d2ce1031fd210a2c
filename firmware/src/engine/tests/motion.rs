//! What must hold whatever the program: limits, no jumps, exact ends, stops, bypass, bounds, no drift.
use super::endurance::{Random, segment};
use super::{no_jump, run_out, std, table};
use crate::engine::{CircleRun, Config, Engine, Fault, Output, Quantity, Refused, Segment, flag};
use core::f64::consts::PI;
use giotto_shared::term::Term;
use giotto_shared::{Actuator, Direction, Plane};
use std::vec::Vec;

const DT: f64 = 1e-3;
/// Lag 20 ms and moving average 40 ms.
pub(super) const KAPPA: [f32; 2] = [4e-4 + 1.6e-3 / 12.0, 6.0 * 1.6e-7 - 2.56e-6 / 120.0];

fn engine() -> Engine {
    let mut engine = Engine::new(Config::robot(1000)).unwrap();
    engine.load(Some(&table(KAPPA[0], KAPPA[1]))).unwrap();
    engine
}

fn circle(feed_m_s: f64) -> CircleRun {
    let centre_m = [0.05, 0.0, 0.0];
    CircleRun {
        centre_m,
        radius_m: 0.05,
        feed_m_s,
        plane: giotto_shared::Plane::Xy,
        direction: Direction::Ccw,
        laps: 1,
        start_rad: PI,
    }
}

/// Largest rate of change, in any axis, of the programmed and the commanded velocity, m/s².
fn accelerations(out: &[Output]) -> (f64, f64) {
    let worst = |pick: &dyn Fn(&Output) -> [i32; 3]| {
        out.windows(3)
            .map(|w| {
                let p = [pick(&w[0]), pick(&w[1]), pick(&w[2])];
                (0..3)
                    .map(|i| f64::from(p[2][i]) - 2.0 * f64::from(p[1][i]) + f64::from(p[0][i]))
                    .fold(0.0, |a: f64, b| a.max(b.abs()))
                    * 1e-9
                    / (DT * DT)
            })
            .fold(0.0, f64::max)
    };
    (worst(&|o| o.nominal_nm), worst(&|o| o.corrected_nm))
}

/// The rate of the offset by axis: ramps are longer where the path leads along a slow one, and as quick as without where it does not; in
/// no tick does an axis change by more than its own bound, and the others are what they were.
#[test]
fn each_axis_keeps_its_own_rate_of_the_offset() {
    let run = |slew_m_s: [f64; 3]| {
        let mut config = Config::robot(1000);
        (config.offset_m, config.slew_m_s) = (0.05, slew_m_s);
        let mut engine = Engine::new(config).unwrap();
        engine.load(Some(&table(KAPPA[0], KAPPA[1]))).unwrap();
        engine.run_circle(&circle(0.3)).unwrap();
        let out = run_out(&mut engine);
        let offset = |o: &Output, axis: usize| o.corrected_nm[axis] - o.nominal_nm[axis];
        for pair in out.windows(2) {
            for (axis, slew_m_s) in slew_m_s.iter().enumerate() {
                let change = (offset(&pair[1], axis) - offset(&pair[0], axis)).abs();
                assert!(f64::from(change) <= slew_m_s * 1e6 + 1.0, "{axis} {change}");
            }
        }
        // The circle is what follows the last settling.
        let settled = out.iter().rposition(|o| o.flags & flag::SETTLING != 0);
        let circle = &out[settled.unwrap() + 1..];
        let y: Vec<i32> = circle.iter().map(|o| offset(o, 1)).collect();
        (circle.len(), engine.counters().slew_cuts, y)
    };
    let (quick, cuts, free) = run([1.0; 3]);
    assert_eq!(cuts, 0);
    // Not along Z: what it may does not matter.
    let (ticks, cuts, _) = run([1.0, 1.0, 1e-6]);
    assert_eq!((ticks, cuts), (quick, 0));
    for axis in 0..2 {
        let mut slew_m_s = [1.0; 3];
        slew_m_s[axis] = 4.5e-3;
        let (ticks, cuts, _) = run(slew_m_s);
        assert!(ticks > quick && cuts == 0, "{axis}: {ticks} {cuts}");
    }
    // Less than the law asks for at constant rate (2.9 mm/s): cut on X, and on X alone.
    let (ticks, cuts, y) = run([1e-3, 1.0, 1.0]);
    assert!(ticks == quick && cuts > 100, "{ticks} {cuts}");
    assert_eq!(y, free);
}

/// The table allows more than the law asks for at constant rate (0.48 mm, 2.9 mm/s), and less than it asks for in the quickest ramp.
#[test]
fn ramps_are_long_enough_for_the_bounds_of_the_table() {
    let run = |offset_m: f32, slew_m_s: f32| {
        let mut table = table(KAPPA[0], KAPPA[1]);
        (table.limits.offset_m, table.limits.slew_m_s) = (offset_m, slew_m_s);
        let mut engine = Engine::new(Config::robot(1000)).unwrap();
        engine.load(Some(&table)).unwrap();
        engine.run_circle(&circle(0.3)).unwrap();
        let out = run_out(&mut engine);
        let size = |o: &Output| {
            (0..3)
                .map(|i| (o.corrected_nm[i] - o.nominal_nm[i]).abs())
                .max()
                .unwrap()
        };
        let cuts = engine.counters().offset_cuts + engine.counters().slew_cuts;
        // The circle is what follows the last settling.
        let circle = out
            .iter()
            .rev()
            .position(|o| o.flags & flag::SETTLING != 0)
            .unwrap();
        (
            circle,
            cuts,
            f64::from(out.iter().map(size).max().unwrap()) * 1e-9,
        )
    };
    let (quick, cuts, asked_m) = run(0.05, 1.0);
    std::println!("without bounds: {quick} ticks, {asked_m} m at most");
    assert_eq!(cuts, 0);
    for (offset_m, slew_m_s) in [(0.6e-3, 1.0), (0.05, 4.5e-3), (0.6e-3, 4.5e-3)] {
        let (ticks, cuts, largest_m) = run(offset_m, slew_m_s);
        std::println!("{offset_m} m, {slew_m_s} m/s: {ticks} ticks, {largest_m} m at most");
        assert_eq!(cuts, 0, "{offset_m} {slew_m_s}");
        assert!(
            ticks > quick && largest_m <= f64::from(offset_m),
            "{ticks} {largest_m}"
        );
    }
    // Beyond the bounds at constant rate: no ramp can help, and none is made longer than it has to be.
    let (ticks, cuts, largest_m) = run(0.3e-3, 1.0);
    assert!(
        ticks == quick && cuts > 0 && largest_m <= 0.3e-3 + 1e-9,
        "{ticks} {cuts} {largest_m}"
    );
}

/// A rounded rectangle in the plane, 100 × 60 mm with corners of 10 mm, exact stops between its pieces.
fn rounded_rectangle(engine: &mut Engine, feed_m_s: f64) -> Vec<Output> {
    let (w, h, r) = (0.1, 0.06, 0.01);
    let mut out = Vec::new();
    let pieces = [
        ([w - r, 0.0], [w - r, r]),
        ([w, h - r], [w - r, h - r]),
        ([r, h], [r, h - r]),
        ([0.0, r], [r, r]),
    ];
    engine.set_position([10_000_000, 0, 0]).unwrap();
    for (to, centre) in pieces {
        engine
            .push(&Segment::Line {
                to_m: [to[0], to[1], 0.0],
                feed_m_s,
            })
            .unwrap();
        let arc = Segment::Arc {
            centre_m: [centre[0], centre[1], 0.0],
            normal: [0.0, 0.0, 1.0],
            sweep_rad: PI / 2.0,
            rise_m: 0.0,
            feed_m_s,
        };
        engine.push(&arc).unwrap();
        out.extend(run_out(engine));
    }
    out
}

#[test]
fn pieces_join_exactly_and_the_path_closes() {
    let mut engine = engine();
    let out = rounded_rectangle(&mut engine, 0.2);
    let last = out.last().unwrap();
    for (axis, end) in [10_000_000, 0, 0].into_iter().enumerate() {
        assert!(
            (last.nominal_nm[axis] - end).abs() <= 20,
            "{:?}",
            last.nominal_nm
        );
    }
    assert_eq!(last.nominal_nm, last.corrected_nm);
    assert_eq!(
        (
            engine.counters().dropped,
            engine.counters().segments,
            engine.fault()
        ),
        (0, 8, None)
    );
    // The operator adds κ2/2 times the jerk to the velocity.
    no_jump(&out, 0.24 * DT);
    let (nominal, corrected) = accelerations(&out);
    std::println!(
        "rounded rectangle, 0.2 m/s: programmed {nominal:.3} m/s², commanded {corrected:.3} m/s²"
    );
    // 0.2²/0.01 = 4 m/s² in the corners; the limit is 5 m/s².
    assert!(nominal <= 5.0 && corrected <= 5.0, "{nominal} {corrected}");
}

/// The bar is the configured acceleration itself, on the commanded path, at joints and between them.
#[test]
fn random_programs_keep_the_configured_acceleration_on_the_commanded_path() {
    let mut random = Random(7);
    let mut engine = engine();
    let (mut worst, mut closest) = (0.0f64, 0);
    for _ in 0..150 {
        let from_m = engine.planner.position_nm().map(|nm| f64::from(nm) * 1e-9);
        let pieces = [
            segment(&mut random, from_m),
            Segment::Line {
                to_m: random.point(),
                feed_m_s: 0.9,
            },
        ];
        for piece in pieces {
            // Helices too steep are refused.
            let refused = engine.push(&piece).err();
            assert!(
                refused.is_none_or(|why| why == Refused::OutOfBounds(Quantity::Rise)),
                "{refused:?}"
            );
        }
        let out = run_out(&mut engine);
        let (nominal, corrected) = accelerations(&out);
        // Second differences of whole nanometres at 1 kHz: 0.004 m/s².
        assert!(
            nominal <= 5.004 && corrected <= 5.004,
            "{nominal} {corrected} {pieces:?}"
        );
        worst = worst.max(corrected);
        closest += i32::from(corrected > 4.5);
    }
    std::println!(
        "largest commanded acceleration {worst:.3} m/s², above 4.5 in {closest} of 150 programs"
    );
    // It is used, too.
    assert!(closest > 30);
}

#[test]
fn a_helix_rises_evenly_and_ends_where_it_should() {
    for (sweep, rise) in [(5.0 * PI, 0.04), (-3.3 * PI, -0.03), (0.7, 0.001)] {
        let mut engine = engine();
        engine
            .set_position([60_000_000, 5_000_000, 1_000_000])
            .unwrap();
        let normal = [0.0, 0.0, 2.0];
        let helix = Segment::Arc {
            centre_m: [0.01, 0.005, 0.3],
            normal,
            sweep_rad: sweep,
            rise_m: rise,
            feed_m_s: 0.3,
        };
        engine.push(&helix).unwrap();
        let out = run_out(&mut engine);
        no_jump(&out, 0.34 * DT);
        let mut before = 0.0;
        for o in &out {
            // Height belongs to the angle travelled, unwrapped from one set-point to the next.
            let (x, y) = (
                f64::from(o.nominal_nm[0]) * 1e-9 - 0.01,
                f64::from(o.nominal_nm[1]) * 1e-9 - 0.005,
            );
            assert!((x.hypot(y) - 0.05).abs() < 3e-9);
            let turns = ((y.atan2(x) - before) / (2.0 * PI)).round();
            let angle = y.atan2(x) - 2.0 * PI * turns;
            before = angle;
            let height = f64::from(o.nominal_nm[2]) * 1e-9 - 0.001;
            assert!(
                (height - angle / sweep * rise).abs() < 5e-9,
                "{height} at {angle}"
            );
        }
        let end = out.last().unwrap().nominal_nm;
        let expected = [
            0.01 + 0.05 * sweep.cos(),
            0.005 + 0.05 * sweep.sin(),
            0.001 + rise,
        ]
        .map(|m| m * 1e9);
        for axis in 0..3 {
            assert!(
                (f64::from(end[axis]) - expected[axis]).abs() < 5.0,
                "{end:?} {expected:?}"
            );
        }
    }
}

#[test]
fn a_stop_at_any_tick_keeps_the_limits_and_leaves_a_usable_engine() {
    let run = circle(0.3);
    let whole = {
        let mut engine = engine();
        engine.run_circle(&run).unwrap();
        run_out(&mut engine).len()
    };
    let mut longest = 0;
    for at in (0..whole).step_by(13) {
        let mut engine = engine();
        engine.run_circle(&run).unwrap();
        engine
            .push(&Segment::Line {
                to_m: [0.2, 0.2, 0.2],
                feed_m_s: 0.1,
            })
            .unwrap();
        let mut out: Vec<Output> = (0..at).map(|_| engine.tick()).collect();
        engine.stop();
        let rest = run_out(&mut engine);
        let moving = rest.iter().filter(|o| o.flags & flag::MOVING != 0).count();
        longest = longest.max(moving);
        out.extend(rest);
        no_jump(&out, 0.54 * DT);
        let (nominal, corrected) = accelerations(&out);
        assert!(
            nominal <= 5.004 && corrected <= 5.004,
            "at {at}: {nominal} {corrected}"
        );
        let last = *out.last().unwrap();
        assert_eq!(last.nominal_nm, last.corrected_nm, "at {at}");
        assert!(engine.counters().stops == 1 && engine.counters().segments <= 2);
        // It goes on from there.
        engine
            .push(&Segment::Line {
                to_m: [0.1, 0.1, 0.1],
                feed_m_s: 0.2,
            })
            .unwrap();
        let on = run_out(&mut engine);
        assert_eq!(on.last().unwrap().nominal_nm, [100_000_000; 3], "at {at}");
        no_jump(&on, 0.25 * DT);
    }
    std::println!("longest stop {longest} ticks; whole run {whole}");
}

#[test]
fn bypass_comes_and_goes_without_a_step_and_equals_the_program_bit_for_bit() {
    let mut engine = engine();
    engine.set_bypass(true);
    while engine.tick().flags != 0 {}
    for _ in 0..300 {
        engine.tick();
    }
    engine.run_circle(&circle(0.3)).unwrap();
    assert!(
        run_out(&mut engine)
            .iter()
            .all(|o| o.nominal_nm == o.corrected_nm)
    );
    engine
        .run_circle(&CircleRun {
            laps: 4,
            ..circle(0.3)
        })
        .unwrap();
    let mut out: Vec<Output> = Vec::new();
    while !engine.idle() {
        match out.len() % 1100 {
            500 => engine.set_bypass(false),
            900 => engine.set_bypass(true),
            // Both within one blend: it is finished, then undone.
            1000 => engine.set_bypass(false),
            1010 => engine.set_bypass(true),
            _ => {}
        }
        out.push(engine.tick());
    }
    let corrected = out
        .iter()
        .filter(|o| o.nominal_nm != o.corrected_nm)
        .count();
    assert!(corrected > 1000 && corrected + 1000 < out.len());
    no_jump(&out, 0.54 * DT);
    let (nominal, commanded) = accelerations(&out);
    std::println!("bypass on and off: {nominal:.3} m/s² programmed, {commanded:.3} commanded");
    assert!(commanded < 1.3 * nominal);
    assert_eq!(engine.counters().slew_cuts, 0);
}

#[test]
fn bounds_of_table_and_image_hold_and_are_counted() {
    for (in_table, in_image) in [(100e-6, 0.02), (0.02, 100e-6)] {
        let mut config = Config::robot(1000);
        config.offset_m = in_image;
        let mut engine = Engine::new(config).unwrap();
        let mut table = table(KAPPA[0], KAPPA[1]);
        table.limits.offset_m = in_table as f32;
        engine.load(Some(&table)).unwrap();
        engine.run_circle(&circle(0.3)).unwrap();
        let out = run_out(&mut engine);
        let most = out
            .iter()
            .flat_map(|o| (0..3).map(|i| (o.corrected_nm[i] - o.nominal_nm[i]).abs()))
            .max()
            .unwrap();
        assert!((99_999..=100_000).contains(&most), "{most} nm");
        assert!(engine.counters().offset_cuts > 500);
        assert!(out.iter().any(|o| o.flags & flag::CUT != 0));
        no_jump(&out, 0.54 * DT);
    }
}

#[test]
fn nothing_outside_its_zone_is_corrected_and_that_is_counted() {
    let mut engine = engine();
    let mut table = table(KAPPA[0], KAPPA[1]);
    table.zones[0].radius_m = [0.06, 0.2];
    table.zones[0].feed_m_s = [0.6, 1.0];
    engine.load(Some(&table)).unwrap();
    engine.run_circle(&circle(0.3)).unwrap();
    assert!(
        run_out(&mut engine)
            .iter()
            .all(|o| o.nominal_nm == o.corrected_nm)
    );
    // The approach and the circle.
    assert_eq!(engine.counters().uncorrected, 2);
}

#[test]
fn numbers_that_are_none_and_programs_out_of_bounds_are_refused() {
    let mut engine = engine();
    let bad = [
        CircleRun {
            radius_m: f64::NAN,
            ..circle(0.3)
        },
        CircleRun {
            radius_m: -0.1,
            ..circle(0.3)
        },
        CircleRun {
            radius_m: 3.0,
            ..circle(0.3)
        },
        CircleRun {
            feed_m_s: f64::INFINITY,
            ..circle(0.3)
        },
        CircleRun {
            laps: 0,
            ..circle(0.3)
        },
        CircleRun {
            feed_m_s: 1.1,
            ..circle(0.3)
        },
        CircleRun {
            centre_m: [2.09, 0.0, 0.0],
            ..circle(0.3)
        },
        CircleRun {
            start_rad: f64::NAN,
            ..circle(0.3)
        },
    ];
    for run in bad {
        assert!(
            matches!(
                engine.run_circle(&run),
                Err(Refused::NotANumber(_) | Refused::OutOfBounds(_))
            ),
            "{run:?}"
        );
    }
    assert!(engine.idle());
    for (name, change) in [("kappa", 0), ("limit", 1), ("term", 2)] {
        let mut table = table(KAPPA[0], KAPPA[1]);
        match change {
            0 => table.zones[0].cumulants.kappa2_s2 = f32::NAN,
            1 => table.limits.offset_m = f32::INFINITY,
            _ => table.zones[0]
                .terms
                .push(Term::Squareness {
                    plane: Plane::Xy,
                    shear_rad: f32::NAN,
                })
                .unwrap(),
        }
        assert!(engine.load(Some(&table)).is_err(), "{name}");
    }
    let cyclic = Term::Cyclic {
        actuator: Actuator::X,
        amplitude_m: 1e-6,
        pitch_m: 0.01,
        phase_rad: 0.0,
    };
    let mut table = table(KAPPA[0], KAPPA[1]);
    table.zones[0]
        .terms
        .extend([cyclic; giotto_shared::law::MAX_CYCLIC + 1]);
    assert!(engine.load(Some(&table)).is_err());
}

#[test]
fn an_overrun_stops_and_latches_until_cleared() {
    let mut engine = engine();
    engine.run_circle(&circle(0.3)).unwrap();
    let mut out: Vec<Output> = (0..900).map(|_| engine.tick()).collect();
    engine.overrun();
    assert_eq!(engine.fault(), Some(Fault::Overrun));
    out.extend(run_out(&mut engine));
    no_jump(&out, 0.54 * DT);
    assert_eq!(engine.run_circle(&circle(0.3)), Err(Refused::Fault));
    assert!(engine.clear_fault());
    engine.run_circle(&circle(0.3)).unwrap();
    run_out(&mut engine);
    assert_eq!(
        (engine.counters().overruns, engine.counters().segments > 0),
        (1, true)
    );
}

/// Twelve days at 1 kHz on one circle: the phase at the end is that of the plan, to the nanometre.
#[test]
fn a_billion_ticks_do_not_drift() {
    let mut engine = engine();
    let laps = 910_000;
    engine
        .run_circle(&CircleRun {
            laps,
            feed_m_s: 0.283,
            ..circle(0.3)
        })
        .unwrap();
    let mut first = engine.tick();
    // The approach is the first segment.
    while engine.counters().segments == 0 || first.flags & flag::CRUISE == 0 {
        first = engine.tick();
    }
    let first = first.nominal_nm;
    // As many constant steps as the tick would make, in one product of the same integers.
    let skipped = engine.executor.skip_cruise(1_000_000);
    std::println!("{skipped} ticks skipped");
    assert!(skipped > 1_000_000_000);
    let rest = run_out(&mut engine);
    let laps_done = rest.iter().filter(|o| o.flags & flag::CRUISE != 0).count();
    assert_eq!(laps_done, 1_000_000);
    let last_cruise = rest
        .iter()
        .rposition(|o| o.flags & flag::CRUISE != 0)
        .unwrap();
    // One step before the first cruise tick the lap began; the last cruise tick ends the last lap.
    let end = rest[last_cruise].nominal_nm;
    let step = 0.283 * DT;
    let gap = f64::from(first[0] - end[0]).hypot(f64::from(first[1] - end[1])) * 1e-9;
    assert!((gap - step).abs() < 20e-9, "{gap} {step}");
}
