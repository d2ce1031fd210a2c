//! Ticks of any curve: lines and helices.
use super::Executor;
use super::phase::{ramp_phase, scaled};
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
        let [x, y, z] = &self.segment.axes;
        let mut wanted = match self.segment.kind {
            Kind::Arc | Kind::Helix => [x.steady(c, s), y.steady(c, s), z.steady(c, s)],
            Kind::Line | Kind::Dwell | Kind::Clear => [0; 3],
        };
        let risen = self.risen(phase_q32);
        let nominal = self.place([c, s], phase_q32, &risen);
        if self.segment.extended {
            self.add_way(c, &risen, [i32::MAX, 0], &mut wanted);
            self.add_terms(c, s, &nominal, &mut wanted);
        }
        self.left = self.left.wrapping_sub(1);
        if self.left == 0 {
            self.begin_fall();
        }
        self.out(nominal, wanted, flag::MOVING | flag::CRUISE)
    }

    /// Adds the profile terms that are not linear. On a line there is no bow.
    #[inline(always)]
    fn add_terms(&mut self, c: i32, s: i32, nominal: &[i32; 3], wanted: &mut [i32; 3]) {
        self.sides.add(&self.segment.extra, c, s, wanted);
        self.by_place(nominal, c, s, wanted);
    }

    /// Adds the linear profile terms of a line, or those of the rise of a helix.
    #[inline(always)]
    fn add_way(&self, c: i32, risen: &[i32; 3], [rate, turning]: [i32; 2], wanted: &mut [i32; 3]) {
        let extra = &self.segment.extra;
        match self.segment.kind {
            Kind::Line => {
                for (w, linear) in wanted.iter_mut().zip(&extra.linear) {
                    *w = w.wrapping_add(linear.on_line(c, rate, turning));
                }
            }
            Kind::Helix => extra.add_rise(risen, rate, turning, wanted),
            Kind::Arc | Kind::Dwell | Kind::Clear => {}
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
    pub(super) fn any_stop(&mut self) -> Output {
        if self.stopped() {
            return self.standstill();
        }
        let (step, shape) = self.stop_tick();
        self.advance(step);
        self.shaped(&shape, self.falls, (self.phase >> 32) as u32)
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
        self.shaped(shape, falling, phase_q32)
    }

    /// At a phase and with the shapes of a ramp.
    #[inline(always)]
    fn shaped(&mut self, shape: &Shapes, falling: bool, phase_q32: u32) -> Output {
        let law = if falling {
            &self.fall
        } else {
            &self.segment.rise
        };
        let (c, s, mut wanted);
        if self.segment.kind == Kind::Line {
            let along = law.along(shape);
            (c, s) = self.weights(phase_q32);
            let [x, y, z] = &self.segment.axes;
            wanted = [mulh(x.v, along), mulh(y.v, along), mulh(z.v, along)];
        } else {
            let (radial, tangential) = law.gain(shape);
            (c, s) = sincos_with(self.sincos, phase_q32);
            let (re, im) = turn(radial, tangential, c, s);
            let [x, y, z] = &self.segment.axes;
            wanted = [x.turned(re, im), y.turned(re, im), z.turned(re, im)];
        }
        let risen = self.risen(phase_q32);
        let nominal = self.place([c, s], phase_q32, &risen);
        if self.segment.extended {
            let turning = if falling {
                shape.w4_q31.wrapping_neg()
            } else {
                shape.w4_q31
            };
            self.add_linear(c, s, shape.s_q31, turning, &mut wanted);
            self.add_way(c, &risen, [shape.s_q31, turning], &mut wanted);
            self.add_terms(c, s, &nominal, &mut wanted);
        }
        self.out(nominal, wanted, flag::MOVING)
    }

    /// Adds the linear profile terms of an arc.
    #[inline(always)]
    fn add_linear(&self, c: i32, s: i32, rate: i32, turning: i32, wanted: &mut [i32; 3]) {
        if matches!(self.segment.kind, Kind::Arc | Kind::Helix) {
            let extra = &self.segment.extra;
            extra.add_linear(rate, turning, [c, s], wanted);
        }
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

    /// Position at these weights and this phase, where the curve has risen so far, nm.
    #[inline(always)]
    pub(super) fn place(&self, [c, s]: [i32; 2], phase_q32: u32, risen: &[i32; 3]) -> [i32; 3] {
        let ([x, y, z], [rx, ry, rz]) = (&self.segment.axes, risen);
        match self.segment.kind {
            Kind::Dwell | Kind::Clear => self.rest_nm,
            Kind::Line => {
                let share = phase_q32 as i32;
                [x.on_line(share), y.on_line(share), z.on_line(share)]
            }
            Kind::Arc | Kind::Helix => [
                x.on_arc(c, s).wrapping_add(*rx),
                y.on_arc(c, s).wrapping_add(*ry),
                z.on_arc(c, s).wrapping_add(*rz),
            ],
        }
    }

    /// How far a helix has risen at a phase, nm: it is an arc of a program, which begins at phase 0.
    #[inline(always)]
    pub(super) fn risen(&self, phase_q32: u32) -> [i32; 3] {
        if self.segment.kind != Kind::Helix {
            return [0; 3];
        }
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
        self.segment.risen(turns, phase_q32)
    }

    /// Offset wanted, nm, standing at these weights.
    pub(super) fn standing_offset(&self, c: i32, s: i32) -> [i32; 3] {
        if !self.segment.extended {
            return [0; 3];
        }
        let mut offset = self.sides.standing();
        let rest = self.rest_nm;
        self.by_place(&rest, c, s, &mut offset);
        self.add_linear(c, s, 0, 0, &mut offset);
        // Before a segment begins the phase is still that of the last one: a helix has risen to where it stands.
        let ([x, y, z], [nx, ny, nz]) = (&self.segment.axes, rest);
        let risen = [
            nx.wrapping_sub(x.on_arc(c, s)),
            ny.wrapping_sub(y.on_arc(c, s)),
            nz.wrapping_sub(z.on_arc(c, s)),
        ];
        self.add_way(c, &risen, [0; 2], &mut offset);
        offset
    }
}
