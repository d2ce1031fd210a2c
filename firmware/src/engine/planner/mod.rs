//! From what a program asks for to integers that the tick runs. Runs in the background.
//!
//! Places and angles come exact, as whole nanometres and phases, and stay so. The correction is
//! millimetres at most and computed in single precision, which a Cortex-M4F has; 24 bits of them are below a nanometre.
//!
//! | file | plans |
//! |---|---|
//! | here | what is asked for, dwells, streams, the choice of feed |
//! | `circle`, `arc`, `line` | each its geometry and timing |
//! | `circular` | what circles and arcs have in common |
//! | `law`, `terms` | the correction, from the numbers of a zone to those of the tick |
//! | `joints` | what an arm's joints ask for |
//! | `soft` | the soft limits |
//! | `worst`, `demand` | what a path asks for at most, and the ramp that keeps it within the bounds |
//! | `machine` | the configuration, in the form that planning needs |
//! | `timing`, `numbers` | phases, ticks; numbers at the border, vectors |
mod arc;
mod circle;
mod circular;
mod demand;
mod joints;
mod law;
mod line;
mod machine;
mod numbers;
mod soft;
mod terms;
mod timing;
mod worst;

use super::config::{Config, whole_above};
use super::planned::{Kind, Planned, Timing};
use super::ramp::clock_step;
use super::stream::{StreamNeeds, StreamPlan};
use super::zones::{Asked, ZoneError, Zones};
use demand::Bounds;
use giotto_shared::path::{ExactSegment, PathError, Quantity};
use giotto_shared::table::Table;
use machine::Machine;
use numbers::{inside, positive};
use timing::{Motion, turns_per_tick};

/// Why a segment was not accepted. Nothing has moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// A number is not finite, or not positive where it must be.
    NotANumber(Quantity),
    /// Beyond what the configuration or the image allows.
    OutOfBounds(Quantity),
    /// Beyond the soft limits of this axis (0 is X).
    SoftLimit(u8),
    /// The queue is full, or the engine is not at rest where it has to be.
    Busy,
    /// A fault has to be cleared first.
    Fault,
}

impl From<PathError> for Refused {
    fn from(error: PathError) -> Self {
        match error {
            PathError::NotANumber(quantity) => Self::NotANumber(quantity),
            PathError::OutOfBounds { quantity, .. } => Self::OutOfBounds(quantity),
        }
    }
}

/// The engine's slow half: plans segments one after the other.
#[derive(Clone, Debug)]
pub struct Planner {
    machine: Machine,
    zones: Zones,
    position_nm: [i32; 3],
    epoch: u8,
}

impl Planner {
    /// Plans from a position on.
    pub fn new(config: &Config, position_nm: [i32; 3]) -> Self {
        Self {
            machine: Machine::new(config),
            zones: Zones::default(),
            position_nm,
            epoch: 0,
        }
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

    /// Other limits, for what is planned from now on.
    pub fn set_config(&mut self, config: &Config) {
        self.machine = Machine::new(config);
    }

    /// After a stop or a declared position: plans on from where the executor stands.
    pub fn resync(&mut self, position_nm: [i32; 3], epoch: u8) {
        (self.position_nm, self.epoch) = (position_nm, epoch);
    }

    /// Where the last planned segment ends, nm.
    pub const fn position_nm(&self) -> [i32; 3] {
        self.position_nm
    }

    /// One segment from where the last one ends, written in place: it is large.
    #[inline(never)]
    pub fn segment(
        &mut self,
        segment: &ExactSegment,
        planned: &mut Planned,
    ) -> Result<(), Refused> {
        match segment {
            ExactSegment::Line { to_nm, feed_m_s } => {
                inside(to_nm, Quantity::Position)?;
                self.soft_place(to_nm)?;
                self.line_to(*to_nm, positive(*feed_m_s, Quantity::Feed)?, planned)
            }
            ExactSegment::Arc(arc) => self.arc(arc, planned),
            ExactSegment::Dwell { time_s } => {
                let ticks = whole_above(positive(*time_s, Quantity::Time)? * self.machine.rate_hz);
                if ticks == u32::MAX {
                    return Err(Refused::OutOfBounds(Quantity::Time));
                }
                self.dwell(ticks, planned);
                Ok(())
            }
        }
    }

    /// Takes out, at rest, the offset that the last segment left there: before a stream, which begins with none.
    pub fn clear(&self, planned: &mut Planned) {
        self.dwell(1, planned);
        planned.kind = Kind::Clear;
    }

    /// A stream of set-points from where the last segment ends, at no more than a feed, for a [`Stream`](super::Stream) with so
    /// many places; its zone is chosen there.
    #[inline(never)]
    pub fn stream(&self, feed_m_s: f32, places: usize) -> Result<StreamPlan, Refused> {
        let feed_m_s = positive(feed_m_s, Quantity::Feed)?;
        self.check_feed(feed_m_s)?;
        let place_m = self.here_m();
        let zone = self.zones.choose(&Asked {
            path_m: &[place_m],
            place_m,
            radius_m: None,
            feed_m_s,
            ccw: None,
        });
        let bounds = self.bounds(zone.is_some());
        let needs = StreamNeeds {
            epoch: self.epoch,
            longest: places as u32,
            arm: self.arm_plan(zone.as_ref()),
            operator: zone.map(|z| z.operator),
            rate_hz: self.machine.rate_hz,
            window_s: self.machine.stream_window_s,
            feed_m_s,
            acceleration_m_s2: self.machine.acceleration_m_s2,
            jerk_m_s3: self.machine.jerk_m_s3,
            hold_ticks: self.machine.stream_hold_ticks,
            engage_ticks: self.machine.engage_ticks,
            bounds_nm: self.machine.bounds_nm(&bounds),
        };
        StreamPlan::build(&needs).ok_or(Refused::OutOfBounds(Quantity::Window))
    }

    fn dwell(&self, ticks: u32, segment: &mut Planned) {
        self.blank(segment);
        segment.timing.cruise_ticks = ticks.max(1);
        segment.corrected = true;
    }

    /// Ramp and constant-rate ticks for a length at no more than a feed.
    fn profile(&self, length: f32, feed: f32, stretch: f32) -> Result<(u32, u32), Refused> {
        // Two ramps alone cover feed·(ramp time): a short length takes a lower feed.
        let mut feed = feed;
        for _ in 0..60 {
            let t = self.machine.ramp_ticks(feed, stretch) as f32 * self.machine.tick_s;
            if feed * t <= length {
                break;
            }
            feed *= (length / (feed * t)).clamp(0.5, 0.98);
        }
        let ramp_ticks = self.machine.ramp_ticks(feed, stretch);
        let ticks = whole_above(length / feed * self.machine.rate_hz);
        if ticks == u32::MAX {
            return Err(Refused::OutOfBounds(Quantity::Time));
        }
        Ok((ramp_ticks, ticks.saturating_sub(ramp_ticks)))
    }

    /// Nothing yet: stands where the last segment ends, within the bounds of the image.
    fn blank(&self, segment: &mut Planned) {
        *segment = Planned {
            settle_step: clock_step(self.machine.engage_ticks),
            start_nm: self.position_nm,
            end_nm: self.position_nm,
            epoch: self.epoch,
            arm: self.arm_plan(None),
            ..Planned::default()
        };
        self.bound(segment, &self.bounds(false));
        segment.corrected = false;
    }

    /// The bounds of the image; where a zone applies those of the table, if they are tighter.
    fn bounds(&self, zone: bool) -> Bounds {
        let Machine {
            offset_m, slew_m_s, ..
        } = self.machine;
        if !zone {
            return Bounds { offset_m, slew_m_s };
        }
        let limits = self.zones.limits();
        Bounds {
            offset_m: offset_m.min(limits.offset_m),
            slew_m_s: slew_m_s.map(|slew_m_s| slew_m_s.min(limits.slew_m_s)),
        }
    }

    /// A zone applies, with its bounds.
    fn bound(&self, segment: &mut Planned, bounds: &Bounds) {
        (segment.offset_nm, segment.slew_nm) = self.machine.bounds_nm(bounds);
        segment.corrected = true;
    }

    /// `per_turn`: what a turn of phase counts.
    fn motion(&self, timing: &Timing, per_turn: f32) -> Motion {
        Motion {
            rate: turns_per_tick(timing) * per_turn * self.machine.rate_hz,
            ramp_s: timing.ramp_ticks as f32 * self.machine.tick_s,
            tick_s: self.machine.tick_s,
            take_up_ticks: self.machine.take_up_ticks,
        }
    }

    /// Largest feed of the machine, m/s.
    pub const fn feed_limit(&self) -> f32 {
        self.machine.feed_m_s
    }

    fn check_feed(&self, feed: f32) -> Result<(), Refused> {
        if feed > self.machine.feed_m_s {
            Err(Refused::OutOfBounds(Quantity::Feed))
        } else {
            Ok(())
        }
    }
}
