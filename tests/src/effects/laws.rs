//! The same faults by other laws than the host's formulas, and an effect that its dictionary does not hold.
use super::{Effect, Seat};
use crate::machine::{Thermal, TwoMass};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Names of the effects that [`other_law`] can hide.
pub const OTHER_LAWS: [&str; 3] = ["two_mass_friction", "thermal_hook", "unlisted_sense_scale"];

/// The effect called `name`, drawn under `seed`.
pub fn other_law(name: &str, seed: u64) -> Option<Effect> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x6c61_7773);
    let name = *OTHER_LAWS.iter().find(|n| **n == name)?;
    let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
    let axis = rng.random_range(0..2_usize);
    let effect = match name {
        "two_mass_friction" => {
            let share = rng.random_range(0.1..0.5);
            let decay_s = rng.random_range(0.02..0.08);
            let omega_rad_s = rng.random_range(150.0..400.0);
            let zeta = rng.random_range(0.2..0.7);
            let travel_m = rng.random_range(1e-6..15e-6);
            Effect {
                name,
                // A wind-up that stays and a spike: either name is right, so is each beside the other.
                accept: vec!["reversal_spike", "backlash", "~higher_order_dynamics"],
                seat: Seat::Slide(axis),
                unit: "um",
                apply: Box::new(move |m, size| {
                    m.axes[axis].two_mass = Some(TwoMass {
                        windup_m: share * size,
                        peak_m: size,
                        decay_s,
                        omega_rad_s,
                        zeta,
                        travel_m,
                    });
                }),
                value: Box::new(|_, _, _| f64::NAN),
                first: 5e-6,
            }
        }
        "thermal_hook" => {
            let (curvature, hook) = (rng.random_range(0.3..4.0), rng.random_range(-0.3..0.3));
            Effect {
                name,
                accept: vec!["thermal_drift"],
                seat: Seat::Whole,
                unit: "um/m",
                apply: Box::new(move |m, size| {
                    m.thermal = Some(Thermal {
                        total: sign * size,
                        curvature,
                        hook,
                    });
                }),
                value: Box::new(|m, plan, _| {
                    let last_s = plan.tests.iter().map(|t| t.started_s).fold(0.0, f64::max);
                    1e6 * m.thermal.map_or(0.0, |t| t.growth(last_s / plan.length_s))
                }),
                first: 30e-6,
            }
        }
        _ => nameless(
            name,
            Box::new(move |m, size| m.geometry.sense_scale[axis] = sign * size),
            30e-6,
        ),
    };
    Some(effect)
}

fn nameless(name: &'static str, apply: super::Apply, first: f64) -> Effect {
    Effect {
        name,
        accept: Vec::new(),
        seat: Seat::Whole,
        unit: "",
        apply,
        value: Box::new(|_, _, _| 0.0),
        first,
    }
}
