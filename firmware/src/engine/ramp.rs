//! The degree-9 feed ramp in fixed point, one evaluation a tick.
//!
//! With x = 2u − 1 and w = 1 − x² (so q = w/4, r = −x) the smoothstep and its derivatives are
//! S = ½ + ½x·(1 + w/2 + 3w²/8 + 5w³/16 + 35w⁴/128), S′ = (315/128) w⁴, S″ = −(315/8) x w³,
//! S‴ = (945/2) w² (1 − 7w/6). Falling ramps are rising ones run backwards: S and S″ keep their sign, S′ and S‴
//! change it.
use giotto_shared::fixed::{mulh, mulh_add, to_fixed};

/// S′ = `FIRST`·w⁴. This and the next two are exact in single precision.
pub(crate) const FIRST: f32 = 315.0 / 128.0;
/// S″ = −`SECOND`·x·w³.
pub(crate) const SECOND: f32 = 315.0 / 8.0;
/// S‴ = `THIRD`·w²(1 − 7w/6).
pub(crate) const THIRD: f32 = 945.0 / 2.0;

/// Coefficients of (S − ½)/x: 1/2 (Q30), w² 3/16 (Q31), w³ 5/32 (Q32), w⁴ 35/256 (Q31). The tick keeps a copy in its own
/// state: one multiple load brings them all, where immediate operands would cost two instructions each. The half is
/// less by what rounding adds: at its very ends S must neither be negative nor pass 1 (test).
pub(crate) const POLYNOMIAL: [i32; 4] = [
    (1 << 29) - 2,
    to_fixed(3.0 / 16.0, 31),
    to_fixed(5.0 / 32.0, 32),
    to_fixed(35.0 / 256.0, 31),
];

/// The ramp at one tick. S‴ is `THIRD`·(w² − 7w³/6).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Shapes {
    /// S, Q31, never negative. Error 8e-9.
    pub(crate) s_q31: i32,
    /// w², Q31.
    pub(crate) w2_q31: i32,
    /// w³, Q30.
    pub(crate) w3_q30: i32,
    /// w⁴, Q31.
    pub(crate) w4_q31: i32,
    /// x·w³, Q29.
    pub(crate) xw3_q29: i32,
}

/// Evaluates the ramp at x = 2u − 1, Q31.
#[inline(always)]
pub(crate) fn shapes(p: &[i32; 4], x: i32) -> Shapes {
    // 1 − x² in Q31; at x = −1 it comes out as −2⁻³¹, which is as good as 0.
    let w = mulh(x, x).wrapping_mul(2) ^ i32::MAX;
    let w2_q31 = mulh(w, w).wrapping_mul(2);
    let w3_q30 = mulh(w2_q31, w);
    let w4_q31 = mulh(w2_q31, w2_q31).wrapping_mul(2);
    let [p0, p2, p3, p4] = *p;
    let straight = p0.wrapping_add(w >> 3);
    let slope_q30 = mulh_add(
        mulh_add(mulh_add(straight, p2, w2_q31), p3, w3_q30),
        p4,
        w4_q31,
    );
    // ±½ in Q29.
    let half = mulh(x, slope_q30);
    Shapes {
        s_q31: half.wrapping_mul(4).wrapping_add(1 << 30),
        w2_q31,
        w3_q30,
        w4_q31,
        xw3_q29: mulh(x, w3_q30),
    }
}

/// Where a ramp stands: u as Q64, that is x as Q63 with its upper bit turned. It overflows in the very tick in which
/// the ramp ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Clock {
    u: u64,
    du: u64,
}

impl Clock {
    /// At the start of a rising ramp.
    pub(crate) const fn rising(step: u64) -> Self {
        Self { u: 0, du: step }
    }

    /// At the start of a falling ramp.
    pub(crate) const fn falling(step: u64) -> Self {
        Self {
            u: u64::MAX,
            du: step,
        }
    }

    /// Whether it is on its way: made for a ramp, and neither at its very start nor over.
    pub(crate) const fn begun(self) -> bool {
        self.u != 0 && self.u != u64::MAX
    }

    /// Whether it goes on.
    pub(crate) const fn runs(self) -> bool {
        self.du != 0
    }

    /// What x changes by in a tick, Q31.
    pub(crate) const fn pace(self) -> i32 {
        (self.du >> 32) as i32
    }

    /// x now, Q31.
    pub(crate) const fn here(self) -> i32 {
        ((self.u >> 32) as u32 ^ (1 << 31)) as i32
    }

    /// x after one more tick of a rising ramp, Q31, and whether that is its end.
    #[inline(always)]
    pub(crate) fn rise(&mut self) -> (i32, bool) {
        let (u, end) = self.u.overflowing_add(self.du);
        self.u = u;
        (self.here(), end)
    }

    /// x after one more tick of a falling ramp, Q31, and whether that is its end.
    #[inline(always)]
    pub(crate) fn fall(&mut self) -> (i32, bool) {
        let (u, end) = self.u.overflowing_sub(self.du);
        self.u = u;
        (self.here(), end)
    }
}

/// Q64 step of u per tick for a ramp of so many ticks (at least 3): 2⁶⁴/ticks, rounded up.
pub(crate) const fn clock_step(ticks: u32) -> u64 {
    let ticks = if ticks < 3 { 3 } else { ticks };
    u64::MAX / ticks as u64 + 1
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use giotto_shared::path::smoothstep;

    #[test]
    fn fixed_point_shapes_are_the_smoothstep() {
        let mut worst = [0.0f64; 4];
        for i in 0..1_000_003i64 {
            let x = ((i * 4295) + i64::from(i32::MIN)).min(i64::from(i32::MAX)) as i32;
            let f = shapes(&POLYNOMIAL, x);
            let s = smoothstep((f64::from(x) / 2f64.powi(31) + 1.0) / 2.0);
            let got = [
                f64::from(f.s_q31) / 2f64.powi(31),
                f64::from(f.w4_q31) / 2f64.powi(31) * f64::from(FIRST),
                -f64::from(f.xw3_q29) / 2f64.powi(29) * f64::from(SECOND),
                (f64::from(f.w2_q31) / 2f64.powi(31)
                    - 7.0 / 6.0 * f64::from(f.w3_q30) / 2f64.powi(30))
                    * f64::from(THIRD),
            ];
            for (w, (g, e)) in worst
                .iter_mut()
                .zip(got.iter().zip([s.value, s.first, s.second, s.third]))
            {
                *w = w.max((g - e).abs());
            }
        }
        std::println!("errors of S, S', S'', S''': {worst:?}");
        assert!(
            worst[0] < 8e-9 && worst[1] < 3e-8 && worst[2] < 6e-7 && worst[3] < 4e-6,
            "{worst:?}"
        );
    }

    #[test]
    fn shares_stay_between_none_and_all() {
        // S is flat within 2⁻¹² of its ends: there rounding alone decides.
        for i in 0..1i64 << 20 {
            for x in [i64::from(i32::MIN) + i, i64::from(i32::MAX) - i] {
                assert!(shapes(&POLYNOMIAL, x as i32).s_q31 >= 0, "{x}");
            }
        }
    }

    #[test]
    fn a_ramp_ends_in_its_last_tick() {
        for ticks in [3, 4, 5, 32, 33, 1000, 4096, 65_535, 1_000_003] {
            let step = clock_step(ticks);
            let (mut up, mut down) = (Clock::rising(step), Clock::falling(step));
            for n in 1..=ticks {
                assert_eq!(
                    (up.rise().1, down.fall().1),
                    (n == ticks, n == ticks),
                    "tick {n} of {ticks}"
                );
            }
        }
    }
}
