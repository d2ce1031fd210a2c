//! Lines.
use super::demand::{Demand, longer};
use super::law::LineLaw;
use super::numbers::{length, seen_from, to_m};
use super::timing::{Way, end_term, turns_per_tick};
use super::{Planner, Refused, terms, worst};
use crate::engine::planned::{Axis, Kind, Planned};
use crate::engine::zones::Asked;
use giotto_shared::fixed::single_to_fixed;
use giotto_shared::path::Quantity;

impl Planner {
    /// To a place, at no more than a feed.
    pub(super) fn line_to(
        &mut self,
        to: [i32; 3],
        feed: f32,
        segment: &mut Planned,
    ) -> Result<(), Refused> {
        self.check_feed(feed)?;
        let from = self.position_nm;
        let mut span_nm = [0; 3];
        for ((span, to), from) in span_nm.iter_mut().zip(to).zip(from) {
            *span = to
                .checked_sub(from)
                .ok_or(Refused::OutOfBounds(Quantity::Length))?;
        }
        if span_nm == [0; 3] {
            self.dwell(1, segment);
            return Ok(());
        }
        let (start, span) = (to_m(from), to_m(span_nm));
        let whole = length(span);
        let [x, y, z] = start;
        let place_m = [x + 0.5 * span[0], y + 0.5 * span[1], z + 0.5 * span[2]];
        let zone = self.zones.choose(&Asked {
            path_m: &[start, place_m, to_m(to)],
            place_m,
            radius_m: None,
            feed_m_s: feed,
            ccw: None,
        });
        let bounds = self.bounds(zone.is_some());
        let mut stretch = 1.0;
        let (timing, law, speed) = loop {
            let (ramp_ticks, cruise_ticks) = self.profile(whole, feed, stretch)?;
            let timing = Way::LINE
                .share_out(ramp_ticks, cruise_ticks)
                .ok_or(Refused::OutOfBounds(Quantity::Feed))?;
            let speed = turns_per_tick(&timing) / Way::LINE_TURNS * whole * self.machine.rate_hz;
            let ramp_s = ramp_ticks as f32 * self.machine.tick_s;
            let law = zone.as_ref().map(|zone| LineLaw::new(zone, speed, ramp_s));
            let worst = worst::on_line(law.as_ref(), speed, ramp_s);
            let demand = Demand {
                offset_m: worst.gain,
                slew_m_s: worst.slew_per_s,
                acceleration_m_s2: worst.acceleration_per_s2,
            };
            let over = demand
                .correction(&bounds, span_nm.map(|nm| nm != 0))
                .max(demand.acceleration(self.machine.acceleration_m_s2));
            match longer(stretch, over) {
                Some(longer) => stretch = longer,
                None => break (timing, law, speed),
            }
        };
        self.blank(segment);
        lay(segment, (from, span_nm), span, whole);
        if let (Some(zone), Some(law)) = (&zone, law) {
            self.bound(segment, &bounds);
            segment.rise = law.rounded();
            self.joints(Some(zone), segment);
            if let Some(profile) = &zone.profile {
                // Without a place there is no point that errors of position could be counted from.
                let seen = zone
                    .reference_m
                    .map(|reference| seen_from(start, reference));
                let motion = self.motion(&timing, 1.0 / Way::LINE_TURNS);
                terms::on_line(profile, &motion, span, seen, &mut segment.extra);
                segment.extended = true;
                if !segment.extra.within_numbers() {
                    return Err(Refused::OutOfBounds(Quantity::Terms));
                }
            }
        }
        segment.timing = timing;
        segment.slowing = self.machine.slowing(speed, self.machine.acceleration_m_s2);
        segment.rise.end_term_q1 = end_term(&timing);
        segment.end_nm = to;
        self.position_nm = to;
        Ok(())
    }
}

/// The axes of a straight segment: from a place by a span, and its unit direction.
fn lay(segment: &mut Planned, (from, span_nm): ([i32; 3], [i32; 3]), span: [f32; 3], whole: f32) {
    segment.kind = Kind::Line;
    let spans = from.into_iter().zip(span_nm).zip(span);
    for (axis, ((base, u), span)) in segment.axes.iter_mut().zip(spans) {
        *axis = Axis {
            base,
            u,
            v: single_to_fixed(span / whole, 31),
            a: 0,
            b: 0,
        };
    }
}
