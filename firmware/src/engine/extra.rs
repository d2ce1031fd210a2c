//! Profile terms in fixed point: what a zone with profile terms adds to the tick.
use core::sync::atomic::{Ordering, compiler_fence};
use giotto_shared::angle::sincos_with;
use giotto_shared::fixed::{mulh, mulh_add};

/// One coordinate's linear terms, nm·2. On an arc the weights of cosφ and sinφ, each
/// `[0] + W·[1] + W²·[2] + w⁴·[3]`; on a line `share·a[0] + W·a[1] + w⁴·a[3]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Linear {
    pub(crate) a: [i32; 4],
    pub(crate) b: [i32; 4],
}

/// The linear terms of an arc for the fast tick, in the form they have: a matrix at the place; opposite in X and Y what
/// goes with velocity and acceleration; outward a constant. Shares of the radius; `W` is that of the constant rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Moving {
    /// X and Y: weights of cosφ and sinφ, nm·2.
    pub(crate) place: [[i32; 2]; 2],
    /// Along the tangent by W and by w⁴, along the radius by W²: Q33.
    pub(crate) tangential: [i32; 2],
    pub(crate) radial: i32,
    /// Q32.
    pub(crate) outward: i32,
}

/// One periodic error: amplitude·sin(phase + per_nm·position), each a vector of X and Y with one entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Cyclic {
    /// nm·2.
    pub(crate) amplitude: [i32; 2],
    /// Units of 2⁻³² turn per nm: nearest whole number, and the rest (Q32).
    pub(crate) per_nm: [i32; 2],
    pub(crate) rest_q32: [i32; 2],
    pub(crate) phase: u32,
}

/// What the sides of X and Y are made of. Offsets in [`FINE`] nm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Turning {
    /// Ticks of a take-up, at least 3, and their distance in x (Q31).
    pub(crate) ticks: u32,
    pub(crate) dx: i32,
    /// Middle of the first tick, Q31.
    pub(crate) first_x: i32,
    /// 3.75/ticks: twice what S gains in a tick at w² = 1.
    pub(crate) share_q30: i32,
    /// By axis: offset of X and Y when it travels forward, doubled, and 2·(gain of S per tick at w² = 1) of its change
    /// from side to side.
    pub(crate) side: [[i32; 2]; 2],
    pub(crate) jump: [[i32; 2]; 2],
    /// By axis: height of the friction pulse, and its change per tick (a share, Q32).
    pub(crate) spike: [i32; 2],
    pub(crate) fade: [i32; 2],
}

/// All profile terms of a segment, as correction (the opposite of the error).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Extra {
    pub(crate) linear: [Linear; 3],
    pub(crate) moving: Moving,
    /// The terms have the form of [`Moving`], and none is beyond its numbers.
    pub(crate) fits: bool,
    /// Indicator of the sense of X and Y: `[0]·cosφ + [1]·sinφ`, a little ahead of the phase.
    pub(crate) ahead: [[i32; 2]; 2],
    pub(crate) turning: Turning,
    /// Offset of X and Y that nothing changes, in [`FINE`] nm.
    pub(crate) constant_fine: [i32; 2],
    pub(crate) cyclic: [Cyclic; 2],
    /// Opposite of the bow, Q31 for u²/2³² in nm, by the axis of travel.
    pub(crate) bow: [i32; 2],
    /// Anything that depends on the sense of an axis.
    pub(crate) sided: bool,
    /// Periodic errors, and any bow.
    pub(crate) periodic: u8,
    pub(crate) bowed: bool,
}

impl Extra {
    /// Whether sides and constants are within the 8 mm of their numbers, with room for their sum.
    pub(crate) fn within_numbers(&self) -> bool {
        let t = &self.turning;
        let [[a, b], [c, d]] = t.side;
        let ([e, f], [g, h]) = (self.constant_fine, t.spike);
        [a, b, c, d, e, f, g, h]
            .iter()
            .all(|fine| fine.unsigned_abs() < 1 << 28)
    }

    /// Indicators of the sense of X and Y. Asked for before anything branches: a product whose factors come from
    /// another block of code costs four instructions instead of one.
    #[inline(always)]
    pub(crate) fn ahead_at(&self, c: i32, s: i32) -> [i32; 2] {
        let [[xc, xs], [yc, ys]] = self.ahead;
        [mulh_add(mulh(xc, c), xs, s), mulh_add(mulh(yc, c), ys, s)]
    }

    /// Adds periodic errors at a position, and bow at a distance from the centre, nm: X and Y.
    #[inline(always)]
    pub(crate) fn by_place(
        &self,
        sincos: &[i32; 2],
        [nx, ny]: [i32; 2],
        arm: impl FnOnce() -> [i32; 2],
        mut offset: [i32; 2],
    ) -> [i32; 2] {
        if self.periodic != 0 {
            offset = self.cyclic[0].add(sincos, nx, ny, offset);
            if self.periodic != 1 {
                offset = self.cyclic[1].add(sincos, nx, ny, offset);
            }
        }
        if self.bowed {
            // Travel along X bows Y, and the other way round.
            let ([ax, ay], [bx, by]) = (arm(), self.bow);
            let [ox, oy] = offset;
            offset = [
                mulh_add(ox, mulh(ay, ay).wrapping_mul(2), by),
                mulh_add(oy, mulh(ax, ax).wrapping_mul(2), bx),
            ];
        }
        offset
    }
}

impl Cyclic {
    #[inline(always)]
    fn add(&self, sincos: &[i32; 2], nx: i32, ny: i32, [ox, oy]: [i32; 2]) -> [i32; 2] {
        // The constants are loaded here, not before the branch that led here: factors from another block of code
        // cost four instructions a product instead of one.
        compiler_fence(Ordering::AcqRel);
        let ([px, py], [rx, ry]) = (self.per_nm, self.rest_q32);
        let whole = nx
            .wrapping_mul(px)
            .wrapping_add(ny.wrapping_mul(py))
            .wrapping_add(self.phase as i32);
        let phase = mulh_add(mulh_add(whole, nx, rx), ny, ry);
        let (_, sine) = sincos_with(*sincos, phase as u32);
        let [ax, ay] = self.amplitude;
        [mulh_add(ox, ax, sine), mulh_add(oy, ay, sine)]
    }
}

impl Linear {
    /// On an arc at constant rate, nm·2: there they cost the tick nothing.
    pub(crate) fn steady(&self) -> (i32, i32) {
        let ([a0, a1, a2, _], [b0, b1, b2, _]) = (self.a, self.b);
        (
            a0.wrapping_add(a1).wrapping_add(a2),
            b0.wrapping_add(b1).wrapping_add(b2),
        )
    }

    /// Offset on an arc in a ramp (`rate` and `rate2` are W and W² in Q31, `turning` w⁴ in Q31 with the sign of the ramp), nm.
    #[inline(always)]
    pub(crate) fn on_arc(&self, rate: i32, rate2: i32, turning: i32, c: i32, s: i32) -> i32 {
        let at = |[k0, k1, k2, k3]: [i32; 4]| {
            let slow = mulh_add(mulh(k1, rate), k2, rate2);
            k0.wrapping_add(mulh_add(slow, k3, turning).wrapping_mul(2))
        };
        mulh_add(mulh(at(self.a), c), at(self.b), s)
    }

    /// Offset on an arc, nm, of what does not depend on the rate.
    #[inline(always)]
    pub(crate) fn at_rest(&self, c: i32, s: i32) -> i32 {
        mulh_add(mulh(self.a[0], c), self.b[0], s)
    }

    /// Offset on a line, nm, without the constant.
    #[inline(always)]
    pub(crate) fn on_line(&self, share: i32, rate: i32, turning: i32) -> i32 {
        mulh_add(
            mulh_add(mulh(self.a[0], share), self.a[1], rate),
            self.a[3],
            turning,
        )
    }
}
