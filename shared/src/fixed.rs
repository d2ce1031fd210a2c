//! Fixed-point arithmetic of the tick: high halves of 32 × 32 → 64 products.
//!
//! On a Cortex-M4 each of these is one instruction (SMMUL, SMMLA, SMMLS). `Qn` in a comment means an integer
//! that stands for itself divided by 2ⁿ; a product of `Qa` and `Qb` is `Q(a + b − 32)`.

/// ⌊a·b / 2³²⌋.
#[inline(always)]
pub const fn mulh(a: i32, b: i32) -> i32 {
    ((a as i64 * b as i64) >> 32) as i32
}

/// acc + ⌊a·b / 2³²⌋.
#[inline(always)]
pub const fn mulh_add(acc: i32, a: i32, b: i32) -> i32 {
    acc.wrapping_add(mulh(a, b))
}

/// ⌊(2³²·acc − a·b) / 2³²⌋.
#[inline(always)]
pub const fn mulh_sub(acc: i32, a: i32, b: i32) -> i32 {
    ((((acc as i64) << 32).wrapping_sub(a as i64 * b as i64)) >> 32) as i32
}

/// Rounds a real number of magnitude below 2^(31 − bits) to `Q(bits)`; saturates beyond, 0 for NaN.
pub const fn to_fixed(value: f64, bits: u32) -> i32 {
    let scaled = value * (1u64 << bits) as f64;
    // `as` saturates and maps NaN to 0: no value can escape the range.
    (if scaled < 0.0 {
        scaled - 0.5
    } else {
        scaled + 0.5
    }) as i32
}

/// [`to_fixed`] from single precision, as exact as 24 bits are. For planning, which has time for a call: sixty places of it
/// inlined took 1 KB of an image.
#[inline(never)]
pub const fn single_to_fixed(value: f32, bits: u32) -> i32 {
    let scaled = value * (1u64 << bits) as f32;
    (if scaled < 0.0 {
        scaled - 0.5
    } else {
        scaled + 0.5
    }) as i32
}

/// `value`·`scale` to the nearest whole number, halves within 1/256 of one to either side; saturates beyond ±2⁵⁵, 0 for
/// NaN. One product in double precision, where a core without it would call half a dozen routines to round.
#[inline(never)]
pub const fn rounded(value: f64, scale: f64) -> i64 {
    ((value * (scale * 256.0)) as i64).saturating_add(128) >> 8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounded_is_the_nearest_whole_number() {
        for i in -100_000..100_000i32 {
            let value = f64::from(i) * 0.017;
            let nearest = rounded(value, 1.0) as f64;
            assert!(
                (nearest - value).abs() <= 0.5 + 1.0 / 256.0,
                "{value}: {nearest}"
            );
            assert_eq!(rounded(f64::from(i), 1e9), i64::from(i) * 1_000_000_000);
        }
        assert_eq!(rounded(f64::NAN, 1.0), 0);
        assert!(
            rounded(f64::INFINITY, 1.0) > 1 << 54 && rounded(f64::NEG_INFINITY, 1.0) < -(1 << 54)
        );
    }

    #[test]
    fn single_precision_saturates_and_rounds_as_double_does() {
        for value in [
            0.0f32,
            0.3,
            -0.3,
            1.5e-4,
            -0.25,
            3.0,
            -3.0,
            f32::NAN,
            f32::INFINITY,
        ] {
            assert_eq!(
                single_to_fixed(value, 8),
                to_fixed(f64::from(value), 8),
                "{value}"
            );
        }
    }
}
