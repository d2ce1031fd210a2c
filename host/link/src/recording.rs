//! Runs on a controller, and the set-points it made of them.
use super::client::Controller;
use super::error::ControllerError;
use giotto_shared::path::CircleRun;
use giotto_shared::wire::{Command, Pose, SUPERVISE_MS};
use giotto_shared::{Direction, Plane};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::Duration;

/// How often the controller hears from us during a run, by the link's clock, so that it does not take us for dead.
const KEEP_ALIVE: Duration = Duration::from_millis(SUPERVISE_MS as u64 / 4);
/// How often it is looked whether the person here has had enough.
const ATTENTION: Duration = Duration::from_millis(50);

/// `laps` turns about the origin in XY from polar angle 0; SI.
pub const fn circle(radius_m: f64, feed_m_s: f64, direction: Direction, laps: u32) -> CircleRun {
    CircleRun {
        centre_m: [0.0; 3],
        radius_m,
        feed_m_s,
        plane: Plane::Xy,
        direction,
        laps,
        start_rad: 0.0,
    }
}

/// One set-point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetPointRecord {
    /// Since the first set-point, s.
    pub time_s: f64,
    /// As programmed, m.
    pub programmed_m: [f64; 3],
    /// As commanded to the drives, m.
    pub corrected_m: [f64; 3],
}

/// All set-points of a run, evenly spaced: from rest to rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Distance in time, s.
    pub dt_s: f64,
    /// The set-points.
    pub points: Vec<SetPointRecord>,
    /// The run was stopped before its end, whoever asked for it.
    pub stopped: bool,
}

fn metres(nm: Pose) -> [f64; 3] {
    nm.map(|nm| f64::from(nm) * 1e-9)
}

impl Controller {
    /// Starts circles; returns at once.
    ///
    /// # Errors
    /// [`ControllerError::Path`], [`ControllerError::Refused`] and those of the link.
    pub fn start_circle(&mut self, circle: &CircleRun) -> Result<(), ControllerError> {
        self.command(Command::RunCircle(circle.exact()?))
    }

    /// Runs circles to their end and returns every `every`th set-point.
    ///
    /// # Errors
    /// [`ControllerError::Refused`]; [`ControllerError::SetPointsLost`] if the record has a gap; those of the link.
    pub fn run_circle(
        &mut self,
        circle: &CircleRun,
        every: u16,
    ) -> Result<Recording, ControllerError> {
        self.begin_recording(every)?;
        self.start_circle(circle)?;
        self.end_recording(every)
    }

    /// While a run is recorded it is stopped as soon as `wish` is set; what was recorded is kept.
    pub fn stop_on(&mut self, wish: Arc<AtomicBool>) {
        self.wish = Some(wish);
    }

    /// Stops what runs if that is wanted; whether it was, now or before.
    pub(super) fn obey(&mut self) -> Result<bool, ControllerError> {
        let wanted = self.wish.as_ref().is_some_and(|wish| wish.load(Relaxed));
        if wanted && !self.stopped {
            self.stopped = true;
            self.command(Command::Stop)?;
        }
        Ok(self.stopped)
    }

    /// Set-points are put away from now on.
    pub(super) fn begin_recording(&mut self, every: u16) -> Result<(), ControllerError> {
        // What is left of another run comes before the second answer.
        self.command(Command::Subscribe {
            every: 0,
            on_link: true,
        })?;
        self.command(Command::Subscribe {
            every: every.max(1),
            on_link: true,
        })?;
        self.set_points.clear();
        self.stopped = false;
        self.stops_before = self.status()?.counters.stops;
        Ok(())
    }

    /// All set-points to the end of the run.
    pub(super) fn end_recording(&mut self, every: u16) -> Result<Recording, ControllerError> {
        let every = every.max(1);
        // The last set-point is that of the next tick of the record after rest: so long by the controller's own ticks, and as
        // long again in case there was no room for it at first.
        let patience = 2 * u32::from(every) + self.identity().tick_hz / 2;
        let mut spoke_at = self.now();
        let mut rests_since = None;
        while !self.set_points.last().is_some_and(|batch| batch.last) {
            self.obey()?;
            let came = self.wait_for_set_points(ATTENTION)?;
            if self.now() < spoke_at + KEEP_ALIVE {
                continue;
            }
            spoke_at = self.now();
            let status = self.status()?;
            if status.motion.is_run() {
                rests_since = None;
                continue;
            }
            let since = *rests_since.get_or_insert(status.tick);
            if !came && status.tick.wrapping_sub(since) > patience {
                return Err(ControllerError::SetPointsLost { lost: 1 });
            }
        }
        self.command(Command::Subscribe {
            every: 0,
            on_link: true,
        })?;
        // By the person here, by the stop input, or by another program.
        self.stopped |= self.status()?.counters.stops != self.stops_before;
        self.recording(every)
    }

    fn recording(&mut self, every: u16) -> Result<Recording, ControllerError> {
        let dt_s = f64::from(every) / f64::from(self.identity().tick_hz);
        let mut points = Vec::new();
        let mut due = None;
        let mut lost = 0;
        for batch in self.set_points.drain(..) {
            let gap = batch.tick.wrapping_sub(due.unwrap_or(batch.tick));
            lost += (gap / u32::from(every)) as usize;
            due = Some(
                batch
                    .tick
                    .wrapping_add(batch.points.len() as u32 * u32::from(every)),
            );
            points.extend(batch.points);
        }
        if lost > 0 {
            return Err(ControllerError::SetPointsLost { lost });
        }
        let timed = points
            .into_iter()
            .enumerate()
            .map(|(index, point)| SetPointRecord {
                time_s: index as f64 * dt_s,
                programmed_m: metres(point.raw_nm),
                corrected_m: metres(point.corrected_nm),
            });
        Ok(Recording {
            dt_s,
            points: timed.collect(),
            stopped: self.stopped,
        })
    }
}
