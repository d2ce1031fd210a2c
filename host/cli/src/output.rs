//! Where results go: tables for people, one JSON document for programs.
use super::failure::Failure;
use indicatif::ProgressBar;
use serde::Serialize;
use std::io::{IsTerminal, Write};
use std::sync::Mutex;
use std::time::Duration;

/// How results are shown, from the flags every command takes.
#[derive(Clone, Copy, Debug)]
pub struct Output {
    /// stdout is one JSON document and nothing else.
    pub json: bool,
    /// Only results and errors; no notes, no progress.
    pub quiet: bool,
    /// Never ask, never draw: for scripts and logs.
    pub non_interactive: bool,
}

impl Output {
    /// A line for a person: stdout, or nothing with `--json`.
    pub fn say(&self, text: impl std::fmt::Display) {
        if !self.json {
            print(format_args!("{text}\n"));
        }
    }

    /// Sentences for a person, at the width of the terminal and set in by `indent`.
    pub fn tell(&self, indent: usize, text: impl std::fmt::Display) {
        self.say(super::paragraph::wrapped(&text.to_string(), indent));
    }

    /// A note beside the result: stderr, silenced by `--quiet`.
    pub fn note(&self, text: impl std::fmt::Display) {
        if !self.quiet {
            let _ = writeln!(
                std::io::stderr(),
                "{}",
                super::failure::plain(&text.to_string())
            );
        }
    }

    /// Whether progress bars may be drawn.
    pub fn draws(&self) -> bool {
        !self.quiet && !self.json && !self.non_interactive && std::io::stderr().is_terminal()
    }

    /// A sign of life while something takes seconds; nothing where nothing is drawn.
    pub fn spinner(&self, words: &'static str) -> ProgressBar {
        if !self.draws() {
            return ProgressBar::hidden();
        }
        let bar = ProgressBar::new_spinner().with_message(words);
        bar.enable_steady_tick(Duration::from_millis(100));
        bar
    }

    /// Prints `value` as the JSON document of this command.
    pub fn document(&self, value: &impl Serialize) -> Result<(), Failure> {
        let text = serde_json::to_string_pretty(value).map_err(|e| {
            Failure::input(format_args!("the result cannot be written as JSON: {e}"))
        })?;
        print(format_args!("{text}\n"));
        finish()
    }
}

/// Why stdout takes no more, once it does not.
static LOST: Mutex<Option<std::io::Error>> = Mutex::new(None);

/// Writes to stdout and remembers the first failure; after it nothing more is written.
pub fn print(text: std::fmt::Arguments<'_>) {
    let Ok(mut lost) = LOST.lock() else { return };
    if lost.is_none() {
        *lost = std::io::stdout().write_fmt(text).err();
    }
}

/// Brings out what is still held back, and says whether all of the result was written. A closed pipe
/// (`giotto … | head`) is no error of ours: who reads has seen enough.
///
/// # Errors
/// The disk is full or the device failed (exit 3).
pub fn finish() -> Result<(), Failure> {
    let Ok(mut lost) = LOST.lock() else {
        return Ok(());
    };
    if lost.is_none() {
        *lost = std::io::stdout().flush().err();
    }
    match &*lost {
        Some(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            let message = format_args!("the result was not written: stdout: {error}");
            Err(Failure::input(message).help("make room where the output goes"))
        }
        _ => Ok(()),
    }
}
