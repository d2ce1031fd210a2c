//! Arcs in a tick of their own: the general one of `curve` takes up to 371 instructions for the β model and 832 with the
//! dearest terms, this one less than half. What it saves is branches on the kind of curve and passing shapes and weights from
//! function to function; what it computes is the same.
use super::phase::{ramp_phase, scaled};
use super::{Executor, Mode};
use crate::engine::planned::turn;
use crate::engine::ramp::{Shapes, shapes};
use crate::engine::{Output, flag};
use core::sync::atomic::{Ordering, compiler_fence};
use giotto_shared::angle::sincos_with;

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
        let wanted = [x.steady(c, s), y.steady(c, s), z.steady(c, s)];
        if TERMS {
            let mut wanted = wanted;
            return self.term_out(c, s, &mut wanted, flag::MOVING | flag::CRUISE);
        }
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
        self.arc_shaped::<TERMS>(&shape, FALLING, phase_q32)
    }

    /// A stop: as a ramp, at the rate of its own.
    #[inline(always)]
    pub(super) fn arc_stop<const TERMS: bool>(&mut self) -> Output {
        if self.stopped() {
            return self.arc_standstill();
        }
        let (step, shape) = self.stop_tick();
        self.phase = self.phase.wrapping_add(step);
        compiler_fence(Ordering::AcqRel);
        self.arc_shaped::<TERMS>(&shape, self.falls, (self.phase >> 32) as u32)
    }

    /// At a phase and with the shapes of a ramp.
    #[inline(always)]
    fn arc_shaped<const TERMS: bool>(
        &mut self,
        shape: &Shapes,
        falls: bool,
        phase_q32: u32,
    ) -> Output {
        let law = if falls {
            &self.fall
        } else {
            &self.segment.rise
        };
        let (radial, tangential) = law.gain(shape);
        let (c, s) = sincos_with(self.sincos, phase_q32);
        let (re, im) = turn(radial, tangential, c, s);
        let [x, y, z] = &self.segment.axes;
        let mut wanted = [x.turned(re, im), y.turned(re, im), z.turned(re, im)];
        if TERMS {
            let turning = if falls {
                shape.w4_q31.wrapping_neg()
            } else {
                shape.w4_q31
            };
            let extra = &self.segment.extra;
            extra.add_linear(shape.s_q31, turning, [c, s], &mut wanted);
            return self.term_out(c, s, &mut wanted, flag::MOVING);
        }
        self.arc_out(c, s, wanted, flag::MOVING)
    }

    /// The offset first, the position last: so the tick needs the fewest registers. The rare case is a call with
    /// scalar arguments: arrays would pass through memory in every tick.
    #[inline(always)]
    fn arc_out(&mut self, c: i32, s: i32, [wx, wy, wz]: [i32; 3], flags: u16) -> Output {
        if !self.guard.pass_easily([wx, wy, wz]) {
            return self.arc_out_with_care(c, s, wx, wy, wz, flags);
        }
        Output::new(self.on_arc(c, s), [wx, wy, wz], flags)
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
        self.finish(self.on_arc(c, s), [wx, wy, wz], flags)
    }

    /// Adds the profile terms that are not linear.
    #[inline(never)]
    fn term_out(&mut self, c: i32, s: i32, wanted: &mut [i32; 3], flags: u16) -> Output {
        self.sides.add(&self.segment.extra, c, s, wanted);
        let nominal = self.on_arc(c, s);
        self.by_place(&nominal, c, s, wanted);
        self.out(nominal, *wanted, flags)
    }

    /// Adds the profile terms that go by the place on an arc.
    #[inline(always)]
    pub(super) fn by_place(&self, nominal: &[i32; 3], c: i32, s: i32, wanted: &mut [i32; 3]) {
        let extra = &self.segment.extra;
        extra.add_periodic(self.sincos, nominal, wanted);
        if extra.bowed {
            let [x, y, z] = &self.segment.axes;
            let arm = [x.turned(c, s), y.turned(c, s), z.turned(c, s)];
            extra.add_bow(&arm, wanted);
        }
    }

    /// The last tick: at its end exactly.
    #[inline(never)]
    fn arc_standstill(&mut self) -> Output {
        let terms = matches!(self.mode, Mode::TermFall | Mode::TermStop);
        self.mode = Mode::Rest;
        // A stop and a feed hold end elsewhere than was planned.
        let planned = self.end == self.segment.timing.end && self.pausing.is_none();
        self.phase = self.end;
        self.stands();
        let mut wanted = [0; 3];
        if terms || !planned {
            let (c, s) = sincos_with(self.sincos, (self.end >> 32) as u32);
            self.rest_nm = self.on_arc(c, s);
            wanted = self.standing_offset(c, s);
        }
        if planned {
            self.rest_nm = self.segment.end_nm;
        }
        self.rest_offset_nm = wanted;
        self.out(self.rest_nm, wanted, flag::MOVING)
    }

    #[inline(always)]
    fn on_arc(&self, c: i32, s: i32) -> [i32; 3] {
        let [x, y, z] = &self.segment.axes;
        [x.on_arc(c, s), y.on_arc(c, s), z.on_arc(c, s)]
    }
}
