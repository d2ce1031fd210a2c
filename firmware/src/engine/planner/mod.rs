//! From what a program asks for to integers that the tick runs. Runs in the background, in `f64`.
//!
//! | file | plans |
//! |---|---|
//! | here | what is asked for, dwells, streams, the choice of ramp and feed |
//! | `round` | circles, arcs and helices |
//! | `line` | lines |
//! | `worst` | bounds: the largest offset, slew and acceleration of what is planned |
mod line;
mod numbers;
mod round;
mod timing;
mod worst;

use super::config::{Config, ticks};
use super::extra::Motion;
use super::planned::{Planned, Timing};
use super::ramp::clock_step;
use super::stream::{StreamNeeds, StreamPlan};
use super::zones::{Asked, ZoneError, Zones};
use giotto_shared::fixed::to_fixed;
use giotto_shared::path::{FeedRamp, Segment};
use giotto_shared::table::Table;
use numbers::{in_u32, positive, to_nm};
use timing::TURN;

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

/// The engine's slow half: plans segments one after the other.
#[derive(Clone, Debug)]
pub struct Planner {
    config: Config,
    zones: Zones,
    position_nm: [i32; 3],
    epoch: u8,
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

    /// Ramp and constant-rate ticks for a length at no more than a feed.
    fn profile(&self, length: f64, feed: f64, stretch: f64) -> Result<(u32, u32), Refused> {
        // Two ramps alone cover feed·(ramp time): a short length takes a lower feed.
        let mut feed = feed;
        for _ in 0..60 {
            let t = f64::from(self.ramp_ticks(feed, stretch)) * self.config.tick_s();
            if feed * t <= length {
                break;
            }
            feed *= (length / (feed * t)).clamp(0.5, 0.98);
        }
        let ramp_ticks = self.ramp_ticks(feed, stretch);
        let cruise = libm::ceil(length / feed / self.config.tick_s()) - f64::from(ramp_ticks);
        let cruise = in_u32(cruise.max(0.0)).ok_or(Refused::OutOfBounds("duration"))?;
        Ok((ramp_ticks, cruise))
    }

    /// The quickest ramp within the limits along the path, made longer by a factor.
    fn ramp_ticks(&self, feed: f64, stretch: f64) -> u32 {
        let duration_s = FeedRamp::within(0.0, feed, &self.config.motion).duration_s * stretch;
        ticks(duration_s * f64::from(self.config.rate_hz))
    }

    /// The factor for a next try at a ramp in which an acceleration was found; `None`: it is within the limit, with
    /// what a sweep over a ramp may miss to spare.
    fn stretch(&self, stretch: f64, acceleration_m_s2: f64, limit_m_s2: f64) -> Option<f64> {
        let over = acceleration_m_s2 / (0.985 * limit_m_s2);
        (over > 1.0 && stretch < 16.0).then(|| stretch * (1.01 * libm::sqrt(over)).clamp(1.01, 2.0))
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
