//! What an image takes and what its tick can reach, against the bars.
use crate::elf::{Image, Reach};
use crate::ticks::largest_table;
use giotto_link::emulator::{Emulator, Pace};
use giotto_link::image::{self, Board};
use giotto_link::{Controller, ControllerError, Segment, Step, circle};
use giotto_shared::Direction;
use serde_json::{Value, json};
use std::path::Path;

/// Most text of an image, bytes.
pub const TEXT_BAR: u32 = 256 * 1024;
/// Most RAM of an image, variables and the deepest stack, bytes.
pub const RAM_BAR: u32 = 48 * 1024;

/// Every so many set-points are asked for: at each of them a host that is busy elsewhere may fall behind.
const EVERY: u16 = 8;

/// The interrupt that makes the set-points.
const TICK: &str = "SysTick";

/// What an image takes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// The board.
    pub board: Board,
    /// Bytes in flash.
    pub text: u32,
    /// Bytes of variables.
    pub variables: u32,
    /// Deepest stack, bytes, measured under the largest table and a run.
    pub stack: u32,
    /// Functions of `core::panicking` and the like in the image.
    pub panics: Vec<String>,
    /// What the tick can reach.
    pub tick: Reach,
}

fn panics(name: &str) -> bool {
    [
        "core::panicking",
        "panic_already",
        "unwrap_failed",
        "expect_failed",
        "rust_begin_unwind",
    ]
    .iter()
    .any(|part| name.contains(part))
}

impl Report {
    /// Bytes of variables and stack.
    pub const fn ram(&self) -> u32 {
        self.variables + self.stack
    }

    /// Functions that panic and that the tick can reach.
    pub fn panics_in_tick(&self) -> Vec<&str> {
        self.tick
            .functions
            .iter()
            .map(String::as_str)
            .filter(|name| panics(name))
            .collect()
    }

    /// Whether every bar is met.
    pub fn meets_bars(&self) -> bool {
        self.text <= TEXT_BAR && self.ram() <= RAM_BAR && self.panics.is_empty()
    }

    /// As one JSON document.
    pub fn document(&self) -> Value {
        json!({
            "board": self.board.name(),
            "text_bytes": self.text,
            "ram_bytes": self.ram(),
            "variables_bytes": self.variables,
            "stack_bytes": self.stack,
            "panic_symbols": self.panics,
            "tick": {
                "functions": self.tick.functions.len(),
                "panic_symbols": self.panics_in_tick(),
                "calls_through_pointers": self.tick.indirect,
            },
            "bars": { "text_bytes": TEXT_BAR, "ram_bytes": RAM_BAR, "met": self.meets_bars() },
        })
    }
}

/// Measures the image of a board with these features: reads the file, and boots it to see how deep its stack goes.
///
/// # Errors
/// Any [`ControllerError`].
pub fn measure(
    board: Board,
    features: &[&str],
    note: &mut dyn FnMut(&str),
) -> Result<Report, ControllerError> {
    let path = image::ensure_with(board, features, note)?;
    let stack = deepest_stack(board, &path, note)?;
    let failed = |reason: String| ControllerError::Emulator { reason };
    let image = Image::read(&path).map_err(|error| failed(error.to_string()))?;
    let tick = image
        .reach(TICK)
        .ok_or_else(|| failed(format!("the image has no {TICK}")))?;
    let panics = image
        .functions(panics)
        .into_iter()
        .map(str::to_owned)
        .collect();
    Ok(Report {
        board,
        text: image.size.text,
        variables: image.size.variables,
        stack,
        panics,
        tick,
    })
}

/// One of each kind of segment, where a zone of the largest table holds.
fn path() -> [Segment; 4] {
    let normal = [0.0, 0.0, 1.0];
    let arc = |rise_m| Segment::Arc {
        centre_m: [0.0; 3],
        normal,
        sweep_rad: if rise_m > 0.0 { -2.0 } else { 2.0 },
        rise_m,
        feed_m_s: 0.3,
    };
    let line = Segment::Line {
        to_m: [0.1, 0.0, 0.0],
        feed_m_s: 0.3,
    };
    [line, arc(0.0), arc(0.01), Segment::Dwell { time_s: 0.01 }]
}

/// Flashes the largest table twice, rolls back, runs corrected circles, resets; asks how deep the stack went.
fn deepest_stack(
    board: Board,
    image: &Path,
    note: &mut dyn FnMut(&str),
) -> Result<u32, ControllerError> {
    use giotto_shared::wire::Command;
    let pace = if board.always_steps() {
        Pace::Stepped
    } else {
        Pace::Free
    };
    let emulator = Emulator::start_board(board, Some(image), pace, note)?;
    let mut controller = Controller::connect(Box::new(emulator.into_link()?), "qemu", 1)?;
    controller.supervise(None)?;
    // Where the emulator has no flash, neither does what comes after it use any stack.
    let flashed = controller.flash(&largest_table(), &mut |_| {}).is_ok();
    if flashed {
        controller.flash(&largest_table(), &mut |_| {})?;
    }
    for direction in [Direction::Ccw, Direction::Cw] {
        controller.run_circle(&circle(0.1, 0.5, direction, 1), EVERY)?;
    }
    for segment in path() {
        controller
            .run_program(
                &[Step {
                    segment,
                    tolerance_m: 0.0,
                }],
                EVERY,
            )
            .map_err(|e| e.error)?;
    }
    if flashed {
        controller.command(Command::Rollback)?;
    }
    controller.run_circle(&circle(0.07, 0.3, Direction::Cw, 1), EVERY)?;
    // The board looks at its stack a few times a second.
    for _ in 0..600 {
        controller.status()?;
    }
    Ok(controller.status()?.stack_bytes)
}
