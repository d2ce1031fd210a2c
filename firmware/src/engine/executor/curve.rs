//! Ticks of any curve: lines, helices, arcs whose bounds the planner could not prove, and a stop in a rising ramp.
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
            if self.segment.kind == Kind::Line {
                let [x, y, _] = &self.segment.extra.linear;
                wanted[0] = wanted[0].wrapping_add(x.on_line(c, i32::MAX, 0));
                wanted[1] = wanted[1].wrapping_add(y.on_line(c, i32::MAX, 0));
            }
            wanted = self.with_terms(c, s, nominal, wanted);
        }
        self.left = self.left.wrapping_sub(1);
        if self.left == 0 {
            self.begin_fall();
        }
        self.out(nominal, wanted, flag::MOVING | flag::CRUISE)
    }

    /// Adds the profile terms that are not linear.
    #[inline(never)]
    fn with_terms(&mut self, c: i32, s: i32, nominal: [i32; 3], wanted: [i32; 3]) -> [i32; 3] {
        let (arm, extra) = (self.arm(c, s), &self.segment.extra);
        let ([nx, ny, _], [wx, wy, wz]) = (nominal, wanted);
        let [sx, sy] = self.sides.tick(extra, c, s);
        let offset = [wx.wrapping_add(sx), wy.wrapping_add(sy)];
        let [wx, wy] = extra.by_place(&self.sincos, [nx, ny], || arm, offset);
        [wx, wy, wz]
    }

    /// Distance from the centre of an arc, nm, X and Y.
    #[inline(always)]
    pub(super) fn arm(&self, c: i32, s: i32) -> [i32; 2] {
        let [x, y, _] = &self.segment.axes;
        match self.segment.kind {
            Kind::Arc | Kind::Helix => [x.turned(c, s), y.turned(c, s)],
            Kind::Line | Kind::Dwell | Kind::Clear => [0; 2],
        }
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
            wanted = self.with_terms(c, s, nominal, wanted);
        }
        self.out(nominal, wanted, flag::MOVING)
    }

    /// Adds the linear profile terms.
    #[inline(always)]
    fn with_linear(&self, c: i32, s: i32, rate: i32, turning: i32, wanted: [i32; 3]) -> [i32; 3] {
        let [x, y, z] = &self.segment.extra.linear;
        let [wx, wy, wz] = wanted;
        if self.segment.kind == Kind::Line {
            let (ex, ey) = (x.on_line(c, rate, turning), y.on_line(c, rate, turning));
            return [wx.wrapping_add(ex), wy.wrapping_add(ey), wz];
        }
        let rate2 = mulh(rate, rate).wrapping_mul(2);
        let (ex, ey) = (
            x.on_arc(rate, rate2, turning, c, s),
            y.on_arc(rate, rate2, turning, c, s),
        );
        [
            wx.wrapping_add(ex),
            wy.wrapping_add(ey),
            wz.wrapping_add(z.at_rest(c, s)),
        ]
    }

    /// Weights of a curve's two vectors, Q31: cosine and sine, or the share of a line.
    #[inline(always)]
    pub(super) fn weights(&self, phase_q32: u32) -> (i32, i32) {
        if self.segment.kind == Kind::Line {
            ((phase_q32 >> 1) as i32, 0)
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
        let [nx, ny, _] = self.rest_nm;
        let offset = self.sides.standing();
        let [wx, wy] =
            self.segment
                .extra
                .by_place(&self.sincos, [nx, ny], || self.arm(c, s), offset);
        self.with_linear(c, s, 0, 0, [wx, wy, 0])
    }
}
