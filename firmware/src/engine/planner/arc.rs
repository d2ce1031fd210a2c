//! Arcs and helices of a program. Their geometry is worked out in double precision: a metre in nanometres is beyond single.
use super::numbers::{finite, positive, to_half_nm, to_nm};
use super::round::{MAX_GAIN, Round};
use super::timing::Way;
use super::{Planner, Refused};
use crate::engine::config::{MAX_POSITION_M, MAX_RADIUS_M};
use crate::engine::planned::Planned;
use core::f64::consts::TAU;
use giotto_shared::fixed::rounded;

/// Units of phase in a turn.
const TURN: f64 = 18_446_744_073_709_551_616.0;

/// What a program says of an arc, SI.
pub(super) struct Arc {
    pub(super) centre: [f64; 3],
    pub(super) normal: [f64; 3],
    pub(super) sweep: f64,
    pub(super) rise: f64,
    pub(super) feed: f64,
}

impl Planner {
    /// From where the last segment ends.
    pub(super) fn arc(&mut self, arc: &Arc, segment: &mut Planned) -> Result<(), Refused> {
        finite(&arc.centre, "centre")?;
        finite(&arc.normal, "normal")?;
        finite(&[arc.sweep, arc.rise], "sweep and rise")?;
        let feed = positive(arc.feed, "feed")?;
        self.check_feed(feed)?;
        let n = unit(arc.normal).ok_or(Refused::NotANumber("normal"))?;
        let from = self.position_nm.map(|p| f64::from(p) * 1e-9);
        // The centre may be given anywhere on the axis: its foot is the centre.
        let height = dot(sub(from, arc.centre), n);
        let centre = add(arc.centre, n.map(|n| height * n));
        let u = sub(from, centre);
        let radius = libm::sqrt(dot(u, u));
        if !(1e-6..=MAX_RADIUS_M).contains(&radius) {
            return Err(Refused::OutOfBounds("radius"));
        }
        let sign = if arc.sweep < 0.0 { -1.0 } else { 1.0 };
        let sweep = libm::fabs(arc.sweep);
        if !(1e-9..=1e6 * TAU).contains(&sweep) {
            return Err(Refused::OutOfBounds("sweep"));
        }
        let rise_per_turn = n.map(|n| n * arc.rise * TAU / sweep);
        // Steeper than that it is more of a line: the travel of a whole turn would not fit into a coordinate.
        if rise_per_turn.iter().any(|travel| libm::fabs(*travel) > MAX_POSITION_M) {
            return Err(Refused::OutOfBounds("rise"));
        }
        let slope = (libm::fabs(arc.rise) / (sweep * radius)) as f32;
        let [_, _, up] = n;
        let round = Round {
            centre_nm: to_nm(&centre, "centre")?,
            u: u.map(to_half_nm),
            v: cross(n, u).map(|v| to_half_nm(sign * v)),
            rise_nm: rise_per_turn.map(|travel| rounded(travel, 1e9) as i32),
            radius_m: radius as f32,
            feed_m_s: feed,
            ccw: up * sign >= 0.0,
            steep: libm::sqrtf(1.0 + slope * slope),
        };
        let turns = libm::floor(sweep / TAU);
        let way = Way { turns: turns as u32, fraction: ((sweep / TAU - turns) * TURN) as u64 };
        // Centripetal acceleration, with what the correction adds, takes at most nine tenths of the limit.
        let limit = self.machine.acceleration_m_s2;
        let feed = feed.min(libm::sqrtf(0.9 / (1.0 + MAX_GAIN) * limit * round.radius_m));
        // The feed is that in the plane: a steep helix is slower, so that feed and acceleration hold along its axis too.
        let feed = feed.min(self.machine.feed_m_s / slope.max(1e-9));
        let length = (sweep * radius) as f32;
        let timing = |stretch: f32| {
            let (ramp_ticks, cruise_ticks) = self.profile(length, feed, stretch)?;
            way.share_out(ramp_ticks, cruise_ticks).ok_or(Refused::OutOfBounds("feed"))
        };
        self.round(&round, limit, &timing, segment)?;
        // Rounding of centre and radius must not show as a gap at the start: move the arc by that nm or two.
        let ends = segment.end_nm.iter_mut().zip(segment.start_nm).zip(self.position_nm);
        for (axis, ((end, start), here)) in segment.axes.iter_mut().zip(ends) {
            let gap = here.wrapping_sub(start);
            (axis.base, *end) = (axis.base.wrapping_add(gap), end.wrapping_add(gap));
        }
        segment.start_nm = self.position_nm;
        self.position_nm = segment.end_nm;
        Ok(())
    }
}

fn dot([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> f64 {
    a * x + b * y + c * z
}

fn add([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [a + x, b + y, c + z]
}

fn sub([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [a - x, b - y, c - z]
}

fn cross([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

fn unit(a: [f64; 3]) -> Option<[f64; 3]> {
    let length = libm::sqrt(dot(a, a));
    (length > 1e-12).then(|| a.map(|x| x / length))
}
