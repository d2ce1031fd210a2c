//! Profile terms: from the numbers of a zone to those of the tick, and how much they ask for.
use super::timing::Motion;
use crate::engine::extra::{Cyclic, Extra, Linear, Moving, Turning};
use crate::engine::ramp::FIRST;
use crate::engine::sides::FINE;
use core::f32::consts::TAU;
use core::num::NonZeroU64;
use giotto_shared::angle::{RAD_PER_UNIT, sincos};
use giotto_shared::fixed::single_to_fixed;
use giotto_shared::law::{CyclicError, Profile as Whole, Spike};

fn nm2(metres: f32) -> i32 {
    single_to_fixed(metres * 1e9, 1)
}

fn fine(metres: f32) -> i32 {
    single_to_fixed(metres * 1e9, FINE)
}

/// The terms of X and Y.
struct Profile {
    radius_offset_m: f32,
    position: [[f32; 2]; 2],
    velocity_s: [[f32; 2]; 2],
    acceleration_s2: [[f32; 2]; 2],
    backlash_m: [f32; 2],
    lateral_m: [f32; 2],
    spike: [Spike<f32>; 2],
    cyclic: [CyclicError<f32>; 2],
    bow_per_m: [f32; 2],
}

impl Profile {
    fn of(p: &Whole<f32>) -> Self {
        let ([[xx, xy, _], [yx, yy, _], _], [bx, by, _], [ax, ay, _]) =
            (p.position, p.velocity_s, p.acceleration_s2);
        let ([[px, pxy, _], [pyx, py, _], _], [sx, sy, _]) = (p.play_m, p.spike);
        let [[_, bow_x, _], [bow_y, ..], _] = p.bow_per_m;
        let [c0, c1, _] = p.cyclic;
        Self {
            radius_offset_m: p.radius_offset_m,
            position: [[xx, xy], [yx, yy]],
            velocity_s: [[bx, 0.0], [0.0, by]],
            acceleration_s2: [[ax, 0.0], [0.0, ay]],
            backlash_m: [px, py],
            lateral_m: [-pxy, pyx],
            spike: [sx, sy],
            cyclic: [c0, c1],
            bow_per_m: [bow_x, bow_y],
        }
    }
}

/// A row of a matrix times X and Y of a vector.
fn by([a, b]: [f32; 2], [x, y]: [f32; 2]) -> f32 {
    a * x + b * y
}

/// For an arc with vectors u and v (m), its centre seen from the reference point (m). Written in place, as all of these:
/// they are large.
pub(super) fn on_arc(
    p: &Whole<f32>,
    m: &Motion,
    [u, v]: [[f32; 3]; 2],
    centre: [f32; 2],
    extra: &mut Extra,
) {
    let p = &Profile::of(p);
    unsteady(p, m, extra);
    let ([ux, uy, uz], [vx, vy, vz]) = (u, v);
    let outward = -p.radius_offset_m / super::numbers::length(u);
    let change = m.rate * FIRST / m.ramp_s;
    // q = u cosφ + v sinφ, q̇ = ω(−u sinφ + v cosφ), q̈ = α(−u sinφ + v cosφ) − ω²(u cosφ + v sinφ).
    let axis = |row: [[f32; 2]; 3], u: f32, v: f32| {
        let [place, velocity, second] = row;
        let of = |weights: [f32; 2]| [by(weights, [ux, uy]), by(weights, [vx, vy])];
        let ([pu, pv], [du, dv], [su, sv]) = (of(place), of(velocity), of(second));
        let square = m.rate * m.rate;
        Linear {
            a: [outward * u - pu, -m.rate * dv, square * su, -change * sv].map(nm2),
            b: [outward * v - pv, m.rate * du, square * sv, change * su].map(nm2),
        }
    };
    let ([px, py], [dx, dy], [sx, sy]) = (p.position, p.velocity_s, p.acceleration_s2);
    let still = Linear {
        a: [nm2(outward * uz), 0, 0, 0],
        b: [nm2(outward * vz), 0, 0, 0],
    };
    extra.linear = [
        axis([px, dx, sx], ux, vx),
        axis([py, dy, sy], uy, vy),
        still,
    ];
    extra.constant_fine = [px, py].map(|row| fine(-by(row, centre)));
    let (cos, sin) = lead(m);
    extra.ahead =
        [(ux, vx), (uy, vy)].map(|(u, v)| [nm2(v * cos - u * sin), nm2(-u * cos - v * sin)]);
    // u²/2³¹ in nm² times this over 2³² is c·u² in nm.
    const PER_NM: f32 = 4_294_967_296.0 * 1e-9;
    extra.bow = p.bow_per_m.map(|c| single_to_fixed(-c * PER_NM, 31));
    extra.bowed = extra.bow != [0; 2];
    let ([[slow, _], _], [[second, _], _]) = (p.velocity_s, p.acceleration_s2);
    let shares = [
        -slow * m.rate,
        -second * change,
        second * m.rate * m.rate,
        0.5 * outward,
    ];
    let [by_rate, by_change, radial, _] = shares.map(|share| single_to_fixed(share, 33));
    extra.moving = Moving {
        place: [px, py].map(|row| [nm2(-by(row, [ux, uy])), nm2(-by(row, [vx, vy]))]),
        tangential: [by_rate, by_change],
        radial,
        outward: single_to_fixed(outward, 32),
    };
    let opposite = |[[a, b], [c, d]]: [[f32; 2]; 2]| a == -d && b == 0.0 && c == 0.0;
    extra.fits = opposite(p.velocity_s)
        && opposite(p.acceleration_s2)
        && shares.iter().all(|share| share.abs() < 0.24)
        && extra.within_numbers();
}

/// For a line with a span (m), its start seen from the reference point (m); `None`: there is none, and errors of position
/// are left out.
pub(super) fn on_line(
    p: &Whole<f32>,
    m: &Motion,
    span: [f32; 3],
    start: Option<[f32; 2]>,
    extra: &mut Extra,
) {
    let p = &Profile::of(p);
    unsteady(p, m, extra);
    let [sx, sy, _] = span;
    let along = [sx, sy];
    let change = m.rate * FIRST / m.ramp_s;
    let axis = |place: [f32; 2], velocity: [f32; 2], second: [f32; 2]| {
        let a = [
            -by(place, along),
            -m.rate * by(velocity, along),
            0.0,
            -change * by(second, along),
        ];
        Linear {
            a: a.map(nm2),
            b: [0; 4],
        }
    };
    let position = start.map_or([[0.0; 2]; 2], |_| p.position);
    let ([px, py], [dx, dy], [ax, ay]) = (position, p.velocity_s, p.acceleration_s2);
    extra.linear = [axis(px, dx, ax), axis(py, dy, ay), Linear::default()];
    extra.constant_fine = [px, py].map(|row| fine(-by(row, start.unwrap_or_default())));
    extra.ahead = along.map(|span| [nm2(span), 0]);
}

/// The terms that are the same on every curve.
#[inline(never)]
fn unsteady(p: &Profile, m: &Motion, extra: &mut Extra) {
    let ticks = m.take_up_ticks as f32;
    let share = 3.75 / ticks;
    // By the sense of X, then of Y.
    let ([bx, by], [lx, ly]) = (p.backlash_m, p.lateral_m);
    let sides = [[bx, -lx], [ly, by]];
    *extra = Extra::default();
    extra.turning = Turning {
        ticks: m.take_up_ticks,
        dx: single_to_fixed(2.0 / ticks, 31),
        first_x: single_to_fixed(1.0 / ticks - 1.0, 31),
        share_q30: single_to_fixed(share, 30),
        side: sides.map(|axis| axis.map(fine)),
        jump: sides.map(|axis| axis.map(|b| fine(b * share))),
        spike: p.spike.map(|spike| fine(spike.peak_m)),
        fade: p.spike.map(|spike| {
            if spike.peak_m == 0.0 {
                0
            } else {
                single_to_fixed(decay(m.tick_s / spike.decay_s), 32)
            }
        }),
    };
    let cyclic = p.cyclic.iter().filter(|c| c.amplitude_m != 0.0);
    for (built, c) in extra.cyclic.iter_mut().zip(cyclic) {
        *built = periodic(c);
        extra.periodic = extra.periodic.wrapping_add(1);
    }
    extra.sided = sides != [[0.0; 2]; 2] || extra.turning.spike != [0; 2];
}

/// A periodic error. Over a metre of a fine pitch single precision would lose its phase: this divides integers.
fn periodic(c: &CyclicError<f32>) -> Cyclic {
    let axis = |value: i32| if c.slide == 1 { [0, value] } else { [value, 0] };
    // 2³² units a pitch, per nm: Q24, from a pitch in units of 2⁻³⁷ m, which every pitch from 0.1 mm on is a whole number of.
    const UNITS_PER_NM: u64 = ((1u128 << (32 + 37 + 24)) / 1_000_000_000) as u64;
    let pitch = NonZeroU64::new((c.pitch_m * (1u64 << 37) as f32) as u64);
    let per_nm_q24 = pitch.map_or(0, |pitch| UNITS_PER_NM / pitch);
    let whole = per_nm_q24.wrapping_add(1 << 23) >> 24;
    let rest_q24 = per_nm_q24.wrapping_sub(whole << 24) as i32;
    Cyclic {
        amplitude: axis(nm2(-c.amplitude_m)),
        per_nm: axis(whole as i32),
        rest_q32: axis(rest_q24 << 8),
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
    p: &Whole<f32>,
    m: &Motion,
    radius: f32,
    [cx, cy]: [f32; 2],
) -> [f32; 2] {
    let p = &Profile::of(p);
    let row = |matrix: [[f32; 2]; 2]| {
        let [x, y] = matrix.map(|[a, b]| a.abs() + b.abs());
        x.max(y)
    };
    let (rate, ramp) = (m.rate, m.rate / m.ramp_s);
    let (speed, acceleration) = (radius * rate, radius * (rate * rate + FIRST * ramp));
    let jerk = radius * (rate * rate * rate + 3.0 * FIRST * rate * ramp + 10.0 * ramp / m.ramp_s);
    let reach = radius + cx.abs() + cy.abs();
    let outward = p.radius_offset_m.abs();
    let (position, velocity) = (row(p.position), row(p.velocity_s));
    let second = row(p.acceleration_s2);
    let mut offset = outward + position * reach + velocity * speed + second * acceleration;
    let mut slew = outward * rate + position * speed + velocity * acceleration + second * jerk;
    // Smoothstep of degree 5: 15/8 of the mean slope.
    let steep = 1.875 / (m.take_up_ticks as f32 * m.tick_s);
    for play in p.backlash_m.iter().chain(&p.lateral_m) {
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
    for bow in p.bow_per_m {
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
                per_nm: [whole, _],
                rest_q32: [rest, _],
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
