//! Angles as integers: a turn is 2³² (or 2⁶⁴), so that a phase wraps by itself and never drifts.
use crate::fixed::{mulh, mulh_add, mulh_sub, rounded, to_fixed};
use core::f64::consts::{PI, TAU};

/// Radians per unit of a 32-bit phase.
pub const RAD_PER_UNIT: f64 = 2.0 * PI / 4_294_967_296.0;

/// Largest error of [`sincos`] over all 2³² phases, of full scale 1.
pub const SINCOS_ERROR: f64 = 2.3e-9;

/// Bits of the phase that choose a place of the table.
const BITS: u32 = 8;
/// (cos, sin) in Q31 at the places, 2⁸ a turn.
static PLACES: [[i32; 2]; 1 << BITS] = places();
/// Half the distance between places, rad.
const HALF_STEP_RAD: f64 = PI / (1u32 << BITS) as f64;
/// The rest of a phase, as Q31, times this is an angle δ in Q36.
const REST: i32 = to_fixed(HALF_STEP_RAD, 37);
/// The rest of a phase, as Q31, times this is −δ/2 in Q28.
const MINUS_HALF_REST: i32 = to_fixed(-HALF_STEP_RAD / 2.0, 29);
const THIRD: i32 = to_fixed(1.0 / 3.0, 32);

/// (cos, sin) of a phase (2³² a turn) in Q31; +1 is 2³¹ − 1. Error at most [`SINCOS_ERROR`] (test over all phases).
///
/// The nearest of 256 places, turned by the rest δ (at most π/256) with sin δ = δ − δ³/6 and 1 − cos δ = δ²/2: 20
/// instructions on a Cortex-M4 for 2 KiB of table; polynomials over an eighth of a turn took 29 and erred by 3.7e-9.
#[inline(always)]
pub fn sincos(phase: u32) -> (i32, i32) {
    sincos_with(SINCOS, phase)
}

/// Constants of [`sincos_with`].
pub const SINCOS: [i32; 2] = [REST, MINUS_HALF_REST];

/// [`sincos`] with [`SINCOS`] from memory: one load brings both, where immediate operands cost four instructions.
#[inline(always)]
pub fn sincos_with([by_rest, by_half]: [i32; 2], phase: u32) -> (i32, i32) {
    let nearest = phase.wrapping_add(1 << (31 - BITS)) >> (32 - BITS);
    let [c, s] = PLACES[nearest as usize];
    let rest = (phase << BITS) as i32;
    let sine = mulh(rest, by_rest);
    // −δ²/2 in Q32, as a product of two numbers: of a square the compiler would know the sign, take it for unsigned
    // and multiply in three instructions instead of one.
    let cosine_less_1 = mulh(sine, mulh(rest, by_half));
    let sine_q32 = mulh_add(sine, sine, mulh(cosine_less_1, THIRD)) >> 4;
    let cos = mulh_sub(mulh_add(c, c, cosine_less_1), s, sine_q32);
    let sin = mulh_add(mulh_add(s, s, cosine_less_1), c, sine_q32);
    (cos, sin)
}

const fn places() -> [[i32; 2]; 1 << BITS] {
    let mut places = [[0; 2]; 1 << BITS];
    let mut k = 0;
    while k < places.len() {
        let angle = TAU * k as f64 / places.len() as f64 - PI;
        // cos and sin of an angle less half a turn are those of the angle with their signs changed.
        places[k] = [
            to_fixed(-series(angle, 1.0, 0), 31),
            to_fixed(-series(angle, angle, 1), 31),
        ];
        k += 1;
    }
    places
}

/// Taylor series of cosine (`n` = 0) or sine (`n` = 1), |x| ≤ π, to 1e-14.
const fn series(x: f64, first: f64, n: usize) -> f64 {
    let (mut term, mut sum) = (first, first);
    let mut k = n + 2;
    while k < 40 {
        term *= -x * x / ((k - 1) * k) as f64;
        sum += term;
        k += 2;
    }
    sum
}

/// Phase nearest to an angle in radians, of size below 5e7.
///
/// ```
/// use giotto_shared::angle::{phase_from_rad, sincos, SINCOS_ERROR};
///
/// let (cos, sin) = sincos(phase_from_rad(1.0));
/// let q31 = f64::from(i32::MAX);
/// assert!((f64::from(cos) / q31 - 1f64.cos()).abs() < SINCOS_ERROR);
/// assert!((f64::from(sin) / q31 - 1f64.sin()).abs() < SINCOS_ERROR);
/// ```
pub fn phase_from_rad(angle_rad: f64) -> u32 {
    // Whole turns fall out of the 32 bits.
    rounded(angle_rad, 1.0 / RAD_PER_UNIT) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error_at(phase: u32) -> f64 {
        let (c, s) = sincos(phase);
        let angle = f64::from(phase) * RAD_PER_UNIT;
        let full = 2_147_483_648.0;
        (f64::from(c) / full - libm::cos(angle))
            .abs()
            .max((f64::from(s) / full - libm::sin(angle)).abs())
    }

    /// 2²⁴ phases, one in each stratum, its place in the stratum stirred so that all low bits are met.
    #[test]
    fn sincos_error_on_a_stratified_sweep() {
        let worst =
            (0..1u32 << 20)
                .map(|i| (i << 12) | (i.wrapping_mul(2_654_435_769) >> 20))
                .chain((0..32u32).flat_map(|k| {
                    (0..64u32).map(move |j| (k << 27).wrapping_add(j).wrapping_sub(32))
                }))
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
