//! Lines.
use super::numbers::{dot, positive, seen_from, sub, unit};
use super::timing::{LINE, TURN, end_term, share_out};
use super::{Planner, Refused, worst};
use crate::engine::extra::Extra;
use crate::engine::planned::{Axis, Kind, Planned};
use crate::engine::ramp::{FIRST, THIRD, clock_step};
use crate::engine::zones::Asked;
use giotto_shared::fixed::to_fixed;

impl Planner {
    pub(super) fn line_to(&mut self, to: [i32; 3], feed: f64) -> Result<Planned, Refused> {
        positive(feed, "feed")?;
        self.check_feed(feed)?;
        let from = self.position_nm;
        let metres = |nm: [i32; 3]| nm.map(|p| f64::from(p) * 1e-9);
        let span = sub(metres(to), metres(from));
        let length = libm::sqrt(dot(span, span));
        let Some(direction) = unit(span) else { return self.dwell(self.config.tick_s()) };
        let mut u_nm = [0; 3];
        for ((u, t), f) in u_nm.iter_mut().zip(to).zip(from) {
            *u = t.checked_sub(f).ok_or(Refused::OutOfBounds("length"))?;
        }
        let middle = [0, 1, 2].map(|i| f64::from(from[i]) * 1e-9 + 0.5 * span[i]);
        let zone = self.zones.choose(&Asked { place_m: middle, radius_m: None, feed_m_s: feed, ccw: None });
        let limit = self.config.motion.acceleration_m_s2;
        let mut stretch = 1.0;
        let (ramp_ticks, cruise_ticks) = loop {
            let (ramp_ticks, cruise_ticks) = self.profile(length, feed, stretch)?;
            let steps = f64::from(ramp_ticks) + f64::from(cruise_ticks);
            let speed = length / (steps * self.config.tick_s());
            let ramp_s = f64::from(ramp_ticks) * self.config.tick_s();
            match self.stretch(stretch, worst::on_line(zone.as_ref(), speed, ramp_s), limit) {
                Some(longer) => stretch = longer,
                None => break (ramp_ticks, cruise_ticks),
            }
        };
        let mut timing = share_out(LINE as u128, ramp_ticks, cruise_ticks);
        timing.clock_step = clock_step(ramp_ticks);
        let mut segment = self.blank();
        segment.kind = Kind::Line;
        for (i, axis) in segment.axes.iter_mut().enumerate() {
            *axis = Axis { base: from[i], u: u_nm[i], v: to_fixed(direction[i], 31), a: 0, b: 0 };
        }
        segment.timing = timing;
        segment.rise.end_term_q1 = end_term(&timing);
        if let Some(zone) = zone {
            let t = f64::from(ramp_ticks) * self.config.tick_s();
            let speed = timing.step as f64 / LINE * length / self.config.tick_s();
            let snap = zone.operator.fourth_s4 * speed * THIRD / (t * t * t) * 1e9;
            segment.rise.k5 = to_fixed(zone.operator.second_s2 * speed * FIRST / t * 1e9, 2);
            segment.rise.k7 = to_fixed(snap, 2);
            segment.rise.k8 = to_fixed(-7.0 / 6.0 * snap, 3);
            self.bound(&mut segment);
            if let Some(profile) = &zone.profile {
                // Without a place there is no point that position errors could be counted from.
                let mut profile = *profile;
                if zone.reference_m.is_none() {
                    profile.position = [[0.0; 2]; 2];
                }
                let start = seen_from(metres(from), zone.reference_m.unwrap_or_default());
                segment.extra = Extra::on_line(&profile, &self.motion(&timing, TURN / LINE), span, start);
                if !segment.extra.within_numbers() {
                    return Err(Refused::OutOfBounds("profile term"));
                }
                segment.extended = true;
            }
        }
        segment.fall = segment.rise.turned_round();
        segment.end_nm = to;
        self.position_nm = to;
        Ok(segment)
    }
}
