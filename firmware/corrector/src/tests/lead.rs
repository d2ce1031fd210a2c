//! Offsets for a controller that adds them to a path of its own, some time later.
use super::*;

const RADIUS_M: f64 = 0.1;
const OMEGA: f64 = 4.0;

/// Largest difference, m, between the offset and that of the place `dead_s` after the newest set-point, on a whole circle.
fn apart(lead_s: f64, dead_s: f64, tick_s: f64) -> f64 {
    let settings = Settings::new(3, "XYZ", 1.0).unwrap();
    let mut corrector = Box::new(Corrector::new(settings.with_lead(lead_s).unwrap()));
    corrector
        .load(&table(cumulants(), &eight()[..1], None))
        .unwrap();
    let mut bare = Box::new(Corrector::new(settings.with_lead(lead_s).unwrap()));
    bare.load(&table(cumulants(), &[], None)).unwrap();
    let law = giotto_shared::law::Operator::new(&Cumulants {
        kappa2_s2: f64::from(cumulants().kappa2_s2),
        kappa4_s4: f64::from(cumulants().kappa4_s4),
    });
    let mut most = 0.0f64;
    for tick in 0..(4.0 / tick_s) as usize {
        let t = tick as f64 * tick_s;
        let mut command = [0.0; JOINTS];
        let (sin, cos) = (OMEGA * t).sin_cos();
        (command[0], command[1]) = (1e3 * RADIUS_M * cos, 1e3 * RADIUS_M * sin);
        let mut input = input(command, [f64::NAN; JOINTS]);
        input.enable = true;
        let out = bare.tick(&input, tick_s);
        assert_eq!(out.latency_s, 0.0);
        // Play goes by the slides, not with the path: on the newest place, whatever the lead.
        let with_play = corrector.tick(&input, tick_s);
        let play = (with_play.command[0] - out.command[0]).abs() * 1e-3;
        if t > 1.5 {
            assert!(play < 10.5e-6, "{play}");
            let (sin, cos) = (OMEGA * (t + dead_s)).sin_cos();
            let outward = law.offset(-OMEGA * OMEGA * RADIUS_M, OMEGA.powi(4) * RADIUS_M);
            for (joint, unit) in [cos, sin].into_iter().enumerate() {
                let offset = (out.command[joint] - command[joint]) * 1e-3;
                most = most.max((offset - outward * unit).abs());
            }
        }
    }
    most
}

#[test]
fn the_offset_is_that_of_the_place_ahead_at_the_rate_of_each_door() {
    for (tick_s, bar) in [
        (4e-3, 0.1e-6),
        (8e-3, 0.1e-6),
        (12e-3, 0.1e-6),
        (48e-3, 1e-6),
    ] {
        let exact = apart(0.010, 0.010, tick_s);
        assert!(exact < bar, "{tick_s}: {exact}");
        // A lead that is wrong by 10 ms turns the offset by 0.04 rad.
        let wrong = apart(0.010, 0.020, tick_s);
        assert!(wrong > 10e-6, "{tick_s}: {wrong}");
    }
}

/// Whatever the path does, the offset changes no faster than the table allows, and does not jump with the path.
#[test]
fn a_path_that_jumps_leaves_the_offset_where_it_was() {
    let settings = Settings::new(3, "XYZ", 1.0).unwrap();
    let mut corrector = Box::new(Corrector::new(settings.with_lead(0.012).unwrap()));
    corrector.load(&table(cumulants(), &[], None)).unwrap();
    let (mut last, mut most, mut largest) = ([0.0; 3], 0.0f64, 0.0f64);
    for tick in 0..2000 {
        let t = f64::from(tick) * 4e-3;
        let aside = if tick > 1200 { 250.0 } else { 0.0 };
        let mut command = [0.0; JOINTS];
        let (sin, cos) = (OMEGA * t).sin_cos();
        (command[0], command[1]) = (1e3 * RADIUS_M * cos + aside, 1e3 * RADIUS_M * sin);
        let mut input = input(command, [f64::NAN; JOINTS]);
        input.enable = true;
        let out = corrector.tick(&input, 4e-3);
        for joint in 0..3 {
            let offset = out.command[joint] - command[joint];
            most = most.max((offset - last[joint]).abs());
            largest = largest.max(offset.abs());
            last[joint] = offset;
        }
    }
    assert_eq!(corrector.counters().resets, 1);
    // 0.1 m/s in 4 ms are 0.4 mm; the circle itself asks for 7 µm a tick.
    assert!(most < 0.02 && largest > 0.3, "{most} {largest}");
}

#[test]
fn a_lead_that_nobody_can_see_ahead_is_refused() {
    let settings = Settings::new(3, "XYZ", 1.0).unwrap();
    for lead_s in [-1e-3, 0.6, f64::NAN] {
        assert_eq!(
            settings.with_lead(lead_s),
            Err(crate::SettingsError("lead_s"))
        );
    }
}
