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
    (if scaled < 0.0 { scaled - 0.5 } else { scaled + 0.5 }) as i32
}
