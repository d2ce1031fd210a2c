//! Full circles at the feed that was asked for, with an entry before and an exit behind.
use super::circular::{MAX_GAIN, Round};
use super::numbers::{inside, positive};
use super::timing::{Way, at_rate};
use super::{Planner, Refused};
use crate::engine::config::whole_above;
use crate::engine::planned::{Planned, Timing};
use core::f32::consts::TAU;
use giotto_shared::angle::sincos;
use giotto_shared::path::{ExactCircle, MAX_RADIUS_M, MAX_TURNS, Quantity};
use giotto_shared::{Actuator, Direction};

impl Planner {
    /// The positioning move to where a circle starts; `false`: the last segment ends there. Refused if the circle would be:
    /// planned behind it in the same place, since both are large, it is not.
    pub fn approach(&mut self, run: &ExactCircle, planned: &mut Planned) -> Result<bool, Refused> {
        let here = self.position_nm;
        self.circle(run, planned)?;
        let start = planned.start_nm;
        self.position_nm = here;
        if start == here {
            return Ok(false);
        }
        self.line_to(start, self.machine.positioning_m_s, planned)?;
        Ok(true)
    }

    /// The circle, wherever the last segment ends.
    #[inline(never)]
    pub fn circle(&mut self, run: &ExactCircle, circle: &mut Planned) -> Result<(), Refused> {
        let arm = run.radius_half_nm;
        let radius_m = positive(arm as f32 * 0.5e-9, Quantity::Radius)?;
        let feed_m_s = positive(run.feed_m_s, Quantity::Feed)?;
        if radius_m > MAX_RADIUS_M as f32 {
            return Err(Refused::OutOfBounds(Quantity::Radius));
        }
        if run.laps == 0 || run.laps > MAX_TURNS {
            return Err(Refused::OutOfBounds(Quantity::Laps));
        }
        self.check_feed(feed_m_s)?;
        inside(&run.centre_nm, Quantity::Centre)?;
        let ccw = run.direction == Direction::Ccw;
        let start = if ccw {
            run.start
        } else {
            run.start.wrapping_neg()
        };
        let [first, second] = run.plane.axes();
        let along = |axis: Actuator, arm: i32| {
            Actuator::SLIDES.map(|slide| if slide == axis { arm } else { 0 })
        };
        let u = along(first, arm);
        let v = along(second, if ccw { arm } else { arm.wrapping_neg() });
        let round = Round {
            centre_nm: run.centre_nm,
            u,
            v,
            rise_nm: [0; 3],
            radius_m,
            feed_m_s,
            ccw,
            steep: 1.0,
        };
        // Constant rate over whole turns: the ramps come before and after.
        let ticks = run.laps as f32 * TAU * radius_m / feed_m_s * self.machine.rate_hz;
        let cruise_ticks = whole_above(ticks);
        if cruise_ticks == u32::MAX {
            return Err(Refused::OutOfBounds(Quantity::Time));
        }
        let turns = Way {
            turns: run.laps,
            fraction: 0,
        };
        let step = turns
            .per_tick(cruise_ticks)
            .ok_or(Refused::OutOfBounds(Quantity::Radius))?;
        let timing = |stretch: f32| {
            let ramp_ticks = self.machine.ramp_ticks(feed_m_s, stretch);
            let entry = (step >> 1).wrapping_mul(u64::from(ramp_ticks));
            let up = u64::from(start) << 32;
            let down = up.wrapping_add(step.wrapping_mul(u64::from(cruise_ticks)));
            let (start, end) = (up.wrapping_sub(entry), down.wrapping_add(entry));
            Ok(Timing {
                start,
                up,
                end,
                ..at_rate(step, ramp_ticks, cruise_ticks)
            })
        };
        // The feed is what is to be measured, whatever its centripetal acceleration: only the ramps keep to the limit.
        let cruise = 1.03 * (1.0 + MAX_GAIN) * feed_m_s * feed_m_s / radius_m;
        self.round(
            &round,
            self.machine.acceleration_m_s2.max(cruise),
            &timing,
            circle,
        )?;
        let at = |phase: u64| {
            let (c, s) = sincos((phase >> 32) as u32);
            circle.axes.map(|axis| axis.on_arc(c, s))
        };
        (circle.start_nm, circle.end_nm) = (at(circle.timing.start), at(circle.timing.end));
        self.position_nm = circle.end_nm;
        Ok(())
    }
}
