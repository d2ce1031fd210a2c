//! From what a program asks for to integers that the tick runs. Runs in the background, in `f64`.
use super::config::{Config, MAX_POSITION_M, MAX_RADIUS_M, MAX_RAMP_TICKS, ticks};
use super::extra::{Extra, Motion};
use super::planned::{Axis, Kind, Law, Planned, Timing};
use super::ramp::{FIRST, SECOND, THIRD, clock_step};
use super::stream::{StreamNeeds, StreamPlan};
use super::zones::{Asked, Built, ZoneError, Zones};
use core::f64::consts::TAU;
use giotto_shared::angle::{phase_from_rad, sincos};
use giotto_shared::fixed::to_fixed;
use giotto_shared::law::{AngularMotion, Operator};
use giotto_shared::path::{CircleRun, FeedRamp, Segment};
use giotto_shared::table::Table;

/// Why a segment was not accepted. Nothing has moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// A number is not finite, or not positive where it must be.
    NotANumber(&'static str),
    /// Beyond what the configuration or the image allows.
    OutOfBounds(&'static str),
    /// The queue is full, or the engine is not at rest where it has to be.
    Busy,
    /// A fault has to be cleared first.
    Fault,
}

/// Most share of the radius by which the fixed-point law can move a circle.
const MAX_GAIN: f64 = 0.12;

/// The engine's slow half: plans segments one after the other.
#[derive(Clone, Debug)]
pub struct Planner {
    config: Config,
    zones: Zones,
    position_nm: [i32; 3],
    epoch: u8,
}

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
    /// Plans from a position on.
    pub fn new(config: &Config, position_nm: [i32; 3]) -> Self {
        Self { config: *config, zones: Zones::default(), position_nm, epoch: 0 }
    }

    /// The table used for segments planned from now on; `None`: no correction. On an error the old one stays.
    pub fn set_table(&mut self, table: Option<&Table>) -> Result<(), ZoneError> {
        match table {
            Some(table) => {
                super::zones::check(table)?;
                self.zones.load(|place| {
                    place.clone_from(table);
                    Ok(())
                })
            }
            None => {
                self.zones.clear();
                Ok(())
            }
        }
    }

    /// As [`Planner::set_table`], written in place by `fill`: a controller has no room for two. On an error no
    /// table is in use.
    pub fn load_table<E: From<ZoneError>>(
        &mut self,
        fill: impl FnOnce(&mut Table) -> Result<(), E>,
    ) -> Result<(), E> {
        self.zones.load(fill)
    }

    /// After a stop or a declared position: plans on from where the executor stands.
    pub fn resync(&mut self, position_nm: [i32; 3], epoch: u8) {
        (self.position_nm, self.epoch) = (position_nm, epoch);
    }

    /// Where the last planned segment ends, nm.
    pub const fn position_nm(&self) -> [i32; 3] {
        self.position_nm
    }

    /// Forgets the last planned segments: plans on from an earlier end.
    pub(crate) fn rewind(&mut self, position_nm: [i32; 3]) {
        self.position_nm = position_nm;
    }

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
        let ramp = self.ramp_ticks(round.feed);
        let segment = self.round(&round, ramp, |ramp_ticks| {
            let entry = (step >> 1).wrapping_mul(u64::from(ramp_ticks));
            let up = u64::from(phase_from_rad(sign * run.start_rad)) << 32;
            let down = up.wrapping_add(step.wrapping_mul(u64::from(cruise_ticks)));
            let (start, end) = (up.wrapping_sub(entry), down.wrapping_add(entry));
            Timing { start, up, end, step, step_q1: step << 1, ramp_ticks, cruise_ticks, ..Timing::default() }
        })?;
        let start = segment.start_nm;
        let approach =
            if start == here { None } else { Some(self.line_to(start, self.config.positioning_m_s)?) };
        self.position_nm = segment.end_nm;
        Ok((approach, segment))
    }

    /// One segment from where the last one ends.
    pub fn segment(&mut self, segment: &Segment) -> Result<Planned, Refused> {
        match *segment {
            Segment::Line { to_m, feed_m_s } => {
                let to = to_nm(&to_m, "end")?;
                self.line_to(to, feed_m_s)
            }
            Segment::Arc { centre_m, normal, sweep_rad, rise_m, feed_m_s } => {
                self.arc(centre_m, normal, sweep_rad, rise_m, feed_m_s)
            }
            Segment::Dwell { time_s } => self.dwell(time_s),
        }
    }

    /// A stream of set-points from where the last segment ends, at no more than a feed; its zone is chosen there.
    pub fn stream(&self, feed_m_s: f64) -> Result<StreamPlan, Refused> {
        positive(feed_m_s, "feed")?;
        self.check_feed(feed_m_s)?;
        let place_m = self.position_nm.map(|p| f64::from(p) * 1e-9);
        let zone = self.zones.choose(&Asked { place_m, radius_m: None, feed_m_s, ccw: None });
        let mut bounds = self.blank();
        if zone.is_some() {
            self.bound(&mut bounds);
        }
        let needs = StreamNeeds {
            operator: zone.map(|z| z.operator),
            tick_s: self.config.tick_s(),
            window_s: self.config.stream_window_s,
            feed_m_s,
            acceleration_m_s2: self.config.motion.acceleration_m_s2,
            hold_ticks: self.config.stream_hold_ticks,
            engage_ticks: self.config.engage_ticks(),
            offset_nm: bounds.offset_nm,
            slew_nm: bounds.slew_nm,
        };
        StreamPlan::build(&needs).ok_or(Refused::OutOfBounds("stream window"))
    }

    fn arc(
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
        let round = Round { centre, u, v, radius, rise_per_turn, feed, ccw: n[2] * sign >= 0.0 };
        let (ramp_ticks, cruise_ticks) = self.profile(sweep * radius, feed)?;
        let whole = (sweep / TAU * 18_446_744_073_709_551_616.0) as u128;
        let mut segment =
            self.round(&round, ramp_ticks, |ramp_ticks| share_out(whole, ramp_ticks, cruise_ticks))?;
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

    fn dwell(&mut self, time_s: f64) -> Result<Planned, Refused> {
        positive(time_s, "time")?;
        let Some(cruise_ticks) = in_u32(libm::ceil(time_s * f64::from(self.config.rate_hz))) else {
            return Err(Refused::OutOfBounds("time"));
        };
        let timing = Timing { cruise_ticks: cruise_ticks.max(1), ..Timing::default() };
        let mut segment = self.blank();
        (segment.timing, segment.corrected) = (timing, true);
        Ok(segment)
    }

    fn line_to(&mut self, to: [i32; 3], feed: f64) -> Result<Planned, Refused> {
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
        let (ramp_ticks, cruise_ticks) = self.profile(length, feed)?;
        let mut timing = share_out(LINE as u128, ramp_ticks, cruise_ticks);
        timing.clock_step = clock_step(ramp_ticks);
        let mut segment = self.blank();
        segment.kind = Kind::Line;
        for (i, axis) in segment.axes.iter_mut().enumerate() {
            *axis = Axis { base: from[i], u: u_nm[i], v: to_fixed(direction[i], 31), a: 0, b: 0 };
        }
        segment.timing = timing;
        segment.rise.end_term_q1 = end_term(&timing);
        let middle = [0, 1, 2].map(|i| f64::from(from[i]) * 1e-9 + 0.5 * span[i]);
        if let Some(zone) =
            self.zones.choose(&Asked { place_m: middle, radius_m: None, feed_m_s: feed, ccw: None })
        {
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
                segment.extended = true;
            }
        }
        segment.fall = segment.rise.turned_round();
        segment.end_nm = to;
        self.position_nm = to;
        Ok(segment)
    }

    /// Everything that a circle and an arc have in common. Lengthens the ramp until the law fits its number range.
    fn round(
        &self,
        round: &Round,
        ramp_ticks: u32,
        timing: impl Fn(u32) -> Timing,
    ) -> Result<Planned, Refused> {
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
        if let Some(zone) = &self.zones.choose(&asked) {
            let mut ramp = ramp_ticks;
            for _ in 0..6 {
                let slower = timing(ramp);
                if let Some((law, radial)) = self.law_on_arc(zone, &slower) {
                    (segment.rise, segment.timing) = (law, slower);
                    self.bound(&mut segment);
                    for axis in &mut segment.axes {
                        axis.a = to_fixed(radial * f64::from(axis.u), 0);
                        axis.b = to_fixed(radial * f64::from(axis.v), 0);
                    }
                    if let Some(profile) = &zone.profile {
                        let centre = seen_from(round.centre, zone.reference_m.unwrap_or(round.centre));
                        let arm = |a: [f64; 3]| a.map(|x| x * round.radius);
                        let motion = self.motion(&slower, TAU);
                        let extra = Extra::on_arc(profile, &motion, arm(round.u), arm(round.v), centre);
                        for (i, axis) in segment.axes.iter_mut().enumerate() {
                            let (a, b) = extra.steady(i);
                            (axis.a, axis.b) = (axis.a.saturating_add(a), axis.b.saturating_add(b));
                        }
                        (segment.extra, segment.extended) = (extra, true);
                    }
                    break;
                }
                ramp = ramp.saturating_mul(2).min(MAX_RAMP_TICKS);
            }
        }
        segment.proven = match self.zones.choose(&asked) {
            Some(zone) if segment.corrected => {
                (!segment.extended || segment.extra.fits()) && self.bounds_proven(&zone, &segment, round)
            }
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
        Ok(segment)
    }

    /// The operator's fixed-point form on a circle, and its gain at constant rate; `None` if a gain is beyond [`MAX_GAIN`].
    fn law_on_arc(&self, zone: &Built, timing: &Timing) -> Option<(Law, f64)> {
        let (operator, third_s3) = (&zone.operator, zone.third_s3);
        let rate = timing.step as f64 / TURN * TAU / self.config.tick_s();
        let t = f64::from(timing.ramp_ticks) * self.config.tick_s();
        let steady = operator.gain(&AngularMotion { rate, ..Default::default() });
        let ramp = FeedRamp { from_m_s: 0.0, to_m_s: rate, duration_s: t };
        let worst = (1..32)
            .map(|i| ramp.at(t * f64::from(i) / 32.0))
            .map(|[_, rate, acceleration, jerk, snap]| {
                let gain = operator.gain(&AngularMotion { rate, acceleration, jerk, snap });
                libm::fabs(gain.radial).max(libm::fabs(gain.tangential))
            })
            .fold(libm::fabs(steady.radial), f64::max);
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
        if !(worst <= MAX_GAIN && fits) {
            return None;
        }
        let [k1, k2, k3, k4, k5, k6, k7, k8, k9] = k.map(|(k, bits)| to_fixed(k, bits));
        Some((Law { k1, k2, k3, k4, k5, k6, k7, k8, k9, end_term_q1: 0 }, steady.radial))
    }

    /// Whether offset and change of offset stay within their bounds all along, with a tenth to spare.
    fn bounds_proven(&self, zone: &Built, segment: &Planned, round: &Round) -> bool {
        let tick_s = self.config.tick_s();
        let (operator, radius) = (&zone.operator, round.radius);
        let motion = self.motion(&segment.timing, TAU);
        let [offset_m, slew_m_s] = zone.profile.as_ref().map_or([0.0; 2], |profile| {
            let centre = seen_from(round.centre, zone.reference_m.unwrap_or(round.centre));
            Extra::worst_on_arc(profile, &motion, radius, centre)
        });
        let rate = motion.rate;
        let t = motion.ramp_s;
        let ramp = FeedRamp { from_m_s: 0.0, to_m_s: rate, duration_s: t };
        let gain = |i: u32| {
            let [_, rate, acceleration, jerk, snap] = ramp.at(t * f64::from(i) / 128.0);
            let gain = operator.gain(&AngularMotion { rate, acceleration, jerk, snap });
            (rate, gain.radial, gain.tangential)
        };
        (0..=128).all(|i| {
            // |d/dt (G − 1)e^{iθ}| = |G′ + iω(G − 1)|.
            let ((_, a, b), (rate, c, d)) = (gain(i), gain(i + 1));
            let per_s = 128.0 / t;
            let slew = libm::hypot((c - a) * per_s - rate * d, (d - b) * per_s + rate * c);
            let nm = |metres: f64| 1.1e9 * metres;
            nm(radius * libm::hypot(c, d) + offset_m) <= f64::from(segment.offset_nm)
                && nm((radius * slew + slew_m_s) * tick_s) <= f64::from(segment.slew_nm)
        })
    }

    /// Ramp and constant-rate ticks for a length at no more than a feed.
    fn profile(&self, length: f64, feed: f64) -> Result<(u32, u32), Refused> {
        // Two ramps alone cover feed·(ramp time): a short length takes a lower feed.
        let mut feed = feed;
        for _ in 0..60 {
            let t = f64::from(self.ramp_ticks(feed)) * self.config.tick_s();
            if feed * t <= length {
                break;
            }
            feed *= (length / (feed * t)).clamp(0.5, 0.98);
        }
        let ramp_ticks = self.ramp_ticks(feed);
        let cruise = libm::ceil(length / feed / self.config.tick_s()) - f64::from(ramp_ticks);
        let cruise = in_u32(cruise.max(0.0)).ok_or(Refused::OutOfBounds("duration"))?;
        Ok((ramp_ticks, cruise))
    }

    fn ramp_ticks(&self, feed: f64) -> u32 {
        ticks(FeedRamp::within(0.0, feed, &self.config.motion).duration_s * f64::from(self.config.rate_hz))
    }

    fn blank(&self) -> Planned {
        Planned {
            settle_step: clock_step(self.config.engage_ticks()),
            offset_nm: to_fixed(self.config.offset_m * 1e9, 0),
            slew_nm: to_fixed(self.config.slew_m_s * self.config.tick_s() * 1e9, 0),
            start_nm: self.position_nm,
            end_nm: self.position_nm,
            epoch: self.epoch,
            ..Planned::default()
        }
    }

    /// A zone applies: its bounds, or the image's if they are tighter.
    fn bound(&self, segment: &mut Planned) {
        let limits = self.zones.limits();
        let offset = f64::from(limits.offset_m).min(self.config.offset_m);
        let slew = f64::from(limits.slew_m_s).min(self.config.slew_m_s) * self.config.tick_s();
        (segment.offset_nm, segment.slew_nm) = (to_fixed(offset * 1e9, 0), to_fixed(slew * 1e9, 0));
        segment.corrected = true;
    }

    fn motion(&self, timing: &Timing, whole: f64) -> Motion {
        let tick_s = self.config.tick_s();
        Motion {
            rate: timing.step as f64 / TURN * whole / tick_s,
            ramp_s: f64::from(timing.ramp_ticks) * tick_s,
            tick_s,
            take_up_s: self.config.take_up_s,
        }
    }

    fn check_feed(&self, feed: f64) -> Result<(), Refused> {
        if feed > self.config.motion.feed_m_s { Err(Refused::OutOfBounds("feed")) } else { Ok(()) }
    }
}

const TURN: f64 = 18_446_744_073_709_551_616.0;
/// Phase units of a whole line.
const LINE: f64 = TURN / 4.0;

/// ∫ of a ramp's rate exceeds its sum by T²/12 of the rate's derivative: step/N·S′/12, in units of 2⁻³² turn, Q1.
fn end_term(timing: &Timing) -> i32 {
    let step_q32 = timing.step as f64 / 4_294_967_296.0;
    to_fixed(step_q32 / f64::from(timing.ramp_ticks) * FIRST / 12.0, 1)
}

/// Turns from start to end, whole ones included.
fn total_turns(timing: &Timing) -> f64 {
    let steps = f64::from(timing.ramp_ticks) + f64::from(timing.cruise_ticks);
    timing.step as f64 / TURN * steps
}

/// Shares a whole length out over two ramps and a constant rate.
fn share_out(whole: u128, ramp_ticks: u32, cruise_ticks: u32) -> Timing {
    let steps = u128::from(ramp_ticks) + u128::from(cruise_ticks);
    let step = ((whole / steps.max(1)) as u64) & !1;
    let up = (step >> 1).wrapping_mul(u64::from(ramp_ticks));
    Timing {
        start: 0,
        up,
        end: whole as u64,
        step,
        step_q1: step << 1,
        ramp_ticks,
        cruise_ticks,
        ..Timing::default()
    }
}

fn finite(values: &[f64], name: &'static str) -> Result<(), Refused> {
    if values.iter().all(|v| v.is_finite()) { Ok(()) } else { Err(Refused::NotANumber(name)) }
}

fn positive(value: f64, name: &'static str) -> Result<(), Refused> {
    if value.is_finite() && value > 0.0 { Ok(()) } else { Err(Refused::NotANumber(name)) }
}

fn to_nm(metres: &[f64; 3], name: &'static str) -> Result<[i32; 3], Refused> {
    finite(metres, name)?;
    if metres.iter().any(|m| libm::fabs(*m) > MAX_POSITION_M) {
        return Err(Refused::OutOfBounds("position"));
    }
    Ok(metres.map(|m| to_fixed(m * 1e9, 0)))
}

fn in_u32(value: f64) -> Option<u32> {
    (0.0..4e9).contains(&value).then_some(value as u32)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// X and Y of a point seen from another.
fn seen_from(point: [f64; 3], reference: [f64; 3]) -> [f64; 2] {
    [point[0] - reference[0], point[1] - reference[1]]
}

fn unit(a: [f64; 3]) -> Option<[f64; 3]> {
    let length = libm::sqrt(dot(a, a));
    (length > 1e-12).then(|| a.map(|x| x / length))
}
