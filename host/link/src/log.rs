//! A board's log: defmt's encoding, in which a line is a number and the words are in the image.
use super::error::ControllerError;
use defmt_decoder::{DecodeError, Table};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// A line of the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    /// The controller's time, as it writes it, s.
    pub time: Option<String>,
    /// `info`, `warn`, `error`; empty where the image says none.
    pub level: &'static str,
    /// The words.
    pub words: String,
}

/// The words of an image.
pub struct Words {
    table: Table,
}

impl Words {
    /// Those of an ELF file.
    ///
    /// # Errors
    /// [`ControllerError::NoImage`]: no such file, or no words in it.
    pub fn of(image: &Path) -> Result<Self, ControllerError> {
        let fail = |reason: String| ControllerError::NoImage {
            path: PathBuf::from(image),
            reason,
        };
        let bytes = std::fs::read(image).map_err(|error| fail(error.to_string()))?;
        let table = Table::parse(&bytes).map_err(|error| fail(error.to_string()))?;
        let table = table.ok_or_else(|| fail("it holds no words of a log".to_owned()))?;
        Ok(Self { table })
    }

    /// Says each line that comes, to the end of what is read. What was disturbed or belongs to another image is left out; how
    /// many such pieces there were.
    ///
    /// # Errors
    /// Those of the reader but a wait that was in vain.
    pub fn read(&self, mut from: impl Read, say: &mut dyn FnMut(Line)) -> io::Result<u64> {
        let (mut decoder, mut bytes, mut disturbed) =
            (self.table.new_stream_decoder(), [0; 256], 0);
        loop {
            let count = match from.read(&mut bytes) {
                Ok(0) => return Ok(disturbed),
                Ok(count) => count,
                Err(error)
                    if matches!(
                        error.kind(),
                        io::ErrorKind::TimedOut | io::ErrorKind::Interrupted
                    ) =>
                {
                    continue;
                }
                Err(error) => return Err(error),
            };
            decoder.received(&bytes[..count]);
            loop {
                match decoder.decode() {
                    Ok(frame) => say(Line {
                        time: frame.display_timestamp().map(|time| time.to_string()),
                        level: frame.level().map_or("", |level| level.as_str()),
                        words: frame.display_message().to_string(),
                    }),
                    Err(DecodeError::UnexpectedEof) => break,
                    Err(DecodeError::Malformed) => disturbed += 1,
                }
            }
        }
    }
}
