//! Where results go: tables for people, one JSON document for programs.
use super::failure::Failure;
use indicatif::ProgressBar;
use serde::Serialize;
use std::io::{IsTerminal, Write};
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
            // A closed pipe (`giotto … | head`) is no error of ours.
            let _ = writeln!(std::io::stdout(), "{text}");
        }
    }

    /// A note beside the result: stderr, silenced by `--quiet`.
    pub fn note(&self, text: impl std::fmt::Display) {
        if !self.quiet {
            let _ = writeln!(std::io::stderr(), "{text}");
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
        let _ = writeln!(std::io::stdout(), "{text}");
        Ok(())
    }
}
