//! Profile terms in fixed point: what a zone with profile terms adds to the tick.
use giotto_shared::angle::sincos_with;
use giotto_shared::fixed::{mulh, mulh_add};
use giotto_shared::law::MAX_CYCLIC;

/// One slide's linear terms, nm·2. On an arc the weights of cosφ and sinφ, each
/// `[0] + W·[1] + W²·[2] + w⁴·[3]`; on a line `share·a[0] + W·a[1] + w⁴·a[3]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Linear {
    pub(crate) a: [i32; 4],
    pub(crate) b: [i32; 4],
}

/// What the rise of a helix adds to one slide's linear terms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Rising {
    /// By how far X, Y and Z have risen: Q34 of the way.
    pub(crate) place_q34: [i32; 3],
    /// By W and by w⁴, nm·2.
    pub(crate) rate: i32,
    pub(crate) change: i32,
}

/// One periodic error: amplitude·sin(phase + per_nm·position) along a slide.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Cyclic {
    /// 0 for X, 1 for Y, 2 for Z.
    pub(crate) slide: usize,
    /// nm·2.
    pub(crate) amplitude: i32,
    /// Units of 2⁻³² turn per nm: nearest whole number, and the rest (Q32).
    pub(crate) per_nm: i32,
    pub(crate) rest_q32: i32,
    pub(crate) phase: u32,
}

/// What the sides of X, Y and Z are made of. Offsets in [`FINE`](super::hysteresis::FINE) nm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Turning {
    /// Ticks of a take-up, at least 3, and their distance in x (Q31).
    pub(crate) ticks: u32,
    pub(crate) dx: i32,
    /// Middle of the first tick, Q31.
    pub(crate) first_x: i32,
    /// 3.75/ticks: twice what S gains in a tick at w² = 1.
    pub(crate) share_q30: i32,
    /// By slide: offset of X, Y and Z when it travels forward, doubled, and 2·(gain of S per tick at w² = 1) of its change
    /// from side to side.
    pub(crate) side: [[i32; 3]; 3],
    pub(crate) jump: [[i32; 3]; 3],
    /// By slide: height of the friction pulse, and its change per tick (a share, Q32).
    pub(crate) spike: [i32; 3],
    pub(crate) fade: [i32; 3],
}

/// All profile terms of a segment, as correction (the opposite of the error).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Extra {
    pub(crate) linear: [Linear; 3],
    /// Used on helices.
    pub(crate) rising: [Rising; 3],
    /// Indicator of the sense of X, Y and Z: `[0]·cosφ + [1]·sinφ + [2]`, a little ahead of the phase.
    pub(crate) ahead: [[i32; 3]; 3],
    pub(crate) turning: Turning,
    /// Offset of X, Y and Z that nothing changes, in [`FINE`](super::hysteresis::FINE) nm.
    pub(crate) constant_fine: [i32; 3],
    pub(crate) cyclic: [Cyclic; MAX_CYCLIC],
    /// Opposite of the bow, Q31 for u²/2³² in nm, by the slide of travel and the slide that is off.
    pub(crate) bow: [[i32; 3]; 3],
    /// Anything that depends on the sense of a slide.
    pub(crate) sided: bool,
    /// Periodic errors, and any bow.
    pub(crate) periodic: u8,
    pub(crate) bowed: bool,
}

impl Extra {
    /// Becomes another one, as far as that one says anything; `rises`: it is of a helix.
    #[inline(always)]
    pub(crate) fn copy(&mut self, from: &Self, rises: bool) {
        for (to, from) in self.linear.iter_mut().zip(&from.linear) {
            *to = *from;
        }
        if rises {
            for (to, from) in self.rising.iter_mut().zip(&from.rising) {
                *to = *from;
            }
        }
        self.sided = from.sided;
        self.ahead = from.ahead;
        self.turning = from.turning;
        self.constant_fine = from.constant_fine;
        self.periodic = from.periodic;
        for (to, from) in self
            .cyclic
            .iter_mut()
            .zip(&from.cyclic)
            .take(usize::from(from.periodic))
        {
            *to = *from;
        }
        self.bowed = from.bowed;
        if from.bowed {
            self.bow = from.bow;
        }
    }

    /// Whether sides and constants are within the 8 mm of their numbers, with room for their sum.
    pub(crate) fn within_numbers(&self) -> bool {
        let sides = self.turning.side.iter().flatten();
        let all = sides.chain(&self.constant_fine).chain(&self.turning.spike);
        all.into_iter().all(|fine| fine.unsigned_abs() < 1 << 28)
    }

    /// Indicators of the sense of X, Y and Z.
    #[inline(always)]
    pub(crate) fn ahead_at(&self, c: i32, s: i32) -> [i32; 3] {
        let [[xc, xs, x], [yc, ys, y], [zc, zs, z]] = self.ahead;
        [
            mulh_add(mulh_add(x, xc, c), xs, s),
            mulh_add(mulh_add(y, yc, c), ys, s),
            mulh_add(mulh_add(z, zc, c), zs, s),
        ]
    }

    /// Adds periodic errors at a position, and bow at a distance from the centre, nm.
    #[inline(always)]
    pub(crate) fn by_place(
        &self,
        sincos: &[i32; 2],
        place: [i32; 3],
        arm: impl FnOnce() -> [i32; 3],
        mut offset: [i32; 3],
    ) -> [i32; 3] {
        for (index, cyclic) in self.cyclic.iter().enumerate() {
            if index >= usize::from(self.periodic) {
                break;
            }
            cyclic.add(sincos, place, &mut offset);
        }
        if self.bowed {
            let ([ax, ay, az], [bx, by, bz]) = (arm(), &self.bow);
            for (arm, [x, y, z]) in [(ax, bx), (ay, by), (az, bz)] {
                let square = mulh(arm, arm).wrapping_mul(2);
                let [ox, oy, oz] = offset;
                offset = [
                    mulh_add(ox, square, *x),
                    mulh_add(oy, square, *y),
                    mulh_add(oz, square, *z),
                ];
            }
        }
        offset
    }
}

impl Cyclic {
    #[inline(always)]
    fn add(&self, sincos: &[i32; 2], place: [i32; 3], offset: &mut [i32; 3]) {
        if let (Some(at), Some(offset)) = (place.get(self.slide), offset.get_mut(self.slide)) {
            let whole = at.wrapping_mul(self.per_nm).wrapping_add(self.phase as i32);
            let phase = mulh_add(whole, *at, self.rest_q32);
            let (_, sine) = sincos_with(*sincos, phase as u32);
            *offset = mulh_add(*offset, self.amplitude, sine);
        }
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
        let ([a0, a1, a2, a3], [b0, b1, b2, b3]) = (self.a, self.b);
        let a = mulh_add(mulh_add(mulh(a1, rate), a2, rate2), a3, turning);
        let b = mulh_add(mulh_add(mulh(b1, rate), b2, rate2), b3, turning);
        let (a, b) = (a.wrapping_mul(2), b.wrapping_mul(2));
        mulh_add(mulh(a0.wrapping_add(a), c), b0.wrapping_add(b), s)
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

impl Rising {
    /// Offset, nm, when a helix has risen so far (nm) and rises at a rate W (Q31) that changes with w⁴ (Q31).
    pub(crate) fn offset(&self, [x, y, z]: [i32; 3], rate: i32, turning: i32) -> i32 {
        let [px, py, pz] = self.place_q34;
        let place = mulh_add(mulh_add(mulh(px, x), py, y), pz, z) >> 2;
        mulh_add(mulh_add(place, self.rate, rate), self.change, turning)
    }
}
