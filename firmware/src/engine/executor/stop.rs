//! Stops: along the path, slowed down by a law of their own.
//!
//! The shapes of a ramp in which a stop begins run on to its end and only the rate is the stop's: so the correction stays as smooth as
//! the ramp was, and what of it hangs on the rate follows the rate.
use super::phase::scaled;
use super::{Executor, Mode};
use crate::engine::descent::{Descent, Slowing};
use crate::engine::ramp::{Clock, FIRST, Shapes, shapes};

/// Share of the braking that a stop in a ramp takes: the correction is still that of the ramp, and its acceleration comes on top.
const IN_RAMP: f32 = 0.7;

impl Executor {
    /// Stops within the limits, beginning with the next tick; what is queued is thrown away.
    pub fn stop(&mut self) {
        if self.stopping() {
            return;
        }
        self.halting = true;
        (self.held, self.pausing) = (false, None);
        self.epoch = self.epoch.wrapping_add(1);
        self.counters.stops = self.counters.stops.wrapping_add(1);
        let (stop, ramp) = match self.mode {
            Mode::ArcCruise => (Mode::ArcStop, None),
            Mode::TermCruise => (Mode::TermStop, None),
            Mode::Cruise => (Mode::Stop, None),
            Mode::ArcRise => (Mode::ArcStop, Some(false)),
            Mode::TermRise => (Mode::TermStop, Some(false)),
            Mode::Rise => (Mode::Stop, Some(false)),
            Mode::ArcFall => (Mode::ArcStop, Some(true)),
            Mode::TermFall => (Mode::TermStop, Some(true)),
            Mode::Fall => (Mode::Stop, Some(true)),
            // At the end of a settling or dwelling in hand the segment is seen to be of an old epoch.
            _ => return,
        };
        match ramp {
            None => self.stop_from(stop, i32::MAX, 0.0),
            Some(falls) if self.clock.begun() => self.stop_in_ramp(stop, falls),
            Some(true) => {}
            Some(false) => self.mode = Mode::Rest,
        }
    }

    /// From a share of the constant rate (Q31) and its growth in a tick.
    fn stop_from(&mut self, stop: Mode, share_q31: i32, growth: f32) {
        if let Some(descent) = Descent::begin(share_q31, growth, self.segment.slowing) {
            (self.descent, self.clock, self.falls) = (descent, Clock::default(), false);
            self.mode = stop;
        }
    }

    /// In a ramp, from the rate and the acceleration of its last tick. A falling one is left to be where it is at rest sooner, and in
    /// its second half, in which it has an eighth of its way left.
    #[inline(never)]
    fn stop_in_ramp(&mut self, stop: Mode, falls: bool) {
        let (x, pace) = (self.clock.here(), self.clock.pace());
        if falls && x < 0 {
            return;
        }
        let (half, whole, law) = if falls {
            (pace >> 1, pace, &self.fall)
        } else {
            (-(pace >> 1), pace.wrapping_neg(), &self.segment.rise)
        };
        let share_q31 = shapes(&self.ramp, x.saturating_add(half)).s_q31;
        let steep = shapes(&self.ramp, x.saturating_add(whole)).w4_q31;
        // S′ a tick: w⁴ in Q31, the step of u in Q32.
        const UNIT: f32 = FIRST / (2_147_483_648.0 * 4_294_967_296.0);
        let growth = steep as f32 * pace as f32 * UNIT;
        let growth = if falls { -growth } else { growth };
        // A ramp keeps the sum of its steps: the place itself is half a step and an end term less.
        let now = shapes(&self.ramp, x);
        let step = scaled(self.segment.timing.step_q1, now.s_q31);
        let end_term = (i64::from(law.end_term(&now)) << 32) as u64;
        let place = self.phase.wrapping_sub(step >> 1).wrapping_sub(end_term);
        let (timing, ramp) = (self.segment.timing, self.clock);
        // Not where that would be longer than the ramp, which is what the end of the segment has room for.
        let Slowing { braking, jerk } = self.segment.slowing;
        let gentle = IN_RAMP * braking;
        let short = 1.0 / gentle + gentle / jerk < 0.95 * timing.ramp_ticks as f32;
        let braking = if short { gentle } else { braking };
        let Some(descent) = Descent::begin(share_q31, growth, Slowing { braking, jerk }) else {
            return;
        };
        if falls {
            let left = self.end.wrapping_sub(place) as f32 / timing.step as f32;
            if descent.way() + 1.0 > left {
                return;
            }
        }
        self.set_phase(place);
        (self.descent, self.clock, self.falls) = (descent, ramp, falls);
        self.mode = stop;
    }

    /// Step and shapes of the next tick of a stop.
    #[inline(always)]
    pub(super) fn stop_tick(&mut self) -> (u64, Shapes) {
        let (x, end) = if self.falls {
            self.clock.fall()
        } else {
            self.clock.rise()
        };
        if end {
            self.clock = Clock::default();
        }
        let [way, s_q31] = self.descent.next_q31();
        let step = scaled(self.segment.timing.step_q1, way);
        let ramp = shapes(&self.ramp, x);
        (step, Shapes { s_q31, ..ramp })
    }

    /// Rate and correction have come to rest: it ends here.
    #[inline(always)]
    pub(super) fn stopped(&mut self) -> bool {
        let over = self.descent.over() && !self.clock.runs();
        if over {
            self.end = self.phase;
        }
        over
    }
}
