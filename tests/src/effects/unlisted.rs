//! Effects outside the contract's list. Naming a listed cause for one of these is wrong.
use super::{Effect, Seat};
use crate::machine::Pattern;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;

/// Names of the effects that [`unlisted`] can hide.
pub const UNLISTED: [&str; 10] = [
    "unknown_third",
    "unknown_third_even",
    "unknown_four_lobes",
    "unknown_five_lobes",
    "unknown_bump",
    "unknown_quadrant",
    "unknown_size_with_feed",
    "unknown_step",
    "unknown_sweep",
    "unknown_transient",
];

/// The effect called `name`; phases and places drawn under `seed`.
pub fn unlisted(name: &str, seed: u64) -> Option<Effect> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x756e_6b6e);
    let name = UNLISTED.iter().find(|n| **n == name)?;
    let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
    let phase_rad = rng.random_range(0.0..2.0 * PI);
    let lobes = |order: f64, odd: bool, reach: [f64; 2]| {
        move |size: f64| Pattern::Lobes {
            order,
            amplitude_m: sign * size,
            phase_rad,
            odd,
            reach,
        }
    };
    let width_rad = rng.random_range(0.08..0.25);
    let which = rng.random_range(0..4_u8);
    let at = rng.random_range(0.3..0.7);
    let orders = [rng.random_range(5.0..15.0), rng.random_range(40.0..90.0)];
    let decay_s = rng.random_range(0.15..0.5);
    let pattern: Box<dyn Fn(f64) -> Pattern + Send + Sync> = match *name {
        "unknown_third" => Box::new(lobes(3.0, true, [1.0, 0.0])),
        "unknown_third_even" => Box::new(lobes(3.0, false, [1.0, 0.0])),
        "unknown_four_lobes" => Box::new(lobes(4.0, false, [0.0, 1.0])),
        "unknown_five_lobes" => Box::new(lobes(5.0, false, [2.0, -1.0])),
        "unknown_bump" => Box::new(move |size| Pattern::Bump {
            height_m: sign * size,
            at_rad: phase_rad,
            width_rad,
            reach: [0.0, 0.0],
        }),
        "unknown_quadrant" => Box::new(move |size| Pattern::Quadrant {
            shift_m: sign * size,
            which,
        }),
        "unknown_size_with_feed" => Box::new(lobes_of_size(sign)),
        "unknown_step" => Box::new(move |size| Pattern::Step {
            jump_m: sign * size,
            at,
        }),
        "unknown_sweep" => Box::new(move |size| Pattern::Sweep {
            amplitude_m: sign * size,
            orders,
        }),
        _ => Box::new(move |size| Pattern::Transient {
            height_m: sign * size,
            decay_s,
        }),
    };
    Some(Effect {
        name,
        accept: Vec::new(),
        seat: Seat::Whole,
        unit: "",
        apply: Box::new(move |m, size| m.patterns.push(pattern(size))),
        value: Box::new(|_, _, _| 0.0),
        first: 3e-6,
    })
}

/// ΔR ∝ f at every radius: neither a lag (f²/R) nor play (flips with direction).
fn lobes_of_size(sign: f64) -> impl Fn(f64) -> Pattern {
    move |size| Pattern::Lobes {
        order: 0.0,
        amplitude_m: sign * size,
        phase_rad: 0.0,
        odd: false,
        reach: [1.0, 0.0],
    }
}
