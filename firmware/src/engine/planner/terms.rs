//! Profile terms: from the numbers of a zone to those of the tick, and how much they ask for.
use super::numbers::{dot, length};
use super::timing::Motion;
use crate::engine::hysteresis::{FINE, limit};
use crate::engine::profile_terms::{Cyclic, Extra, Linear, Rising, Turning};
use crate::engine::ramp::FIRST;
use core::f32::consts::TAU;
use core::num::NonZeroU64;
use giotto_shared::angle::{RAD_PER_UNIT, sincos};
use giotto_shared::fixed::single_to_fixed;
use giotto_shared::law::{CyclicError, Profile};

fn nm2(metres: f32) -> i32 {
    single_to_fixed(metres * 1e9, 1)
}

fn nm4(metres: f32) -> i32 {
    single_to_fixed(metres * 1e9, 2)
}

fn fine(metres: f32) -> i32 {
    single_to_fixed(metres * 1e9, FINE)
}

/// What goes by the rate and by its change in a rising ramp.
struct Pace {
    rate: f32,
    change: f32,
}

impl Pace {
    fn of(m: &Motion) -> Self {
        Self {
            rate: m.rate,
            change: m.rate * FIRST / m.ramp_s,
        }
    }
}

/// An arc or helix as the terms see it, m.
pub(super) struct Curve {
    /// Vectors of its plane.
    pub(super) u: [f32; 3],
    pub(super) v: [f32; 3],
    /// Travel in a turn; 0 for an arc.
    pub(super) rise: [f32; 3],
    /// Its centre, seen from the point that errors of position are counted from.
    pub(super) centre: [f32; 3],
}

/// For an arc or helix. Written in place, as all of these: they are large.
pub(super) fn on_arc(p: &Profile<f32>, m: &Motion, curve: &Curve, extra: &mut Extra) {
    unsteady(p, m, extra);
    let (pace, Curve { u, v, rise, centre }) = (Pace::of(m), curve);
    let outward = -p.radius_offset_m / length(*u);
    let (cos, sin) = lead(m);
    for slide in 0..3 {
        let (row, velocity, second) = (
            p.position[slide],
            p.velocity_s[slide],
            p.acceleration_s2[slide],
        );
        let (u_k, v_k) = (u[slide], v[slide]);
        // q = u cosφ + v sinφ, q̇ = ω(−u sinφ + v cosφ), q̈ = α(−u sinφ + v cosφ) − ω²(u cosφ + v sinφ).
        let square = second * pace.rate * pace.rate;
        let (along, changing) = (velocity * pace.rate, second * pace.change);
        extra.linear[slide] = Linear {
            a: [
                nm2(outward * u_k - dot(row, *u)),
                nm4(-along * v_k),
                nm4(square * u_k),
                nm4(-changing * v_k),
            ],
            b: [
                nm2(outward * v_k - dot(row, *v)),
                nm4(along * u_k),
                nm4(square * v_k),
                nm4(changing * u_k),
            ],
        };
        // Radians of the arc's rate to turns of the rise's.
        let per_radian = rise[slide] / TAU;
        extra.rising[slide] = Rising {
            place_q34: row.map(|share| single_to_fixed(-share, 34)),
            rate: nm2(-along * per_radian),
            change: nm2(-changing * per_radian),
        };
        extra.constant_fine[slide] = fine(-dot(row, *centre));
        extra.ahead[slide] = [
            nm2(v_k * cos - u_k * sin),
            nm2(-u_k * cos - v_k * sin),
            single_to_fixed(per_radian * 1e9, 0),
        ];
    }
    // u²/2³¹ in nm² times this over 2³² is c·u² in nm.
    const PER_NM: f32 = 4_294_967_296.0 * 1e-9;
    extra.bow = p
        .bow_per_m
        .map(|row| row.map(|c| single_to_fixed(-c * PER_NM, 31)));
    extra.bowed = extra.bow != [[0; 3]; 3];
    turns(extra);
}

/// For a line with a span (m), its start seen from the reference point (m); `None`: there is none, and errors of position
/// are left out.
pub(super) fn on_line(
    p: &Profile<f32>,
    m: &Motion,
    span: [f32; 3],
    start: Option<[f32; 3]>,
    extra: &mut Extra,
) {
    unsteady(p, m, extra);
    let pace = Pace::of(m);
    for slide in 0..3 {
        let row = start.map_or([0.0; 3], |_| p.position[slide]);
        let along = span[slide];
        extra.linear[slide] = Linear {
            a: [
                -dot(row, span),
                -pace.rate * p.velocity_s[slide] * along,
                0.0,
                -pace.change * p.acceleration_s2[slide] * along,
            ]
            .map(nm2),
            b: [0; 4],
        };
        extra.constant_fine[slide] = fine(-dot(row, start.unwrap_or_default()));
        // It never turns.
        extra.ahead[slide] = [0, 0, single_to_fixed(along * 1e9, 0)];
    }
    turns(extra);
}

/// The terms that are the same on every curve.
#[inline(never)]
fn unsteady(p: &Profile<f32>, m: &Motion, extra: &mut Extra) {
    let ticks = m.take_up_ticks as f32;
    let share = 3.75 / ticks;
    *extra = Extra::default();
    extra.turning = Turning {
        take_up: m.take_up_ticks.saturating_add(1),
        dx: single_to_fixed(2.0 / ticks, 31),
        first_x: single_to_fixed(1.0 / ticks - 1.0, 31),
        share_q30: single_to_fixed(share, 30),
        side: p.play_m.map(|slide| slide.map(fine)),
        jump: p.play_m.map(|slide| slide.map(|b| fine(b * share))),
        spike: p.spike.map(|spike| fine(spike.peak_m)),
        fade: p.spike.map(|spike| {
            if spike.peak_m == 0.0 {
                0
            } else {
                single_to_fixed(decay(m.tick_s / spike.decay_s), 32)
            }
        }),
        ..Turning::default()
    };
    let cyclic = p.cyclic.iter().filter(|c| c.amplitude_m != 0.0);
    for (built, c) in extra.cyclic.iter_mut().zip(cyclic) {
        *built = periodic(c);
        extra.periodic = extra.periodic.wrapping_add(1);
    }
}

/// Once the indicators of the curve are there: which of them are looked at, and what their turns take.
fn turns(extra: &mut Extra) {
    let t = &mut extra.turning;
    let sided = t.side != [[0; 3]; 3] || t.spike != [0; 3];
    for slide in 0..3 {
        let idle = t.side[slide] == [0; 3] && t.spike[slide] == 0;
        t.ticks[slide] = if idle { 0 } else { t.take_up };
        t.limit[slide] = limit(extra.ahead[slide], sided);
    }
}

/// A periodic error. Over a metre of a fine pitch single precision would lose its phase: this divides integers.
fn periodic(c: &CyclicError<f32>) -> Cyclic {
    // 2³² units a pitch, per nm: Q24, from a pitch in units of 2⁻³⁷ m, which every pitch from 0.1 mm on is a whole number of.
    const UNITS_PER_NM: u64 = ((1u128 << (32 + 37 + 24)) / 1_000_000_000) as u64;
    let pitch = NonZeroU64::new((c.pitch_m * (1u64 << 37) as f32) as u64);
    let per_nm_q24 = pitch.map_or(0, |pitch| UNITS_PER_NM / pitch);
    let whole = per_nm_q24.wrapping_add(1 << 23) >> 24;
    let rest_q24 = per_nm_q24.wrapping_sub(whole << 24) as i32;
    Cyclic {
        slide: c.slide,
        amplitude: nm2(-c.amplitude_m),
        per_nm: whole as i32,
        rest_q32: rest_q24 << 8,
        phase: phase(c.phase_rad),
    }
}

/// Phase (2³² a turn) of an angle in rad, to the 24 bits of single precision.
fn phase(angle_rad: f32) -> u32 {
    (angle_rad * (1.0 / RAD_PER_UNIT) as f32) as i64 as u32
}

/// Cosine and sine of the angle by which reversals are seen early: the middle of the take-up falls on the reversal, which
/// is noticed half a tick late on average, and the take-up begins in the next tick.
fn lead(m: &Motion) -> (f32, f32) {
    let ticks = 0.5 * m.take_up_ticks as f32 + 0.5;
    let (c, s) = sincos(phase(m.rate * ticks * m.tick_s));
    let real = |q31: i32| q31 as f32 * (1.0 / 2_147_483_648.0);
    (real(c), real(s))
}

/// e⁻ʸ − 1 for y from 0 to 4; relative error 2e-6, below 0.1 that of single precision.
fn decay(y: f32) -> f32 {
    let z = y / 16.0;
    let series = -z * (1.0 - z / 2.0 * (1.0 - z / 3.0 * (1.0 - z / 4.0 * (1.0 - z / 5.0))));
    // e²ᵃ − 1 = (eᵃ − 1)(2 + (eᵃ − 1)), four times.
    (0..4).fold(series, |e, _| e * (2.0 + e))
}

/// Offset (m) and slew (m/s) that all terms together ask for on an arc at most: the sum of each one's own largest.
pub(super) fn worst_on_arc(
    p: &Profile<f32>,
    m: &Motion,
    radius: f32,
    centre: [f32; 3],
) -> [f32; 2] {
    let largest = |by_slide: [f32; 3]| by_slide.iter().fold(0.0f32, |most, v| most.max(v.abs()));
    let position = largest(p.position.map(length));
    let (velocity, second) = (largest(p.velocity_s), largest(p.acceleration_s2));
    let (rate, ramp) = (m.rate, m.rate / m.ramp_s);
    let (speed, acceleration) = (radius * rate, radius * (rate * rate + FIRST * ramp));
    let jerk = radius * (rate * rate * rate + 3.0 * FIRST * rate * ramp + 10.0 * ramp / m.ramp_s);
    let reach = radius + length(centre);
    let outward = p.radius_offset_m.abs();
    let mut offset = outward + position * reach + velocity * speed + second * acceleration;
    let mut slew = outward * rate + position * speed + velocity * acceleration + second * jerk;
    // Smoothstep of degree 5: 15/8 of the mean slope.
    let steep = 1.875 / (m.take_up_ticks as f32 * m.tick_s);
    for play in p.play_m.iter().flatten() {
        offset += 0.5 * play.abs();
        slew += play.abs() * steep;
    }
    for spike in p.spike.iter().filter(|spike| spike.peak_m != 0.0) {
        let peak = spike.peak_m.abs();
        offset += peak;
        slew += peak * (2.0 * steep + 1.0 / spike.decay_s);
    }
    for c in p.cyclic.iter().filter(|c| c.amplitude_m != 0.0) {
        offset += c.amplitude_m.abs();
        slew += c.amplitude_m.abs() * TAU / c.pitch_m * speed;
    }
    for bow in p.bow_per_m.iter().flatten() {
        offset += bow.abs() * radius * radius;
        slew += 2.0 * bow.abs() * radius * speed;
    }
    [offset, slew]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decay_is_the_exponential() {
        for i in 1..4000 {
            let y = i as f32 * 1e-3;
            let exact = libm::expm1(-f64::from(y));
            let error = (f64::from(decay(y)) / exact - 1.0).abs();
            assert!(error < if y < 0.1 { 3e-7 } else { 2e-6 }, "{y}: {error:e}");
        }
    }

    #[test]
    fn a_periodic_error_keeps_its_phase_over_a_metre() {
        for pitch_m in [1e-4f32, 3e-4, 0.0025, 0.01, 0.37, 10.0] {
            let c = CyclicError {
                slide: 0,
                amplitude_m: 1e-6,
                pitch_m,
                phase_rad: 0.0,
            };
            let Cyclic {
                per_nm: whole,
                rest_q32: rest,
                ..
            } = periodic(&c);
            let exact = 4.294_967_296 / f64::from(pitch_m);
            let got = f64::from(whole) + f64::from(rest) / 4_294_967_296.0;
            // Turns after a metre.
            assert!(
                (got - exact).abs() * 1e9 / 4_294_967_296.0 < 2e-8,
                "{pitch_m}: {got} {exact}"
            );
        }
    }
}
