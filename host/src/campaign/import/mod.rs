//! Foreign measurements into a campaign.
//!
//! | file | holds |
//! |---|---|
//! | `layout` | what a layout is: separator, decimal mark, which field is what in which unit |
//! | `grid` | where the rows begin, how their fields are divided, which lines name them |
//! | `words` | what the name of a column says |
//! | `detect` | which layout a file has |
//! | `leica`, `spatial_analyzer`, `rtde`, `kflop` | one file a format with a layout of its own |
//! | `named` | columns known by the words and units of a header (exports, logs, other languages, the contract's own) |
//! | `xml` | logs in XML as tables |
//! | `plain_text` | carriage returns and grouped thousands as plain rows |
//! | `columns` | columns named on the command line |
//! | `recognise` | a file by its first lines |
//! | `rows` | the rows of a file, SI, block by block |
//! | `place` | where the rows of a turn stand in a file |
//! | `sample` | a fair sample of its points |
//! | `ring` | the circle that most points are on |
//! | `motion` | turns found from the motion: start, stop, pauses, laps, both directions, arcs |
//! | `clocked` | turns of deviations over time |
//! | `scan` | one look at all rows: which are the circle, and where they stand |
//! | `add` | recordings as runs of a campaign, all or none |
//! | `batch` | a whole session: folders, names, lists |
//! | `ballbar20` | the results in `.b5r` files |
//!
//! A new instrument is a file with its `recognise` and a line in `detect`.
mod add;
pub mod ballbar20;
pub mod batch;
mod clocked;
mod columns;
mod detect;
mod grid;
mod kflop;
mod layout;
mod leica;
mod motion;
mod named;
mod place;
mod plain_text;
mod recognise;
mod ring;
mod rows;
mod rtde;
mod sample;
mod scan;
mod spatial_analyzer;
#[cfg(test)]
mod tests;
mod turns;
mod words;
mod xml;

pub use add::{Added, Laps, Options, Reason, add, add_each, open};
pub use detect::Format;
pub(in crate::campaign) use layout::Quantity;
pub use rows::Slice;

use crate::campaign::CampaignError;
use std::path::Path;

/// The layout of a foreign file, by its first lines; nothing else of it is read.
///
/// # Errors
/// A file that cannot be read, or whose layout is not known.
pub fn recognise(
    file: &Path,
    format: Format,
    columns: Option<&str>,
) -> Result<Format, CampaignError> {
    let reading = recognise::Reading {
        format,
        columns,
        even: None,
    };
    recognise::rows_of(file, reading).map(|slice| slice.format())
}
