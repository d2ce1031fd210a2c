//! The motion engine: programs in, set-points out, one a tick.
//!
//! | part | runs | does |
//! |---|---|---|
//! | [`Planner`] | background | turns a program and the table into integers: places exactly, the correction in single precision |
//! | [`Executor`] | timer interrupt | one set-point a tick from those integers |
//! | [`Engine`] | both in one thread | the two with a queue between, for the host and for simple boards |
//!
//! Positions are `i32` nanometres in machine coordinates (±2.147 m), so that bypass equals the input bit for bit and
//! nothing is lost at 1 m. Phases are integers: no drift however long a run.
//!
//! What a program may ask for, and what it gets: the feed along the path is the one asked for, or less where the length
//! or, on arcs of a program, the centripetal acceleration does not allow it (a [`CircleRun`] keeps its feed: it is there
//! to be measured). Segments join at an exact stop. Ramps are long enough that the *commanded* path, with what the operator
//! adds, keeps the configured acceleration (play taken up and friction pulses come on top of it), and that offset and slew
//! keep the bounds of the table: only where constant feed alone is beyond them is the offset cut, and counted.
//!
//! Measured, in simulation:
//!
//! | what | bar | measured | by |
//! |---|---|---|---|
//! | set-point against the law in `f64`, R ≤ 1 m | 0.1 µm | 0.013 µm | `set_points_are_the_law…` |
//! | sine and cosine over all 2³² phases | 5e-7 | 2.26e-9 | `cargo test --release -p giotto-shared -- --ignored sincos` |
//! | contour error left, of the uncorrected: circle; ellipse, figure of eight (stream) | 1, 2, 5 % | 0.03, 1.2, 3.7 % | `contour` |
//! | arc between lines, rounded rectangle; the same on a machine of two lags | 5 % | 0.2, 0.4 %; 0.6, 0.8 % | `contour` |
//! | commanded acceleration in 150 random programs | 5 m/s² | 4.91 m/s² | `random_programs_keep…` |
//! | random programs with stops, bypass and overruns | 1e9 ticks | 1.0e9 ticks of 72,599 programs (seed 1): no fault without its cause, 55,538 undisturbed ends exact to the nanometre | `cargo test --release -p giotto-firmware -- --ignored endurance` |
//!
//! On arcs with joints the residue was the third cumulant, which no circle shows: it is assumed to be that of a lag
//! and a moving average with the table's κ2 and κ4, if there are such
//! ([`third_of_lag_and_average`](giotto_shared::model::Cumulants::third_of_lag_and_average)), and acts only where the
//! feed changes on an arc. At constant feed the set-points are those of κ2 and κ4 alone.
mod arm;
pub mod bench;
mod config;
mod descent;
mod engage;
mod executor;
mod guard;
mod hysteresis;
mod planned;
mod planner;
mod profile_terms;
mod ramp;
mod stream;
mod zones;

pub use config::{Config, ConfigError, MIN_RAMP_TICKS, RATE_HZ};
pub use executor::{Executor, Inbox};
pub use giotto_shared::path::{
    CircleRun, ExactArc, ExactCircle, ExactSegment, MAX_POSITION_M, MAX_RADIUS_M, MotionLimits,
    Quantity, Segment,
};
pub use planned::Planned;
pub use planner::{Planner, Refused};
pub(crate) use stream::{FARTHEST_NM, farthest_nm};
pub use stream::{PLACES, Stream, StreamCounters, StreamPlan, StreamSample, StreamState};
pub use zones::ZoneError;

use giotto_shared::table::Table;

/// Segments that wait in the queue of an [`Engine`], at most.
pub const QUEUE: usize = 7;

/// Bits of [`Output::flags`].
pub mod flag {
    /// The programmed position moves.
    pub const MOVING: u16 = 1;
    /// At constant feed.
    pub const CRUISE: u16 = 2;
    /// Standing while the offset moves to what the next segment starts with.
    pub const SETTLING: u16 = 4;
    /// Offset or its change was cut to its bound in this tick.
    pub const CUT: u16 = 8;
}

/// One set-point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Output {
    /// As programmed, nm.
    pub nominal_nm: [i32; 3],
    /// As commanded to the drives, nm.
    pub corrected_nm: [i32; 3],
    /// Bits of [`flag`].
    pub flags: u16,
}

impl Output {
    #[inline(always)]
    fn new(nominal_nm: [i32; 3], offset_nm: [i32; 3], flags: u16) -> Self {
        let ([nx, ny, nz], [ox, oy, oz]) = (nominal_nm, offset_nm);
        let corrected_nm = [
            nx.wrapping_add(ox),
            ny.wrapping_add(oy),
            nz.wrapping_add(oz),
        ];
        Self {
            nominal_nm,
            corrected_nm,
            flags,
        }
    }
}

/// Why nothing runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// A tick came late or was lost.
    Overrun,
    /// A segment did not start where the machine stands.
    Discontinuity,
    /// Set-points of a stream stayed away.
    Starved,
}

/// Counts since start; they wrap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Counters {
    /// Segments finished.
    pub segments: u32,
    /// Segments begun for which no zone of the table holds.
    pub uncorrected: u32,
    /// Segments thrown away after a stop or in a fault.
    pub dropped: u32,
    /// Stops.
    pub stops: u32,
    /// Ticks in which the offset was cut.
    pub offset_cuts: u32,
    /// Ticks in which the change of the offset was cut.
    pub slew_cuts: u32,
    /// Overruns reported by the board.
    pub overruns: u32,
}

/// Planner, queue and executor in one.
pub struct Engine {
    planner: Planner,
    queue: heapless::spsc::Queue<Planned, { QUEUE + 1 }>,
    executor: Executor,
}

impl Engine {
    /// Standing at the machine's origin, without a table, correction engaged.
    pub fn new(config: Config) -> Result<Self, ConfigError> {
        let config = config.checked()?;
        Ok(Self {
            planner: Planner::new(&config, [0; 3]),
            queue: heapless::spsc::Queue::new(),
            executor: Executor::new([0; 3], config.engage_ticks(), false),
        })
    }

    /// The table for segments accepted from now on; `None`: no correction. Acts between segments. On an
    /// error the old one stays.
    pub fn load(&mut self, table: Option<&Table>) -> Result<(), ZoneError> {
        self.planner.set_table(table)
    }

    /// Engages or disengages the correction, at any time, without a step.
    pub fn set_bypass(&mut self, bypass: bool) {
        self.executor.set_bypass(bypass);
    }

    /// Whether the correction is disengaged or on its way to be.
    pub fn bypass(&self) -> bool {
        self.executor.bypass()
    }

    /// Declares the position while idle.
    pub fn set_position(&mut self, position_nm: [i32; 3]) -> Result<(), Refused> {
        if !self.idle() || !self.executor.set_position(position_nm) {
            return Err(Refused::Busy);
        }
        Ok(())
    }

    /// Moves to where the circle starts, then runs it.
    pub fn run_circle(&mut self, run: &CircleRun) -> Result<(), Refused> {
        self.ready(2)?;
        let run = run.exact()?;
        let mut planned = Planned::default();
        // Room for both was checked.
        if self.planner.approach(&run, &mut planned)? {
            let _ = self.queue.enqueue(planned);
        }
        self.planner.circle(&run, &mut planned)?;
        let _ = self.queue.enqueue(planned);
        Ok(())
    }

    /// Appends a segment; it runs with an exact stop at its ends.
    pub fn push(&mut self, segment: &Segment) -> Result<(), Refused> {
        self.ready(1)?;
        let exact = segment.exact(self.planner.position_nm())?;
        let mut planned = Planned::default();
        self.planner.segment(&exact, &mut planned)?;
        let _ = self.queue.enqueue(planned);
        Ok(())
    }

    fn ready(&mut self, room: usize) -> Result<(), Refused> {
        if self.executor.fault().is_some() {
            return Err(Refused::Fault);
        }
        if self.executor.stopping() || self.queue.capacity() - self.queue.len() < room {
            return Err(Refused::Busy);
        }
        if self.idle() {
            self.planner
                .resync(self.executor.rest_nm(), self.executor.epoch());
        }
        Ok(())
    }

    /// Stops within the limits from the next tick on; what is queued is thrown away.
    pub fn stop(&mut self) {
        self.executor.stop();
    }

    /// One tick.
    #[inline]
    pub fn tick(&mut self) -> Output {
        self.executor.tick(&mut self.queue)
    }

    /// Nothing in hand and nothing queued.
    pub fn idle(&self) -> bool {
        self.executor.idle() && self.queue.is_empty()
    }

    /// The board saw that a tick came late or was lost.
    pub fn overrun(&mut self) {
        self.executor.overrun();
    }

    /// Why nothing runs, if so.
    pub fn fault(&self) -> Option<Fault> {
        self.executor.fault()
    }

    /// Accepts segments again after a fault; `false` while still moving.
    pub fn clear_fault(&mut self) -> bool {
        self.executor.clear_fault()
    }

    /// Counts since start.
    pub fn counters(&self) -> &Counters {
        self.executor.counters()
    }
}

#[cfg(test)]
mod tests;
