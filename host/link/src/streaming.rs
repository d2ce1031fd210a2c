//! Set-points streamed to a controller: one a tick, sent ahead of it as long as its queue takes them.
use super::client::Controller;
use super::error::ControllerError;
use super::recording::Recording;
use giotto_shared::wire::{Chunk, Command, FaultCause, POINTS, Status, Steps};

/// What came of a stream.
#[derive(Clone, Debug, PartialEq)]
pub struct Streamed {
    /// Its set-points.
    pub recording: Recording,
    /// Ticks for which no set-point had come in time, and which the controller bridged.
    pub missing: u32,
    /// Set-points that came too late for their tick.
    pub late: u32,
    /// Set-points farther from the one before than the feed allows.
    pub rejected: u32,
}

impl Controller {
    /// Streams set-points, one a tick, from where the machine stands and at no more than a feed; returns every `every`th as
    /// it was commanded.
    ///
    /// # Errors
    /// [`ControllerError::Starved`] if they did not come in time and the controller gave the stream up; as
    /// [`Controller::run_circle`] otherwise.
    ///
    /// ```
    /// use giotto_link::{OpenOptions, Port, open};
    ///
    /// // Set-points of another planner, one a tick: 10 µm along X, in a cosine from rest to rest.
    /// let places_nm: Vec<[i32; 3]> = (0..=500)
    ///     .map(|tick| (std::f64::consts::PI * f64::from(tick) / 500.0).cos())
    ///     .map(|c| [(5_000.0 * (1.0 - c)) as i32, 0, 0])
    ///     .collect();
    /// let mut controller = open(&Port::Sim, &OpenOptions::default(), &mut |_| {})?;
    /// let streamed = controller.run_stream(&places_nm, 0.01, 1)?;
    /// assert_eq!((streamed.missing, streamed.late, streamed.rejected), (0, 0, 0));
    /// assert_eq!(controller.status()?.raw_nm, [10_000, 0, 0]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn run_stream(
        &mut self,
        places_nm: &[[i32; 3]],
        feed_m_s: f64,
        every: u16,
    ) -> Result<Streamed, ControllerError> {
        let before = self.status()?;
        self.begin_recording(every)?;
        // Begins when the queue is full.
        self.command(Command::BeginStream {
            feed_m_s: feed_m_s as f32,
            ahead: u16::MAX,
        })?;
        let sent = self
            .send_points(before.raw_nm, places_nm)
            .and_then(|()| self.append(&Command::End));
        if sent.is_err() {
            // Refused, it would be followed to where it ends and starve there.
            let _ = self.command(Command::Stop);
        }
        let recording = self.end_recording(every);
        let after = self.status()?;
        let (was, is) = (before.counters, after.counters);
        let missing = is.missing_set_points.wrapping_sub(was.missing_set_points);
        if after.fault == Some(FaultCause::Starved) {
            return Err(ControllerError::Starved { missing });
        }
        match sent {
            Ok(()) | Err(ControllerError::Stopped) => {}
            Err(error) => return Err(error),
        }
        Ok(Streamed {
            recording: recording?,
            missing,
            late: is.late_set_points.wrapping_sub(was.late_set_points),
            rejected: is.rejected_set_points.wrapping_sub(was.rejected_set_points),
        })
    }

    /// Streams set-points and never says that there are no more, as a host that has died: how the controller stands when it has
    /// come to rest.
    ///
    /// # Errors
    /// As [`Controller::run_stream`].
    pub fn run_stream_without_end(
        &mut self,
        places_nm: &[[i32; 3]],
        feed_m_s: f64,
    ) -> Result<Status, ControllerError> {
        let before = self.status()?;
        self.command(Command::BeginStream {
            feed_m_s: feed_m_s as f32,
            ahead: u16::MAX,
        })?;
        self.send_points(before.raw_nm, places_nm)?;
        self.at_rest()
    }

    fn send_points(
        &mut self,
        from_nm: [i32; 3],
        places_nm: &[[i32; 3]],
    ) -> Result<(), ControllerError> {
        let mut writer = Steps::from(from_nm);
        let mut rest = places_nm;
        while !rest.is_empty() {
            let mut steps = Chunk::new();
            let fitting = rest
                .iter()
                .take(POINTS)
                .take_while(|&&place| writer.write(place, &mut steps));
            rest = &rest[fitting.count()..];
            self.append(&Command::Points { steps })?;
        }
        Ok(())
    }
}
