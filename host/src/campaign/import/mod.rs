//! Foreign measurements into a campaign.
//!
//! | file | holds |
//! |---|---|
//! | `layout` | what a layout is: separator, decimal mark, which field is what in which unit |
//! | `detect` | which layout a file has |
//! | `leica`, `spatial_analyzer`, `rtde`, `kflop` | one file a format with a layout of its own |
//! | `named` | columns known by the words and units of a header (German locale, plain exports, the contract's own) |
//! | `columns` | columns named on the command line |
//! | `recognise` | a file by its first lines |
//! | `rows` | the rows of a file, SI, block by block |
//! | `sample` | a fair sample of its points |
//! | `trim` | feed-in, feed-out, laps, arcs |
//! | `scan` | one look at all rows: which are the circle, and where they stand |
//! | `add` | recordings as runs of a campaign, all or none |
//! | `ballbar20` | the results in `.b5r` files |
//!
//! A new instrument is a file with its `recognise` and a line in `detect`.
mod add;
pub mod ballbar20;
mod columns;
mod detect;
mod kflop;
mod layout;
mod leica;
mod named;
mod recognise;
mod rows;
mod rtde;
mod sample;
mod scan;
mod spatial_analyzer;
mod trim;

pub use add::{Added, Laps, Options, add, open};
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
    recognise::rows_of(file, format, columns).map(|slice| slice.format())
}
