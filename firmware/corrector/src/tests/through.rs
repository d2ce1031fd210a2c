//! What is not corrected is not touched.
use super::*;
use rand::{Rng, RngExt, SeedableRng};

fn random(rng: &mut impl Rng) -> [f64; JOINTS] {
    core::array::from_fn(|_| {
        f64::from_bits(rng.random::<u64>() & 0x807f_ffff_ffff_ffff | 0x3ff0_0000_0000_0000)
    })
}

#[test]
fn never_enabled_the_output_is_the_input_to_the_bit() {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let mut corrector = corrector(9, 1.0);
    corrector.load(&table(cumulants(), &eight(), None)).unwrap();
    for tick in 0..20_000 {
        let (mut command, feedback) = (random(&mut rng), random(&mut rng));
        if tick % 997 == 0 {
            command[3] = f64::NAN;
        }
        let out = corrector.tick(&input(command, feedback), 1e-3);
        for joint in 0..JOINTS {
            assert_eq!(out.command[joint].to_bits(), command[joint].to_bits());
            assert_eq!(out.feedback[joint].to_bits(), feedback[joint].to_bits());
        }
        assert!(!out.active && out.latency_s == 0.0);
    }
}

#[test]
fn disabled_and_after_a_rest_the_input_passes_to_the_bit_again() {
    for (units_per_mm, tick_s) in [(1.0, 1e-3), (1.0 / 25.4, 250e-6), (1.0, 4e-3)] {
        let mut corrector = corrector(4, units_per_mm);
        corrector.load(&table(cumulants(), &eight(), None)).unwrap();
        let metre = 1e3 * units_per_mm;
        let mut corrected = false;
        let ticks = (8.0 / tick_s) as usize;
        for tick in 0..ticks {
            let t = tick as f64 * tick_s;
            // Three turns, disabled in the second, a rest, then a turn again.
            let at = if t < 5.0 {
                circle(0.05, 4.0, 2.0, 1.0, t - 0.2)
            } else {
                circle(0.05, 4.0, 1.0, 1.0, t - 5.2)
            };
            let mut command = [0.0; JOINTS];
            for (command, at) in command.iter_mut().zip(at) {
                *command = at * metre;
            }
            command[3] = 7.0 * t.min(3.0);
            let mut input = input(command, command);
            input.enable = t > 0.1 && t < 2.0;
            let out = corrector.tick(&input, tick_s);
            corrected |= (out.command[0] - command[0]).abs() > 1e-4 * metre;
            if t > 5.0 {
                assert!(!out.active && out.latency_s == 0.0);
                assert_eq!(out.command.map(f64::to_bits), command.map(f64::to_bits));
                assert_eq!(out.feedback.map(f64::to_bits), command.map(f64::to_bits));
            }
        }
        assert!(corrected, "it was on before");
    }
}

#[test]
fn feedback_is_given_back_without_offset_and_latency() {
    let mut corrector = corrector(3, 1.0);
    corrector.load(&table(cumulants(), &eight(), None)).unwrap();
    let (mut most, mut offset) = (0.0f64, 0.0f64);
    for tick in 0..4000 {
        let [x, y, z] = circle(50.0, 4.0, 2.0, 1000.0, f64::from(tick) * 1e-3 - 0.2);
        let mut command = [0.0; JOINTS];
        command[..3].copy_from_slice(&[x, y, z]);
        // A drive that follows exactly: the planner has to see no following error at all.
        let mut input = input(command, [0.0; JOINTS]);
        input.enable = true;
        let mut twin = corrector.clone();
        input.feedback = twin.tick(&input, 1e-3).command;
        let out = corrector.tick(&input, 1e-3);
        for joint in 0..3 {
            most = most.max((out.feedback[joint] - command[joint]).abs());
            offset = offset.max((out.command[joint] - command[joint]).abs());
        }
    }
    assert!(most < 1e-12 && offset > 1.0, "{most} {offset}");
}

#[test]
fn a_table_that_is_none_changes_nothing() {
    let mut corrector = corrector(3, 1.0);
    let good = table(cumulants(), &eight(), None);
    for at in 0..good.len() {
        let mut bad = good.clone();
        bad[at] ^= 0x10;
        assert!(corrector.load(&bad).is_err() || bad.len() < 8, "byte {at}");
        assert!(corrector.load(&good[..at]).is_err());
    }
    assert!(!corrector.has_table());
    let mut input = input([1.0; JOINTS], [1.0; JOINTS]);
    input.enable = true;
    assert!(corrector.tick(&input, 1e-3).fault);
}
