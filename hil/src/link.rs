//! What a table takes on the link, beside a raw echo of as many bytes on the same emulated line.
use crate::ticks::largest_table;
use giotto::controller::emulator::{Emulator, Pace};
use giotto::controller::image::{self, Board};
use giotto::controller::link::Link;
use giotto::controller::{Controller, ControllerError};
use serde_json::{Value, json};
use std::time::{Duration, Instant};

/// The bar: bytes a second of a table (written and read back) beside those of the echo, percent.
pub const BAR_PERCENT: f64 = 70.0;
/// Bytes that the echo has on their way at most; the receiver's queue holds as many.
const WINDOW: usize = 256;
const ROUNDS: usize = 9;

/// What was measured; medians of interleaved rounds.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Bytes of the table.
    pub table_bytes: usize,
    /// Write, read back, commit and confirm, s.
    pub table_s: Vec<f64>,
    /// The same bytes sent and returned, s.
    pub echo_s: Vec<f64>,
}

fn median(seconds: &[f64]) -> f64 {
    let mut sorted = seconds.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

impl Report {
    /// Bytes a second of table and echo, and the ratio in percent.
    pub fn rates(&self) -> [f64; 3] {
        let rate = |seconds: &[f64]| self.table_bytes as f64 / median(seconds);
        let (table, echo) = (rate(&self.table_s), rate(&self.echo_s));
        [table, echo, 100.0 * table / echo]
    }

    /// As one JSON document.
    pub fn document(&self) -> Value {
        let [table, echo, percent] = self.rates();
        json!({
            "table_bytes": self.table_bytes,
            "table_bytes_per_s": table,
            "echo_bytes_per_s": echo,
            "percent": percent,
            "table_s": self.table_s,
            "echo_s": self.echo_s,
            "bars": { "percent": BAR_PERCENT, "met": percent >= BAR_PERCENT },
        })
    }
}

/// Measures on the emulated mps2-an386.
///
/// # Errors
/// Any [`ControllerError`].
pub fn measure(note: &mut dyn FnMut(&str)) -> Result<Report, ControllerError> {
    let board = Board::Mps2An386;
    let table = largest_table();
    let echo = image::ensure_with(board, &["echo"], note)?;
    let mut echo = Emulator::start_board(board, Some(&echo), Pace::Fast, note)?.into_link()?;
    let emulator = Emulator::start_board(board, None, Pace::Fast, note)?;
    let mut controller = Controller::connect(Box::new(emulator.into_link()?), "qemu", 1)?;
    let (mut table_s, mut echo_s) = (Vec::new(), Vec::new());
    for round in 0..=ROUNDS {
        let echoed = returned(&mut echo, &table)?;
        let started = Instant::now();
        controller.flash(&table, &mut |_| {})?;
        // The first round finds everything cold.
        if round > 0 {
            table_s.push(started.elapsed().as_secs_f64());
            echo_s.push(echoed);
        }
    }
    Ok(Report { table_bytes: table.len(), table_s, echo_s })
}

/// Seconds until all bytes have come back.
fn returned(link: &mut impl Link, bytes: &[u8]) -> Result<f64, ControllerError> {
    let fault = |reason: String| ControllerError::Emulator { reason };
    let started = Instant::now();
    let (mut sent, mut back) = (0, Vec::with_capacity(bytes.len()));
    let mut buffer = [0; WINDOW];
    while back.len() < bytes.len() {
        let to = bytes.len().min(back.len() + WINDOW);
        if to > sent {
            link.send(&bytes[sent..to]).map_err(|e| fault(e.to_string()))?;
            sent = to;
        }
        let until = link.now() + Duration::from_secs(5);
        let count = link.receive(&mut buffer, until).map_err(|e| fault(e.to_string()))?;
        if count == 0 {
            return Err(fault(format!("the echo stopped after {} of {} bytes", back.len(), bytes.len())));
        }
        back.extend_from_slice(&buffer[..count]);
    }
    if back == bytes {
        Ok(started.elapsed().as_secs_f64())
    } else {
        Err(fault("the echo differs".to_owned()))
    }
}
