//! What the server needs of an engine.
use crate::engine::Config;
use giotto_shared::wire::{
    ExactCircle, ExactSegment, FaultCause, MotionRefusal, MotionState, Pose, PositionState,
    Refusal, SetPoint,
};

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
    /// Segments finished.
    pub segments: u32,
    /// Segments, or batches of set-points, that wait.
    pub queued: u8,
    /// Ticks of a stream without a usable set-point.
    pub missing_set_points: u32,
    /// Set-points of a stream that came after their tick.
    pub late_set_points: u32,
    /// Set-points of a stream farther from the one before than the feed allows.
    pub rejected_set_points: u32,
    /// Why nothing runs, if so.
    pub fault: Option<FaultCause>,
    /// The stop input is active.
    pub stop_input: bool,
    /// What is known of where the machine stands.
    pub position: PositionState,
    /// Override of the feed, percent.
    pub override_percent: u8,
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

    /// Whether it plans the path itself. One that corrects the set-points of another controller does not: nothing is stopped
    /// there because a host falls silent, and tables are exchanged while the machine moves.
    fn plans(&self) -> bool {
        true
    }

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
    fn run_circle(&mut self, run: &ExactCircle) -> Result<(), MotionRefusal>;

    /// Opens a program.
    ///
    /// # Errors
    /// Any [`MotionRefusal`]; nothing is open then.
    fn begin(&mut self) -> Result<(), MotionRefusal>;

    /// Appends to it, leaving the joint with the segment before by no more than a tolerance.
    ///
    /// # Errors
    /// [`MotionRefusal::QueueFull`]: to be tried again. [`MotionRefusal::NoProgram`], or what does not fit; the program stays as
    /// it was.
    fn append(&mut self, segment: &ExactSegment, tolerance_nm: u32) -> Result<(), MotionRefusal>;

    /// Opens a stream of set-points, at no more than a feed; the tick begins when so many wait.
    ///
    /// # Errors
    /// Any [`MotionRefusal`]; nothing is open then.
    fn begin_stream(&mut self, feed_m_s: f32, ahead: u16) -> Result<(), MotionRefusal>;

    /// The next set-points of it: for each axis the change of the step from one to the next, in postcard's i32, nm.
    ///
    /// # Errors
    /// [`MotionRefusal::QueueFull`]: to be tried again. [`MotionRefusal::NoProgram`], or places that are none; the stream stays as
    /// it was.
    fn points(&mut self, bytes: &[u8]) -> Result<(), MotionRefusal>;

    /// The program has no more segments, the stream no more set-points.
    ///
    /// # Errors
    /// [`MotionRefusal::NoProgram`]; for a stream also [`MotionRefusal::QueueFull`].
    fn end(&mut self) -> Result<(), MotionRefusal>;

    /// Stops within limits.
    fn stop(&mut self);

    /// The segment in hand finishes; what waits is thrown away. Until the next program is accepted.
    fn hold(&mut self);

    /// Plans within these limits from now on.
    ///
    /// # Errors
    /// [`MotionRefusal::Busy`].
    fn configure(&mut self, config: &Config) -> Result<(), MotionRefusal>;

    /// Holds the feed within limits (`true`), or lets it go on.
    ///
    /// # Errors
    /// [`MotionRefusal::NotHeld`]: nothing runs, or a stream does.
    fn pause(&mut self, on: bool) -> Result<(), MotionRefusal>;

    /// Share of the feed asked for, percent, of what is accepted from now on.
    fn set_override(&mut self, percent: u8);

    /// Forgets a fault, at rest, in the next tick.
    ///
    /// # Errors
    /// [`MotionRefusal::Busy`].
    fn clear_fault(&mut self) -> Result<(), MotionRefusal>;

    /// Says where the machine stands, at rest, nm.
    ///
    /// # Errors
    /// [`MotionRefusal::Busy`]; [`MotionRefusal::Path`] if that is no place.
    fn declare(&mut self, place_nm: Pose) -> Result<(), MotionRefusal>;

    /// Gives every so many ticks' set-point of a run to [`Motion::next_set_point`]; 0: none.
    fn subscribe(&mut self, every: u16);

    /// Set-points that wait to be taken.
    fn set_points_waiting(&self) -> usize;

    /// The oldest set-point not yet taken.
    fn next_set_point(&mut self) -> Option<TimedSetPoint>;
}
