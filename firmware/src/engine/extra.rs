//! Profile terms in fixed point: what a zone with profile terms adds to the tick.
use super::ramp::{Clock, FIRST, clock_step, shapes};
use giotto_shared::angle::{phase_from_rad, sincos};
use giotto_shared::fixed::{mulh, mulh_add, to_fixed};
use giotto_shared::law::Profile;

/// One coordinate's linear terms, nm·2. On an arc the weights of cosφ and sinφ, each
/// `[0] + W·[1] + W²·[2] + w⁴·[3]`; on a line `share·a[0] + W·a[1] + w⁴·a[3]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Linear {
    pub(crate) a: [i32; 4],
    pub(crate) b: [i32; 4],
    /// nm, everywhere.
    pub(crate) constant_nm: i32,
}

/// One periodic error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Cyclic {
    /// nm·2; 0: none.
    amplitude: i32,
    /// Units of 2⁻³² turn per nm: whole and fraction (Q32).
    per_nm: u32,
    per_nm_q32: u32,
    phase: u32,
    on_y: bool,
}

/// All profile terms of a segment, as correction (the opposite of the error).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Extra {
    pub(crate) linear: [Linear; 3],
    /// Indicator of the sense of X and Y: `[0]·cosφ + [1]·sinφ`, a little ahead of the phase.
    pub(crate) ahead: [[i32; 2]; 2],
    /// Offset of X and Y by the sense of X and Y, nm·2.
    cross: [[i32; 2]; 2],
    /// Height of the pulse where its onset begins, nm·2⁸, and its loss per tick, Q32.
    spike: [i32; 2],
    loss_q32: [i32; 2],
    take_up_step: u64,
    cyclic: [Cyclic; 2],
    /// Opposite of the bow, Q32 for u²/2³² in nm, by the axis of travel.
    bow: [i32; 2],
    /// Anything that depends on the sense of an axis; anything periodic; any bow.
    sided: bool,
    periodic: bool,
    bowed: bool,
}

/// What the planner knows of the motion.
pub(crate) struct Motion {
    /// Constant rate, rad/s (arcs) or 1/s (lines).
    pub(crate) rate: f64,
    /// Duration of a ramp, s.
    pub(crate) ramp_s: f64,
    pub(crate) tick_s: f64,
    /// Time in which an axis' play is taken up, s.
    pub(crate) take_up_s: f64,
}

impl Extra {
    /// For an arc with vectors u and v (m), its centre seen from the reference point (m).
    pub(crate) fn on_arc(p: &Profile<f64>, m: &Motion, u: [f64; 3], v: [f64; 3], centre: [f64; 2]) -> Self {
        let mut extra = Self::unsteady(p, m);
        let radius = libm::sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
        let outward = -p.radius_offset_m / radius;
        let acceleration = m.rate * FIRST / m.ramp_s;
        let nm2 = |metres: f64| to_fixed(metres * 1e9, 1);
        for i in 0..3 {
            extra.linear[i].a[0] = nm2(outward * u[i]);
            extra.linear[i].b[0] = nm2(outward * v[i]);
        }
        for i in 0..2 {
            let by = |matrix: &[[f64; 2]; 2], arm: [f64; 3]| matrix[i][0] * arm[0] + matrix[i][1] * arm[1];
            // q = u cosφ + v sinφ, q̇ = ω(−u sinφ + v cosφ), q̈ = α(−u sinφ + v cosφ) − ω²(u cosφ + v sinφ).
            let (second, square) = (&p.acceleration_s2, m.rate * m.rate);
            extra.linear[i].a = [
                nm2(outward * u[i] - by(&p.position, u)),
                nm2(-m.rate * by(&p.velocity_s, v)),
                nm2(square * by(second, u)),
                nm2(-acceleration * by(second, v)),
            ];
            extra.linear[i].b = [
                nm2(outward * v[i] - by(&p.position, v)),
                nm2(m.rate * by(&p.velocity_s, u)),
                nm2(square * by(second, v)),
                nm2(acceleration * by(second, u)),
            ];
            let fixed = p.position[i][0] * centre[0] + p.position[i][1] * centre[1];
            extra.linear[i].constant_nm = to_fixed(-fixed * 1e9, 0);
            let turn = m.rate * extra.lead_s(m);
            let (cos, sin) = (libm::cos(turn), libm::sin(turn));
            extra.ahead[i] = [nm2(v[i] * cos - u[i] * sin), nm2(-u[i] * cos - v[i] * sin)];
        }
        // u²/2³² in nm² times this over 2³² is c·u² in nm.
        extra.bow = p.bow_per_m.map(|c| to_fixed(-c * 1e-9 * 4_294_967_296.0, 32));
        extra.bowed = extra.bow != [0; 2];
        extra
    }

    /// For a line with a span (m), its start seen from the reference point (m).
    pub(crate) fn on_line(p: &Profile<f64>, m: &Motion, span: [f64; 3], start: [f64; 2]) -> Self {
        let mut extra = Self::unsteady(p, m);
        let nm2 = |metres: f64| to_fixed(metres * 1e9, 1);
        for i in 0..2 {
            let by = |matrix: &[[f64; 2]; 2], arm: [f64; 2]| matrix[i][0] * arm[0] + matrix[i][1] * arm[1];
            let along = [span[0], span[1]];
            let velocity = -m.rate * by(&p.velocity_s, along);
            let acceleration = -m.rate * FIRST / m.ramp_s * by(&p.acceleration_s2, along);
            extra.linear[i].a = [nm2(-by(&p.position, along)), nm2(velocity), 0, nm2(acceleration)];
            extra.linear[i].constant_nm = to_fixed(-by(&p.position, start) * 1e9, 0);
            extra.ahead[i] = [nm2(span[i]), 0];
        }
        extra
    }

    /// The terms that are the same on every curve.
    fn unsteady(p: &Profile<f64>, m: &Motion) -> Self {
        let nm2 = |metres: f64| to_fixed(metres * 1e9, 1);
        let half = |metres: f64| nm2(0.5 * metres);
        let mut extra = Self {
            cross: [
                [half(p.backlash_m[0]), half(p.lateral_m[1])],
                [half(-p.lateral_m[0]), half(p.backlash_m[1])],
            ],
            take_up_step: clock_step(libm::ceil(m.take_up_s / m.tick_s) as u32),
            ..Self::default()
        };
        let lead = extra.lead_s(m);
        for (i, spike) in p.spike.iter().enumerate() {
            if spike.peak_m != 0.0 {
                extra.spike[i] = to_fixed(spike.peak_m * libm::exp(lead / spike.decay_s) * 1e9, 8);
                extra.loss_q32[i] = to_fixed(-libm::expm1(-m.tick_s / spike.decay_s), 32);
            }
        }
        for (built, c) in extra.cyclic.iter_mut().zip(&p.cyclic) {
            let per_nm = 4.294_967_296 / c.pitch_m;
            let whole = libm::floor(per_nm);
            *built = Cyclic {
                amplitude: nm2(-c.amplitude_m),
                per_nm: whole as u32,
                per_nm_q32: ((per_nm - whole) * 4_294_967_296.0) as u32,
                phase: phase_from_rad(c.phase_rad),
                on_y: c.axis == 1,
            };
        }
        extra.sided = extra.cross != [[0; 2]; 2] || extra.spike != [0; 2];
        extra.periodic = extra.cyclic.iter().any(|c| c.amplitude != 0);
        extra
    }

    /// The middle of the take-up falls on the reversal.
    fn lead_s(&self, m: &Motion) -> f64 {
        0.5 * m.take_up_s
    }

    /// The linear terms at constant rate on an arc, nm·2: they cost the tick nothing.
    pub(crate) fn steady(&self, axis: usize) -> (i32, i32) {
        let Linear { a, b, .. } = self.linear[axis];
        (a[0].wrapping_add(a[1]).wrapping_add(a[2]), b[0].wrapping_add(b[1]).wrapping_add(b[2]))
    }

    /// [`Self::unsteady_at`] where the machine stands: sides and pulses stay as they are.
    pub(crate) fn standing_at(
        &self,
        sides: &Sides,
        ramp: &[i32; 4],
        nominal: [i32; 3],
        arm: [i32; 2],
    ) -> [i32; 2] {
        let frozen = Self { loss_q32: [0; 2], ..*self };
        frozen.unsteady_at(&mut sides.clone(), ramp, [0; 2], nominal, arm)
    }

    /// Indicators of the sense of X and Y. Asked for before anything branches: a product whose factors come from
    /// another block of code costs four instructions instead of one.
    #[inline(always)]
    pub(crate) fn ahead_at(&self, c: i32, s: i32) -> [i32; 2] {
        let [[xc, xs], [yc, ys]] = self.ahead;
        [mulh_add(mulh(xc, c), xs, s), mulh_add(mulh(yc, c), ys, s)]
    }

    /// Everything but the linear terms of an arc, nm: X and Y.
    #[inline(always)]
    pub(crate) fn unsteady_at(
        &self,
        sides: &mut Sides,
        ramp: &[i32; 4],
        ahead: [i32; 2],
        nominal: [i32; 3],
        arm: [i32; 2],
    ) -> [i32; 2] {
        let mut offset = [self.linear[0].constant_nm, self.linear[1].constant_nm];
        if self.sided {
            let mut sense = [0; 2];
            for (i, side) in sides.0.iter_mut().enumerate() {
                let (value, pulse) =
                    side.tick(ramp, ahead[i], self.take_up_step, self.spike[i], self.loss_q32[i]);
                sense[i] = value;
                offset[i] = offset[i].wrapping_add(pulse);
            }
            for (o, [by_x, by_y]) in offset.iter_mut().zip(self.cross) {
                *o = mulh_add(mulh_add(*o, by_x, sense[0]), by_y, sense[1]);
            }
        }
        if self.periodic {
            for cyclic in &self.cyclic {
                if cyclic.amplitude != 0 {
                    let at = if cyclic.on_y { nominal[1] } else { nominal[0] };
                    let fraction = (i64::from(at).wrapping_mul(i64::from(cyclic.per_nm_q32)) >> 32) as u32;
                    let phase = (at as u32).wrapping_mul(cyclic.per_nm).wrapping_add(fraction);
                    let (_, sine) = sincos(phase.wrapping_add(cyclic.phase));
                    let o = mulh(cyclic.amplitude, sine);
                    if cyclic.on_y {
                        offset[1] = offset[1].wrapping_add(o);
                    } else {
                        offset[0] = offset[0].wrapping_add(o);
                    }
                }
            }
        }
        if self.bowed {
            // Travel along X bows Y, and the other way round.
            offset[1] = mulh_add(offset[1], mulh(arm[0], arm[0]), self.bow[0]);
            offset[0] = mulh_add(offset[0], mulh(arm[1], arm[1]), self.bow[1]);
        }
        offset
    }
}

impl Linear {
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
        mulh_add(mulh_add(mulh(self.a[0], share), self.a[1], rate), self.a[3], turning)
    }
}

/// The senses in which X and Y travel, kept from segment to segment: play stays on its side at rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Sides([Side; 2]);

#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
struct Side {
    forward: bool,
    turning: bool,
    clock: Clock,
    /// ±1 in Q31, between them while the play is taken up; 0 as long as the axis has not moved.
    value: i32,
    from: i32,
    /// Friction pulse, nm·2⁸, and what was left of the one before when its onset began.
    pulse: i32,
    before: i32,
}

/// Indicators below this, nm, do not turn a side: the axis stands, or stands as good as still.
const DEAD_NM: i32 = 16;

impl Sides {
    /// Before a segment: an axis that never moved takes the side that the segment begins with.
    pub(crate) fn seed(&mut self, extra: &Extra, c: i32, s: i32) {
        for (side, ahead) in self.0.iter_mut().zip(extra.ahead_at(c, s)) {
            if side.value == 0 && !side.turning && ahead.unsigned_abs() > DEAD_NM as u32 {
                side.forward = ahead > 0;
                side.value = if side.forward { i32::MAX } else { -i32::MAX };
            }
        }
    }
}

impl Side {
    /// (sense in Q31, pulse in nm) after one more tick.
    #[inline(always)]
    fn tick(&mut self, p: &[i32; 4], ahead: i32, step: u64, spike: i32, loss_q32: i32) -> (i32, i32) {
        self.pulse = self.pulse.wrapping_sub(mulh(self.pulse, loss_q32));
        if self.turning {
            return self.turn(p, loss_q32);
        }
        let turn = if self.value >= 0 { ahead < -DEAD_NM } else { false }
            || if self.value <= 0 { ahead > DEAD_NM } else { false };
        if turn {
            let forward = ahead > 0;
            self.forward = forward;
            self.turning = true;
            self.from = self.value;
            self.clock = Clock::rising(step);
            self.before = self.pulse;
            // The axis lags behind its new sense: the correction goes ahead with it.
            self.pulse = if forward { spike } else { spike.wrapping_neg() };
            return self.turn(p, loss_q32);
        }
        (self.value, self.pulse >> 8)
    }

    /// A turn under way is finished before the next begins.
    #[inline(never)]
    fn turn(&mut self, p: &[i32; 4], loss_q32: i32) -> (i32, i32) {
        self.before = self.before.wrapping_sub(mulh(self.before, loss_q32));
        let (x, end) = self.clock.rise();
        if end {
            self.turning = false;
            self.value = if self.forward { i32::MAX } else { -i32::MAX };
            return (self.value, self.pulse >> 8);
        }
        let share = shapes(p, x).s_q31;
        let to = if self.forward { i32::MAX >> 1 } else { -(i32::MAX >> 1) };
        let way = mulh(share, i32::wrapping_sub(to, self.from >> 1)).wrapping_mul(4);
        self.value = self.from.wrapping_add(way);
        let change = mulh(self.pulse.wrapping_sub(self.before), share).wrapping_mul(2);
        (self.value, self.before.wrapping_add(change) >> 8)
    }
}
