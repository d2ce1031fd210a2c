//! The senses in which X, Y and Z travel, and what hangs on them: play, lateral play and friction pulses.
//!
//! A reversal is seen half a take-up time ahead of the slide. Over the take-up time the offset then moves from one side to
//! the other by the smoothstep of degree 5, S′ = (15/8)·w² with w = 1 − x², added up tick by tick at the middle of each
//! tick; what the sum leaves (2e-4 of the way at 8 ticks, with the fourth power of their number) is set right when no
//! slide turns any more. The friction pulse rises with it and then decays. In a tilted plane two slides may turn at once.
use super::profile_terms::{Extra, Turning};
use core::sync::atomic::{Ordering, compiler_fence};
use giotto_shared::fixed::{mulh, mulh_add};

/// Fraction bits of offsets here, of nm.
pub(crate) const FINE: u32 = 8;
/// Indicators below this, nm, do not turn a side: the slide stands, or stands as good as still.
const DEAD_NM: i32 = 16;
/// Limit of the indicator of a slide that does not move: none is below it.
const STANDS: i32 = i32::MIN;

/// Limit of a slide's indicator with these weights; `sided`: anything depends on senses.
pub(crate) fn limit(weights: [i32; 3], sided: bool) -> i32 {
    let moves = weights.iter().any(|nm| nm.unsigned_abs() > DEAD_NM as u32);
    match (moves, sided) {
        (true, true) => DEAD_NM.wrapping_neg(),
        // It moves, and never comes to be looked at.
        (true, false) => STANDS.wrapping_add(1),
        (false, _) => STANDS,
    }
}

/// Kept from segment to segment: play stays on its side at rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Sides {
    side: [Side; 3],
    /// Offset of X, Y and Z by the sides and by what is constant, in [`FINE`] nm.
    base: [i32; 3],
}

/// What each tick needs comes first, in the order in which it is needed.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
struct Side {
    /// Friction pulse and its change per tick as a share of itself (Q32), in [`FINE`] nm.
    pulse: i32,
    fade: i32,
    /// Ticks of a turn still to come, and one more in which all is set right; 0: none under way.
    left: u32,
    /// 0 while the slide travels forward, −1 backward; in a turn, what it turns to.
    mask: i32,
    /// An indicator below this, turned over by `mask`, is a reversal.
    limit: i32,
    /// Middle of the turn's next tick, Q31.
    x: i32,
    /// What a turn adds per tick to the pulse at w² = 1 (Q31).
    rise: i32,
    /// `left` when a turn begins; 0: nothing hangs on the sense of this slide.
    turn: u32,
    /// Offset of X, Y and Z by this slide alone once it has turned.
    settled: [i32; 3],
    /// The slide has moved: its sense is known.
    known: bool,
}

impl Sides {
    /// Before a segment whose indicators are `ahead` where it begins. A slide that never moved takes the side that
    /// the segment begins with.
    pub(crate) fn begin(&mut self, extra: &Extra, [ax, ay, az]: [i32; 3]) {
        let (t, [x, y, z]) = (&extra.turning, &mut self.side);
        x.begin(t, 0, ax);
        y.begin(t, 1, ay);
        z.begin(t, 2, az);
        self.settle(extra);
        for (side, by) in self.side.iter().zip(&t.side) {
            // Where the last segment ended in a turn, the offset stands between the sides.
            if side.known && side.left != 0 {
                let now = side.sense(t.dx);
                for ((base, by), settled) in self.base.iter_mut().zip(by).zip(side.settled) {
                    *base = mulh_add(base.wrapping_sub(settled), *by, now);
                }
            }
        }
    }

    /// No slide turns any more: what rounding of the turns left is set right.
    #[inline(never)]
    fn settle(&mut self, extra: &Extra) {
        let ([x, y, z], [cx, cy, cz]) = (&self.side, extra.constant_fine);
        let ([xx, xy, xz], [yx, yy, yz]) = (x.settled, y.settled);
        let [zx, zy, zz] = z.settled;
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

    /// One tick later, at these weights of the curve's vectors: adds the offset of X, Y and Z, nm.
    ///
    /// A call of its own: within the tick of an arc there are not registers enough, and what does not fit is
    /// put away and fetched again word by word.
    #[inline(never)]
    pub(crate) fn add(&mut self, extra: &Extra, c: i32, s: i32, wanted: &mut [i32; 3]) {
        let [x, y, z] = &mut self.side;
        let ([ahead_x, ahead_y, ahead_z], t) = (&extra.ahead, &extra.turning);
        let mut ended = x.tick(t, 0, ahead(ahead_x, c, s), &mut self.base);
        compiler_fence(Ordering::AcqRel);
        ended |= y.tick(t, 1, ahead(ahead_y, c, s), &mut self.base);
        compiler_fence(Ordering::AcqRel);
        ended |= z.tick(t, 2, ahead(ahead_z, c, s), &mut self.base);
        compiler_fence(Ordering::AcqRel);
        if ended && (x.left | y.left | z.left) == 0 {
            self.settle(extra);
        }
        let ([x, y, z], [wx, wy, wz]) = (self.standing(), *wanted);
        *wanted = [wx.wrapping_add(x), wy.wrapping_add(y), wz.wrapping_add(z)];
    }
}

impl Side {
    /// Before a segment.
    #[inline(never)]
    fn begin(&mut self, t: &Turning, slide: usize, ahead: i32) {
        let limit = t.limit[slide];
        if !self.known && limit != STANDS {
            (self.known, self.mask) = (true, ahead >> 31);
        }
        (self.limit, self.fade) = (limit, t.fade[slide]);
        // What a pulse of the last segment left goes with the next turn.
        self.turn = if self.pulse == 0 {
            t.ticks[slide]
        } else {
            t.take_up
        };
        let sense = if self.known { sense(self.mask) } else { 0 };
        let [x, y, z] = t.side[slide];
        self.settled = [mulh(x, sense), mulh(y, sense), mulh(z, sense)];
    }

    /// One tick; whether it was the last of a turn.
    #[inline(always)]
    fn tick(&mut self, t: &Turning, slide: usize, ahead: i32, base: &mut [i32; 3]) -> bool {
        self.pulse = mulh_add(self.pulse, self.pulse, self.fade);
        if self.left != 0 {
            return self.turn(&t.jump[slide], t.dx, base);
        }
        if (ahead ^ self.mask) < self.limit {
            self.reverse(t.spike[slide], t);
        }
        false
    }

    /// Begins a turn.
    #[inline(never)]
    fn reverse(&mut self, spike: i32, t: &Turning) {
        self.mask = !self.mask;
        // The slide lags behind its new sense: the correction goes ahead with it. What is left of the last pulse goes.
        let height = spike ^ self.mask;
        self.rise = mulh(height.wrapping_sub(self.pulse), t.share_q30).wrapping_mul(4);
        let [sx, sy, sz] = self.settled;
        self.settled = [sx.wrapping_neg(), sy.wrapping_neg(), sz.wrapping_neg()];
        (self.left, self.x) = (self.turn, t.first_x);
    }

    /// One tick of a turn; whether it was the last, which only sets right.
    #[inline(always)]
    fn turn(&mut self, jump: &[i32; 3], dx: i32, base: &mut [i32; 3]) -> bool {
        self.left = self.left.wrapping_sub(1);
        if self.left == 0 {
            return true;
        }
        let x = self.x;
        self.x = x.wrapping_add(dx);
        let w = mulh(x, x).wrapping_mul(2) ^ i32::MAX;
        let w2_q31 = mulh(w, w).wrapping_mul(2);
        self.pulse = mulh_add(self.pulse, self.rise, w2_q31);
        let toward_q31 = w2_q31 ^ self.mask;
        // Put away before the rest is begun: all at once does not fit into the registers.
        compiler_fence(Ordering::AcqRel);
        let ([bx, by, bz], [jx, jy, jz]) = (*base, *jump);
        *base = [
            mulh_add(bx, jx, toward_q31),
            mulh_add(by, jy, toward_q31),
            mulh_add(bz, jz, toward_q31),
        ];
        false
    }

    /// Sense now, Q31.
    fn sense(&self, dx: i32) -> i32 {
        if self.left <= 1 {
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

/// Indicator of the sense of a slide at these weights of the curve's vectors.
#[inline(always)]
pub(crate) fn ahead([by_cos, by_sin, always]: &[i32; 3], c: i32, s: i32) -> i32 {
    mulh_add(mulh_add(*always, *by_cos, c), *by_sin, s)
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
                    left: 2,
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
