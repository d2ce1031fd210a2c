//! Angles as integers: a turn is 2³² (or 2⁶⁴), so that a phase wraps by itself and never drifts.
use crate::fixed::{mulh, mulh_add, to_fixed};
use core::f64::consts::{FRAC_PI_4, PI};

/// Radians per unit of a 32-bit phase.
pub const RAD_PER_UNIT: f64 = 2.0 * PI / 4_294_967_296.0;

/// Largest error of [`sincos`] over all 2³² phases, of full scale 1.
pub const SINCOS_ERROR: f64 = 4.0e-9;

/// Polynomials of degree 3 in z = t², t the phase within an octant pair scaled to ±1:
/// sin(πt/4) = t·Σ SIN z^k, 1 − cos(πt/4) = z·Σ COS z^k.
const SIN: [f64; 4] = economise(series(FRAC_PI_4, 1));
const COS: [f64; 4] = economise(series(FRAC_PI_4 * FRAC_PI_4 / 2.0, 2));

/// Coefficients of [`sincos_with`]. The tick keeps a copy in its own state: one multiple load brings them all,
/// where immediate operands would cost two instructions each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SinCos {
    sin: [i32; 4],
    cos: [i32; 4],
}

impl SinCos {
    /// Each step of Horner's scheme with [`mulh_add`] halves the scale (z is Q31), so each coefficient has one bit
    /// more than the one before it. All are positive because the argument of the scheme is −z.
    pub const NEW: Self = Self {
        sin: [to_fixed(SIN[0], 31), to_fixed(-SIN[1], 32), to_fixed(SIN[2], 33), to_fixed(-SIN[3], 34)],
        cos: [to_fixed(COS[0], 32), to_fixed(-COS[1], 33), to_fixed(COS[2], 34), to_fixed(-COS[3], 35)],
    };
}

/// (cos, sin) of a phase (2³² a turn) in Q31; +1 is 2³¹ − 1. Error at most [`SINCOS_ERROR`] (test over all phases).
#[inline]
pub fn sincos(phase: u32) -> (i32, i32) {
    sincos_with(&SinCos::NEW, phase)
}

/// [`sincos`] with the coefficients in memory.
#[inline(always)]
pub fn sincos_with(k: &SinCos, phase: u32) -> (i32, i32) {
    // The rest from the nearest multiple of a quarter turn, ±1/8 turn, as Q31.
    let t = (phase << 2) as i32;
    // −t² in Q31: unlike +1, −1 is a number there.
    let z = mulh(t, t).wrapping_mul(-2);
    let ([s0, s1, s2, s3], [c0, c1, c2, c3]) = (k.sin, k.cos);
    let sin_over_t = mulh_add(s0, mulh_add(s1, mulh_add(s2, s3, z), z), z);
    let sin = mulh(t, sin_over_t).wrapping_mul(2);
    let versine = mulh_add(c0, mulh_add(c1, mulh_add(c2, c3, z), z), z);
    let cos = mulh_add(i32::MAX, versine, z);
    // A quarter turn swaps the two and flips a sign.
    let quarters = phase.wrapping_add(1 << 29);
    let (c, s) = if quarters & (1 << 30) == 0 { (cos, sin) } else { (sin, cos) };
    let flip_s = (quarters as i32) >> 31;
    let flip_c = (quarters.wrapping_add(1 << 30) as i32) >> 31;
    ((c ^ flip_c).wrapping_sub(flip_c), (s ^ flip_s).wrapping_sub(flip_s))
}

/// Number of Taylor terms before economisation.
const TERMS: usize = 9;

/// Taylor series first·(1 − x²/(n+1)(n+2) + …) of sine (`n` = 1) or versine (`n` = 2) in z, with x = π/4·t.
const fn series(first: f64, n: usize) -> [f64; TERMS] {
    let mut a = [0.0; TERMS];
    a[0] = first;
    let mut k = 1;
    while k < TERMS {
        let m = (n + 2 * k) as f64;
        a[k] = -a[k - 1] * FRAC_PI_4 * FRAC_PI_4 / (m * (m - 1.0));
        k += 1;
    }
    a
}

/// Lowers the degree to 3 by subtracting multiples of shifted Chebyshev polynomials T*ₙ(z), z in 0…1: near-minimax.
const fn economise(mut a: [f64; TERMS]) -> [f64; 4] {
    let mut degree = TERMS - 1;
    while degree > 3 {
        let t = chebyshev(degree);
        let share = a[degree] / t[degree];
        let mut k = 0;
        while k <= degree {
            a[k] -= share * t[k];
            k += 1;
        }
        degree -= 1;
    }
    [a[0], a[1], a[2], a[3]]
}

/// Coefficients of T*ₙ(z) = Tₙ(2z − 1).
const fn chebyshev(n: usize) -> [f64; TERMS] {
    let mut before = [0.0; TERMS];
    let mut now = [0.0; TERMS];
    before[0] = 1.0;
    now[0] = -1.0;
    now[1] = 2.0;
    let mut k = 1;
    while k < n {
        let mut next = [0.0; TERMS];
        let mut i = 0;
        while i < TERMS {
            next[i] = -2.0 * now[i] - before[i] + if i > 0 { 4.0 * now[i - 1] } else { 0.0 };
            i += 1;
        }
        before = now;
        now = next;
        k += 1;
    }
    now
}

/// Phase nearest to an angle in radians.
pub fn phase_from_rad(angle_rad: f64) -> u32 {
    let turns = angle_rad / (2.0 * PI);
    let fraction = turns - libm::floor(turns);
    (fraction * 4_294_967_296.0 + 0.5) as u64 as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error_at(phase: u32) -> f64 {
        let (c, s) = sincos(phase);
        let angle = f64::from(phase) * RAD_PER_UNIT;
        let full = 2_147_483_648.0;
        (f64::from(c) / full - libm::cos(angle)).abs().max((f64::from(s) / full - libm::sin(angle)).abs())
    }

    /// 2²⁴ phases, one in each stratum, its place in the stratum stirred so that all low bits are met.
    #[test]
    fn sincos_error_on_a_stratified_sweep() {
        let worst = (0..1u32 << 20)
            .map(|i| (i << 12) | (i.wrapping_mul(2_654_435_769) >> 20))
            .chain(
                (0..32u32).flat_map(|k| (0..64u32).map(move |j| (k << 27).wrapping_add(j).wrapping_sub(32))),
            )
            .map(error_at)
            .fold(0.0, f64::max);
        std::println!("largest sincos error {worst:.3e}");
        assert!(worst <= SINCOS_ERROR, "{worst:e}");
    }

    /// All 2³² phases: `cargo test --release -p giotto-shared -- --ignored sincos_error_over_all`.
    #[test]
    #[ignore = "exhaustive: minutes"]
    fn sincos_error_over_all_phases() {
        let worst = (0..=u32::MAX).map(error_at).fold(0.0, f64::max);
        std::println!("largest sincos error {worst:.3e}");
        assert!(worst <= SINCOS_ERROR, "{worst:e}");
    }

    #[test]
    fn phase_of_known_angles() {
        assert_eq!(phase_from_rad(0.0), 0);
        assert_eq!(phase_from_rad(PI / 2.0), 1 << 30);
        assert_eq!(phase_from_rad(-PI / 2.0), 3 << 30);
        assert_eq!(phase_from_rad(5.0 * PI), 1 << 31);
        assert_eq!(phase_from_rad(-1e-18), 0);
    }
}
