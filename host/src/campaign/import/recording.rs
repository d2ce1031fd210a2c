//! The numbers of a foreign file, in SI.
use super::detect::{Detected, Format, detect};
use super::layout::{DateOrder, Head, Layout, Quantity, latin1, split};
use crate::campaign::{CampaignError, Place, Problem};
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

const EXPECTED: &str = "a file with measurements";

/// Columns of a file; what it does not hold is empty.
#[derive(Clone, Debug)]
pub(super) struct Recording {
    pub(super) format: Format,
    /// Line of the first row, from 1.
    pub(super) first_line: usize,
    pub(super) rows: usize,
    pub(super) time_s: Vec<f64>,
    pub(super) angle_rad: Vec<f64>,
    pub(super) deviation_m: Vec<f64>,
    pub(super) radius_m: Vec<f64>,
    pub(super) position_m: [Vec<f64>; 3],
    pub(super) target_m: [Vec<f64>; 3],
}

/// Which layout a file has, by its first lines.
pub(super) fn recognise(path: &Path, wanted: Format, given: Option<&str>) -> Result<Layout, CampaignError> {
    let io = |e: std::io::Error| CampaignError::io(path, "read", EXPECTED, &e);
    if path.is_dir() {
        return Err(CampaignError::new(Place::file(path), Problem::IsDirectory { expected: EXPECTED }));
    }
    let mut head = Vec::new();
    std::fs::File::open(path).map_err(io)?.take(1 << 16).read_to_end(&mut head).map_err(io)?;
    if head.is_empty() {
        return Err(CampaignError::new(Place::file(path), Problem::Empty { expected: EXPECTED }));
    }
    let head = Head::of(&head);
    let refuse = |problem| Err(CampaignError::new(Place::at(path, 1, 1), problem));
    match detect(&head, wanted, given) {
        Err(reason) => refuse(Problem::Columns { reason }),
        Ok(Detected::Results) => refuse(Problem::ResultsOnly),
        Ok(Detected::Unknown) => {
            let found = crate::campaign::table::shorten(head.line(0));
            refuse(Problem::UnknownFormat { found, wanted: wanted.to_string() })
        }
        Ok(Detected::Table(layout)) => Ok(layout),
    }
}

impl Recording {
    /// Reads a file. `progress` is told the bytes read so far.
    pub(super) fn read(
        path: &Path,
        wanted: Format,
        given: Option<&str>,
        progress: &dyn Fn(u64),
    ) -> Result<Self, CampaignError> {
        Self::read_table(path, &recognise(path, wanted, given)?, progress)
    }

    fn read_table(path: &Path, layout: &Layout, progress: &dyn Fn(u64)) -> Result<Self, CampaignError> {
        let io = |e: std::io::Error| CampaignError::io(path, "read", EXPECTED, &e);
        let mut reader = BufReader::with_capacity(1 << 18, std::fs::File::open(path).map_err(io)?);
        let mut recording = Self {
            format: layout.format,
            first_line: layout.skip + 1,
            rows: 0,
            time_s: Vec::new(),
            angle_rad: Vec::new(),
            deviation_m: Vec::new(),
            radius_m: Vec::new(),
            position_m: Default::default(),
            target_m: Default::default(),
        };
        let needed = layout.fields.iter().map(|f| f.0 + 1).max().unwrap_or(0);
        let mut line = Vec::new();
        let (mut number, mut bytes, mut blank) = (0, 0u64, None);
        loop {
            line.clear();
            let read = reader.read_until(b'\n', &mut line).map_err(io)?;
            if read == 0 {
                break;
            }
            bytes += read as u64;
            number += 1;
            if number <= layout.skip {
                continue;
            }
            if line.trim_ascii().is_empty() {
                blank = blank.or(Some(number));
                continue;
            }
            if let Some(blank) = blank {
                return Err(CampaignError::new(Place::at(path, blank, 1), Problem::EmptyLine));
            }
            recording
                .row(layout, needed, &line)
                .map_err(|(column, problem)| CampaignError::new(Place::at(path, number, column), problem))?;
            if recording.rows.is_multiple_of(1 << 16) {
                progress(bytes);
            }
        }
        progress(bytes);
        Ok(recording)
    }

    fn row(&mut self, layout: &Layout, needed: usize, line: &[u8]) -> Result<(), (usize, Problem)> {
        let text;
        let line = match std::str::from_utf8(line) {
            Ok(line) => line,
            Err(_) => {
                text = latin1(line);
                &text
            }
        };
        let line = line.trim_end_matches(['\n', '\r']);
        let parts = split(line, layout.separator);
        if parts.len() < needed {
            return Err((
                line.chars().count().max(1),
                Problem::Ragged { found: parts.len(), expected: needed },
            ));
        }
        for &(at, quantity, factor) in &layout.fields {
            let field = parts[at];
            let column = || line[..field.as_ptr() as usize - line.as_ptr() as usize].chars().count() + 1;
            let name = || format!("{quantity:?}").to_lowercase();
            let value = if let Quantity::Stamp(order) = quantity {
                seconds(field, order)
                    .ok_or_else(|| (column(), Problem::NotAStamp { text: field.to_owned() }))?
            } else {
                let parsed = if layout.decimal_comma && field.contains(',') {
                    fast_float2::parse::<f64, _>(field.replace(',', "."))
                } else {
                    fast_float2::parse::<f64, _>(field)
                };
                match parsed {
                    Ok(v) if v.is_finite() => v * factor,
                    Ok(_) => {
                        return Err((
                            column(),
                            Problem::NotFinite { text: field.to_owned(), column: name() },
                        ));
                    }
                    Err(_) if field.is_empty() => {
                        return Err((column(), Problem::EmptyField { column: name() }));
                    }
                    Err(_) => {
                        let text = crate::campaign::table::shorten(field);
                        return Err((column(), Problem::NotANumber { text, column: name() }));
                    }
                }
            };
            let into = match quantity {
                Quantity::Time | Quantity::Stamp(_) => &mut self.time_s,
                Quantity::Angle => &mut self.angle_rad,
                Quantity::Deviation => &mut self.deviation_m,
                Quantity::Radius => &mut self.radius_m,
                Quantity::Position(axis) => &mut self.position_m[axis],
                Quantity::Target(axis) => &mut self.target_m[axis],
            };
            into.push(value);
        }
        self.rows += 1;
        Ok(())
    }
}

/// Seconds of a stamp since 1970 (UTC assumed; only differences are used).
pub(super) fn seconds(text: &str, order: DateOrder) -> Option<f64> {
    let text = text.trim().trim_start_matches('\'').trim();
    let (date, clock) = text.split_once(' ')?;
    let mut date = date.split(['.', '/', '-']).map(|p| p.parse::<i64>().ok());
    let (a, b, year) = (date.next()??, date.next()??, date.next()??);
    let (day, month) = match order {
        DateOrder::DayMonthYear => (a, b),
        DateOrder::MonthDayYear => (b, a),
    };
    let year = if year < 100 { year + 2000 } else { year };
    let mut clock = clock.trim().split(':');
    let (hour, minute) = (clock.next()?.parse::<f64>().ok()?, clock.next()?.parse::<f64>().ok()?);
    let second = clock.next()?.replace(',', ".").parse::<f64>().ok()?;
    if clock.next().is_some()
        || !(1..=12).contains(&month)
        || !(1..=31).contains(&day)
        || !(1970..=9999).contains(&year)
    {
        return None;
    }
    // Days since 1970 of the proleptic Gregorian calendar, years starting in March.
    let shifted = if month > 2 { year } else { year - 1 };
    let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    let days = 365 * shifted + shifted / 4 - shifted / 100 + shifted / 400 + day_of_year - 719_468;
    Some(days as f64 * 86_400.0 + hour * 3600.0 + minute * 60.0 + second)
}
