//! Ticks of arcs whose offset, and its change, the planner proved to be within their bounds: the fast ones.
use super::phase::{ramp_phase, scaled};
use super::{Executor, Mode};
use crate::engine::planned::turn;
use crate::engine::ramp::shapes;
use crate::engine::{Output, flag};
use core::sync::atomic::{Ordering, compiler_fence};
use giotto_shared::angle::sincos_with;
use giotto_shared::fixed::{mulh, mulh_add, mulh_sub};

impl Executor {
    #[inline(always)]
    pub(super) fn arc_cruise<const TERMS: bool>(&mut self) -> Output {
        let phase = self.phase.wrapping_add(self.segment.timing.step);
        self.phase = phase;
        self.left = self.left.wrapping_sub(1);
        if self.left == 0 {
            self.begin_fall();
        }
        let (c, s) = sincos_with(self.sincos, (phase >> 32) as u32);
        let [x, y, z] = &self.segment.axes;
        if TERMS {
            (self.at_nm[0], self.wanted_nm[0]) = (x.on_arc(c, s), x.steady(c, s));
            (self.at_nm[1], self.wanted_nm[1]) = (y.on_arc(c, s), y.steady(c, s));
            (self.at_nm[2], self.wanted_nm[2]) = (z.on_arc(c, s), z.steady(c, s));
            compiler_fence(Ordering::AcqRel);
            return self.term_out(c, s, flag::MOVING | flag::CRUISE);
        }
        let wanted = [x.steady(c, s), y.steady(c, s), z.steady(c, s)];
        self.arc_out(c, s, wanted, flag::MOVING | flag::CRUISE)
    }

    #[inline(always)]
    pub(super) fn arc_ramp<const TERMS: bool, const FALLING: bool>(&mut self) -> Output {
        let (x, end) = if FALLING {
            self.clock.fall()
        } else {
            self.clock.rise()
        };
        if end {
            return if FALLING {
                self.arc_standstill()
            } else {
                self.top()
            };
        }
        let shape = shapes(&self.ramp, x);
        let step = scaled(self.segment.timing.step_q1, shape.s_q31);
        self.phase = self.phase.wrapping_add(step);
        // The phase is put away before the law is begun: both at once do not fit into the registers.
        compiler_fence(Ordering::AcqRel);
        let law = if FALLING {
            &self.fall
        } else {
            &self.segment.rise
        };
        let phase_q32 = ramp_phase(self.phase, step, law.end_term(&shape));
        let (radial, tangential) = law.gain(&shape);
        let (c, s) = sincos_with(self.sincos, phase_q32);
        if TERMS {
            let turning = if FALLING {
                shape.w4_q31.wrapping_neg()
            } else {
                shape.w4_q31
            };
            let moving = &self.segment.extra.moving;
            let radial = radial.wrapping_add(moving.outward);
            let (re, im) = turn(radial, tangential, c, s);
            let [by_rate, by_change] = moving.tangential;
            let along = mulh_add(mulh(by_rate, shape.s_q31), by_change, turning);
            let rate2 = mulh(shape.s_q31, shape.s_q31).wrapping_mul(2);
            // One piece after the other and its result put away: all at once they do not fit into the registers.
            self.shares = [re, im, along, mulh(moving.radial, rate2)];
            compiler_fence(Ordering::AcqRel);
            let segment = &self.segment;
            let [x, y, z] = &segment.axes;
            let [[xc, xs], [yc, ys]] = segment.extra.moving.place;
            let [re, im, along, outward] = self.shares;
            let wanted = mulh_add(mulh_add(x.turned(re, im), xc, c), xs, s);
            let (wanted, arm) = (
                mulh_add(wanted, along, x.turned(s.wrapping_neg(), c)),
                x.turned(c, s),
            );
            (self.at_nm[0], self.wanted_nm[0]) =
                (x.base.wrapping_add(arm), mulh_add(wanted, outward, arm));
            compiler_fence(Ordering::AcqRel);
            let [re, im, along, outward] = self.shares;
            let wanted = mulh_add(mulh_add(y.turned(re, im), yc, c), ys, s);
            let (wanted, arm) = (
                mulh_sub(wanted, along, y.turned(s.wrapping_neg(), c)),
                y.turned(c, s),
            );
            (self.at_nm[1], self.wanted_nm[1]) =
                (y.base.wrapping_add(arm), mulh_sub(wanted, outward, arm));
            compiler_fence(Ordering::AcqRel);
            let [re, im, ..] = self.shares;
            (self.at_nm[2], self.wanted_nm[2]) = (z.on_arc(c, s), z.turned(re, im));
            compiler_fence(Ordering::AcqRel);
            return self.term_out(c, s, flag::MOVING);
        }
        let (re, im) = turn(radial, tangential, c, s);
        let [x, y, z] = &self.segment.axes;
        let wanted = [x.turned(re, im), y.turned(re, im), z.turned(re, im)];
        self.arc_out(c, s, wanted, flag::MOVING)
    }

    /// The offset first, the position last: so the tick needs the fewest registers. The rare case is a call with
    /// scalar arguments: arrays would pass through memory in every tick.
    #[inline(always)]
    fn arc_out(&mut self, c: i32, s: i32, [wx, wy, wz]: [i32; 3], flags: u16) -> Output {
        let [x, y, z] = &self.segment.axes;
        if !self.guard.small([wx, wy, wz]) {
            return self.arc_out_with_care(c, s, wx, wy, wz, flags);
        }
        Output::new(
            [x.on_arc(c, s), y.on_arc(c, s), z.on_arc(c, s)],
            [wx, wy, wz],
            flags,
        )
    }

    /// Adds to what was put away the profile terms that are not linear.
    #[inline(always)]
    fn term_out(&mut self, c: i32, s: i32, flags: u16) -> Output {
        let [sx, sy] = self.sides.tick(&self.segment.extra, c, s);
        let [nx, ny, nz] = self.at_nm;
        let [wx, wy, wz] = self.wanted_nm;
        let (wx, wy) = (wx.wrapping_add(sx), wy.wrapping_add(sy));
        let [wx, wy] =
            self.segment
                .extra
                .by_place(&self.sincos, [nx, ny], || self.arm_here(), [wx, wy]);
        if !self.guard.small([wx, wy, wz]) {
            return self.term_out_with_care(wx, wy, wz, flags);
        }
        Output::new([nx, ny, nz], [wx, wy, wz], flags)
    }

    #[inline(never)]
    fn term_out_with_care(&mut self, wx: i32, wy: i32, wz: i32, flags: u16) -> Output {
        self.finish(self.at_nm, [wx, wy, wz], flags)
    }

    /// Distance from the centre, nm, X and Y.
    #[inline(always)]
    fn arm_here(&self) -> [i32; 2] {
        let ([x, y, _], [nx, ny, _]) = (&self.segment.axes, self.at_nm);
        [nx.wrapping_sub(x.base), ny.wrapping_sub(y.base)]
    }

    #[inline(never)]
    fn arc_out_with_care(
        &mut self,
        c: i32,
        s: i32,
        wx: i32,
        wy: i32,
        wz: i32,
        flags: u16,
    ) -> Output {
        let axes = &self.segment.axes;
        let nominal = [
            axes[0].on_arc(c, s),
            axes[1].on_arc(c, s),
            axes[2].on_arc(c, s),
        ];
        self.finish(nominal, [wx, wy, wz], flags)
    }

    /// The last tick: at its end exactly.
    #[inline(never)]
    pub(super) fn arc_standstill(&mut self) -> Output {
        let terms = self.mode == Mode::TermFall;
        self.mode = Mode::Rest;
        // A stop and a feed hold end elsewhere than was planned.
        let planned = self.end == self.segment.timing.end && self.pausing.is_none();
        self.phase = self.end;
        self.stands();
        let mut wanted = [0; 3];
        if terms || !planned {
            let (c, s) = sincos_with(self.sincos, (self.end >> 32) as u32);
            let [x, y, z] = &self.segment.axes;
            self.rest_nm = [x.on_arc(c, s), y.on_arc(c, s), z.on_arc(c, s)];
            wanted = self.standing_offset(c, s);
        }
        if planned {
            self.rest_nm = self.segment.end_nm;
        }
        self.rest_offset_nm = wanted;
        if self.guard.rest(wanted) {
            return Output::new(self.rest_nm, wanted, flag::MOVING);
        }
        self.finish(self.rest_nm, wanted, flag::MOVING)
    }
}
