//! Ticks of any curve: lines, helices, and a stop in a rising ramp of anything.
use super::phase::{ramp_phase, scaled};
use super::{Executor, Mode};
use crate::engine::planned::{Kind, turn};
use crate::engine::ramp::{Shapes, shapes};
use crate::engine::{Output, flag};
use giotto_shared::angle::sincos_with;
use giotto_shared::fixed::mulh;

impl Executor {
    #[inline(never)]
    pub(super) fn cruise(&mut self) -> Output {
        self.advance(self.segment.timing.step);
        let phase_q32 = (self.phase >> 32) as u32;
        let (c, s) = self.weights(phase_q32);
        let nominal = self.place(c, s, phase_q32);
        let [x, y, z] = &self.segment.axes;
        let mut wanted = match self.segment.kind {
            Kind::Arc | Kind::Helix => [x.steady(c, s), y.steady(c, s), z.steady(c, s)],
            Kind::Line | Kind::Dwell | Kind::Clear => [0; 3],
        };
        if self.segment.extended {
            wanted = self.with_way(c, s, nominal, i32::MAX, 0, wanted);
            wanted = self.with_terms(c, s, nominal, wanted);
        }
        self.left = self.left.wrapping_sub(1);
        if self.left == 0 {
            self.begin_fall();
        }
        self.out(nominal, wanted, flag::MOVING | flag::CRUISE)
    }

    /// Adds the profile terms that are not linear.
    #[inline(always)]
    fn with_terms(&mut self, c: i32, s: i32, nominal: [i32; 3], wanted: [i32; 3]) -> [i32; 3] {
        let extra = &self.segment.extra;
        let offset = sum(wanted, self.sides.tick(extra, c, s));
        extra.by_place(&self.sincos, nominal, || self.arm(c, s), offset)
    }

    /// Distance from the centre of an arc, nm.
    #[inline(always)]
    fn arm(&self, c: i32, s: i32) -> [i32; 3] {
        let [x, y, z] = &self.segment.axes;
        match self.segment.kind {
            Kind::Arc | Kind::Helix => [x.turned(c, s), y.turned(c, s), z.turned(c, s)],
            Kind::Line | Kind::Dwell | Kind::Clear => [0; 3],
        }
    }

    /// Adds the linear profile terms of a line, or those of the rise of a helix.
    #[inline(always)]
    fn with_way(
        &self,
        c: i32,
        s: i32,
        nominal: [i32; 3],
        rate: i32,
        turning: i32,
        wanted: [i32; 3],
    ) -> [i32; 3] {
        match self.segment.kind {
            Kind::Line => {
                let [x, y, z] = &self.segment.extra.linear;
                let along = [
                    x.on_line(c, rate, turning),
                    y.on_line(c, rate, turning),
                    z.on_line(c, rate, turning),
                ];
                sum(wanted, along)
            }
            Kind::Helix => self.with_rise(c, s, nominal, rate, turning, wanted),
            Kind::Arc | Kind::Dwell | Kind::Clear => wanted,
        }
    }

    #[inline(never)]
    fn with_rise(
        &self,
        c: i32,
        s: i32,
        [nx, ny, nz]: [i32; 3],
        rate: i32,
        turning: i32,
        wanted: [i32; 3],
    ) -> [i32; 3] {
        let [x, y, z] = &self.segment.axes;
        let risen = [
            nx.wrapping_sub(x.on_arc(c, s)),
            ny.wrapping_sub(y.on_arc(c, s)),
            nz.wrapping_sub(z.on_arc(c, s)),
        ];
        let [x, y, z] = &self.segment.extra.rising;
        let offset = [
            x.offset(risen, rate, turning),
            y.offset(risen, rate, turning),
            z.offset(risen, rate, turning),
        ];
        sum(wanted, offset)
    }

    #[inline(never)]
    pub(super) fn any_ramp(&mut self, falling: bool) -> Output {
        let (x, end) = if falling {
            self.clock.fall()
        } else {
            self.clock.rise()
        };
        if end {
            return if falling {
                self.standstill()
            } else {
                self.top()
            };
        }
        self.ramp_at(&shapes(&self.ramp, x), falling)
    }

    #[inline(never)]
    pub(super) fn both(&mut self) -> Output {
        let (x, end) = self.clock.rise();
        let (later, _) = self.second.rise();
        if end {
            // The rising ramp is over: what remains is the falling one alone.
            self.clock = self.second.mirrored();
            self.mode = Mode::Fall;
            let shape = shapes(&self.ramp, self.clock.here());
            return self.ramp_at(&shape, true);
        }
        self.ramp_at(
            &shapes(&self.ramp, x).minus(shapes(&self.ramp, later)),
            false,
        )
    }

    /// One tick of a ramp on any curve.
    #[inline(never)]
    fn ramp_at(&mut self, shape: &Shapes, falling: bool) -> Output {
        let step = scaled(self.segment.timing.step_q1, shape.s_q31);
        self.advance(step);
        let law = if falling {
            &self.fall
        } else {
            &self.segment.rise
        };
        let phase_q32 = ramp_phase(self.phase, step, law.end_term(shape));
        let (c, s) = self.weights(phase_q32);
        let nominal = self.place(c, s, phase_q32);
        let [x, y, z] = &self.segment.axes;
        let mut wanted = if self.segment.kind == Kind::Line {
            let along = law.along(shape);
            [mulh(x.v, along), mulh(y.v, along), mulh(z.v, along)]
        } else {
            let (radial, tangential) = law.gain(shape);
            let (re, im) = turn(radial, tangential, c, s);
            [x.turned(re, im), y.turned(re, im), z.turned(re, im)]
        };
        if self.segment.extended {
            let turning = if falling {
                shape.w4_q31.wrapping_neg()
            } else {
                shape.w4_q31
            };
            wanted = self.with_linear(c, s, shape.s_q31, turning, wanted);
            wanted = self.with_way(c, s, nominal, shape.s_q31, turning, wanted);
            wanted = self.with_terms(c, s, nominal, wanted);
        }
        self.out(nominal, wanted, flag::MOVING)
    }

    /// Adds the linear profile terms of an arc.
    #[inline(always)]
    fn with_linear(&self, c: i32, s: i32, rate: i32, turning: i32, wanted: [i32; 3]) -> [i32; 3] {
        if !matches!(self.segment.kind, Kind::Arc | Kind::Helix) {
            return wanted;
        }
        let rate2 = mulh(rate, rate).wrapping_mul(2);
        let [x, y, z] = &self.segment.extra.linear;
        let slides = [
            x.on_arc(rate, rate2, turning, c, s),
            y.on_arc(rate, rate2, turning, c, s),
            z.on_arc(rate, rate2, turning, c, s),
        ];
        sum(wanted, slides)
    }

    /// Weights of a curve's two vectors, Q31: cosine and sine, or the share of a line.
    #[inline(always)]
    pub(super) fn weights(&self, phase_q32: u32) -> (i32, i32) {
        if self.segment.kind == Kind::Line {
            // The phase of a line is its share in Q30; rounding may carry it past either end.
            let share_q30 = (phase_q32 as i32).clamp(-(1 << 30), (1 << 30) - 1);
            (share_q30.wrapping_mul(2), 0)
        } else {
            sincos_with(self.sincos, phase_q32)
        }
    }

    /// Position, nm.
    #[inline(always)]
    pub(super) fn place(&self, c: i32, s: i32, phase_q32: u32) -> [i32; 3] {
        let [x, y, z] = &self.segment.axes;
        match self.segment.kind {
            Kind::Dwell | Kind::Clear => self.rest_nm,
            Kind::Line => {
                let share = phase_q32 as i32;
                [x.on_line(share), y.on_line(share), z.on_line(share)]
            }
            Kind::Arc => [x.on_arc(c, s), y.on_arc(c, s), z.on_arc(c, s)],
            Kind::Helix => {
                self.on_helix([x.on_arc(c, s), y.on_arc(c, s), z.on_arc(c, s)], phase_q32)
            }
        }
    }

    #[inline(never)]
    fn on_helix(&self, flat: [i32; 3], phase_q32: u32) -> [i32; 3] {
        // In a ramp the sum of steps is a little ahead of the phase, at its very end a little behind: the one may have
        // passed a whole turn and the other not.
        let sum_q32 = (self.phase >> 32) as u32;
        let ahead = sum_q32.wrapping_sub(phase_q32) as i32;
        let early = ahead > 0 && sum_q32 < phase_q32;
        let late = ahead < 0 && sum_q32 > phase_q32;
        let turns = self
            .turns
            .wrapping_add(i32::from(late))
            .wrapping_sub(i32::from(early));
        let [x, y, z] = self.segment.risen(turns, phase_q32);
        let [bx, by, bz] = self
            .segment
            .risen(0, (self.segment.timing.start >> 32) as u32);
        let [fx, fy, fz] = flat;
        let add = |f: i32, r: i32, b: i32| f.wrapping_add(r).wrapping_sub(b);
        [add(fx, x, bx), add(fy, y, by), add(fz, z, bz)]
    }

    /// Offset wanted, nm, standing at these weights.
    pub(super) fn standing_offset(&self, c: i32, s: i32) -> [i32; 3] {
        if !self.segment.extended {
            return [0; 3];
        }
        let sides = self.sides.standing();
        let extra = &self.segment.extra;
        let offset = extra.by_place(&self.sincos, self.rest_nm, || self.arm(c, s), sides);
        let offset = self.with_linear(c, s, 0, 0, offset);
        self.with_way(c, s, self.rest_nm, 0, 0, offset)
    }
}

#[inline(always)]
fn sum([a, b, c]: [i32; 3], [x, y, z]: [i32; 3]) -> [i32; 3] {
    [a.wrapping_add(x), b.wrapping_add(y), c.wrapping_add(z)]
}
