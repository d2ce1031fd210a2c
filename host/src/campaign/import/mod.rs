//! Foreign measurements into a campaign.
//!
//! | file | holds |
//! |---|---|
//! | `layout` | what a layout is: separator, decimal mark, which field is what in which unit |
//! | `detect` | which layout a file has |
//! | `leica`, `spatial_analyzer`, `rtde`, `kflop` | one file a format with a layout of its own |
//! | `named` | columns known by the words and units of a header (German locale, plain exports, the contract's own) |
//! | `columns` | columns named on the command line |
//! | `recording` | the numbers of a file, SI |
//! | `trim` | feed-in, feed-out, laps, arcs |
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
mod recording;
mod rtde;
mod spatial_analyzer;
mod trim;

pub use add::{Added, Laps, Options, add};
pub use detect::Format;

use crate::campaign::CampaignError;
use std::path::Path;

/// The layout of a foreign file, by its first lines; nothing else of it is read.
///
/// # Errors
/// A file that cannot be read, or whose layout is not known.
pub fn recognise(file: &Path, format: Format, columns: Option<&str>) -> Result<Format, CampaignError> {
    recording::recognise(file, format, columns).map(|layout| layout.format)
}
