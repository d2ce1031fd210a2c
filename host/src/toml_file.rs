//! TOML files that people write: every refusal with file, line and column.
use crate::campaign::Place;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};
use toml::de::{DeTable, DeValue};

/// A file that cannot be used as it is.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{at}: {problem}")]
pub struct TomlFileError {
    /// Where.
    pub at: Box<Place>,
    /// What, and what was expected.
    pub problem: Box<TomlProblem>,
}

/// Everything that a TOML file is refused for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[allow(
    missing_docs,
    reason = "the message of each variant is its documentation"
)]
pub enum TomlProblem {
    #[error("no such file; expected {expected}")]
    Missing { expected: &'static str },
    #[error("is a directory; expected {expected}")]
    IsDirectory { expected: &'static str },
    #[error("cannot be {action}: {reason}")]
    Io {
        action: &'static str,
        reason: String,
    },
    #[error("not UTF-8 text; expected {expected}")]
    NotUtf8 { expected: &'static str },
    #[error("is empty; expected {expected}")]
    Empty { expected: &'static str },
    #[error("{reason}; expected {expected}")]
    Syntax {
        reason: String,
        expected: &'static str,
    },
    #[error("format {found}, and this build reads format {known}")]
    Format { found: String, known: u32 },
    #[error("`{key}` is {found}; expected {expected}")]
    Value {
        key: String,
        found: String,
        expected: String,
    },
    #[error("{what}; expected {expected}")]
    Missed { what: String, expected: String },
}

impl TomlFileError {
    /// A problem at a place.
    pub fn new(at: Place, problem: TomlProblem) -> Self {
        Self {
            at: Box::new(at),
            problem: Box::new(problem),
        }
    }

    /// What to do next, one sentence.
    pub fn help(&self) -> &'static str {
        match *self.problem {
            TomlProblem::Missing { .. }
            | TomlProblem::IsDirectory { .. }
            | TomlProblem::Io { .. } => "check the path",
            TomlProblem::Format { .. } => "make the file again with this version of giotto",
            TomlProblem::NotUtf8 { .. } | TomlProblem::Empty { .. } => "check which file this is",
            _ => "correct this line of the file",
        }
    }
}

/// What the reader of TOML says, in words for who wrote the file: kinds of values, not types of a program.
fn in_words(message: &str) -> String {
    const KINDS: [(&str, &str); 12] = [
        ("invalid type: string ", "found the text "),
        ("invalid type: integer ", "found the number "),
        ("invalid type: floating point ", "found the number "),
        ("invalid type: boolean ", "found "),
        ("invalid type: sequence", "found a list"),
        ("invalid type: map", "found a table"),
        ("expected a sequence", "expected a list"),
        ("expected a map", "expected a table"),
        ("expected a string", "expected a text"),
        ("expected f64", "expected a number"),
        ("unknown field ", "unknown key "),
        ("missing field ", "there is no key "),
    ];
    let mut words = message.to_owned();
    for (of_the_reader, plain) in KINDS {
        words = words.replace(of_the_reader, plain);
    }
    // The rest of it names types of the program.
    match words.split_once("expected struct ") {
        Some((before, _)) => format!("{before}expected a table"),
        None => words,
    }
}

/// The text of a TOML file and where it came from.
///
/// ```
/// use giotto::toml_file::TomlText;
///
/// #[derive(Debug, serde::Deserialize)]
/// #[serde(deny_unknown_fields)]
/// struct Limits {
///     feed_mm_s: f64,
/// }
/// let read = |text| TomlText::new("limits.toml", text, "the limits of a machine").parse::<Limits>();
/// assert_eq!(read("feed_mm_s = 300.0\n").unwrap().feed_mm_s, 300.0);
/// let error = read("\nfeed = 300.0\n").unwrap_err().to_string();
/// assert!(error.contains("limits.toml:2"), "{error}");
/// ```
#[derive(Clone, Debug)]
pub struct TomlText {
    /// The file.
    pub file: PathBuf,
    text: String,
    expected: &'static str,
}

impl TomlText {
    /// Reads a file; `expected` says in words what it should hold.
    ///
    /// # Errors
    /// Missing, a directory, unreadable, not UTF-8 or empty.
    pub fn read(file: &Path, expected: &'static str) -> Result<Self, TomlFileError> {
        let fail = |at, problem| Err(TomlFileError::new(at, problem));
        let bytes = match std::fs::read(file) {
            Ok(bytes) => bytes,
            Err(_) if file.is_dir() => {
                return fail(Place::file(file), TomlProblem::IsDirectory { expected });
            }
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
                return fail(Place::file(file), TomlProblem::Missing { expected });
            }
            Err(e) => {
                let problem = TomlProblem::Io {
                    action: "read",
                    reason: e.to_string(),
                };
                return fail(Place::file(file), problem);
            }
        };
        let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&bytes);
        match std::str::from_utf8(bytes) {
            Ok(text) if text.trim().is_empty() => {
                fail(Place::file(file), TomlProblem::Empty { expected })
            }
            Ok(text) => Ok(Self::new(file, text, expected)),
            Err(e) => fail(
                Place::of_byte(file, bytes, e.valid_up_to()),
                TomlProblem::NotUtf8 { expected },
            ),
        }
    }

    /// Text that is in memory, with the name it goes by.
    pub fn new(file: impl Into<PathBuf>, text: &str, expected: &'static str) -> Self {
        Self {
            file: file.into(),
            text: text.to_owned(),
            expected,
        }
    }

    /// Reads the text as a `T`.
    ///
    /// # Errors
    /// Not TOML, or not the keys and types of a `T`.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, TomlFileError> {
        toml::from_str(&self.text).map_err(|e| {
            let at = match e.span() {
                Some(span) => Place::of_byte(&self.file, self.text.as_bytes(), span.start),
                None => Place::file(&self.file),
            };
            let reason = in_words(&e.message().replace('\n', ", "));
            TomlFileError::new(
                at,
                TomlProblem::Syntax {
                    reason,
                    expected: self.expected,
                },
            )
        })
    }

    /// The text of a key at the top, as it is written; for what must be known before all else.
    pub fn top(&self, key: &str) -> Option<String> {
        let document = DeTable::parse(&self.text).ok()?;
        let span = document.get_ref().get(key)?.span();
        self.text.get(span).map(str::to_owned)
    }

    /// A value that is out of its range. The path goes through tables by key and through lists by number
    /// (`["effect", "0", "value"]`); of a key that is not there, the nearest table above is pointed at.
    pub fn value_error(
        &self,
        path: &[&str],
        found: impl ToString,
        expected: impl ToString,
    ) -> TomlFileError {
        let key = path
            .iter()
            .filter(|k| k.parse::<usize>().is_err())
            .copied()
            .collect::<Vec<_>>()
            .join(".");
        let problem = TomlProblem::Value {
            key,
            found: found.to_string(),
            expected: expected.to_string(),
        };
        TomlFileError::new(self.place(path), problem)
    }

    /// A problem of the whole of a table.
    pub fn missed(
        &self,
        path: &[&str],
        what: impl ToString,
        expected: impl ToString,
    ) -> TomlFileError {
        let problem = TomlProblem::Missed {
            what: what.to_string(),
            expected: expected.to_string(),
        };
        TomlFileError::new(self.place(path), problem)
    }

    /// A problem with the format number at the top.
    pub fn format_error(&self, found: String, known: u32) -> TomlFileError {
        TomlFileError::new(
            self.place(&["format"]),
            TomlProblem::Format { found, known },
        )
    }

    fn place(&self, path: &[&str]) -> Place {
        let Ok(document) = DeTable::parse(&self.text) else {
            return Place::file(&self.file);
        };
        let mut span = None;
        let mut next = path.first().and_then(|key| document.get_ref().get(*key));
        let mut rest = path.get(1..).unwrap_or_default();
        while let Some(value) = next {
            span = Some(value.span());
            let Some((step, after)) = rest.split_first() else {
                break;
            };
            rest = after;
            next = match value.get_ref() {
                DeValue::Table(table) => table.get(*step),
                DeValue::Array(list) => step.parse::<usize>().ok().and_then(|i| list.get(i)),
                _ => None,
            };
        }
        match span {
            Some(span) => Place::of_byte(&self.file, self.text.as_bytes(), span.start),
            None => Place::at(&self.file, 1, 1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code, reason = "only whether it is read counts")]
    struct Names {
        name: String,
        feeds: Vec<f64>,
        inner: Option<Inner>,
    }

    #[derive(Debug, Deserialize)]
    #[allow(dead_code, reason = "only whether it is read counts")]
    struct Inner {
        size: f64,
    }

    #[test]
    fn what_is_refused_is_said_without_types_of_a_program() {
        let refused = |text: &str| {
            let read = TomlText::new("a.toml", text, "names").parse::<Names>();
            read.unwrap_err().to_string()
        };
        for (text, said) in [
            (
                "name = 3\nfeeds = []",
                "found the number `3`, expected a text",
            ),
            (
                "name = \"a\"\nfeeds = \"x\"",
                "found the text \"x\", expected a list",
            ),
            (
                "name = \"a\"\nfeeds = []\ninner = \"x\"",
                "found the text \"x\", expected a table",
            ),
            (
                "name = \"a\"\nfeeds = [\"x\"]",
                "found the text \"x\", expected a number",
            ),
            ("name = \"a\"\nfeeds = []\nnmae = 1", "unknown key `nmae`"),
            ("name = \"a\"", "there is no key `feeds`"),
        ] {
            let words = refused(text);
            assert!(words.contains(said), "{said}: {words}");
            for programmers in ["struct", "invalid type", "f64", "sequence", "field"] {
                assert!(!words.contains(programmers), "{words}");
            }
        }
    }
}
