//! What can be wrong with a campaign: one place (file, line, column), one problem, one thing to do next.
use crate::kinematics::ReachError;
use std::fmt;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A campaign that cannot be used as it is. Its text names file, line and column and what was expected;
/// [`CampaignError::help`] says what to do next.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{at}: {problem}")]
pub struct CampaignError {
    /// Where.
    pub at: Box<Place>,
    /// What.
    pub problem: Box<Problem>,
}

/// A place in a file. Lines and columns count from 1; columns count characters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file (or directory).
    pub file: PathBuf,
    /// Line, if the problem has one.
    pub line: Option<usize>,
    /// Column, if the problem has one.
    pub column: Option<usize>,
}

impl Place {
    /// A whole file.
    pub fn file(file: impl Into<PathBuf>) -> Self {
        Self {
            file: file.into(),
            line: None,
            column: None,
        }
    }

    /// A line and column of a file.
    pub fn at(file: impl Into<PathBuf>, line: usize, column: usize) -> Self {
        Self {
            file: file.into(),
            line: Some(line),
            column: Some(column),
        }
    }

    /// The place of a byte of a text.
    pub fn of_byte(file: impl Into<PathBuf>, text: &[u8], byte: usize) -> Self {
        let before = &text[..byte.min(text.len())];
        let start = before
            .iter()
            .rposition(|&b| b == b'\n')
            .map_or(0, |p| p + 1);
        let line = 1 + before.iter().filter(|&&b| b == b'\n').count();
        let column = 1 + String::from_utf8_lossy(&before[start..]).chars().count();
        Self::at(file, line, column)
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
            if let Some(column) = self.column {
                write!(f, ":{column}")?;
            }
        }
        Ok(())
    }
}

/// Everything that a campaign is refused for.
#[derive(Clone, Debug, PartialEq, Error)]
#[allow(
    missing_docs,
    reason = "the message of each variant is its documentation"
)]
pub enum Problem {
    // The file system.
    #[error("no such file; expected {expected}")]
    Missing { expected: &'static str },
    #[error("is a directory; expected {expected}")]
    IsDirectory { expected: &'static str },
    #[error("cannot be {action}: {reason}")]
    Io {
        action: &'static str,
        reason: String,
    },
    #[error("is empty; expected {expected}")]
    Empty { expected: &'static str },
    #[error("not UTF-8 text; expected {expected}")]
    NotUtf8 { expected: &'static str },

    // campaign.toml.
    #[error("not valid TOML: {reason}")]
    Toml { reason: String },
    #[error("`{key}` is missing; expected {expected}")]
    MissingKey {
        key: &'static str,
        expected: &'static str,
    },
    #[error("`{key}` is {found}; expected {expected}")]
    WrongType {
        key: String,
        found: String,
        expected: &'static str,
    },
    #[error("unknown key `{key}`; did you mean `{known}`?")]
    UnknownKey { key: String, known: &'static str },
    #[error("`{key}` is {value}; expected {expected}")]
    OutOfRange {
        key: &'static str,
        value: String,
        expected: &'static str,
    },
    #[error("`direction` is \"{found}\"; expected \"ccw\" or \"cw\"")]
    UnknownDirection { found: String },
    #[error(
        "the points lie across ({}, {}, {}), which is not the plane {declared}",
        normal[0], normal[1], normal[2]
    )]
    OtherPlane {
        declared: &'static str,
        normal: [f64; 3],
    },
    #[error(
        "a circle of radius {radius_mm} mm about [{}, {}, {}] mm, at {angle_deg}°: {reason}",
        centre_mm[0], centre_mm[1], centre_mm[2]
    )]
    OutOfReach {
        radius_mm: f64,
        centre_mm: [f64; 3],
        angle_deg: f64,
        reason: ReachError,
    },
    #[error("no run \"{file}\"; expected one of {}", some_of(runs))]
    UnknownRun { file: String, runs: Vec<String> },
    #[error("the campaign lists no runs; expected at least one [[run]]")]
    NoRuns,
    #[error("run \"{file}\" is listed twice (first in line {first}); expected each run once")]
    DuplicateRun { file: String, first: usize },
    #[error("file name \"{file}\" leaves the campaign's directory; expected a name inside it")]
    OutsideDirectory { file: String },

    // The shape of a run's file.
    #[error("header is \"{found}\"; expected {}", SHAPES)]
    Header { found: String },
    #[error("column \"{name}\" twice; expected each column once")]
    DuplicateColumn { name: String },
    #[error("no header: the first line holds numbers; expected {}", SHAPES)]
    NoHeader,
    #[error("semicolons separate the columns; expected commas and decimal points")]
    Semicolons,
    #[error("row has {found} fields; expected {expected} as in the header")]
    Ragged { found: usize, expected: usize },
    #[error(
        "\"{text}\" has a decimal comma; expected a decimal point (row has {found} fields for {expected} columns)"
    )]
    DecimalComma {
        text: String,
        found: usize,
        expected: usize,
    },
    #[error("\"{text}\" is not a number; expected {column} as a number")]
    NotANumber { text: String, column: String },
    #[error("empty field; expected {column} as a number")]
    EmptyField { column: String },
    #[error("empty line or comment in the data; expected a row")]
    EmptyLine,
    #[error("\"{text}\" is not finite; expected {column} as a finite number")]
    NotFinite { text: String, column: String },

    // The sense of a run.
    #[error("only {found} sample(s); expected at least {expected} over one turn")]
    TooFew { found: usize, expected: usize },
    #[error("time goes back from {from_s} s to {to_s} s; expected rows in time order")]
    TimeBackwards { from_s: f64, to_s: f64 },
    #[error("time stands still at {at_s} s over all rows; expected time stamps that grow")]
    TimeConstant { at_s: f64 },
    #[error(
        "samples are missing over {gap_deg:.0}° of the turn ({gap_s:.4} s); expected no gap over {limit_deg:.0}°"
    )]
    Gap {
        gap_s: f64,
        gap_deg: f64,
        limit_deg: f64,
    },
    #[error("the angle stands still at {at_deg:.3}° over all rows; expected a full turn")]
    AngleConstant { at_deg: f64 },
    #[error(
        "the angle runs {found} over the run; expected {expected}, as the campaign's direction = \"{direction}\" says"
    )]
    DirectionContradicted {
        found: &'static str,
        expected: &'static str,
        direction: &'static str,
    },
    #[error("the angle jumps back by {back_deg:.2}°; expected angles in order of travel")]
    AngleBackwards { back_deg: f64 },
    #[error("the samples cover {covered_deg:.1}° of the circle; expected one full turn of 360°")]
    Arc { covered_deg: f64 },
    #[error(
        "the samples cover {covered_deg:.1}°, the campaign says arc_deg = {declared_deg}; expected them to agree"
    )]
    ArcContradicted { covered_deg: f64, declared_deg: f64 },
    #[error("the samples go on for {turns:.2} turns; expected exactly one")]
    SeveralTurns { turns: f64 },
    #[error(
        "the samples last {measured_s:.4} s and repeat themselves, {laps} laps of {programmed_s:.4} s; expected exactly one turn"
    )]
    SeveralLaps {
        measured_s: f64,
        programmed_s: f64,
        laps: u32,
    },
    #[error(
        "the samples last {measured_s:.4} s, one turn at the programmed feed {programmed_s:.4} s: {share:.2} of a turn; expected one full turn"
    )]
    TooShort {
        measured_s: f64,
        programmed_s: f64,
        share: f64,
    },
    #[error(
        "the samples last {measured_s:.4} s, one turn at the programmed feed {programmed_s:.4} s: {hint}; expected one turn"
    )]
    TooLong {
        measured_s: f64,
        programmed_s: f64,
        hint: String,
    },
    #[error(
        "{column} is {value}, far from a circle of {radius_mm} mm: {hint}; expected {expected}"
    )]
    Implausible {
        column: String,
        value: String,
        radius_mm: f64,
        hint: String,
        expected: String,
    },
    #[error(
        "the points fit a circle of radius {fitted_mm:.6} mm, the campaign says {programmed_mm} mm: {hint}; expected them to agree within 25 %"
    )]
    WrongRadius {
        fitted_mm: f64,
        programmed_mm: f64,
        hint: String,
    },
    #[error("no circle through the points: {reason}; expected points on a circle")]
    NoCircle { reason: String },
    #[error(
        "the instrument stood at its limit, {value_um} µm over {rows} rows in a row; expected readings inside its range"
    )]
    OutOfInstrumentRange { value_um: f64, rows: usize },
    #[error(
        "the first and the last reading are {apart_um} µm apart where a whole turn would close; expected evenly spaced readings of one turn"
    )]
    Open { apart_um: f64 },
    #[error(
        "the same value, {value_um} µm, over {rows} rows in a row while the machine went on; expected readings of their own"
    )]
    Held { value_um: f64, rows: usize },
    #[error(
        "the deviations span {span_um} µm with {noise_nm} nm of noise, finer than an instrument reads: they look like millimetres called µm; expected micrometres"
    )]
    CalledMicrometres { span_um: f64, noise_nm: f64 },
    #[error(
        "holds the same measurement as \"{other}\", noise and all; expected a file of its own for each run"
    )]
    DuplicateData { other: String },

    // Foreign files.
    #[error(
        "first line \"{found}\" belongs to no known layout (asked for: {wanted}){}; expected a giotto CSV, a header naming x and y or deviation with units, Leica, SpatialAnalyzer, RTDE, RSI, EGM, Motive, Vicon, ROS, halscope or KFLOP",
        listed(names)
    )]
    UnknownFormat {
        found: String,
        wanted: String,
        /// Names of its columns, if it has any.
        names: Vec<String>,
        /// What `--columns` could be.
        example: Option<String>,
    },
    #[error("{reason}")]
    Columns {
        reason: String,
        /// What `--columns` could be.
        example: Option<String>,
    },
    #[error("not the XML of a Ballbar 20 file: {reason}")]
    Xml { reason: String },
    #[error("a Ballbar 20 file holds results, its samples cannot be read; expected samples")]
    ResultsOnly,
    #[error("\"{text}\" is not a date and time; expected one such as 08.11.2022 16:17:28.353")]
    NotAStamp { text: String },
    #[error("the samples cover {covered_deg:.1}° of the circle; expected at least 180°")]
    ShortArc { covered_deg: f64 },
    #[error(
        "only {found} of {rows} points lie on the circle of {radius_mm} mm; expected a circular test"
    )]
    OffCircle {
        found: usize,
        rows: usize,
        radius_mm: f64,
    },
    #[error(
        "the direction of travel cannot be seen in deviations over time; expected --direction ccw or cw"
    )]
    DirectionUnknown,

    #[error("no file of measurements in it; expected .csv, .txt, .log, .tsv, .dat or .xml")]
    EmptyFolder,
    #[error("\"{name}\" does not fit the pattern \"{pattern}\"; expected {expected}")]
    NamePattern {
        name: String,
        pattern: String,
        expected: String,
    },
    #[error("{found}; expected {expected}")]
    List { found: String, expected: String },

    // Writing.
    #[error(
        "run {index} of the campaign has file name \"{file}\" already used; expected each name once"
    )]
    DuplicateName { index: usize, file: String },
}

impl CampaignError {
    /// Whether a file contradicts what the campaign says of it (radius, feed, direction, a whole turn): a label that was confused,
    /// and no file that cannot be read.
    pub fn contradicts_its_label(&self) -> bool {
        matches!(
            *self.problem,
            Problem::DirectionContradicted { .. }
                | Problem::ArcContradicted { .. }
                | Problem::TooShort { .. }
                | Problem::TooLong { .. }
                | Problem::Implausible { .. }
                | Problem::WrongRadius { .. }
        )
    }
}

/// The first names of a long list and its last.
fn some_of(names: &[String]) -> String {
    const FIRST: usize = 4;
    match names.split_last() {
        Some((last, rest)) if rest.len() > FIRST => {
            format!(
                "{}, … {last}, {} in all",
                rest[..FIRST].join(", "),
                names.len()
            )
        }
        _ => names.join(", "),
    }
}

const SHAPES: &str = "`time_s,deviation_um`, `angle_deg,deviation_um`, `time_s,x_mm,y_mm[,z_mm]` or `x_mm,y_mm[,z_mm]` (`deviation_mm` and `radius_mm` serve as well)";

/// The columns that do not make a circular test.
fn listed(names: &[String]) -> String {
    if names.is_empty() {
        String::new()
    } else {
        let names: Vec<&str> = names.iter().map(|n| n.trim()).collect();
        format!(": no circular test in the columns {}", names.join(", "))
    }
}

impl CampaignError {
    /// A problem at a place.
    pub fn new(at: Place, problem: Problem) -> Self {
        Self {
            at: Box::new(at),
            problem: Box::new(problem),
        }
    }

    /// What the operating system said about a file.
    pub(crate) fn io(
        file: &Path,
        action: &'static str,
        expected: &'static str,
        error: &std::io::Error,
    ) -> Self {
        let problem = match error.kind() {
            std::io::ErrorKind::NotFound => Problem::Missing { expected },
            std::io::ErrorKind::IsADirectory => Problem::IsDirectory { expected },
            _ if file.is_dir() => Problem::IsDirectory { expected },
            _ => Problem::Io {
                action,
                reason: error.to_string(),
            },
        };
        Self::new(Place::file(file), problem)
    }

    /// What to do next, one sentence.
    pub fn help(&self) -> String {
        let (Problem::UnknownFormat { example, .. } | Problem::Columns { example, .. }) =
            &*self.problem
        else {
            return self.usual_help().to_owned();
        };
        let Some(example) = example else {
            return "for example --columns time_s,-,x_mm,y_mm (- skips one); a file of text is expected"
                .to_owned();
        };
        let columns = example.split(',').count();
        if columns == 1 {
            return format!("name its column: --columns {example} --angles even");
        }
        format!("name its {columns} columns, for example --columns {example} (- skips one)")
    }

    fn usual_help(&self) -> &'static str {
        use Problem as P;
        match *self.problem {
            P::Missing { .. } | P::IsDirectory { .. } | P::Io { .. } => "check the path",
            P::Empty { .. } => "measure or export the file again",
            P::NotUtf8 { .. }
            | P::Semicolons
            | P::DecimalComma { .. }
            | P::Header { .. }
            | P::NoHeader => {
                "`giotto import` reads other formats (German locale, trackers, robot logs, --columns)"
            }
            P::Toml { .. }
            | P::WrongType { .. }
            | P::OutOfRange { .. }
            | P::OtherPlane { .. }
            | P::UnknownDirection { .. } => "correct this line of campaign.toml",
            P::OutOfReach { .. } => {
                "correct `centre_mm` (in the robot's base), the tool, the orientation or the branch in campaign.toml"
            }
            P::MissingKey { .. } | P::UnknownKey { .. } => "correct the key in campaign.toml",
            P::UnknownRun { .. } => "`giotto campaign list` shows the runs of a campaign",
            P::NoRuns => "add a run with `giotto import`",
            P::DuplicateRun { .. } | P::DuplicateName { .. } => {
                "remove one of the two, or give the second its own file"
            }
            P::OutsideDirectory { .. } => "copy the file into the campaign's directory",
            P::DuplicateColumn { .. }
            | P::Ragged { .. }
            | P::NotANumber { .. }
            | P::EmptyField { .. } => "correct or export the file again",
            P::EmptyLine | P::NotFinite { .. } => "remove the row, or export the file again",
            P::TooFew { .. } => "measure a full turn, with at least 16 samples",
            P::TimeBackwards { .. } | P::TimeConstant { .. } => {
                "export the rows in time order, time in seconds"
            }
            P::Gap { .. } => "measure the run again; the recording lost samples",
            P::AngleConstant { .. } | P::AngleBackwards { .. } => {
                "export the rows in order of travel"
            }
            P::DirectionContradicted { .. } => "correct `direction`, or the sign of the angles",
            P::Arc { .. } | P::SeveralTurns { .. } | P::SeveralLaps { .. } => {
                "`giotto import` trims laps and feed-in, and takes arcs of 180° and more"
            }
            P::ArcContradicted { .. } => "correct `arc_deg`, or import the file again",
            P::TooShort { .. } => "record the whole turn, or correct the programmed feed or radius",
            P::TooLong { .. } => {
                "correct the programmed feed (mm/s), the radius (mm) or the unit of time_s"
            }
            P::Implausible { .. } | P::WrongRadius { .. } => {
                "correct the unit in the header, or the programmed radius"
            }
            P::Open { .. } => "export the whole turn, or give the angles in a column of their own",
            P::Held { .. } => "measure the run again; the instrument lost its target",
            P::CalledMicrometres { .. } => {
                "correct the header to deviation_mm, or name the columns: --columns angle_deg,deviation_mm"
            }
            P::NoCircle { .. } => "check which file this is",
            P::OutOfInstrumentRange { .. } => {
                "set the instrument up again; the readings beyond its range are lost"
            }
            P::EmptyFolder => "give the files themselves",
            P::NamePattern { .. } => {
                "for example --name '{radius}_{feed}_{direction}'; {} stands for anything"
            }
            P::List { .. } => "correct this line of the list",
            P::UnknownFormat { .. } | P::Columns { .. } => "name the columns with --columns",
            P::Xml { .. } => "export the results from Ballbar 20 again",
            P::ResultsOnly => {
                "set its results beside giotto's: giotto analyze CAMPAIGN --ballbar FILE.b5r"
            }
            P::NotAStamp { .. } => {
                "name the columns: --columns x_mm,y_mm,z_mm leaves the stamps out"
            }
            P::ShortArc { .. } => "measure a full turn, or an arc of 180° and more",
            P::OffCircle { .. } => "check --radius, its unit, and which file this is",
            P::DirectionUnknown => "add --direction",
            P::DuplicateData { .. } => {
                "measure the run again, or remove one of the two: a copy is not a repetition"
            }
        }
    }
}
