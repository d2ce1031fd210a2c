//! What the robot measured, as a file that `giotto import` reads: `time_s,x_mm,y_mm,z_mm`.
use crate::Place;
use std::io::{self, Write};
use std::time::Duration;

/// Writes rows as they come.
#[derive(Debug)]
pub struct Record<W: Write> {
    out: W,
    last: Option<Duration>,
    rows: u64,
}

impl<W: Write> Record<W> {
    /// Begins a file.
    ///
    /// # Errors
    /// Those of writing.
    pub fn begin(mut out: W) -> io::Result<Self> {
        out.write_all(b"time_s,x_mm,y_mm,z_mm\n")?;
        Ok(Self {
            out,
            last: None,
            rows: 0,
        })
    }

    /// A place of the robot at its time, unless that was written already.
    ///
    /// # Errors
    /// Those of writing.
    pub fn take(&mut self, (time, [x, y, z]): (Duration, Place)) -> io::Result<()> {
        if self.last.is_some_and(|last| last >= time) {
            return Ok(());
        }
        self.last = Some(time);
        self.rows += 1;
        writeln!(self.out, "{:.6},{x:.4},{y:.4},{z:.4}", time.as_secs_f64())
    }

    /// Rows so far.
    pub const fn rows(&self) -> u64 {
        self.rows
    }

    /// Brings everything out.
    ///
    /// # Errors
    /// Those of writing.
    pub fn end(mut self) -> io::Result<W> {
        self.out.flush()?;
        Ok(self.out)
    }
}
