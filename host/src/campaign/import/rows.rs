//! The rows of a foreign file, walked in blocks on all cores: SI numbers column by column, refusals by line and column.
//!
//! A row is parsed byte by byte without a copy of it. What that does not understand is read again with all leniency of
//! [`Layout`] (blanks of other alphabets, odd stamps), and what that does not understand either is refused.
use super::layout::{DateOrder, Layout, Quantity, latin1, split};
use crate::campaign::blocks::{Fault, Text};
use crate::campaign::decimal;
use crate::campaign::table::{Batch, shorten};
use crate::campaign::{CampaignError, Place, Problem};
use giotto_shared::circle::Scatter;
use std::fs::File;
use std::ops::ControlFlow;
use std::path::Path;

pub(super) const EXPECTED: &str = "a file with measurements";

/// Rows of a foreign file that stand one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    pub(super) layout: Layout,
    /// Bytes of the file, from the first of a row to one after the last.
    pub(super) bytes: [u64; 2],
    /// Line of the first row, from 1.
    pub(super) first_line: usize,
    /// Rows, as far as they are known.
    pub(in crate::campaign) rows: usize,
    /// Moments of its points in space, if they were taken.
    pub(in crate::campaign) scatter: Option<Scatter>,
}

/// A block of rows, as its place in the file is known when it is taken.
pub(super) struct Block {
    /// Rows before it in the slice.
    pub(super) first: usize,
    pub(super) rows: usize,
    /// Bytes of the file.
    pub(super) bytes: [u64; 2],
}

impl Slice {
    /// What its columns hold.
    pub(in crate::campaign) fn quantities(&self) -> Vec<Quantity> {
        self.layout.fields.iter().map(|f| f.1).collect()
    }

    /// The layout that was recognised.
    pub fn format(&self) -> super::Format {
        self.layout.format
    }

    /// Line of a row, counted from the first of the slice.
    pub(in crate::campaign) fn line(&self, row: usize) -> usize {
        self.first_line + row
    }

    /// The columns of one row, if it can be read.
    pub(super) fn one(&self, line: &[u8]) -> Option<Vec<f64>> {
        let parsed = Plan::of(&self.layout).block(line);
        (parsed.batch.rows == 1).then(|| {
            parsed
                .batch
                .columns
                .iter()
                .map(|column| column[0])
                .collect()
        })
    }

    /// Walks the rows: `prepare` gets blocks of columns on all cores, `take` gets what it made in order and may end the walk.
    pub(super) fn walk<T: Send>(
        &self,
        path: &Path,
        prepare: impl Fn(Batch) -> T + Sync,
        mut take: impl FnMut(Block, T) -> Result<ControlFlow<()>, CampaignError>,
    ) -> Result<(), CampaignError> {
        let io = |e: std::io::Error| CampaignError::io(path, "read", EXPECTED, &e);
        let text = Text::between(File::open(path).map_err(io)?, self.bytes[0], self.bytes[1])
            .map_err(io)?;
        let plan = Plan::of(&self.layout);
        let (mut lines, mut rows) = (0, 0);
        let mut blank: Option<usize> = None;
        let parse = |at: u64, bytes: &[u8]| {
            let parsed = plan.block(bytes);
            let [blank, count, lines] = [parsed.blank, Some(parsed.batch.rows), Some(parsed.lines)];
            (
                blank,
                count,
                lines,
                parsed.failed,
                [at, at + bytes.len() as u64],
                prepare(parsed.batch),
            )
        };
        let walked = text.walk(parse, |(empty, count, more, failed, bytes, prepared)| {
            let refuse = |line: usize, column: usize, problem: Problem| {
                Err(CampaignError::new(
                    Place::at(path, self.first_line + line, column),
                    problem,
                ))
            };
            let (count, more) = (count.unwrap_or(0), more.unwrap_or(0));
            if let (Some(blank), true) = (blank, count > 0 || failed.is_some()) {
                return refuse(blank, 1, Problem::EmptyLine); // blank lines may end a file, not divide it
            }
            if let Some((line, column, problem)) = failed {
                return refuse(lines + line, column, problem);
            }
            blank = blank.or(empty.map(|line| lines + line));
            lines += more;
            let block = Block {
                first: rows,
                rows: count,
                bytes,
            };
            rows += count;
            if count == 0 {
                Ok(ControlFlow::Continue(()))
            } else {
                take(block, prepared)
            }
        });
        walked.map_err(|fault| match fault {
            Fault::Io(e) => io(e),
            Fault::Endless(_) => {
                let problem = Problem::Columns {
                    reason: "no line end for a long way; expected rows".to_owned(),
                };
                CampaignError::new(Place::at(path, self.first_line + lines, 1), problem)
            }
            Fault::Taken(error) => error,
        })
    }

    /// As [`walk`](Self::walk) for those who need no places.
    pub(in crate::campaign) fn walk_all<T: Send>(
        &self,
        path: &Path,
        prepare: impl Fn(Batch) -> T + Sync,
        mut take: impl FnMut(T) -> Result<(), CampaignError>,
    ) -> Result<(), CampaignError> {
        self.walk(path, prepare, |_, prepared| {
            take(prepared).map(|()| ControlFlow::Continue(()))
        })
    }
}

/// Fields in the order in which they stand in a row.
struct Plan<'a> {
    layout: &'a Layout,
    /// Field of the row, column of the batch, meaning, factor.
    fields: Vec<(usize, usize, Quantity, f64)>,
}

struct Parsed {
    batch: Batch,
    lines: usize,
    /// First empty line of those at the end.
    blank: Option<usize>,
    failed: Option<(usize, usize, Problem)>,
}

impl<'a> Plan<'a> {
    fn of(layout: &'a Layout) -> Self {
        let columns = layout.fields.iter().enumerate();
        let mut fields: Vec<_> = columns
            .map(|(k, &(at, quantity, factor))| (at, k, quantity, factor))
            .collect();
        fields.sort_by_key(|f| f.0);
        Self { layout, fields }
    }

    fn block(&self, bytes: &[u8]) -> Parsed {
        let guess = bytes.len() / (8 * self.fields.len()) + 1;
        let mut columns: Vec<Vec<f64>> = self
            .fields
            .iter()
            .map(|_| Vec::with_capacity(guess))
            .collect();
        let mut values = vec![0.0; columns.len()];
        let (mut at, mut rows, mut lines, mut blank, mut failed) = (0, 0, 0, None, None);
        let mut dates = Dates::default();
        while at < bytes.len() {
            let fast = if matches!(bytes[at], b'\n' | b'\r') {
                None
            } else {
                self.fast(bytes, at, &mut dates, &mut values)
            };
            let next = match fast {
                Some(next) => next,
                None => {
                    let end =
                        memchr::memchr(b'\n', &bytes[at..]).map_or(bytes.len(), |p| at + p + 1);
                    let line = &bytes[at..end];
                    if line.trim_ascii().is_empty() {
                        blank = blank.or(Some(lines));
                        (at, lines) = (end, lines + 1);
                        continue;
                    }
                    if let Err((column, problem)) = slow(self.layout, line, &mut values) {
                        failed = Some((lines, column, problem));
                        break;
                    }
                    end
                }
            };
            if let Some(blank) = blank {
                failed = Some((blank, 1, Problem::EmptyLine));
                break;
            }
            columns
                .iter_mut()
                .zip(&values)
                .for_each(|(column, value)| column.push(*value));
            (at, rows, lines) = (next, rows + 1, lines + 1);
        }
        Parsed {
            batch: Batch { columns, rows },
            lines,
            blank,
            failed,
        }
    }

    /// Reads the row at `at` into `values`; the byte after its end, or nothing where it is not plain.
    fn fast(
        &self,
        bytes: &[u8],
        mut at: usize,
        dates: &mut Dates,
        values: &mut [f64],
    ) -> Option<usize> {
        let separator = self.layout.separator;
        let runs = separator == b' ';
        let mark = if self.layout.decimal_comma {
            b','
        } else {
            b'.'
        };
        let mut field = 0;
        if runs {
            at = skip(bytes, at, b" \t\"");
        }
        for &(wanted, column, quantity, factor) in &self.fields {
            while field < wanted {
                let rest = bytes.get(at..)?;
                let p = if runs {
                    memchr::memchr3(b' ', b'\t', b'\n', rest)
                } else {
                    memchr::memchr2(separator, b'\n', rest)
                }?;
                if rest[p] == b'\n' {
                    return None;
                }
                at += p + 1;
                if runs {
                    at = skip(bytes, at, b" \t\"");
                }
                field += 1;
            }
            at = skip(
                bytes,
                at,
                if separator == b'\t' { b" \"" } else { b" \t\"" },
            );
            let rest = bytes.get(at..)?;
            let (value, used) = match quantity {
                Quantity::Stamp(order) => dates.stamp(rest, order)?,
                _ => decimal::parse(rest, mark)?,
            };
            if !value.is_finite() {
                return None;
            }
            values[column] = value * factor;
            at += used;
            if !runs {
                at = skip(
                    bytes,
                    at,
                    if separator == b'\t' { b" \"" } else { b" \t\"" },
                );
            } else if bytes.get(at) == Some(&b'"') {
                at += 1;
            }
            match bytes.get(at) {
                None | Some(b'\n' | b'\r') => {}
                Some(&b) if b == separator || (runs && b == b'\t') => {}
                Some(_) => return None,
            }
        }
        // What stands behind the last field of interest is no matter of ours.
        match bytes.get(at) {
            None => Some(at),
            Some(b'\n') => Some(at + 1),
            Some(_) => {
                Some(memchr::memchr(b'\n', &bytes[at..]).map_or(bytes.len(), |p| at + p + 1))
            }
        }
    }
}

fn skip(bytes: &[u8], mut at: usize, blanks: &[u8]) -> usize {
    while bytes.get(at).is_some_and(|b| blanks.contains(b)) {
        at += 1;
    }
    at
}

/// Stamps of one day after the other: the day is worked out once.
#[derive(Default)]
struct Dates {
    text: [u8; 10],
    length: usize,
    days: i64,
}

impl Dates {
    /// Seconds since 1970 of `'08.11.2022 16:17:28.353`, and the bytes that it takes.
    fn stamp(&mut self, bytes: &[u8], order: DateOrder) -> Option<(f64, usize)> {
        let quote = usize::from(bytes.first() == Some(&b'\''));
        let date = &bytes[quote..];
        let length = date.iter().take(11).position(|&b| b == b' ')?;
        let date = &date[..length];
        if self.length != length || self.text[..length] != *date {
            self.text.get_mut(..length)?.copy_from_slice(date);
            self.days = days(std::str::from_utf8(date).ok()?, order)?;
            self.length = length;
        }
        let clock = &bytes[quote + length + 1..];
        let two = |k: usize| {
            let digit = |k: usize| {
                clock
                    .get(k)
                    .filter(|b| b.is_ascii_digit())
                    .map(|b| f64::from(b - b'0'))
            };
            Some(10.0 * digit(k)? + digit(k + 1)?)
        };
        if clock.get(2) != Some(&b':') || clock.get(5) != Some(&b':') {
            return None;
        }
        let (seconds, used) = decimal::parse(&clock[6..], b'.')?;
        let seconds = (seconds >= 0.0).then_some(seconds)?;
        let value = self.days as f64 * 86_400.0 + two(0)? * 3600.0 + two(3)? * 60.0 + seconds;
        Some((value, quote + length + 1 + 6 + used))
    }
}

/// Reads a row with all leniency.
fn slow(layout: &Layout, line: &[u8], values: &mut [f64]) -> Result<(), (usize, Problem)> {
    let text;
    let line = match std::str::from_utf8(line) {
        Ok(line) => line,
        Err(_) => {
            text = latin1(line);
            &text
        }
    };
    let line = line.trim_end_matches(['\n', '\r']);
    let needed = layout.fields.iter().map(|f| f.0 + 1).max().unwrap_or(0);
    let parts = split(line, layout.separator);
    if parts.len() < needed {
        return Err((
            line.chars().count().max(1),
            Problem::Ragged {
                found: parts.len(),
                expected: needed,
            },
        ));
    }
    for (&(at, quantity, factor), value) in layout.fields.iter().zip(values) {
        let field = parts[at];
        let column = || {
            line[..field.as_ptr() as usize - line.as_ptr() as usize]
                .chars()
                .count()
                + 1
        };
        let name = || format!("{quantity:?}").to_lowercase();
        *value = if let Quantity::Stamp(order) = quantity {
            seconds(field, order).ok_or_else(|| {
                (
                    column(),
                    Problem::NotAStamp {
                        text: field.to_owned(),
                    },
                )
            })?
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
                        Problem::NotFinite {
                            text: field.to_owned(),
                            column: name(),
                        },
                    ));
                }
                Err(_) if field.is_empty() => {
                    return Err((column(), Problem::EmptyField { column: name() }));
                }
                Err(_) => {
                    let text = shorten(field);
                    return Err((
                        column(),
                        Problem::NotANumber {
                            text,
                            column: name(),
                        },
                    ));
                }
            }
        };
    }
    Ok(())
}

/// Seconds of a stamp since 1970 (UTC assumed; only differences are used).
fn seconds(text: &str, order: DateOrder) -> Option<f64> {
    let text = text.trim().trim_start_matches('\'').trim();
    let (date, clock) = text.split_once(' ')?;
    let mut clock = clock.trim().split(':');
    let (hour, minute) = (
        clock.next()?.parse::<f64>().ok()?,
        clock.next()?.parse::<f64>().ok()?,
    );
    let second = clock.next()?.replace(',', ".").parse::<f64>().ok()?;
    if clock.next().is_some() {
        return None;
    }
    Some(days(date, order)? as f64 * 86_400.0 + hour * 3600.0 + minute * 60.0 + second)
}

/// Days since 1970 of the proleptic Gregorian calendar, years starting in March.
fn days(date: &str, order: DateOrder) -> Option<i64> {
    let mut date = date.split(['.', '/', '-']).map(|p| p.parse::<i64>().ok());
    let (a, b, year) = (date.next()??, date.next()??, date.next()??);
    let (day, month) = match order {
        DateOrder::DayMonthYear => (a, b),
        DateOrder::MonthDayYear => (b, a),
    };
    let year = if year < 100 { year + 2000 } else { year };
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) || !(1970..=9999).contains(&year) {
        return None;
    }
    let shifted = if month > 2 { year } else { year - 1 };
    let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    Some(365 * shifted + shifted / 4 - shifted / 100 + shifted / 400 + day_of_year - 719_468)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_readers_of_a_row_agree_and_the_plain_one_needs_no_help() {
        let layout = |separator, decimal_comma, fields: &[(usize, Quantity, f64)]| Layout {
            format: super::super::Format::Columns,
            separator,
            decimal_comma,
            skip: 0,
            fields: fields.to_vec(),
        };
        let stamp = Quantity::Stamp(DateOrder::DayMonthYear);
        let xyz: Vec<_> = (0..3).map(|k| (k, Quantity::Position(k), 1e-3)).collect();
        let leica = [&xyz[..], &[(5, stamp, 1.0)]].concat();
        let rtde = [
            (0, Quantity::Time, 1.0),
            (4, Quantity::Position(0), 1.0),
            (2, Quantity::Position(1), 1.0),
        ];
        let cases: [(Layout, &str); 6] = [
            (
                layout(b',', false, &leica),
                "1832.4,-977.1 , 6.118e2,0.01,20,'08.11.2022 16:17:28.353,P\r\n",
            ),
            (
                layout(b',', false, &leica),
                "1,2,3,,,'29.02.2024 00:00:00.5\n",
            ),
            (layout(b';', true, &xyz), "1,25;-0,5;3;Bemerkung\r\n"),
            (layout(b' ', false, &rtde), " 0.002  7 8.5\t9 -1.25\n"),
            (layout(b'\t', false, &rtde), "0.1\t7\t8.5\t9\t-1.25"),
            (layout(b',', false, &xyz), "\"1.5\",\"2\",\"-3\"\n"),
        ];
        for (layout, row) in cases {
            let plan = Plan::of(&layout);
            let [mut fast, mut slow_values] = [
                vec![0.0; layout.fields.len()],
                vec![0.0; layout.fields.len()],
            ];
            assert_eq!(
                plan.fast(row.as_bytes(), 0, &mut Dates::default(), &mut fast),
                Some(row.len()),
                "{row}"
            );
            slow(&layout, row.as_bytes(), &mut slow_values).unwrap();
            assert_eq!(fast, slow_values, "{row}");
            assert!(fast.iter().all(|v| *v != 0.0), "{row}: {fast:?}");
        }
    }

    #[test]
    fn days_are_those_of_the_calendar() {
        assert_eq!(days("01.01.1970", DateOrder::DayMonthYear), Some(0));
        assert_eq!(days("11/08/22", DateOrder::MonthDayYear), Some(19_304));
        assert_eq!(days("13/08/22", DateOrder::MonthDayYear), None);
    }
}
