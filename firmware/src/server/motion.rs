//! What the server needs of an engine.
use giotto_shared::wire::{CircleRun, FaultCause, MotionRefusal, MotionState, Pose, Refusal, SetPoint};

/// The engine as its tick last left it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Snapshot {
    /// What it is doing.
    pub state: MotionState,
    /// Ticks since boot, wrapping.
    pub tick: u32,
    /// Programmed position, nm.
    pub raw_nm: Pose,
    /// Corrected position, nm.
    pub corrected_nm: Pose,
    /// Ticks that were not finished when the next was due.
    pub tick_overruns: u32,
    /// Set-points whose offset was clamped.
    pub offset_clamps: u32,
    /// Set-points whose offset rate was clamped.
    pub slew_clamps: u32,
    /// Set-points that found no room on their way out.
    pub dropped_set_points: u32,
    /// Segments thrown away.
    pub dropped_segments: u32,
    /// Segments begun for which no zone of the table holds.
    pub uncorrected_segments: u32,
    /// Stops.
    pub stops: u32,
    /// Why nothing runs, if so.
    pub fault: Option<FaultCause>,
    /// The stop input is active.
    pub stop_input: bool,
}

/// A set-point with its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedSetPoint {
    /// Tick at which it held.
    pub tick: u32,
    /// The set-point.
    pub point: SetPoint,
    /// Last one of its run.
    pub last: bool,
}

/// An engine, seen from the link. Every call returns at once; what it asks for takes effect in the tick.
pub trait Motion {
    /// State, position and counts.
    fn snapshot(&self) -> Snapshot;

    /// Ticks since boot, as in the snapshot.
    fn now(&self) -> u32;

    /// Corrects with the table of this image from the next program on; `None`: no correction.
    ///
    /// # Errors
    /// [`MotionRefusal::Busy`] while a program runs: nothing has changed then. [`Refusal::Table`] or
    /// [`MotionRefusal::Terms`] if the table cannot be used: there is no correction then.
    fn install(&mut self, image: Option<&[u8]>) -> Result<(), Refusal>;

    /// Switches the correction off (`true`) or on, smoothly.
    fn bypass(&mut self, on: bool);

    /// Starts circles.
    ///
    /// # Errors
    /// Any [`MotionRefusal`]; nothing has started then.
    fn run_circle(&mut self, run: &CircleRun) -> Result<(), MotionRefusal>;

    /// Stops within limits.
    fn stop(&mut self);

    /// The segment in hand finishes; what waits is thrown away. Until the next program is accepted.
    fn hold(&mut self);

    /// Gives every so many ticks' set-point of a run to [`Motion::next_set_point`]; 0: none.
    fn subscribe(&mut self, every: u16);

    /// Set-points that wait to be taken.
    fn set_points_waiting(&self) -> usize;

    /// The oldest set-point not yet taken.
    fn next_set_point(&mut self) -> Option<TimedSetPoint>;
}
