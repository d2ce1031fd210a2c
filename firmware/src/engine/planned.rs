//! A segment in the form that the tick runs: integers only, everything that could fail already done.
use super::ramp::Shapes;
use giotto_shared::angle::sincos;
use giotto_shared::fixed::{mulh, mulh_add, mulh_sub};

/// Which curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) enum Kind {
    /// Stands still for `Timing::cruise_ticks`.
    #[default]
    Dwell,
    /// p = base + u·s, s the share of the way done.
    Line,
    /// p = base + u·cosφ + v·sinφ.
    Arc,
    /// An arc that also moves by `rise` each turn.
    Helix,
}

/// The curve. `base` is in nm·2³¹ with half a nm added, so that the sum only has to be shifted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Curve {
    pub(crate) kind: Kind,
    pub(crate) base: [i64; 3],
    pub(crate) u_nm: [i32; 3],
    pub(crate) v_nm: [i32; 3],
    /// nm per turn of φ.
    pub(crate) rise_nm: [i32; 3],
}

/// A base for [`Curve`].
pub(crate) const fn base(nm: i32) -> i64 {
    ((nm as i64) << 31) + (1 << 30)
}

impl Curve {
    /// Position, nm, where the vectors have the weights c and s (Q31).
    #[inline(always)]
    pub(crate) fn at(&self, c: i32, s: i32) -> [i32; 3] {
        let one = |base: i64, u: i32, v: i32| {
            let sum = base
                .wrapping_add((i64::from(u)).wrapping_mul(i64::from(c)))
                .wrapping_add((i64::from(v)).wrapping_mul(i64::from(s)));
            (sum >> 31) as i32
        };
        let ([bx, by, bz], [ux, uy, uz], [vx, vy, vz]) = (self.base, self.u_nm, self.v_nm);
        [one(bx, ux, vx), one(by, uy, vy), one(bz, uz, vz)]
    }

    /// Weights of the two vectors at a phase.
    #[inline(always)]
    pub(crate) fn weights(&self, phase_q32: u32) -> (i32, i32) {
        match self.kind {
            Kind::Arc | Kind::Helix => sincos(phase_q32),
            Kind::Line => ((phase_q32 >> 1) as i32, 0),
            Kind::Dwell => (0, 0),
        }
    }

    /// How far the rise has come, nm, after so many turns (whole, and their fraction).
    #[inline(always)]
    pub(crate) fn risen(&self, turns: i32, fraction_q32: u32) -> [i32; 3] {
        self.rise_nm.map(|rise| {
            let part = (i64::from(rise).wrapping_mul(i64::from(fraction_q32))) >> 32;
            rise.wrapping_mul(turns).wrapping_add(part as i32)
        })
    }
}

/// Rising ramp, constant rate, falling ramp. Phases in turns (or shares of a line) of 2⁶⁴.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Timing {
    pub(crate) start: u64,
    /// Exact phase at the end of the rising ramp.
    pub(crate) up: u64,
    /// Exact phase at the end.
    pub(crate) end: u64,
    /// Phase per tick at the constant rate; even.
    pub(crate) step: u64,
    pub(crate) ramp_ticks: u32,
    pub(crate) cruise_ticks: u32,
    /// Q63 step of the ramp's x per tick.
    pub(crate) clock_step: i64,
    /// Euler–Maclaurin term of the ramp's phase, units of 2⁻³² turn at w⁴ = 1, Q2.
    pub(crate) end_term_q2: i32,
}

impl Timing {
    /// Euler–Maclaurin term at this point of a rising ramp, units of 2⁻³² turn.
    #[inline(always)]
    pub(crate) fn end_term(&self, w4_q30: i32) -> i32 {
        mulh(w4_q30, self.end_term_q2)
    }
}

/// The operator in fixed point: on an arc the complex gain δ + ib (Q33), on a line the offset along it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Law {
    /// δ: W²(k1 + k2 W²), Q34 and Q35.
    pub(crate) k1: i32,
    pub(crate) k2: i32,
    /// δ: W·xw³ and w⁸, Q32.
    pub(crate) k3: i32,
    pub(crate) k4: i32,
    /// b: w⁴(k5 + k6 W²), Q34 and Q35. On a line k5 is nm·2³.
    pub(crate) k5: i32,
    pub(crate) k6: i32,
    /// b: w²(1 − 7w/6), Q31. On a line nm·2⁴.
    pub(crate) k7: i32,
}

impl Law {
    /// Offset on an arc, nm, with the phase's weights c and s.
    #[inline(always)]
    pub(crate) fn on_arc(&self, curve: &Curve, f: Shapes, falling: i32, c: i32, s: i32) -> [i32; 3] {
        let rate = (f.s_q32 >> 1) as i32;
        let rate2 = mulh(rate, rate).wrapping_mul(2);
        let main = mulh(mulh_add(self.k1, self.k2, rate2), rate2);
        let jerk = mulh(rate, f.xw3_q29);
        let acceleration2 = mulh(f.w4_q30, f.w4_q30);
        let fine = mulh_add(mulh(self.k3, jerk), self.k4, acceleration2);
        let radial = main.wrapping_add(fine.wrapping_mul(32));
        let ahead = mulh(mulh_add(self.k5, self.k6, rate2), f.w4_q30).wrapping_mul(2);
        let snap = mulh(self.k7, f.s3_q29).wrapping_mul(32);
        let tangential = (ahead.wrapping_add(snap) ^ falling).wrapping_sub(falling);
        // (δ + ib)(c + is), Q32.
        let re = mulh_sub(mulh(radial, c), tangential, s);
        let im = mulh_add(mulh(radial, s), tangential, c);
        let ([ux, uy, uz], [vx, vy, vz]) = (curve.u_nm, curve.v_nm);
        let one = |u, v| mulh_add(mulh(u, re), v, im);
        [one(ux, vx), one(uy, vy), one(uz, vz)]
    }

    /// Offset on a line, nm, along its unit direction (Q31).
    #[inline(always)]
    pub(crate) fn on_line(&self, direction: &[i32; 3], f: Shapes, falling: i32) -> [i32; 3] {
        let ahead = mulh_add(mulh(self.k5, f.w4_q30), self.k7, f.s3_q29);
        let ahead = (ahead ^ falling).wrapping_sub(falling);
        let [x, y, z] = *direction;
        [mulh(x, ahead), mulh(y, ahead), mulh(z, ahead)]
    }
}

/// Offset at constant rate, nm·2: a·cosφ + b·sinφ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Steady {
    pub(crate) a: [i32; 3],
    pub(crate) b: [i32; 3],
}

impl Steady {
    /// Offset, nm, at most 2 nm below exact (two floors); exactly 0 where there is no correction.
    #[inline(always)]
    pub(crate) fn at(&self, c: i32, s: i32) -> [i32; 3] {
        let ([ax, ay, az], [bx, by, bz]) = (self.a, self.b);
        let one = |a, b| mulh_add(mulh(a, c), b, s);
        [one(ax, bx), one(ay, by), one(az, bz)]
    }
}

/// A segment ready to run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Planned {
    pub(crate) curve: Curve,
    pub(crate) timing: Timing,
    pub(crate) law: Law,
    pub(crate) steady: Steady,
    /// Bounds on offset (nm) and its change (nm per tick).
    pub(crate) offset_nm: i32,
    pub(crate) slew_nm: i32,
    /// Ticks to move the offset from what it is to what this segment starts with.
    pub(crate) settle_ticks: u32,
    pub(crate) settle_step: i64,
    pub(crate) start_offset_nm: [i32; 3],
    pub(crate) epoch: u8,
    pub(crate) start_nm: [i32; 3],
    pub(crate) end_nm: [i32; 3],
    /// A zone of the table applies.
    pub(crate) corrected: bool,
}

impl Planned {
    /// Offset wanted where it stands still, nm, at the weights of that place.
    pub(crate) fn rest_offset(&self, _c: i32, _s: i32) -> [i32; 3] {
        [0; 3]
    }

    /// Where it ends, nm.
    pub const fn end_nm(&self) -> [i32; 3] {
        self.end_nm
    }

    /// How many ticks it takes once started, settling not counted.
    pub const fn ticks(&self) -> u64 {
        self.timing.cruise_ticks as u64 + 2 * self.timing.ramp_ticks as u64
    }

    /// Whether a zone of the table applies.
    pub const fn corrected(&self) -> bool {
        self.corrected
    }
}
