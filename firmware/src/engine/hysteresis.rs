//! The senses in which X, Y and Z travel, and what hangs on them: play, lateral play and friction pulses.
//!
//! A reversal is seen half a take-up time ahead of the slide. Over the take-up time the offset then moves from one side to
//! the other by the smoothstep of degree 5, S′ = (15/8)·w² with w = 1 − x², added up tick by tick at the middle of each
//! tick; what the sum leaves (2e-4 of the way at 8 ticks, with the fourth power of their number) is set right when no
//! slide turns any more. The friction pulse rises with it and then decays. In a tilted plane two slides may turn at once.
use super::profile_terms::Extra;
use giotto_shared::fixed::{mulh, mulh_add};

/// Fraction bits of offsets here, of nm.
pub(crate) const FINE: u32 = 8;
/// Indicators below this, nm, do not turn a side: the slide stands, or stands as good as still.
const DEAD_NM: i32 = 16;

/// Kept from segment to segment: play stays on its side at rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Sides {
    side: [Side; 3],
    /// Offset of X, Y and Z by the sides and by what is constant, in [`FINE`] nm.
    base: [i32; 3],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
struct Side {
    /// 0 while the slide travels forward, −1 backward; in a turn, what it turns to.
    mask: i32,
    /// An indicator below this, turned over by `mask`, is a reversal.
    limit: i32,
    /// Friction pulse and its change per tick as a share of itself (Q32), in [`FINE`] nm.
    pulse: i32,
    fade: i32,
    /// Ticks of a turn still to come; 0: none under way.
    left: u32,
    /// Middle of the turn's next tick, Q31.
    x: i32,
    /// What a turn adds per tick to the pulse, and to the offset of X, Y and Z, at w² = 1 (Q31).
    rise: i32,
    jump: [i32; 3],
    /// Offset of X, Y and Z by this slide alone once it has turned.
    settled: [i32; 3],
    /// The slide has moved: its sense is known.
    known: bool,
}

impl Sides {
    /// Before a segment whose indicators are `ahead` where it begins. A slide that never moved takes the side that
    /// the segment begins with.
    pub(crate) fn begin(&mut self, extra: &Extra, ahead: [i32; 3]) {
        let t = &extra.turning;
        let by_slide = ahead.into_iter().zip(extra.ahead).zip(t.fade);
        let by_slide = by_slide.zip(t.jump.into_iter().zip(t.side));
        for (side, (((ahead, weights), fade), (jump, by))) in self.side.iter_mut().zip(by_slide) {
            let moves = weights.iter().any(|nm| nm.unsigned_abs() > DEAD_NM as u32);
            if !side.known && moves {
                (side.known, side.mask) = (true, if ahead >= 0 { 0 } else { -1 });
            }
            side.limit = if extra.sided && moves {
                DEAD_NM.wrapping_neg()
            } else {
                i32::MIN
            };
            side.fade = fade;
            side.jump = jump.map(|jump| jump ^ side.mask);
            let sense = if side.known { sense(side.mask) } else { 0 };
            side.settled = by.map(|by| mulh(by, sense));
        }
        self.settle(extra);
        for (side, by) in self.side.iter().zip(t.side) {
            // Where the last segment ended in a turn, the offset stands between the sides.
            if side.known && side.left != 0 {
                let now = side.sense(t.dx);
                for ((base, by), settled) in self.base.iter_mut().zip(by).zip(side.settled) {
                    *base = mulh_add(base.wrapping_sub(settled), by, now);
                }
            }
        }
    }

    /// No slide turns any more: what rounding of the turns left is set right.
    #[inline(always)]
    fn settle(&mut self, extra: &Extra) {
        let [x, y, z] = &self.side;
        let ([cx, cy, cz], [xx, xy, xz]) = (extra.constant_fine, x.settled);
        let ([yx, yy, yz], [zx, zy, zz]) = (y.settled, z.settled);
        self.base = [
            cx.wrapping_add(xx).wrapping_add(yx).wrapping_add(zx),
            cy.wrapping_add(xy).wrapping_add(yy).wrapping_add(zy),
            cz.wrapping_add(xz).wrapping_add(yz).wrapping_add(zz),
        ];
    }

    /// Offset of X, Y and Z as it stands, nm.
    pub(crate) fn standing(&self) -> [i32; 3] {
        let ([x, y, z], [bx, by, bz]) = (&self.side, self.base);
        [
            bx.wrapping_add(x.pulse) >> FINE,
            by.wrapping_add(y.pulse) >> FINE,
            bz.wrapping_add(z.pulse) >> FINE,
        ]
    }

    /// Offset of X, Y and Z, nm, one tick later, at these weights of the curve's vectors.
    #[inline(always)]
    pub(crate) fn tick(&mut self, extra: &Extra, c: i32, s: i32) -> [i32; 3] {
        let [ahead_x, ahead_y, ahead_z] = extra.ahead_at(c, s);
        let [x, y, z] = &mut self.side;
        let mut ended = x.tick(extra, 0, ahead_x, &mut self.base);
        ended |= y.tick(extra, 1, ahead_y, &mut self.base);
        ended |= z.tick(extra, 2, ahead_z, &mut self.base);
        if ended && (x.left | y.left | z.left) == 0 {
            self.settle(extra);
        }
        self.standing()
    }
}

impl Side {
    /// One tick; whether it was the last of a turn.
    #[inline(always)]
    fn tick(&mut self, extra: &Extra, slide: usize, ahead: i32, base: &mut [i32; 3]) -> bool {
        self.pulse = mulh_add(self.pulse, self.pulse, self.fade);
        if self.left != 0 {
            return self.turn(base, extra.turning.dx);
        }
        if (ahead ^ self.mask) < self.limit {
            self.reverse(extra, slide);
        }
        false
    }

    /// Begins a turn.
    #[inline(always)]
    fn reverse(&mut self, extra: &Extra, slide: usize) {
        let t = &extra.turning;
        self.mask = !self.mask;
        // The slide lags behind its new sense: the correction goes ahead with it. What is left of the last pulse goes.
        let height = t.spike[slide] ^ self.mask;
        self.rise = mulh(height.wrapping_sub(self.pulse), t.share_q30).wrapping_mul(4);
        let [jx, jy, jz] = t.jump[slide];
        self.jump = [jx ^ self.mask, jy ^ self.mask, jz ^ self.mask];
        let [sx, sy, sz] = self.settled;
        self.settled = [sx.wrapping_neg(), sy.wrapping_neg(), sz.wrapping_neg()];
        (self.left, self.x) = (t.ticks, t.first_x);
    }

    /// One tick of a turn; whether it was the last.
    #[inline(always)]
    fn turn(&mut self, base: &mut [i32; 3], dx: i32) -> bool {
        let x = self.x;
        self.x = x.wrapping_add(dx);
        let w = mulh(x, x).wrapping_mul(2) ^ i32::MAX;
        let w2_q31 = mulh(w, w).wrapping_mul(2);
        let ([bx, by, bz], [jx, jy, jz]) = (*base, self.jump);
        *base = [
            mulh_add(bx, jx, w2_q31),
            mulh_add(by, jy, w2_q31),
            mulh_add(bz, jz, w2_q31),
        ];
        self.pulse = mulh_add(self.pulse, self.rise, w2_q31);
        self.left = self.left.wrapping_sub(1);
        self.left == 0
    }

    /// Sense now, Q31.
    fn sense(&self, dx: i32) -> i32 {
        if self.left == 0 {
            return sense(self.mask);
        }
        // 2S − 1 = (15/8)(x − 2x³/3 + x⁵/5) where the last tick ended.
        let x = self.x.wrapping_sub(dx >> 1);
        let x2 = mulh(x, x).wrapping_mul(2);
        let slope = 1_006_632_960i32
            .wrapping_sub(mulh(x2, 1_342_177_280))
            .wrapping_add(mulh(mulh(x2, x2).wrapping_mul(2), 402_653_184));
        let share = mulh(x, slope)
            .clamp(-(1 << 28), (1 << 28) - 1)
            .wrapping_mul(8);
        share ^ self.mask
    }
}

/// Q31.
const fn sense(mask: i32) -> i32 {
    i32::MAX ^ mask
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_under_way_is_the_smoothstep() {
        let dx = 1 << 20;
        for i in -2047..2047 {
            for mask in [0, -1] {
                let at = f64::from(i) / 2048.0;
                let x = (at * 2_147_483_648.0) as i32;
                let side = Side {
                    left: 1,
                    x: x + (dx >> 1),
                    mask,
                    ..Side::default()
                };
                let way = 1.875 * (at - 2.0 / 3.0 * at.powi(3) + at.powi(5) / 5.0);
                let expected = if mask == 0 { way } else { -way };
                let got = f64::from(side.sense(dx)) / 2_147_483_648.0;
                assert!((got - expected).abs() < 2e-8, "{at}: {got} {expected}");
            }
        }
    }
}
