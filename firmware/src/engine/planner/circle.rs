//! Full circles at the feed that was asked for, with an entry before and an exit behind.
use super::numbers::{finite, positive, to_half_nm, to_nm};
use super::round::{MAX_GAIN, Round};
use super::timing::{Way, at_rate};
use super::{Planner, Refused};
use crate::engine::config::{MAX_RADIUS_M, whole_above};
use crate::engine::planned::{Planned, Timing};
use core::f32::consts::TAU;
use giotto_shared::Direction;
use giotto_shared::angle::phase_from_rad;
use giotto_shared::path::CircleRun;

/// Most turns of one run, and the largest angle to start at, rad: what a phase is exact for.
const MAX_LAPS: u32 = 1_000_000;
const MAX_START_RAD: f32 = 1e6;

impl Planner {
    /// The positioning move to where a circle starts (`None` if already there) and the circle, both written in place: they are
    /// large.
    #[inline(never)]
    pub fn circle(
        &mut self,
        run: &CircleRun,
        approach: &mut Option<Planned>,
        circle: &mut Planned,
    ) -> Result<(), Refused> {
        let radius_m = positive(run.radius_m, "radius")?;
        let feed_m_s = positive(run.feed_m_s, "feed")?;
        finite(&[run.start_rad], "start angle")?;
        if radius_m > MAX_RADIUS_M as f32 {
            return Err(Refused::OutOfBounds("radius"));
        }
        if run.laps == 0 || run.laps > MAX_LAPS {
            return Err(Refused::OutOfBounds("laps"));
        }
        if (run.start_rad as f32).abs() > MAX_START_RAD {
            return Err(Refused::OutOfBounds("start angle"));
        }
        self.check_feed(feed_m_s)?;
        let ccw = run.direction == Direction::Ccw;
        let arm = to_half_nm(run.radius_m);
        let start_rad = if ccw { run.start_rad } else { -run.start_rad };
        let round = Round {
            centre_nm: to_nm(&run.centre_m, "centre")?,
            u: [arm, 0, 0],
            v: [0, if ccw { arm } else { -arm }, 0],
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
            return Err(Refused::OutOfBounds("duration"));
        }
        let turns = Way { turns: run.laps, fraction: 0 };
        let step = turns.per_tick(cruise_ticks).ok_or(Refused::OutOfBounds("radius"))?;
        let timing = |stretch: f32| {
            let ramp_ticks = self.machine.ramp_ticks(feed_m_s, stretch);
            let entry = (step >> 1).wrapping_mul(u64::from(ramp_ticks));
            let up = u64::from(phase_from_rad(start_rad)) << 32;
            let down = up.wrapping_add(step.wrapping_mul(u64::from(cruise_ticks)));
            let (start, end) = (up.wrapping_sub(entry), down.wrapping_add(entry));
            Ok(Timing { start, up, end, ..at_rate(step, ramp_ticks, cruise_ticks) })
        };
        // The feed is what is to be measured, whatever its centripetal acceleration: only the ramps keep to the limit.
        let cruise = 1.03 * (1.0 + MAX_GAIN) * feed_m_s * feed_m_s / radius_m;
        self.round(&round, self.machine.acceleration_m_s2.max(cruise), &timing, circle)?;
        let start = circle.start_nm;
        *approach = None;
        if start != self.position_nm {
            let line = approach.insert(Planned::default());
            self.line_to(start, self.machine.positioning_m_s, line)?;
        }
        self.position_nm = circle.end_nm;
        Ok(())
    }
}
