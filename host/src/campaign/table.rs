//! The numbers of a run's CSV, fast: chunked reads, exact floats, errors by line and column.
use super::blocks::{BLOCK, Fault, Text};
use super::decimal;
use super::error::{CampaignError, Place, Problem};
use super::similar_decimals::Shape;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

const EXPECTED_RUN: &str = "a CSV with one run";

/// A column of the contract.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Column {
    /// `time_s`.
    Time,
    /// `angle_deg`.
    Angle,
    /// `deviation_um`, `deviation_mm`.
    Deviation(Unit),
    /// `radius_mm`.
    Radius,
    /// `x_mm`, `y_mm`, `z_mm`.
    Position(usize),
}

/// Unit of a length in a header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unit {
    Um,
    Mm,
}

impl Column {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "time_s" => Self::Time,
            "angle_deg" => Self::Angle,
            "deviation_um" => Self::Deviation(Unit::Um),
            "deviation_mm" => Self::Deviation(Unit::Mm),
            "radius_mm" => Self::Radius,
            "x_mm" => Self::Position(0),
            "y_mm" => Self::Position(1),
            "z_mm" => Self::Position(2),
            _ => return None,
        })
    }

    /// The name in a header.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Time => "time_s",
            Self::Angle => "angle_deg",
            Self::Deviation(Unit::Um) => "deviation_um",
            Self::Deviation(Unit::Mm) => "deviation_mm",
            Self::Radius => "radius_mm",
            Self::Position(0) => "x_mm",
            Self::Position(1) => "y_mm",
            Self::Position(_) => "z_mm",
        }
    }
}

/// Rows in SI, column by column.
#[derive(Debug)]
pub(crate) struct Batch {
    /// One vector a field.
    pub(crate) columns: Vec<Vec<f64>>,
    /// Rows in each.
    pub(crate) rows: usize,
}

/// A file of one of the contract's shapes. Row `k` (from 0) stands in line `k + 2`.
#[derive(Debug)]
pub(crate) struct Table {
    path: PathBuf,
    pub(crate) header: Vec<Column>,
    text: Text,
}

impl Table {
    /// Opens a file and reads its header.
    pub(crate) fn open(path: &Path) -> Result<Self, CampaignError> {
        let io = |e: std::io::Error| CampaignError::io(path, "read", EXPECTED_RUN, &e);
        if path.is_dir() {
            return Err(CampaignError::new(
                Place::file(path),
                Problem::IsDirectory {
                    expected: EXPECTED_RUN,
                },
            ));
        }
        let mut text = Text::open(std::fs::File::open(path).map_err(io)?).map_err(io)?;
        let head = text.head();
        if head.is_empty() {
            return Err(CampaignError::new(
                Place::file(path),
                Problem::Empty {
                    expected: EXPECTED_RUN,
                },
            ));
        }
        let start = if head.starts_with(b"\xEF\xBB\xBF") {
            3
        } else {
            0
        };
        let end = head[start..]
            .iter()
            .position(|&b| b == b'\n')
            .map_or(head.len(), |p| start + p);
        let header = parse_header(path, &head[start..end])?;
        text.skip(end + 1);
        Ok(Self {
            path: path.to_path_buf(),
            header,
            text,
        })
    }

    /// Rows to expect, unless they come at once.
    pub(crate) fn rows(&self) -> Option<usize> {
        self.text.rows()
    }

    /// Walks all rows, each column times its factor: `prepare` works on batches on all cores, `take` gets what it made in the
    /// order of the file.
    pub(crate) fn walk<T: Send>(
        self,
        factors: &[f64],
        prepare: impl Fn(Batch) -> T + Sync,
        mut take: impl FnMut(T) -> Result<(), CampaignError>,
    ) -> Result<(), CampaignError> {
        let (path, header) = (&self.path, &self.header);
        let mut blank_at: Option<u64> = None;
        let parse = |at: u64, block: &[u8]| {
            let parsed = parse_block(block, factors).map_err(|line| at + line as u64)?;
            let blank = parsed.blank_at.map(|blank| at + blank as u64);
            let rows = parsed.rows;
            let prepared = (rows > 0).then(|| {
                prepare(Batch {
                    columns: parsed.columns,
                    rows,
                })
            });
            Ok((blank, prepared))
        };
        let walked = self.text.walk(parse, |result: Result<_, u64>| {
            let (blank, prepared) = result.map_err(|at| explain(path, header, at))?;
            if let Some(prepared) = prepared {
                if let Some(at) = blank_at {
                    return Err(explain(path, header, at)); // blank lines may end a file, not divide it
                }
                take(prepared)?;
            }
            blank_at = blank_at.or(blank);
            Ok(ControlFlow::Continue(()))
        });
        walked.map_err(|fault| match fault {
            Fault::Io(e) => CampaignError::io(path, "read", EXPECTED_RUN, &e),
            Fault::Endless(at) => explain(path, header, at),
            Fault::Taken(error) => error,
        })
    }
}

/// The place of a field, for checks that know only row and column. Reads the file again (errors are rare).
pub(crate) fn place(path: &Path, row: usize, field: usize) -> Place {
    let line_number = row + 2;
    let column = std::fs::File::open(path)
        .ok()
        .and_then(|f| BufReader::new(f).split(b'\n').nth(line_number - 1)?.ok())
        .map_or(1, |line| {
            let before = line
                .split(|&b| b == b',')
                .take(field)
                .map(|f| String::from_utf8_lossy(f).chars().count() + 1);
            1 + before.sum::<usize>()
        });
    Place::at(path, line_number, column)
}

fn parse_header(path: &Path, line: &[u8]) -> Result<Vec<Column>, CampaignError> {
    let err = |column: usize, problem| Err(CampaignError::new(Place::at(path, 1, column), problem));
    let Ok(line) = std::str::from_utf8(line) else {
        let at = std::str::from_utf8(line).map_or_else(|e| e.valid_up_to(), |_| 0);
        let column = String::from_utf8_lossy(&line[..at]).chars().count() + 1;
        return err(
            column,
            Problem::NotUtf8 {
                expected: EXPECTED_RUN,
            },
        );
    };
    let line = line.trim_end_matches('\r');
    if line.trim().is_empty() {
        return err(
            1,
            Problem::Header {
                found: String::new(),
            },
        );
    }
    let mut header = Vec::new();
    let mut column = 1;
    for name in line.split(',') {
        match Column::parse(name.trim()) {
            Some(c) if header.contains(&c) => {
                return err(
                    column,
                    Problem::DuplicateColumn {
                        name: name.trim().to_owned(),
                    },
                );
            }
            Some(c) => header.push(c),
            None if line.contains(';') => {
                return err(line.find(';').unwrap_or(0) + 1, Problem::Semicolons);
            }
            None if line.split(',').all(|f| f.trim().parse::<f64>().is_ok()) => {
                return err(1, Problem::NoHeader);
            }
            None => {
                return err(
                    column,
                    Problem::Header {
                        found: shorten(line),
                    },
                );
            }
        }
        column += name.chars().count() + 1;
    }
    let has = |c: Column| header.contains(&c);
    let radial = header
        .iter()
        .filter(|c| matches!(c, Column::Deviation(_) | Column::Radius))
        .count();
    let positions = header
        .iter()
        .filter(|c| matches!(c, Column::Position(_)))
        .count();
    let polar = radial == 1 && positions == 0 && (has(Column::Time) || has(Column::Angle));
    let planar =
        radial == 0 && !has(Column::Angle) && has(Column::Position(0)) && has(Column::Position(1));
    if !(polar || planar) {
        return err(
            1,
            Problem::Header {
                found: shorten(line),
            },
        );
    }
    Ok(header)
}

/// Whether a first line is a header of the contract.
pub(crate) fn is_contract_header(line: &str) -> bool {
    parse_header(Path::new(""), line.as_bytes()).is_ok()
}

pub(crate) fn shorten(text: &str) -> String {
    let text = text.trim();
    if text.chars().count() <= 60 {
        text.to_owned()
    } else {
        text.chars().take(57).chain("…".chars()).collect()
    }
}

struct Parsed {
    columns: Vec<Vec<f64>>,
    rows: usize,
    blank_at: Option<usize>,
}

/// A column that grows row by row.
struct Growing {
    values: Vec<f64>,
    /// Of the field above.
    shape: Option<Shape>,
    factor: f64,
}

/// Parses whole lines of as many numbers as there are factors to SI; the error is the offset of the line that does not fit.
fn parse_block(bytes: &[u8], factors: &[f64]) -> Result<Parsed, usize> {
    let width = factors.len();
    // The last line may have no end.
    let lines = memchr::memchr_iter(b'\n', bytes).count() + 1;
    let new = |&factor: &f64| Growing {
        values: Vec::with_capacity(lines),
        shape: None,
        factor,
    };
    let mut columns: Vec<Growing> = factors.iter().map(new).collect();
    let (mut at, mut rows, mut blank_at) = (0, 0, None);
    'rows: while at < bytes.len() {
        let line = at;
        for (field, column) in columns.iter_mut().enumerate() {
            let like_above = column
                .shape
                .as_ref()
                .and_then(|shape| shape.read(bytes, at));
            if let Some((value, next)) = like_above {
                column.values.push(value * column.factor);
                at = next;
                continue;
            }
            if field == 0 && is_blank(bytes, at) {
                // Blank lines may end a file, not divide it.
                if !bytes[at..].iter().all(u8::is_ascii_whitespace) {
                    return Err(at);
                }
                blank_at = Some(at);
                break 'rows;
            }
            at = parse_unlike(column, bytes, at, field + 1 == width).ok_or(line)?;
        }
        rows += 1;
    }
    Ok(Parsed {
        columns: columns.into_iter().map(|column| column.values).collect(),
        rows,
        blank_at,
    })
}

/// A field of any shape into its column; the byte behind its end.
#[cold]
fn parse_unlike(column: &mut Growing, bytes: &[u8], at: usize, last: bool) -> Option<usize> {
    let (value, next) = parse_field(bytes, at, last)?;
    column.shape = Shape::of(&bytes[at..next]);
    column.values.push(value * column.factor);
    Some(next)
}

/// Whether the line at `at` is empty.
fn is_blank(bytes: &[u8], at: usize) -> bool {
    matches!(bytes[at], b'\n' | b'\r' | b' ' | b'\t')
        && bytes[at..]
            .iter()
            .take_while(|b| **b != b'\n')
            .all(u8::is_ascii_whitespace)
}

/// A finite number with blanks around it, and the byte behind the end of its field.
fn parse_field(bytes: &[u8], at: usize, last: bool) -> Option<(f64, usize)> {
    let at = skip_blanks(bytes, at);
    let (value, used) =
        decimal::parse(&bytes[at..], b'.').filter(|(value, _)| value.is_finite())?;
    let end = skip_blanks(bytes, at + used);
    let next = match bytes.get(end) {
        Some(b',') if !last => end + 1,
        Some(b'\n') if last => end + 1,
        Some(b'\r') if last && bytes.get(end + 1).is_none_or(|&b| b == b'\n') => {
            bytes.len().min(end + 2)
        }
        None if last => end,
        _ => return None,
    };
    Some((value, next))
}

fn skip_blanks(bytes: &[u8], mut at: usize) -> usize {
    while matches!(bytes.get(at), Some(b' ' | b'\t')) {
        at += 1;
    }
    at
}

/// Says what is wrong with the line that starts at `offset`.
fn explain(path: &Path, header: &[Column], offset: u64) -> CampaignError {
    let found = (|| -> std::io::Result<(usize, Vec<u8>)> {
        let file = std::fs::File::open(path)?;
        let mut reader = BufReader::with_capacity(BLOCK, file);
        let mut lines = 0;
        let mut left = offset;
        while left > 0 {
            let chunk = reader.fill_buf()?;
            let n = chunk.len().min(usize::try_from(left).unwrap_or(usize::MAX));
            if n == 0 {
                break;
            }
            lines += chunk[..n].iter().filter(|&&b| b == b'\n').count();
            reader.consume(n);
            left -= n as u64;
        }
        reader.seek(SeekFrom::Start(offset))?;
        let mut line = Vec::new();
        // A binary file may have no line ends at all.
        reader.take(1 << 16).read_until(b'\n', &mut line)?;
        Ok((lines + 1, line))
    })();
    match found {
        Ok((number, line)) => {
            let (column, problem) = explain_line(header, &line);
            CampaignError::new(Place::at(path, number, column), problem)
        }
        Err(e) => CampaignError::io(path, "read", EXPECTED_RUN, &e),
    }
}

fn explain_line(header: &[Column], line: &[u8]) -> (usize, Problem) {
    let line = match std::str::from_utf8(line) {
        Ok(text) => text.trim_end_matches(['\n', '\r']),
        Err(e) => {
            let column = String::from_utf8_lossy(&line[..e.valid_up_to()])
                .chars()
                .count()
                + 1;
            return (
                column,
                Problem::NotUtf8 {
                    expected: "numbers",
                },
            );
        }
    };
    if line.trim().is_empty() {
        return (1, Problem::EmptyLine);
    }
    let fields: Vec<&str> = line.split(',').collect();
    let (found, expected) = (fields.len(), header.len());
    let mut column = 1;
    for (field, text) in fields.iter().enumerate() {
        let name = header.get(field).map_or("nothing", |c| c.name()).to_owned();
        let value = text.trim();
        let here = column + text.chars().take_while(|c| c.is_whitespace()).count();
        if field >= expected {
            // `0,00125,-179,7`: every field an integer part or digits of a fraction.
            let digits = |f: &&str| {
                f.trim()
                    .trim_start_matches(['-', '+'])
                    .bytes()
                    .all(|b| b.is_ascii_digit())
            };
            let comma = found == 2 * expected && fields.iter().all(digits);
            let problem = if comma {
                Problem::DecimalComma {
                    text: format!("{},{}", fields[0].trim(), fields[1].trim()),
                    found,
                    expected,
                }
            } else {
                Problem::Ragged { found, expected }
            };
            return (if comma { 1 } else { column }, problem);
        }
        match fast_float2::parse::<f64, _>(value) {
            Ok(v) if v.is_finite() => {}
            Ok(_) => {
                return (
                    here,
                    Problem::NotFinite {
                        text: value.to_owned(),
                        column: name,
                    },
                );
            }
            Err(_) if value.is_empty() && found == expected => {
                return (here, Problem::EmptyField { column: name });
            }
            Err(_) if value.contains(';') => return (column, Problem::Semicolons),
            Err(_) => {
                return (
                    here,
                    Problem::NotANumber {
                        text: shorten(value),
                        column: name,
                    },
                );
            }
        }
        column += text.chars().count() + 1;
    }
    (
        column.saturating_sub(1),
        Problem::Ragged { found, expected },
    )
}
