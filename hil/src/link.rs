//! What a table takes on the link, beside a raw echo of as many bytes on the same emulated line, as many of them on their
//! way at once.
use crate::ticks::largest_table;
use giotto_link::emulator::{Emulator, Pace};
use giotto_link::image::{self, Board};
use giotto_link::link::Link;
use giotto_link::{Controller, ControllerError};
use giotto_shared::wire::IN_FLIGHT;
use serde_json::{Value, json};
use std::time::{Duration, Instant};

/// The bar: bytes a second of a table (written and read back) beside those of the echo, percent.
pub const BAR_PERCENT: f64 = 70.0;
/// Emulators of each kind, and times taken of each.
const ROUNDS: usize = 9;
const TIMES: usize = 3;

/// What was measured, a median of each round; table and echo of a round are neighbours in time.
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
    /// Bytes a second of table and echo, and the ratio in percent: the median of the ratios of the rounds, since what else
    /// runs on the machine slows both of a round.
    pub fn rates(&self) -> [f64; 3] {
        let rate = |seconds: &[f64]| self.table_bytes as f64 / median(seconds);
        let ratios: Vec<f64> = self
            .echo_s
            .iter()
            .zip(&self.table_s)
            .map(|(echo, table)| echo / table)
            .collect();
        [
            rate(&self.table_s),
            rate(&self.echo_s),
            100.0 * median(&ratios),
        ]
    }

    /// Whether the bar is met.
    pub fn meets_bar(&self) -> bool {
        let [.., percent] = self.rates();
        percent >= BAR_PERCENT
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
            "bars": { "percent": BAR_PERCENT, "met": self.meets_bar() },
        })
    }
}

/// Measures on the emulated mps2-an386. One emulator at a time: an idle one keeps a core busy, and the echo, which polls,
/// more of it than the image that sleeps.
///
/// # Errors
/// Any [`ControllerError`].
pub fn measure(note: &mut dyn FnMut(&str)) -> Result<Report, ControllerError> {
    let table = largest_table();
    let board = Board::Mps2An386;
    let images = [
        image::ensure_with(board, &["echo"], note)?,
        image::ensure(board, note)?,
    ];
    let [echo, giotto] = images.map(|image| {
        move || Emulator::start_board(board, Some(&image), Pace::Free, &mut |_| {})?.into_link()
    });
    let (mut table_s, mut echo_s) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        let mut link = echo()?;
        // The first time everything is cold.
        returned(&mut link, &table)?;
        let times: Result<Vec<_>, _> = (0..TIMES).map(|_| returned(&mut link, &table)).collect();
        echo_s.push(median(&times?));
        drop(link);
        let mut controller = Controller::connect(Box::new(giotto()?), "qemu", 1)?;
        flashed(&mut controller, &table)?;
        let times: Result<Vec<_>, _> = (0..TIMES)
            .map(|_| flashed(&mut controller, &table))
            .collect();
        table_s.push(median(&times?));
    }
    Ok(Report {
        table_bytes: table.len(),
        table_s,
        echo_s,
    })
}

/// Seconds until the table is confirmed.
fn flashed(controller: &mut Controller, table: &[u8]) -> Result<f64, ControllerError> {
    let started = Instant::now();
    controller.flash(table, &mut |_| {})?;
    Ok(started.elapsed().as_secs_f64())
}

/// Seconds until all bytes have come back.
fn returned(link: &mut impl Link, bytes: &[u8]) -> Result<f64, ControllerError> {
    let fault = |reason: String| ControllerError::Emulator { reason };
    let started = Instant::now();
    let (mut sent, mut back) = (0, Vec::with_capacity(bytes.len()));
    let mut buffer = [0; IN_FLIGHT];
    while back.len() < bytes.len() {
        let to = bytes.len().min(back.len() + IN_FLIGHT);
        if to > sent {
            link.send(&bytes[sent..to])
                .map_err(|e| fault(e.to_string()))?;
            sent = to;
        }
        let until = link.now() + Duration::from_secs(5);
        let count = link
            .receive(&mut buffer, until)
            .map_err(|e| fault(e.to_string()))?;
        if count == 0 {
            return Err(fault(format!(
                "the echo stopped after {} of {} bytes",
                back.len(),
                bytes.len()
            )));
        }
        back.extend_from_slice(&buffer[..count]);
    }
    if back == bytes {
        Ok(started.elapsed().as_secs_f64())
    } else {
        Err(fault("the echo differs".to_owned()))
    }
}
