//! Which layout a file has.
use super::layout::{Head, Layout};
use super::named::Found;
use super::recognise::Reading;
use super::{columns, kflop, leica, named, rtde, spatial_analyzer};
use std::fmt;

/// Layouts that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// By the first lines of the file.
    Auto,
    /// CSV of a giotto campaign.
    Contract,
    /// Columns by the words of the header, `;` between them, decimal comma.
    German,
    /// Columns by the words of the header.
    Named,
    /// Leica tracker CSV.
    Leica,
    /// SpatialAnalyzer text.
    SpatialAnalyzer,
    /// Universal Robots RTDE recording.
    Rtde,
    /// KFLOP log.
    Kflop,
    /// As `--columns` says.
    Columns,
    /// Ballbar 20 `.b5r`: results without samples.
    B5r,
}

impl Format {
    /// Every layout with its name on a command line and what it is.
    pub const ALL: [(Self, &str, &str); 10] = [
        (Self::Auto, "auto", "By the first lines of the file"),
        (Self::Contract, "contract", "CSV of a giotto campaign"),
        (
            Self::German,
            "german",
            "Columns by the words of the header, `;` between them, decimal comma",
        ),
        (Self::Named, "named", "Columns by the words of the header"),
        (Self::Leica, "leica", "Leica tracker CSV"),
        (
            Self::SpatialAnalyzer,
            "spatial-analyzer",
            "SpatialAnalyzer text",
        ),
        (Self::Rtde, "rtde", "Universal Robots RTDE recording"),
        (Self::Kflop, "kflop", "KFLOP log"),
        (Self::Columns, "columns", "As `--columns` says"),
        (
            Self::B5r,
            "b5r",
            "Ballbar 20 `.b5r`: results without samples",
        ),
    ];
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Auto => "any",
            Self::Contract => "giotto CSV",
            Self::German => "CSV with decimal commas",
            Self::Named => "text with named columns",
            Self::Leica => "Leica tracker CSV",
            Self::SpatialAnalyzer => "SpatialAnalyzer text",
            Self::Rtde => "UR RTDE recording",
            Self::Kflop => "KFLOP log",
            Self::Columns => "columns as given",
            Self::B5r => "Ballbar 20 results",
        })
    }
}

/// What detection says in the end.
#[derive(Debug)]
pub(super) enum Detected {
    Table(Box<Layout>),
    /// Results, no samples.
    Results,
    /// No layout that is known; the names of its columns, if it has any.
    Unknown {
        names: Vec<String>,
    },
}

/// Looks at the first lines. A format other than `Auto` tries that layout alone.
pub(super) fn detect(head: &Head, reading: Reading<'_>) -> Result<Detected, String> {
    let wanted = reading.format;
    if let Some(given) = reading.columns {
        let layout = columns::recognise(head, given, reading.even.is_some())?;
        return Ok(Detected::Table(Box::new(layout)));
    }
    let xml = head.line(0).trim_start().starts_with('<');
    if wanted == Format::B5r || (wanted == Format::Auto && xml) {
        return Ok(Detected::Results);
    }
    type Recogniser = fn(&Head) -> Option<Layout>;
    let known: [Recogniser; 4] = [
        spatial_analyzer::recognise,
        rtde::recognise,
        kflop::recognise,
        leica::recognise,
    ];
    let fits = |l: &Layout| wanted == Format::Auto || l.format == wanted;
    let mut found = known.iter().filter_map(|recognise| recognise(head));
    if let Some(layout) = found.find(fits) {
        return Ok(Detected::Table(Box::new(layout)));
    }
    Ok(match named::recognise(head, reading.even.is_some()) {
        Found::Table(layout) if fits(&layout) => Detected::Table(layout),
        Found::Names(names) => Detected::Unknown { names },
        _ => Detected::Unknown { names: Vec::new() },
    })
}
