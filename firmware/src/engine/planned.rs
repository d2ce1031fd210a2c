//! A segment in the form that the tick runs: integers only, everything that could fail already done.
use super::arm::ArmPlan;
use super::descent::Slowing;
use super::profile_terms::Extra;
use super::ramp::Shapes;
use giotto_shared::fixed::{mulh, mulh_add, mulh_sub};
use giotto_shared::path::{on_arc, risen};

/// Which curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) enum Kind {
    /// Stands still for `Timing::cruise_ticks`.
    #[default]
    Dwell,
    /// As a dwell of one tick, once the offset has moved to none.
    Clear,
    /// p = base + u·share, v its unit direction.
    Line,
    /// p = base + u·cosφ + v·sinφ.
    Arc,
    /// An arc that also moves by `rise` each turn.
    Helix,
}

/// One coordinate of the curve and of its correction at constant rate; the tick loads it as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Axis {
    /// nm.
    pub(crate) base: i32,
    /// nm·2 on arcs, nm on lines.
    pub(crate) u: i32,
    /// nm·2 on arcs, unit direction in Q31 on lines.
    pub(crate) v: i32,
    /// Correction at constant rate on arcs, nm·2: a·cosφ + b·sinφ.
    pub(crate) a: i32,
    pub(crate) b: i32,
}

impl Axis {
    /// Position on an arc, nm (rounded down), at cosine and sine in Q31.
    #[inline(always)]
    pub(crate) fn on_arc(&self, c: i32, s: i32) -> i32 {
        on_arc([self.base, self.u, self.v], c, s)
    }

    /// Position on a line, nm (rounded down). The share is Q30 and signed: rounding may carry it past either end.
    #[inline(always)]
    pub(crate) fn on_line(&self, share_q30: i32) -> i32 {
        let way = i64::from(self.u).wrapping_mul(i64::from(share_q30)) >> 30;
        self.base.wrapping_add(way as i32)
    }

    /// A vector of the plane turned and scaled by re + i·im (Q31), nm: its coordinate on this axis.
    #[inline(always)]
    pub(crate) fn turned(&self, re: i32, im: i32) -> i32 {
        mulh_add(mulh(self.u, re), self.v, im)
    }

    /// Correction at constant rate, nm; at most 2 nm below exact (two floors), exactly 0 where there is none.
    #[inline(always)]
    pub(crate) fn steady(&self, c: i32, s: i32) -> i32 {
        mulh_add(mulh(self.a, c), self.b, s)
    }
}

/// Rising ramp, constant rate, falling ramp. Phases in turns of 2⁶⁴, or shares of a line of 2⁶².
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Timing {
    pub(crate) start: u64,
    /// Exact phase at the end of the rising ramp.
    pub(crate) up: u64,
    /// Exact phase at the end.
    pub(crate) end: u64,
    /// Phase per tick at the constant rate; even.
    pub(crate) step: u64,
    /// Twice that: a ramp's share of it is then the upper half of a product.
    pub(crate) step_q1: u64,
    pub(crate) ramp_ticks: u32,
    pub(crate) cruise_ticks: u32,
    /// Q63 step of the ramp's x per tick.
    pub(crate) clock_step: u64,
}

/// The operator in a ramp, in fixed point. `W` is the share of the constant rate.
///
/// On an arc the complex gain δ + ib (Q32, |k| < 2³¹):
/// δ = W²(k1 + k2 W²) + k3 W·xw³ + (k4 w⁴ + k9 W) w⁴, b = w⁴(k5 + k6 W²) + k7 w² + k8 w³.
/// On a line the offset along it, nm·2: k5 w⁴ + k7 w² + k8 w³.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Law {
    /// Q33.
    pub(crate) k1: i32,
    /// Q34.
    pub(crate) k2: i32,
    /// Q32.
    pub(crate) k3: i32,
    /// Q30.
    pub(crate) k4: i32,
    /// Q33; on a line nm·2².
    pub(crate) k5: i32,
    /// Q34.
    pub(crate) k6: i32,
    /// Q30; on a line nm·2².
    pub(crate) k7: i32,
    /// Q31; on a line nm·2³.
    pub(crate) k8: i32,
    /// Q30.
    pub(crate) k9: i32,
    /// What the sum of rates lacks of the phase (Euler–Maclaurin), units of 2⁻³² turn at w⁴ = 1, Q1.
    pub(crate) end_term_q1: i32,
}

impl Law {
    /// The law of the same ramp run backwards in time: odd derivatives change their sign.
    pub(crate) const fn turned_round(self) -> Self {
        Self {
            k5: self.k5.wrapping_neg(),
            k6: self.k6.wrapping_neg(),
            k7: self.k7.wrapping_neg(),
            k8: self.k8.wrapping_neg(),
            k9: self.k9.wrapping_neg(),
            end_term_q1: self.end_term_q1.wrapping_neg(),
            ..self
        }
    }

    /// Euler–Maclaurin term, units of 2⁻³² turn.
    #[inline(always)]
    pub(crate) fn end_term(&self, f: &Shapes) -> i32 {
        mulh(f.w4_q31, self.end_term_q1)
    }

    /// (δ, b) in Q32. Asked for before sine and cosine: so the tick needs the fewest registers.
    #[inline(always)]
    pub(crate) fn gain(&self, f: &Shapes) -> (i32, i32) {
        let rate2 = mulh(f.s_q31, f.s_q31).wrapping_mul(2);
        let main = mulh(mulh_add(self.k1, self.k2, rate2), rate2);
        let jerk = mulh(f.s_q31, f.xw3_q29);
        let change = mulh_add(mulh(self.k4, f.w4_q31), self.k9, f.s_q31);
        let fine = mulh_add(mulh(self.k3, jerk), change, f.w4_q31);
        let radial = main.wrapping_add(fine.wrapping_mul(16));
        let ahead = mulh(mulh_add(self.k5, self.k6, rate2), f.w4_q31);
        let snap = mulh_add(mulh(self.k7, f.w2_q31), self.k8, f.w3_q30);
        (radial, ahead.wrapping_add(snap.wrapping_mul(8)))
    }

    /// Offset along a line, nm·2.
    #[inline(always)]
    pub(crate) fn along(&self, f: &Shapes) -> i32 {
        mulh_add(
            mulh_add(mulh(self.k5, f.w4_q31), self.k7, f.w2_q31),
            self.k8,
            f.w3_q30,
        )
    }
}

/// (δ + ib)(c + is) in Q31, from Q32 and Q31.
#[inline(always)]
pub(crate) fn turn(radial: i32, tangential: i32, c: i32, s: i32) -> (i32, i32) {
    (
        mulh_sub(mulh(radial, c), tangential, s),
        mulh_add(mulh(radial, s), tangential, c),
    )
}

/// A segment ready to run. What an arm asks for is last: the tick of all others reaches theirs by short offsets.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Planned {
    pub(crate) axes: [Axis; 3],
    /// The law in the rising ramp.
    pub(crate) rise: Law,
    pub(crate) timing: Timing,
    /// What a stop of it may take.
    pub(crate) slowing: Slowing,
    pub(crate) kind: Kind,
    /// A zone of the table applies.
    pub(crate) corrected: bool,
    /// The zone has profile terms.
    pub(crate) extended: bool,
    /// Segments planned before a stop carry an older one.
    pub(crate) epoch: u8,
    /// Helix: nm per turn.
    pub(crate) rise_nm: [i32; 3],
    /// Bounds on offset (nm) and its change by axis (nm per tick).
    pub(crate) offset_nm: i32,
    pub(crate) slew_nm: [i32; 3],
    /// Clock step of the ramp that moves the offset from what it is to what this segment starts with.
    pub(crate) settle_step: u64,
    pub(crate) start_nm: [i32; 3],
    pub(crate) end_nm: [i32; 3],
    pub(crate) extra: Extra,
    /// What the joints of an arm ask for.
    pub(crate) arm: ArmPlan,
}

impl Planned {
    /// Becomes another one, as far as that one says anything. Field by field and only what it uses: all at once it is a call of
    /// memcpy, at five instructions a word nine hundred of the tick's thousand.
    #[inline(never)]
    pub fn copy(&mut self, from: &Self) {
        let [x, y, z] = &from.axes;
        self.axes = [*x, *y, *z];
        self.rise = from.rise;
        self.timing = from.timing;
        self.slowing = from.slowing;
        self.kind = from.kind;
        self.corrected = from.corrected;
        self.extended = from.extended;
        self.epoch = from.epoch;
        self.rise_nm = from.rise_nm;
        (self.offset_nm, self.slew_nm) = (from.offset_nm, from.slew_nm);
        self.settle_step = from.settle_step;
        (self.start_nm, self.end_nm) = (from.start_nm, from.end_nm);
        self.arm.copy(&from.arm);
        if from.extended {
            self.extra.copy(&from.extra, from.kind == Kind::Helix);
        }
    }

    /// How far a helix has risen, nm, at so many turns (whole, and their fraction).
    pub(crate) fn risen(&self, turns: i32, fraction_q32: u32) -> [i32; 3] {
        risen(self.rise_nm, turns, fraction_q32)
    }

    /// Where it ends, nm.
    pub const fn end_nm(&self) -> [i32; 3] {
        self.end_nm
    }

    /// How many ticks it takes once started, settling not counted.
    pub const fn ticks(&self) -> u64 {
        self.timing.cruise_ticks as u64 + 2 * self.timing.ramp_ticks as u64
    }

    /// Not counted if no zone applies.
    pub(crate) const fn leave_out(&mut self) {
        self.corrected = true;
    }

    /// Whether a zone of the table applies.
    pub const fn corrected(&self) -> bool {
        self.corrected
    }
}
