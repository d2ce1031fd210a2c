//! Circles, arcs and helices.
use super::numbers::{cross, dot, finite, in_u32, positive, seen_from, sub, to_nm, unit};
use super::timing::{TURN, end_term, share_out, total_turns};
use super::worst::{self, Worst};
use super::{Planner, Refused};
use crate::engine::config::{MAX_POSITION_M, MAX_RADIUS_M, MAX_RAMP_TICKS};
use crate::engine::extra::Extra;
use crate::engine::planned::{Axis, Kind, Law, Planned, Timing};
use crate::engine::ramp::{FIRST, SECOND, THIRD, clock_step};
use crate::engine::zones::{Asked, Built};
use core::f64::consts::TAU;
use giotto_shared::angle::{phase_from_rad, sincos};
use giotto_shared::fixed::to_fixed;
use giotto_shared::law::AngularMotion;
use giotto_shared::path::CircleRun;

/// Most share of the radius by which the fixed-point law can move a circle.
const MAX_GAIN: f64 = 0.12;

/// One circle or arc in its plane, SI.
struct Round {
    centre: [f64; 3],
    u: [f64; 3],
    v: [f64; 3],
    radius: f64,
    rise_per_turn: [f64; 3],
    feed: f64,
    /// Sense seen from +Z.
    ccw: bool,
}

impl Planner {
    /// The positioning move to where a circle starts (`None` if already there), and the circle.
    #[inline(never)]
    pub fn circle(&mut self, run: &CircleRun) -> Result<(Option<Planned>, Planned), Refused> {
        finite(&run.centre_m, "centre")?;
        positive(run.radius_m, "radius")?;
        positive(run.feed_m_s, "feed")?;
        finite(&[run.start_rad], "start angle")?;
        if run.radius_m > MAX_RADIUS_M {
            return Err(Refused::OutOfBounds("radius"));
        }
        if run.laps == 0 || run.laps > 1_000_000 {
            return Err(Refused::OutOfBounds("laps"));
        }
        let sign = f64::from(run.direction.sign());
        let round = Round {
            centre: run.centre_m,
            u: [1.0, 0.0, 0.0],
            v: [0.0, sign, 0.0],
            radius: run.radius_m,
            rise_per_turn: [0.0; 3],
            feed: run.feed_m_s,
            ccw: run.direction == giotto_shared::Direction::Ccw,
        };
        self.check_feed(round.feed)?;
        let here = self.position_nm;
        // Constant rate over whole turns: the ramps come before and after.
        let turns = u128::from(run.laps) << 64;
        let wanted = libm::ceil(f64::from(run.laps) * TAU * round.radius / round.feed / self.config.tick_s());
        let Some(cruise_ticks) = in_u32(wanted) else { return Err(Refused::OutOfBounds("duration")) };
        let step = ((turns / u128::from(cruise_ticks)) as u64) & !1;
        let timing = |ramp_ticks: u32| {
            let entry = (step >> 1).wrapping_mul(u64::from(ramp_ticks));
            let up = u64::from(phase_from_rad(sign * run.start_rad)) << 32;
            let down = up.wrapping_add(step.wrapping_mul(u64::from(cruise_ticks)));
            let (start, end) = (up.wrapping_sub(entry), down.wrapping_add(entry));
            Timing { start, up, end, step, step_q1: step << 1, ramp_ticks, cruise_ticks, ..Timing::default() }
        };
        // The feed is what is to be measured, whatever its centripetal acceleration: only the ramps keep to the limit.
        let mut stretch = 1.0;
        let segment = loop {
            let (segment, worst) = self.round(&round, self.ramp_ticks(round.feed, stretch), timing)?;
            let cruise = 1.03 * (1.0 + MAX_GAIN) * round.feed * round.feed / round.radius;
            let limit = self.config.motion.acceleration_m_s2.max(cruise);
            match self.stretch(stretch, worst.acceleration_per_s2 * round.radius, limit) {
                Some(longer) => stretch = longer,
                None => break segment,
            }
        };
        let start = segment.start_nm;
        let approach =
            if start == here { None } else { Some(self.line_to(start, self.config.positioning_m_s)?) };
        self.position_nm = segment.end_nm;
        Ok((approach, segment))
    }

    pub(super) fn arc(
        &mut self,
        centre: [f64; 3],
        normal: [f64; 3],
        sweep: f64,
        rise: f64,
        feed: f64,
    ) -> Result<Planned, Refused> {
        finite(&centre, "centre")?;
        finite(&normal, "normal")?;
        finite(&[sweep, rise], "sweep and rise")?;
        positive(feed, "feed")?;
        self.check_feed(feed)?;
        let n = unit(normal).ok_or(Refused::NotANumber("normal"))?;
        let from = self.position_nm.map(|p| f64::from(p) * 1e-9);
        let arm = sub(from, centre);
        // The centre may be given anywhere on the axis: its foot is the centre.
        let height = dot(arm, n);
        let centre = [centre[0] + height * n[0], centre[1] + height * n[1], centre[2] + height * n[2]];
        let arm = sub(from, centre);
        let radius = libm::sqrt(dot(arm, arm));
        let u = unit(arm).ok_or(Refused::OutOfBounds("radius"))?;
        if !(1e-6..=MAX_RADIUS_M).contains(&radius) {
            return Err(Refused::OutOfBounds("radius"));
        }
        let sign = if sweep < 0.0 { -1.0 } else { 1.0 };
        let sweep = libm::fabs(sweep);
        if !(1e-9..=1e6 * TAU).contains(&sweep) {
            return Err(Refused::OutOfBounds("sweep"));
        }
        let v = cross(n, u).map(|a| a * sign);
        let rise_per_turn = n.map(|a| a * rise * TAU / sweep);
        // Steeper than that it is more of a line: the travel of a whole turn would not fit into a coordinate.
        if rise_per_turn.iter().any(|travel| libm::fabs(*travel) > MAX_POSITION_M) {
            return Err(Refused::OutOfBounds("rise"));
        }
        let round = Round { centre, u, v, radius, rise_per_turn, feed, ccw: n[2] * sign >= 0.0 };
        let whole = (sweep / TAU * TURN) as u128;
        // Centripetal acceleration, with what the correction adds, takes at most nine tenths of the limit.
        let limit = self.config.motion.acceleration_m_s2;
        let feed = feed.min(libm::sqrt(0.9 / (1.0 + MAX_GAIN) * limit * radius));
        // The feed is that in the plane: a steep helix is slower, so that feed and acceleration hold along its axis too.
        let slope = libm::fabs(rise) / (sweep * radius);
        let feed = feed.min(self.config.motion.feed_m_s / slope.max(1e-9));
        let steep = libm::sqrt(1.0 + slope * slope);
        let mut stretch = 1.0;
        let mut segment = loop {
            let (ramp_ticks, cruise_ticks) = self.profile(sweep * radius, feed, stretch)?;
            let timing = |ramp_ticks| share_out(whole, ramp_ticks, cruise_ticks);
            let (segment, worst) = self.round(&round, ramp_ticks, timing)?;
            match self.stretch(stretch, worst.acceleration_per_s2 * radius * steep, limit) {
                Some(longer) => stretch = longer,
                None => break segment,
            }
        };
        // Rounding of centre and radius must not show as a gap at the start: move the arc by that nm or two.
        for (i, axis) in segment.axes.iter_mut().enumerate() {
            let gap = self.position_nm[i] - segment.start_nm[i];
            axis.base += gap;
            segment.end_nm[i] += gap;
        }
        segment.start_nm = self.position_nm;
        self.position_nm = segment.end_nm;
        Ok(segment)
    }

    /// Everything that a circle and an arc have in common. Lengthens the ramp until the law fits its number range.
    fn round(
        &self,
        round: &Round,
        ramp_ticks: u32,
        timing: impl Fn(u32) -> Timing,
    ) -> Result<(Planned, Worst), Refused> {
        let reach = round.radius + libm::sqrt(dot(round.centre, round.centre));
        if reach > MAX_POSITION_M {
            return Err(Refused::OutOfBounds("position"));
        }
        let scale = |a: [f64; 3], by: f64| a.map(|x| to_fixed(x * by, 0));
        let centre_nm = to_nm(&round.centre, "centre")?;
        let flat = round.rise_per_turn == [0.0; 3];
        let mut segment = self.blank();
        segment.kind = if flat { Kind::Arc } else { Kind::Helix };
        segment.rise_nm = scale(round.rise_per_turn, 1e9);
        for (i, axis) in segment.axes.iter_mut().enumerate() {
            let arm = |a: f64| to_fixed(a * round.radius * 1e9, 1);
            *axis = Axis { base: centre_nm[i], u: arm(round.u[i]), v: arm(round.v[i]), a: 0, b: 0 };
        }
        segment.timing = timing(ramp_ticks);
        let asked = Asked {
            place_m: round.centre,
            radius_m: Some(round.radius),
            feed_m_s: round.feed,
            ccw: Some(round.ccw),
        };
        let zone = self.zones.choose(&asked);
        let sweep = |zone: Option<&Built>, timing: &Timing| {
            let motion = self.motion(timing, TAU);
            worst::on_arc(zone, motion.rate, motion.ramp_s)
        };
        let mut worst = Worst::default();
        if let Some(zone) = &zone {
            let mut ramp = ramp_ticks;
            for _ in 0..6 {
                let slower = timing(ramp);
                worst = sweep(Some(zone), &slower);
                if worst.gain <= MAX_GAIN
                    && let Some((law, radial)) = self.law_on_arc(zone, &slower)
                {
                    (segment.rise, segment.timing) = (law, slower);
                    self.correct(&mut segment, round, zone, radial)?;
                    break;
                }
                ramp = ramp.saturating_mul(2).min(MAX_RAMP_TICKS);
            }
        }
        if !segment.corrected {
            worst = sweep(None, &segment.timing);
        }
        segment.proven = match &zone {
            Some(zone) if segment.corrected => self.proven(zone, &segment, round, &worst),
            // No correction, no change of it.
            _ => true,
        };
        segment.timing.clock_step = clock_step(segment.timing.ramp_ticks);
        segment.rise.end_term_q1 = end_term(&segment.timing);
        segment.fall = segment.rise.turned_round();
        let at = |phase: u64| {
            let (c, s) = sincos((phase >> 32) as u32);
            segment.axes.map(|a| a.on_arc(c, s))
        };
        let (start_nm, mut end_nm) = (at(segment.timing.start), at(segment.timing.end));
        if !flat {
            let risen = scale(round.rise_per_turn.map(|r| r * total_turns(&segment.timing)), 1e9);
            end_nm = [0, 1, 2].map(|i| end_nm[i] + risen[i]);
        }
        (segment.start_nm, segment.end_nm) = (start_nm, end_nm);
        Ok((segment, worst))
    }

    /// Gives a segment the bounds of its table, its correction at constant rate and its profile terms.
    fn correct(
        &self,
        segment: &mut Planned,
        round: &Round,
        zone: &Built,
        radial: f64,
    ) -> Result<(), Refused> {
        self.bound(segment);
        for axis in &mut segment.axes {
            axis.a = to_fixed(radial * f64::from(axis.u), 0);
            axis.b = to_fixed(radial * f64::from(axis.v), 0);
        }
        let Some(profile) = &zone.profile else { return Ok(()) };
        let centre = seen_from(round.centre, zone.reference_m.unwrap_or(round.centre));
        let arm = |a: [f64; 3]| a.map(|x| x * round.radius);
        let motion = self.motion(&segment.timing, TAU);
        let extra = Extra::on_arc(profile, &motion, arm(round.u), arm(round.v), centre);
        if !extra.within_numbers() {
            return Err(Refused::OutOfBounds("profile term"));
        }
        for (i, axis) in segment.axes.iter_mut().enumerate() {
            let (a, b) = extra.steady(i);
            (axis.a, axis.b) = (axis.a.saturating_add(a), axis.b.saturating_add(b));
        }
        (segment.extra, segment.extended) = (extra, true);
        Ok(())
    }

    /// The operator's fixed-point form on a circle, and its gain at constant rate; `None` if a
    /// number is beyond its range.
    fn law_on_arc(&self, zone: &Built, timing: &Timing) -> Option<(Law, f64)> {
        let (operator, third_s3) = (&zone.operator, zone.third_s3);
        let rate = timing.step as f64 / TURN * TAU / self.config.tick_s();
        let t = f64::from(timing.ramp_ticks) * self.config.tick_s();
        let steady = operator.gain(&AngularMotion { rate, ..Default::default() });
        let (a, b) = (operator.second_s2, operator.fourth_s4);
        let snap = b * rate * THIRD / (t * t * t);
        let k = [
            (-a * rate * rate, 33),
            (b * rate * rate * rate * rate, 34),
            (4.0 * b * rate * rate / (t * t) * SECOND, 32),
            (-3.0 * b * (rate * FIRST / t) * (rate * FIRST / t), 30),
            (a * rate * FIRST / t, 33),
            (-6.0 * b * rate * rate * rate * FIRST / t, 34),
            (snap, 30),
            (-7.0 / 6.0 * snap, 31),
            // (κ3/6) p‴ along the radius: Re(iω)³ and the rest of it only delay.
            (-3.0 * third_s3 * rate * rate * FIRST / t, 30),
        ];
        let fits = k.iter().all(|&(k, bits)| libm::fabs(k) * (1u64 << bits) as f64 <= 0.98 * 2_147_483_648.0);
        if !fits {
            return None;
        }
        let [k1, k2, k3, k4, k5, k6, k7, k8, k9] = k.map(|(k, bits)| to_fixed(k, bits));
        Some((Law { k1, k2, k3, k4, k5, k6, k7, k8, k9, end_term_q1: 0 }, steady.radial))
    }

    /// Whether offset and change of offset stay within their bounds all along, with a tenth to spare.
    fn proven(&self, zone: &Built, segment: &Planned, round: &Round, worst: &Worst) -> bool {
        let motion = self.motion(&segment.timing, TAU);
        let [offset_m, slew_m_s] = zone.profile.as_ref().map_or([0.0; 2], |profile| {
            let centre = seen_from(round.centre, zone.reference_m.unwrap_or(round.centre));
            Extra::worst_on_arc(profile, &motion, round.radius, centre)
        });
        let nm = |metres: f64| 1.1e9 * metres;
        (!segment.extended || segment.extra.fits())
            && nm(round.radius * worst.gain + offset_m) <= f64::from(segment.offset_nm)
            && nm((round.radius * worst.slew_per_s + slew_m_s) * motion.tick_s) <= f64::from(segment.slew_nm)
    }
}
