//! Arcs and helices of a program. Whoever asks for one has worked out its vectors; here they are looked at: a plane that
//! is none, or a start elsewhere, must not move a machine, wherever it comes from.
use super::circular::{MAX_GAIN, Round};
use super::numbers::{arm, dot, inside, is_counter_clockwise, length, positive, to_m};
use super::timing::{TURNS_PER_UNIT, Way};
use super::{Planner, Refused};
use crate::engine::planned::Planned;
use core::f32::consts::TAU;
use giotto_shared::path::{
    ExactArc, MAX_RADIUS_M, MAX_TURNS, MIN_FRACTION, MIN_RADIUS_M, Quantity,
};

/// Vectors of a plane may be so far from square or equally long, m and of the radius: what rounding them leaves.
const SLACK: [f32; 2] = [1.5e-9, 1e-6];
/// Farthest start from where the machine stands, nm: what rounding of centre and vectors leaves.
const MAX_GAP_NM: u32 = 4;

/// Vectors that are a circle's, and a rise square to them.
fn is_plane(u: [f32; 3], v: [f32; 3], rise: [f32; 3], radius: f32) -> bool {
    let [rounding, share] = SLACK;
    let slack = rounding + share * radius;
    let square = |a: f32, slack: f32| a.abs() <= slack * radius;
    let across = rounding + share * length(rise);
    (length(v) - radius).abs() <= slack
        && square(dot(u, v), slack)
        && square(dot(u, rise), across)
        && square(dot(v, rise), across)
}

impl Planner {
    /// From where the last segment ends.
    pub(super) fn arc(&mut self, arc: &ExactArc, segment: &mut Planned) -> Result<(), Refused> {
        let feed = positive(arc.feed_m_s, Quantity::Feed)?;
        self.check_feed(feed)?;
        inside(&arc.centre_nm, Quantity::Centre)?;
        inside(&arc.rise_nm, Quantity::Rise)?;
        let (u, v, rise) = (arm(arc.u_half_nm), arm(arc.v_half_nm), to_m(arc.rise_nm));
        let radius = length(u);
        if !(MIN_RADIUS_M as f32 * 0.999..=MAX_RADIUS_M as f32 * 1.001).contains(&radius) {
            return Err(Refused::OutOfBounds(Quantity::Radius));
        }
        if !is_plane(u, v, rise, radius) {
            return Err(Refused::OutOfBounds(Quantity::Plane));
        }
        if arc.turns > MAX_TURNS || (arc.turns == 0 && arc.fraction < MIN_FRACTION) {
            return Err(Refused::OutOfBounds(Quantity::Sweep));
        }
        let turns = arc.turns as f32 + arc.fraction as f32 * TURNS_PER_UNIT;
        // As whole nanometres the end may have wrapped: its last turn is looked at before.
        let ([cx, cy, cz], [rx, ry, rz]) = (to_m(arc.centre_nm), rise.map(|rise| rise * turns));
        self.check_reach([cx + rx, cy + ry, cz + rz], radius)?;
        if arc
            .gap_nm(self.position_nm)
            .iter()
            .any(|gap| gap.unsigned_abs() > MAX_GAP_NM)
        {
            return Err(Refused::OutOfBounds(Quantity::Gap));
        }
        self.soft_arc(arc)?;
        let end = arc.end_nm(self.position_nm);
        let slope = length(rise) / (TAU * radius);
        let round = Round {
            centre_nm: arc.centre_nm,
            u: arc.u_half_nm,
            v: arc.v_half_nm,
            rise_nm: arc.rise_nm,
            radius_m: radius,
            feed_m_s: feed,
            ccw: is_counter_clockwise(u, v),
            steep: libm::sqrtf(1.0 + slope * slope),
        };
        let way = Way {
            turns: arc.turns,
            fraction: arc.fraction,
        };
        // Centripetal acceleration, with what the correction adds, takes at most nine tenths of the limit.
        let limit = self.machine.acceleration_m_s2;
        let feed = feed.min(libm::sqrtf(0.9 / (1.0 + MAX_GAIN) * limit * radius));
        // The feed is that in the plane: a steep helix is slower, so that feed and acceleration hold along its axis too.
        let feed = feed.min(self.machine.feed_m_s / slope.max(1e-9));
        let timing = |stretch: f32| {
            let (ramp_ticks, cruise_ticks) = self.profile(turns * TAU * radius, feed, stretch)?;
            way.share_out(ramp_ticks, cruise_ticks)
                .ok_or(Refused::OutOfBounds(Quantity::Feed))
        };
        self.round(&round, limit, &timing, segment)?;
        // Rounding of centre and radius must not show as a gap at the start: the arc moves by that nm or two.
        for (axis, gap) in segment.axes.iter_mut().zip(arc.gap_nm(self.position_nm)) {
            axis.base = axis.base.wrapping_add(gap);
        }
        (segment.start_nm, segment.end_nm) = (self.position_nm, end);
        self.position_nm = end;
        Ok(())
    }
}
