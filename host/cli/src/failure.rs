//! The one place where an error becomes words and an exit code.
use std::fmt::Display;
use std::io::Write;
use std::process::ExitCode;

/// Why a command did not do what it was asked, by the contract's exit codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Wrong usage.
    Usage = 2,
    /// Bad input: the message names file, line, column and what was expected.
    BadInput = 3,
    /// No answer from, or refused by, the controller.
    Controller = 4,
    /// Done, but the check it was asked for failed.
    Check = 5,
    /// Interrupted by the person at the terminal, as shells say it.
    Interrupted = 130,
}

/// An error on its way to the terminal.
#[derive(Debug)]
pub struct Failure {
    kind: Kind,
    message: String,
    help: Option<String>,
}

impl Failure {
    /// Bad input (exit 3).
    pub fn input(message: impl Display) -> Self {
        Self::new(Kind::BadInput, message)
    }

    /// Controller silent or refusing (exit 4).
    pub fn controller(message: impl Display) -> Self {
        Self::new(Kind::Controller, message)
    }

    /// A requested check failed (exit 5).
    pub fn check(message: impl Display) -> Self {
        Self::new(Kind::Check, message)
    }

    /// Interrupted (exit 130).
    pub fn interrupted(message: impl Display) -> Self {
        Self::new(Kind::Interrupted, message)
    }

    /// Wrong usage (exit 2).
    pub fn usage(message: impl Display) -> Self {
        Self::new(Kind::Usage, message)
    }

    fn new(kind: Kind, message: impl Display) -> Self {
        Self {
            kind,
            message: message.to_string(),
            help: None,
        }
    }

    /// Adds what to do next.
    #[must_use]
    pub fn help(mut self, help: impl Display) -> Self {
        self.help = Some(help.to_string());
        self
    }

    /// Prints the error on stderr and gives the exit code.
    pub fn report(&self) -> ExitCode {
        // A closed or full stderr must not make a panic of an error: the exit code still says it.
        let mut stderr = std::io::stderr();
        let _ = writeln!(stderr, "error: {}", plain(&self.message));
        if let Some(help) = &self.help {
            let _ = writeln!(stderr, " help: {}", plain(help));
        }
        ExitCode::from(self.kind as u8)
    }
}

impl From<giotto::toml_file::TomlFileError> for Failure {
    fn from(error: giotto::toml_file::TomlFileError) -> Self {
        let help = error.help();
        Self::input(error).help(help)
    }
}

/// Words of the library and of the system for a person: programmers set keys and commands off by backticks, the system adds
/// the number of its error.
pub fn plain(words: &str) -> String {
    let mut text = words.replace('`', "");
    while let Some(from) = text.find(" (os error ") {
        let Some(length) = text[from..].find(')') else {
            break;
        };
        text.replace_range(from..=from + length, "");
    }
    text
}

/// Writing a result failed: the place it should go to is bad input.
pub fn cannot_write(path: &std::path::Path, error: &std::io::Error) -> Failure {
    Failure::input(format_args!("{}: cannot write: {error}", path.display()))
        .help("choose another path with -o, or make room there")
}

#[cfg(test)]
mod tests {
    use super::plain;

    #[test]
    fn a_person_reads_neither_backticks_nor_numbers_of_errors() {
        let words =
            "`radius_mm` is missing: No space left on device (os error 28), see `giotto status`";
        let read = "radius_mm is missing: No space left on device, see giotto status";
        assert_eq!(plain(words), read);
        assert_eq!(plain("odd (os error 28"), "odd (os error 28");
    }
}
