//! The contract's closed list, without the two causes of serial arms.
use super::{Effect, Seat, Slides};
use crate::machine::{Cyclic, Friction, Machine, Plan, StickSlip, Thermal, Vibration};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;

/// Names of the causes that [`listed`] can hide.
pub const LISTED: [&str; 17] = [
    "higher_order_dynamics",
    "radius_offset",
    "scale_error",
    "scale_mismatch",
    "squareness",
    "servo_mismatch",
    "bandwidth_mismatch",
    "backlash",
    "lateral_play",
    "reversal_spike",
    "cyclic_error",
    "straightness",
    "vibration",
    "interpolation_chord",
    "feed_clamp",
    "thermal_drift",
    "stick_slip",
];

/// κ4/24 − κ2²/4: what a chain has of β2 beyond the one lag with the same κ2 (β2 = κ2²/8 + κ4/24, Eq. 15).
fn beta2_beyond_lag_s4(machine: &Machine) -> f64 {
    let [k2, k4] = machine.axes[0].cumulants();
    k4 / 24.0 - k2 * k2 / 4.0
}

/// The effect called `name` on X, Y or both; its sign, slide and secondary parameters drawn under `seed`.
pub fn listed(name: &str, seed: u64) -> Option<Effect> {
    listed_on(name, seed, Slides::XY)
}

/// The effect called `name` on the given slides.
pub fn listed_on(name: &str, seed: u64, slides: Slides) -> Option<Effect> {
    let pair = slides.pair;
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x6c69_7374);
    let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
    let drawn = pair[rng.random_range(0..2_usize)];
    let axis = slides.axis.unwrap_or(drawn);
    let other = if axis == pair[0] { pair[1] } else { pair[0] };
    let index = LISTED.iter().position(|n| *n == name)?;
    let name = LISTED[index];
    let constant = |v: f64| -> super::Value { Box::new(move |_: &Machine, _: &Plan, _| v) };
    let plain = |unit, first, apply: super::Apply, value: super::Value| Effect {
        name,
        accept: vec![name],
        seat: Seat::Whole,
        unit,
        apply,
        value,
        first,
    };
    let effect = match name {
        "higher_order_dynamics" => {
            // Size is ωn⁻⁴: the misfit is that of κ4. Half are mechanics behind the lag, half a response of
            // second order alone, as the paper's robot has it (ωn ≈ 38 rad/s, ζ ≈ 0.72).
            let alone = rng.random_bool(0.5);
            let zeta = rng.random_range(if alone { 0.715..0.86 } else { 0.69..0.86 });
            plain(
                "s^4",
                80.0_f64.powi(-4),
                Box::new(move |m, size| {
                    for a in &mut m.axes {
                        a.mechanics = Some([size.powf(-0.25), zeta]);
                        if alone {
                            a.lag_s = 0.0;
                        }
                    }
                }),
                Box::new(|m, _, _| beta2_beyond_lag_s4(m)),
            )
        }
        "radius_offset" => plain(
            "mm",
            3e-6,
            Box::new(move |m, size| m.radius_offset_m = sign * size),
            Box::new(|m, _, _| m.radius_offset_m * 1e3),
        ),
        "scale_error" => plain(
            "um/m",
            20e-6,
            Box::new(move |m, size| m.geometry.scale.iter_mut().for_each(|s| *s += sign * size)),
            Box::new(|m, _, _| 1e6 / 3.0 * m.geometry.scale.iter().sum::<f64>()),
        ),
        "scale_mismatch" => plain(
            "um/m",
            30e-6,
            Box::new(move |m, size| {
                m.geometry.scale[pair[0]] += sign * size / 2.0;
                m.geometry.scale[pair[1]] -= sign * size / 2.0;
            }),
            Box::new(|m, _, [a, b]| 1e6 * (m.geometry.scale[a] - m.geometry.scale[b])),
        ),
        "squareness" => plain(
            "um/m",
            30e-6,
            Box::new(move |m, size| m.geometry.squareness_rad[pair[0]] = sign * size),
            // Of the slide with the one after it: a pair is asked for in the order of its plane.
            Box::new(|m, _, [a, _]| 1e6 * m.geometry.squareness_rad[a]),
        ),
        "servo_mismatch" => {
            // Two thirds are unequal kv, one third unequal dead times: one class on circles.
            let dead = rng.random_bool(1.0 / 3.0);
            plain(
                "s",
                20e-6,
                Box::new(move |m, size| {
                    for (i, a) in m.axes.iter_mut().enumerate() {
                        // A slide beside the pair stays in the middle.
                        let half = match i {
                            _ if i == pair[0] => 0.5 * sign * size,
                            _ if i == pair[1] => -0.5 * sign * size,
                            _ => 0.0,
                        };
                        if dead {
                            // Both stay causal.
                            a.dead_time_s += size / 2.0 + half;
                        } else {
                            a.lag_s += half;
                        }
                    }
                }),
                Box::new(|m, _, [a, b]| m.axes[a].delay_s() - m.axes[b].delay_s()),
            )
        }
        "bandwidth_mismatch" => plain(
            "s^2",
            3e-3_f64.powi(2),
            // A smoothing filter on one axis, its delay made up for on the others. Size is the window squared.
            Box::new(move |m, size| {
                m.axes[axis].average_s = size.sqrt();
                for i in (0..3).filter(|i| *i != axis) {
                    m.axes[i].dead_time_s += size.sqrt() / 2.0;
                }
            }),
            Box::new(|m, _, [a, b]| m.axes[a].cumulants()[0] - m.axes[b].cumulants()[0]),
        ),
        "backlash" => {
            let sign = if rng.random_bool(0.8) { 1.0 } else { -1.0 };
            plain(
                "mm",
                3e-6,
                Box::new(move |m, size| m.axes[axis].backlash_m = sign * size),
                Box::new(move |m, _, _| 1e3 * m.axes[axis].backlash_m),
            )
        }
        "lateral_play" => plain(
            "mm",
            3e-6,
            Box::new(move |m, size| m.lateral_play_m[axis][other] = sign * size),
            Box::new(move |m, _, _| 1e3 * m.lateral_play_m[axis][other]),
        ),
        "reversal_spike" => {
            // An effect that is asked for on one slide is on no other.
            let both = rng.random_bool(0.5) && slides.axis.is_none();
            let decay_s = rng.random_range(0.015..0.1);
            let rise_s = decay_s * rng.random_range(0.02..0.25);
            let presliding_m = rng.random_range(0.5e-6..25e-6);
            let mut e = plain(
                "um",
                5e-6,
                Box::new(move |m, size| {
                    let friction = Friction {
                        peak_m: size,
                        decay_s,
                        rise_s,
                        presliding_m,
                    };
                    for (i, a) in m.axes.iter_mut().enumerate() {
                        if i == axis || (both && pair.contains(&i)) {
                            a.friction = Some(friction);
                        }
                    }
                }),
                Box::new(move |m, _, _| 1e6 * m.axes[axis].friction.map_or(0.0, |f| f.peak_m)),
            );
            // The spikes' mean changes with f/R, as a response of higher order would make it.
            e.accept.push("~higher_order_dynamics");
            if both {
                return Some(e);
            }
            e
        }
        "cyclic_error" => {
            let pitch_m = rng.random_range(0.005..0.04);
            let phase_rad = rng.random_range(0.0..2.0 * PI);
            plain(
                "um",
                2e-6,
                Box::new(move |m, size| {
                    m.geometry.cyclic[axis] = Some(Cyclic {
                        amplitude_m: size,
                        pitch_m,
                        phase_rad,
                    });
                }),
                Box::new(move |m, _, _| {
                    1e6 * m.geometry.cyclic[axis].map_or(0.0, |c| c.amplitude_m)
                }),
            )
        }
        "straightness" => plain(
            "um",
            50e-6,
            Box::new(move |m, size| m.geometry.bow_per_m[axis][other] = sign * size),
            // The bow over the largest circle.
            Box::new(move |m, plan, _| {
                let largest = plan.tests.iter().map(|t| t.radius_m).fold(0.0, f64::max);
                1e6 * m.geometry.bow_per_m[axis][other] * largest * largest
            }),
        ),
        "vibration" => {
            let frequency_hz = rng.random_range(4.0..60.0);
            let along = if rng.random_bool(0.5) {
                None
            } else {
                Some(axis)
            };
            plain(
                "Hz",
                2e-6,
                Box::new(move |m, size| {
                    m.vibration = Some(Vibration {
                        frequency_hz,
                        amplitude_m: size,
                        axis: along,
                    });
                }),
                constant(frequency_hz),
            )
        }
        "interpolation_chord" => {
            let mut e = plain(
                "s",
                0.015_f64.powi(2),
                // Size is the period squared, as the sagitta goes.
                Box::new(|m, size| m.interpolation_s = size.sqrt()),
                Box::new(|m, _, _| m.interpolation_s),
            );
            // Chords have a κ4 that one lag has not.
            e.accept.push("~higher_order_dynamics");
            e
        }
        "feed_clamp" => plain(
            "mm/s^2",
            1.0 / 3.0,
            // Size is 1/a.
            Box::new(|m, size| m.centripetal_limit_m_s2 = 1.0 / size),
            Box::new(|m, _, _| 1e3 * m.centripetal_limit_m_s2),
        ),
        "thermal_drift" => {
            let curvature = if rng.random_bool(0.5) {
                0.0
            } else {
                rng.random_range(0.5..3.0)
            };
            plain(
                "um/m",
                30e-6,
                Box::new(move |m, size| {
                    m.thermal = Some(Thermal {
                        total: sign * size,
                        curvature,
                        hook: 0.0,
                    })
                }),
                // What can be known: the growth between the first run and the last.
                Box::new(|m, plan, _| {
                    let last_s = plan.tests.iter().map(|t| t.started_s).fold(0.0, f64::max);
                    1e6 * m.thermal.map_or(0.0, |t| t.growth(last_s / plan.length_s))
                }),
            )
        }
        "stick_slip" => {
            let speed_m_s = rng.random_range(0.005..0.02);
            let slip_s = rng.random_range(0.002..0.01);
            plain(
                "um",
                5e-6,
                Box::new(move |m, size| {
                    m.axes[axis].stick_slip = Some(StickSlip {
                        height_m: size,
                        speed_m_s,
                        slip_s,
                    });
                }),
                Box::new(move |m, _, _| 1e6 * m.axes[axis].stick_slip.map_or(0.0, |s| s.height_m)),
            )
        }
        _ => return None,
    };
    let seat = match name {
        "backlash" | "lateral_play" | "reversal_spike" | "cyclic_error" | "straightness"
        | "stick_slip" => Seat::Slide(axis),
        "scale_mismatch" | "squareness" | "servo_mismatch" | "bandwidth_mismatch" => {
            Seat::Pair(pair)
        }
        _ => Seat::Whole,
    };
    Some(Effect { seat, ..effect })
}
