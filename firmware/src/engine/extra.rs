//! Profile terms in fixed point: what a zone with profile terms adds to the tick.
use super::ramp::FIRST;
use super::sides::FINE;
use core::f64::consts::TAU;
use core::sync::atomic::{Ordering, compiler_fence};
use giotto_shared::angle::{phase_from_rad, sincos_with};
use giotto_shared::fixed::{mulh, mulh_add, to_fixed};
use giotto_shared::law::Profile;

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
    amplitude: [i32; 2],
    /// Units of 2⁻³² turn per nm: nearest whole number, and the rest (Q32).
    per_nm: [i32; 2],
    rest_q32: [i32; 2],
    phase: u32,
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
    fits: bool,
    /// Indicator of the sense of X and Y: `[0]·cosφ + [1]·sinφ`, a little ahead of the phase.
    pub(crate) ahead: [[i32; 2]; 2],
    pub(crate) turning: Turning,
    /// Offset of X and Y that nothing changes, in [`FINE`] nm.
    pub(crate) constant_fine: [i32; 2],
    cyclic: [Cyclic; 2],
    /// Opposite of the bow, Q31 for u²/2³² in nm, by the axis of travel.
    bow: [i32; 2],
    /// Anything that depends on the sense of an axis.
    sided: bool,
    /// Periodic errors, and any bow.
    periodic: u8,
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
            extra.constant_fine[i] = to_fixed(-fixed * 1e9, FINE);
            let turn = m.rate * extra.lead_s(m);
            let (cos, sin) = (libm::cos(turn), libm::sin(turn));
            extra.ahead[i] = [nm2(v[i] * cos - u[i] * sin), nm2(-u[i] * cos - v[i] * sin)];
        }
        // u²/2³¹ in nm² times this over 2³² is c·u² in nm.
        extra.bow = p.bow_per_m.map(|c| to_fixed(-c * 1e-9 * 4_294_967_296.0, 31));
        extra.bowed = extra.bow != [0; 2];
        let ([[slow, _], _], [[second, _], _]) = (p.velocity_s, p.acceleration_s2);
        let shares = [-slow * m.rate, -second * acceleration, second * m.rate * m.rate, 0.5 * outward];
        let [by_rate, by_change, radial, _] = shares.map(|share| to_fixed(share, 33));
        let place = |i: usize, arm: [f64; 3]| nm2(-p.position[i][0] * arm[0] - p.position[i][1] * arm[1]);
        extra.moving = Moving {
            place: [[place(0, u), place(0, v)], [place(1, u), place(1, v)]],
            tangential: [by_rate, by_change],
            radial,
            outward: to_fixed(outward, 32),
        };
        let opposite = |[[a, b], [c, d]]: [[f64; 2]; 2]| a == -d && b == 0.0 && c == 0.0;
        extra.fits = opposite(p.velocity_s)
            && opposite(p.acceleration_s2)
            && shares.iter().all(|share| libm::fabs(*share) < 0.24)
            && extra.within_numbers();
        extra
    }

    /// Whether sides and constants are within the 8 mm of their numbers, with room for their sum.
    pub(crate) fn within_numbers(&self) -> bool {
        let t = &self.turning;
        let small = |fine: &i32| fine.unsigned_abs() < 1 << 28;
        self.constant_fine.iter().chain(t.side.iter().flatten()).chain(&t.spike).all(small)
    }

    /// Whether the fast tick can run it.
    pub(crate) const fn fits(&self) -> bool {
        self.fits
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
            extra.constant_fine[i] = to_fixed(-by(&p.position, start) * 1e9, FINE);
            extra.ahead[i] = [nm2(span[i]), 0];
        }
        extra
    }

    /// The terms that are the same on every curve.
    fn unsteady(p: &Profile<f64>, m: &Motion) -> Self {
        let nm2 = |metres: f64| to_fixed(metres * 1e9, 1);
        let ticks = take_up_ticks(m);
        let share = 3.75 / f64::from(ticks);
        let mut extra = Self::default();
        // By the sense of X, then of Y.
        let sides = [[p.backlash_m[0], -p.lateral_m[0]], [p.lateral_m[1], p.backlash_m[1]]];
        let fine = |metres: f64| to_fixed(metres * 1e9, FINE);
        extra.turning = Turning {
            ticks,
            dx: to_fixed(2.0 / f64::from(ticks), 31),
            first_x: to_fixed(1.0 / f64::from(ticks) - 1.0, 31),
            share_q30: to_fixed(share, 30),
            side: sides.map(|axis| axis.map(fine)),
            jump: sides.map(|axis| axis.map(|b| fine(b * share))),
            ..Turning::default()
        };
        for (i, spike) in p.spike.iter().enumerate() {
            if spike.peak_m != 0.0 {
                extra.turning.spike[i] = fine(spike.peak_m);
                extra.turning.fade[i] = to_fixed(libm::expm1(-m.tick_s / spike.decay_s), 32);
            }
        }
        let mut periodic = 0;
        let cyclic = p.cyclic.iter().filter(|c| c.amplitude_m != 0.0);
        for (built, c) in extra.cyclic.iter_mut().zip(cyclic) {
            let axis = |value: i32| if c.axis == 1 { [0, value] } else { [value, 0] };
            let per_nm = 4.294_967_296 / c.pitch_m;
            let whole = libm::round(per_nm);
            *built = Cyclic {
                amplitude: axis(nm2(-c.amplitude_m)),
                per_nm: axis(whole as i64 as i32),
                rest_q32: axis(to_fixed(per_nm - whole, 32)),
                phase: phase_from_rad(c.phase_rad),
            };
            periodic += 1;
        }
        extra.periodic = periodic;
        extra.sided = sides != [[0.0; 2]; 2] || extra.turning.spike != [0; 2];
        extra
    }

    /// The middle of the take-up falls on the reversal: it is noticed half a tick late on average, and the
    /// take-up begins in the next tick.
    fn lead_s(&self, m: &Motion) -> f64 {
        (0.5 * f64::from(self.turning.ticks) + 0.5) * m.tick_s
    }

    /// Whether anything depends on the sense of an axis.
    pub(crate) const fn sided(&self) -> bool {
        self.sided
    }

    /// Offset bound (m) and slew bound (m/s) of all terms together on an arc: the sum of each one's own largest.
    pub(crate) fn worst_on_arc(p: &Profile<f64>, m: &Motion, radius: f64, centre: [f64; 2]) -> [f64; 2] {
        let row = |matrix: &[[f64; 2]; 2]| {
            matrix.iter().map(|[a, b]| libm::fabs(*a) + libm::fabs(*b)).fold(0.0, f64::max)
        };
        let (rate, ramp) = (m.rate, m.rate / m.ramp_s);
        let (speed, acceleration) = (radius * rate, radius * (rate * rate + FIRST * ramp));
        let jerk = radius * (rate * rate * rate + 3.0 * FIRST * rate * ramp + 10.0 * ramp / m.ramp_s);
        let reach = radius + libm::fabs(centre[0]) + libm::fabs(centre[1]);
        let outward = libm::fabs(p.radius_offset_m);
        let (position, velocity) = (row(&p.position), row(&p.velocity_s));
        let second = row(&p.acceleration_s2);
        let mut offset = outward + position * reach + velocity * speed + second * acceleration;
        let mut slew = outward * rate + position * speed + velocity * acceleration + second * jerk;
        // Smoothstep of degree 5: 15/8 of the mean slope.
        let steep = 1.875 / (f64::from(take_up_ticks(m)) * m.tick_s);
        for play in p.backlash_m.iter().chain(&p.lateral_m) {
            offset += 0.5 * libm::fabs(*play);
            slew += libm::fabs(*play) * steep;
        }
        for spike in p.spike.iter().filter(|spike| spike.peak_m != 0.0) {
            let peak = libm::fabs(spike.peak_m);
            offset += peak;
            slew += peak * (2.0 * steep + 1.0 / spike.decay_s);
        }
        for c in p.cyclic.iter().filter(|c| c.amplitude_m != 0.0) {
            offset += libm::fabs(c.amplitude_m);
            slew += libm::fabs(c.amplitude_m) * TAU / c.pitch_m * speed;
        }
        for bow in p.bow_per_m {
            offset += libm::fabs(bow) * radius * radius;
            slew += 2.0 * libm::fabs(bow) * radius * speed;
        }
        [offset, slew]
    }

    /// The linear terms at constant rate on an arc, nm·2: they cost the tick nothing.
    pub(crate) fn steady(&self, axis: usize) -> (i32, i32) {
        let Linear { a, b, .. } = self.linear[axis];
        (a[0].wrapping_add(a[1]).wrapping_add(a[2]), b[0].wrapping_add(b[1]).wrapping_add(b[2]))
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
        let whole = nx.wrapping_mul(px).wrapping_add(ny.wrapping_mul(py)).wrapping_add(self.phase as i32);
        let phase = mulh_add(mulh_add(whole, nx, rx), ny, ry);
        let (_, sine) = sincos_with(*sincos, phase as u32);
        let [ax, ay] = self.amplitude;
        [mulh_add(ox, ax, sine), mulh_add(oy, ay, sine)]
    }
}

/// Ticks of a take-up.
fn take_up_ticks(m: &Motion) -> u32 {
    (libm::ceil(m.take_up_s / m.tick_s) as u32).clamp(3, 1 << 20)
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
