//! Programs run on a controller: segments sent ahead of the machine as long as its queue takes them.
use super::client::Controller;
use super::error::ControllerError;
use super::recording::Recording;
use giotto_shared::path::{Segment, Step};
use giotto_shared::wire::{Command, ExactSegment, MotionRefusal, Refusal, Status};
use std::time::Duration;

/// From one attempt to append to a full queue to the next, unless set-points come before.
const ROOM_AFTER: Duration = Duration::from_millis(20);

/// Why a program was not run to its end.
#[derive(Debug, thiserror::Error)]
#[error("{error}")]
pub struct ProgramError {
    /// The step that could not be sent (0 is the first), if it was one.
    pub step: Option<usize>,
    /// Why.
    pub error: ControllerError,
}

impl From<ControllerError> for ProgramError {
    fn from(error: ControllerError) -> Self {
        Self { step: None, error }
    }
}

/// All steps in the engine's numbers, from a place on.
fn exact(steps: &[Step], from_nm: [i32; 3]) -> Result<Vec<(ExactSegment, u32)>, ProgramError> {
    let mut at = from_nm;
    let one = |(step, wanted): (usize, &Step)| {
        let segment = wanted.segment.exact(at).map_err(|error| ProgramError {
            step: Some(step),
            error: ControllerError::Path(error),
        })?;
        at = segment.end_nm(at);
        Ok((segment, (wanted.tolerance_m.max(0.0) * 1e9) as u32))
    };
    steps.iter().enumerate().map(one).collect()
}

impl Controller {
    /// Runs a program from where the machine stands and returns every `every`th set-point. Nothing moves if a number of any
    /// step cannot be sent; a step that the controller refuses ends the program after those before it.
    ///
    /// # Errors
    /// [`ControllerError::Path`] and [`ControllerError::Refused`] with the step; as [`Controller::run_circle`] otherwise.
    ///
    /// ```
    /// use giotto_link::{OpenOptions, Port, Segment, Step, open};
    ///
    /// let line = Segment::Line { to_m: [0.01, 0.0, 0.0], feed_m_s: 0.05 };
    /// let mut controller = open(&Port::Sim, &OpenOptions::default(), &mut |_| {})?;
    /// let run = controller.run_program(&[Step { segment: line, tolerance_m: 0.0 }], 1)?;
    /// // It goes there and stands, and its limits make it slower than the feed alone.
    /// let last = run.points.last().unwrap();
    /// assert!((last.programmed_m[0] - 0.01).abs() < 1e-8);
    /// assert!(last.time_s > 0.01 / 0.05);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn run_program(&mut self, steps: &[Step], every: u16) -> Result<Recording, ProgramError> {
        let from_nm = self.status()?.raw_nm;
        let segments = exact(steps, from_nm)?;
        self.begin_recording(every)?;
        self.command(Command::Begin)?;
        let sent = self.append_all(&segments);
        let recording = self.end_recording(every);
        match sent {
            // What was recorded up to there is wanted.
            Err(error) if !matches!(error.error, ControllerError::Stopped) => Err(error),
            _ => Ok(recording?),
        }
    }

    /// Sends a program and returns when all of it is accepted: where it will end, nm.
    ///
    /// # Errors
    /// As [`Controller::run_program`].
    pub fn send_program(&mut self, steps: &[Step]) -> Result<[i32; 3], ProgramError> {
        let from_nm = self.status()?.raw_nm;
        let segments = exact(steps, from_nm)?;
        self.command(Command::Begin)?;
        self.append_all(&segments)?;
        Ok(segments
            .iter()
            .fold(from_nm, |at, (segment, _)| segment.end_nm(at)))
    }

    /// Moves in a straight line to a place, nm, once what runs has come to its end, and returns when the machine stands there.
    ///
    /// # Errors
    /// As [`Controller::run_program`].
    pub fn move_to(&mut self, to_nm: [i32; 3], feed_m_s: f64) -> Result<(), ControllerError> {
        if self.at_rest()?.raw_nm == to_nm {
            return Ok(());
        }
        let to_m = to_nm.map(|nm| f64::from(nm) * 1e-9);
        let step = Step {
            segment: Segment::Line { to_m, feed_m_s },
            tolerance_m: 0.0,
        };
        self.send_program(&[step]).map_err(|error| error.error)?;
        self.at_rest().map(drop)
    }

    /// Waits until nothing moves: how the controller stands then.
    pub(super) fn at_rest(&mut self) -> Result<Status, ControllerError> {
        loop {
            let status = self.status()?;
            if !status.motion.is_run() {
                return Ok(status);
            }
            self.listen(ROOM_AFTER)?;
        }
    }

    fn append_all(&mut self, segments: &[(ExactSegment, u32)]) -> Result<(), ProgramError> {
        for (step, &(segment, tolerance_nm)) in segments.iter().enumerate() {
            if let Err(error) = self.append(&Command::Append {
                segment,
                tolerance_nm,
            }) {
                // What was accepted runs to its end.
                let _ = self.command(Command::End);
                return Err(ProgramError {
                    step: Some(step),
                    error,
                });
            }
        }
        Ok(self.command(Command::End)?)
    }

    /// Waits for room.
    pub(super) fn append(&mut self, append: &Command) -> Result<(), ControllerError> {
        loop {
            if self.obey()? {
                return Err(ControllerError::Stopped);
            }
            match self.command(append.clone()) {
                Err(ControllerError::Refused(Refusal::Motion(MotionRefusal::QueueFull))) => {
                    self.wait_for_set_points(ROOM_AFTER)?;
                }
                other => return other,
            }
        }
    }
}
