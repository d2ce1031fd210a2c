//! Errors of one joint or link.
use super::{Arm, Gear, Kinematics};
use crate::effects::Seat;
use crate::machine::{Friction, Plan};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;

/// Names of the effects that [`arm_effect`] can hide.
pub const ARM_EFFECTS: [&str; 7] = [
    "joint_lag_mismatch",
    "bandwidth_mismatch",
    "joint_reversal",
    "joint_backlash",
    "joint_cyclic_error",
    "joint_zero",
    "link_length",
];

/// Those that one place cannot tell from one another.
pub const ALIKE: [&str; 2] = ["joint_zero", "link_length"];

type Apply = Box<dyn Fn(&mut Arm, f64) + Send + Sync>;
type Value = Box<dyn Fn(&Arm, &Plan) -> f64 + Send + Sync>;

/// One error of an arm; its misfit grows with the size.
pub struct ArmEffect {
    /// Name of the cause.
    pub name: &'static str,
    /// The joint, or the whole arm.
    pub seat: Seat,
    /// Unit of the true value.
    pub unit: &'static str,
    /// Puts it into an arm.
    pub apply: Apply,
    /// True value in the contract's unit; not a number where the contract leaves it open.
    pub value: Value,
    /// A size to begin the search with.
    pub first: f64,
}

/// The effect called `name` on a joint that moves the tool, drawn under `seed`.
pub fn arm_effect(name: &str, seed: u64, kinematics: &Kinematics) -> Option<ArmEffect> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x6172_6d00);
    let name = *ARM_EFFECTS.iter().find(|n| **n == name)?;
    let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
    let turning = kinematics.turning();
    let joint = rng.random_range(0..turning.min(3));
    // A turn of the base turns the circle, which no circle shows.
    let bent = if turning == 2 {
        1
    } else {
        rng.random_range(1..3_usize)
    };
    let (ratio, order) = (
        rng.random_range(60.0..160.0_f64).round(),
        rng.random_range(1..=2),
    );
    let (waves, phase_rad) = (ratio * f64::from(order), rng.random_range(0.0..2.0 * PI));
    let decay_s = rng.random_range(0.02..0.08);
    let rise_s = decay_s * rng.random_range(0.03..0.2);
    let presliding_m = rng.random_range(2e-6..2e-5);
    let count = turning as f64;
    let (seat, unit, first, apply, value): (Seat, _, _, Apply, Value) = match name {
        "joint_lag_mismatch" => (
            Seat::Joint(joint),
            "s",
            1e-4,
            Box::new(move |a, size| a.joints[joint].chain.lag_s += sign * size),
            Box::new(move |a, _| {
                let all = a.joints.iter().take(turning).map(|j| j.chain.delay_s());
                a.joints[joint].chain.delay_s() - all.sum::<f64>() / count
            }),
        ),
        "bandwidth_mismatch" => (
            Seat::Joint(joint),
            "s^2",
            1e-5,
            Box::new(move |a, size| {
                for (k, j) in a.joints.iter_mut().enumerate() {
                    if k == joint {
                        j.chain.average_s = size.sqrt();
                    } else {
                        j.chain.dead_time_s += size.sqrt() / 2.0;
                    }
                }
            }),
            Box::new(|_, _| f64::NAN),
        ),
        "joint_reversal" => (
            Seat::Joint(joint),
            "um",
            1e-5,
            Box::new(move |a, size| {
                a.joints[joint].chain.friction = Some(Friction {
                    peak_m: size,
                    decay_s,
                    rise_s,
                    presliding_m,
                });
            }),
            Box::new(|_, _| f64::NAN),
        ),
        "joint_backlash" => (
            Seat::Joint(joint),
            "mrad",
            2e-5,
            Box::new(move |a, size| a.joints[joint].chain.backlash_m = size),
            Box::new(move |a, _| 1e3 * a.joints[joint].chain.backlash_m),
        ),
        "joint_cyclic_error" => (
            Seat::Joint(joint),
            "mrad",
            1e-5,
            Box::new(move |a, amplitude_rad| {
                a.joints[joint].gear = Some(Gear {
                    amplitude_rad,
                    waves,
                    phase_rad,
                });
            }),
            Box::new(move |a, _| 1e3 * a.joints[joint].gear.map_or(0.0, |g| g.amplitude_rad)),
        ),
        "joint_zero" => (
            Seat::Joint(bent),
            "mrad",
            1e-4,
            Box::new(move |a, size| a.joints[bent].zero_rad += sign * size),
            Box::new(move |a, _| 1e3 * a.joints[bent].zero_rad),
        ),
        _ => {
            let first_link = rng.random_bool(0.5);
            (
                Seat::Whole,
                "mm",
                1e-4,
                Box::new(move |a, size| *link(&mut a.real, first_link) += sign * size),
                Box::new(move |a, _| {
                    let mut believed = a.believed.clone();
                    let mut real = a.real.clone();
                    1e3 * (*link(&mut real, first_link) - *link(&mut believed, first_link))
                }),
            )
        }
    };
    Some(ArmEffect {
        name,
        seat,
        unit,
        apply,
        value,
        first,
    })
}

/// A link of an arm: the upper one or the lower.
fn link(kinematics: &mut Kinematics, upper: bool) -> &mut f64 {
    match kinematics {
        Kinematics::Scara { l1_m, l2_m, .. } => {
            if upper {
                l1_m
            } else {
                l2_m
            }
        }
        Kinematics::Six { c2_m, c3_m, .. } => {
            if upper {
                c2_m
            } else {
                c3_m
            }
        }
    }
}
