//! Profile terms in fixed point: what a zone with profile terms adds to the tick.
use super::hysteresis::ahead;
use core::sync::atomic::{Ordering, compiler_fence};
use giotto_shared::angle::sincos_with;
use giotto_shared::fixed::{mulh, mulh_add};
use giotto_shared::law::MAX_CYCLIC;

/// One slide's linear terms. On an arc the weights of cosφ and sinφ, each `[0] + W·[1] + W²·[2] + w⁴·[3]`, `[0]` in nm·2 and the
/// others in nm·4, since they meet Q31; on a line `share·a[0] + W·a[1] + w⁴·a[3]`, nm·2.
#[repr(C)]
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
    /// Ticks of a take-up and one that sets right, at least 4; by slide the same, or 0 where nothing hangs on its sense.
    pub(crate) take_up: u32,
    pub(crate) ticks: [u32; 3],
    /// By slide, of its indicator: [`limit`](super::hysteresis::limit).
    pub(crate) limit: [i32; 3],
    /// Distance of the ticks of a take-up in x (Q31).
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
    /// Periodic errors, and any bow.
    pub(crate) periodic: u8,
    pub(crate) bowed: bool,
}

impl Turning {
    /// In pieces that the compiler copies in place: all at once it is a call.
    #[inline(always)]
    fn copy(&mut self, from: &Self) {
        (self.take_up, self.ticks, self.limit) = (from.take_up, from.ticks, from.limit);
        (self.dx, self.first_x, self.share_q30) = (from.dx, from.first_x, from.share_q30);
        self.side = from.side;
        self.jump = from.jump;
        (self.spike, self.fade) = (from.spike, from.fade);
    }
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
        self.ahead = from.ahead;
        self.turning.copy(&from.turning);
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
        let [x, y, z] = &self.ahead;
        [ahead(x, c, s), ahead(y, c, s), ahead(z, c, s)]
    }

    /// Adds the linear terms on an arc in a ramp (`rate` is W in Q31, `turning` w⁴ in Q31 with the sign of the ramp), nm.
    #[inline(never)]
    pub(crate) fn add_linear(
        &self,
        rate: i32,
        turning: i32,
        [c, s]: [i32; 2],
        wanted: &mut [i32; 3],
    ) {
        let rate2 = mulh(rate, rate).wrapping_mul(2);
        let ([lx, ly, lz], [x, y, z]) = (&self.linear, wanted);
        // One after the other: the coefficients of all do not fit into the registers.
        *x = lx.on_arc(*x, [rate, rate2, turning], [c, s]);
        compiler_fence(Ordering::AcqRel);
        *y = ly.on_arc(*y, [rate, rate2, turning], [c, s]);
        compiler_fence(Ordering::AcqRel);
        *z = lz.on_arc(*z, [rate, rate2, turning], [c, s]);
    }

    /// Adds the linear terms of the rise of a helix that has risen so far (nm) and rises at a rate W (Q31) that changes with
    /// w⁴ (Q31), nm.
    #[inline(never)]
    pub(crate) fn add_rise(
        &self,
        risen: &[i32; 3],
        rate: i32,
        turning: i32,
        wanted: &mut [i32; 3],
    ) {
        for (w, rising) in wanted.iter_mut().zip(&self.rising) {
            *w = w.wrapping_add(rising.offset(*risen, rate, turning));
        }
    }

    /// Adds periodic errors at a position, nm.
    #[inline(never)]
    pub(crate) fn add_periodic(&self, sincos: [i32; 2], place: &[i32; 3], wanted: &mut [i32; 3]) {
        let used = self.cyclic.get(..usize::from(self.periodic));
        for cyclic in used.unwrap_or_default() {
            cyclic.add(sincos, place, wanted);
        }
    }

    /// Adds the bow at a distance from the centre, nm.
    #[inline(never)]
    pub(crate) fn add_bow(&self, arm: &[i32; 3], wanted: &mut [i32; 3]) {
        for (arm, [x, y, z]) in arm.iter().zip(&self.bow) {
            let square = mulh(*arm, *arm).wrapping_mul(2);
            let [ox, oy, oz] = *wanted;
            *wanted = [
                mulh_add(ox, square, *x),
                mulh_add(oy, square, *y),
                mulh_add(oz, square, *z),
            ];
        }
    }
}

impl Cyclic {
    #[inline(always)]
    fn add(&self, sincos: [i32; 2], place: &[i32; 3], offset: &mut [i32; 3]) {
        if let (Some(at), Some(offset)) = (place.get(self.slide), offset.get_mut(self.slide)) {
            let whole = at.wrapping_mul(self.per_nm).wrapping_add(self.phase as i32);
            let phase = mulh_add(whole, *at, self.rest_q32);
            let (_, sine) = sincos_with(sincos, phase as u32);
            *offset = mulh_add(*offset, self.amplitude, sine);
        }
    }
}

impl Linear {
    /// On an arc at constant rate, nm·2: there they cost the tick nothing.
    pub(crate) fn steady(&self) -> (i32, i32) {
        let ([a0, a1, a2, _], [b0, b1, b2, _]) = (self.a, self.b);
        let whole = |k0: i32, k1: i32, k2: i32| k0.wrapping_add(k1.wrapping_add(k2) >> 1);
        (whole(a0, a1, a2), whole(b0, b1, b2))
    }

    /// Offset so far and that on an arc in a ramp, nm; by W, W² and w⁴ in Q31.
    #[inline(always)]
    fn on_arc(&self, so_far: i32, [rate, rate2, turning]: [i32; 3], [c, s]: [i32; 2]) -> i32 {
        let [a0, a1, a2, a3] = self.a;
        let a = mulh_add(mulh_add(mulh_add(a0, a1, rate), a2, rate2), a3, turning);
        let so_far = mulh_add(so_far, a, c);
        compiler_fence(Ordering::AcqRel);
        let [b0, b1, b2, b3] = self.b;
        let b = mulh_add(mulh_add(mulh_add(b0, b1, rate), b2, rate2), b3, turning);
        mulh_add(so_far, b, s)
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
    #[inline(always)]
    fn offset(&self, [x, y, z]: [i32; 3], rate: i32, turning: i32) -> i32 {
        let [px, py, pz] = self.place_q34;
        let place = mulh_add(mulh_add(mulh(px, x), py, y), pz, z) >> 2;
        mulh_add(mulh_add(place, self.rate, rate), self.change, turning)
    }
}
