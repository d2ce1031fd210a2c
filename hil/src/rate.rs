//! How fast a controller can be: ticks a second with time to spare, and the time from a file to a confirmed table.
use crate::ticks::largest_table;
use giotto_link::emulator::{Emulator, Pace};
use giotto_link::image::{self, Board};
use giotto_link::{Controller, ControllerError, circle};
use giotto_shared::Direction;
use giotto_shared::wire::MotionState;
use serde_json::{Value, json};
use std::time::Instant;

/// The engine's bar: ticks a second with half the time idle.
pub const RATE_BAR_HZ: u32 = 8000;
/// The bar on idle time, percent.
pub const IDLE_BAR_PERCENT: f64 = 50.0;
/// The bar on flash, verify and confirm, s.
pub const FLASH_BAR_S: f64 = 1.0;

/// What was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// Ticks a second of the image.
    pub tick_hz: u32,
    /// Least idle time while a corrected circle ran, percent.
    pub idle_percent: f64,
    /// Ticks that were late.
    pub overruns: u32,
    /// Flash, read back, commit, confirm and verify of the largest table, s by the clock.
    pub flash_s: f64,
    /// The same by the controller's ticks.
    pub flash_controller_s: f64,
    /// Bytes of that table.
    pub table_bytes: usize,
}

impl Report {
    /// Whether every bar is met.
    pub fn meets_bars(&self) -> bool {
        self.tick_hz >= RATE_BAR_HZ
            && self.idle_percent >= IDLE_BAR_PERCENT
            && self.overruns == 0
            && self.flash_s <= FLASH_BAR_S
    }

    /// As one JSON document.
    pub fn document(&self) -> Value {
        json!({
            "tick_hz": self.tick_hz,
            "idle_percent": self.idle_percent,
            "tick_overruns": self.overruns,
            "flash_s": self.flash_s,
            "flash_controller_s": self.flash_controller_s,
            "table_bytes": self.table_bytes,
            "bars": { "tick_hz": RATE_BAR_HZ, "idle_percent": IDLE_BAR_PERCENT, "flash_s": FLASH_BAR_S,
                      "met": self.meets_bars() },
        })
    }
}

/// Measures the mps2-an386 at 25 MHz with eight times the usual ticks, under the largest table.
///
/// # Errors
/// Any [`ControllerError`].
pub fn measure(note: &mut dyn FnMut(&str)) -> Result<Report, ControllerError> {
    let board = Board::Mps2An386;
    let (flash_s, flash_controller_s) = flash_time(board, note)?;
    let path = image::ensure_with(board, &["fast"], note)?;
    let emulator = Emulator::start_board(board, Some(&path), Pace::Free, note)?;
    let mut controller = Controller::connect(Box::new(emulator.into_link()?), "qemu", 1)?;
    controller.supervise(None)?;
    controller.flash(&largest_table(), &mut |_| {})?;
    let tick_hz = controller.identity().tick_hz;
    // Long enough for several spans of the board's measurement; no set-points on the link, as in production.
    controller.start_circle(&circle(0.1, 0.5, Direction::Ccw, 20))?;
    let mut least = f64::INFINITY;
    let begun = controller.status()?.tick;
    let mut status = controller.status()?;
    while !matches!(status.motion, MotionState::Idle | MotionState::Fault) {
        // Not the spans before and during the start.
        if status.tick.wrapping_sub(begun) > tick_hz {
            least = status
                .idle_permille
                .map_or(least, |permille| least.min(f64::from(permille) / 10.0));
        }
        controller.stay_silent(std::time::Duration::from_millis(5))?;
        status = controller.status()?;
    }
    Ok(Report {
        tick_hz,
        idle_percent: if least.is_finite() { least } else { 0.0 },
        overruns: status.counters.tick_overruns,
        flash_s,
        flash_controller_s,
        table_bytes: largest_table().len(),
    })
}

/// Time for the largest table from its first byte to the last of the verification, by the clock and by ticks.
fn flash_time(board: Board, note: &mut dyn FnMut(&str)) -> Result<(f64, f64), ControllerError> {
    let emulator = Emulator::start_board(board, None, Pace::Free, note)?;
    let mut controller = Controller::connect(Box::new(emulator.into_link()?), "qemu", 1)?;
    let table = largest_table();
    let before = controller.status()?.tick;
    let started = Instant::now();
    controller.flash(&table, &mut |_| {})?;
    controller.verify(&table)?;
    let clock_s = started.elapsed().as_secs_f64();
    let ticks = controller.status()?.tick.wrapping_sub(before);
    Ok((
        clock_s,
        f64::from(ticks) / f64::from(controller.identity().tick_hz),
    ))
}
