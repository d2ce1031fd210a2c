//! The rows of a foreign file, walked in blocks on all cores: SI numbers column by column, refusals by line and column.
//!
//! A row is parsed byte by byte without a copy of it. What that does not understand is read again with all leniency of
//! [`Layout`] (blanks of other alphabets, odd stamps), and what that does not understand either is refused.
mod lenient;

use lenient::slow;

use super::layout::{DateOrder, Layout, Quantity};
use crate::campaign::blocks::{Fault, Text};
use crate::campaign::decimal;
use crate::campaign::table::Batch;
use crate::campaign::{CampaignError, Place, Problem};
use giotto_shared::circle::Scatter;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

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
    /// The text, where it is not read as it stands in the file.
    pub(super) text: Option<Arc<[u8]>>,
    /// Bytes of rows that are no part of the circle, in order, between the first and the last row.
    pub(super) left_out: Arc<[[u64; 2]]>,
    /// Lines without a row: the row before which they stand and how many they are.
    pub(super) skipped: Arc<[(usize, usize)]>,
}

/// A block of rows, as its place in the file is known when it is taken.
pub(super) struct Block {
    /// Rows before it in the slice.
    pub(super) first: usize,
    pub(super) rows: usize,
    /// Bytes of the file.
    pub(super) bytes: [u64; 2],
    /// Lines of the slice before it.
    pub(super) line: usize,
    /// Lines without a value: row of the block before which they stand, how many.
    pub(super) missing: Vec<(usize, usize)>,
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
        let before = self.skipped.partition_point(|(at, _)| *at <= row);
        self.first_line + row + self.skipped[..before].iter().map(|s| s.1).sum::<usize>()
    }

    /// The bytes of a part of the text.
    pub(super) fn read(&self, path: &Path, bytes: [u64; 2]) -> Result<Vec<u8>, CampaignError> {
        let io = |e: std::io::Error| CampaignError::io(path, "read", EXPECTED, &e);
        if let Some(text) = &self.text {
            let end = text
                .len()
                .min(usize::try_from(bytes[1]).unwrap_or(usize::MAX));
            let start = end.min(usize::try_from(bytes[0]).unwrap_or(usize::MAX));
            return Ok(text[start..end].to_vec());
        }
        let mut file = File::open(path).map_err(io)?;
        file.seek(SeekFrom::Start(bytes[0])).map_err(io)?;
        let mut text = Vec::new();
        file.take(bytes[1] - bytes[0])
            .read_to_end(&mut text)
            .map_err(io)?;
        Ok(text)
    }

    /// The columns of one row, if it can be read.
    pub(super) fn one(&self, line: &[u8]) -> Option<Vec<f64>> {
        let parsed = Plan::of(self).block(u64::MAX - line.len() as u64, line);
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
        let [from, to] = self.bytes;
        let text = match &self.text {
            Some(text) => Text::of_memory(text.clone(), from, to),
            None => Text::between(File::open(path).map_err(io)?, from, to).map_err(io)?,
        };
        let plan = Plan::of(self);
        let (mut lines, mut rows) = (0, 0);
        let mut blank: Option<usize> = None;
        let parse = |at: u64, bytes: &[u8]| {
            let parsed = plan.block(at, bytes);
            let rest = Rest {
                rows: parsed.batch.rows,
                lines: parsed.lines,
                blank: parsed.blank,
                failed: parsed.failed,
                missing: parsed.missing,
                bytes: [at, at + bytes.len() as u64],
            };
            (rest, prepare(parsed.batch))
        };
        let walked = text.walk(parse, |(rest, prepared): (Rest, T)| {
            let refuse = |line: usize, column: usize, problem: Problem| {
                Err(CampaignError::new(
                    Place::at(path, self.first_line + line, column),
                    problem,
                ))
            };
            if let (Some(blank), true) = (blank, rest.rows > 0 || rest.failed.is_some()) {
                return refuse(blank, 1, Problem::EmptyLine); // blank lines and comments may end a file, not divide it
            }
            if let Some((line, column, problem)) = rest.failed {
                return refuse(lines + line, column, problem);
            }
            blank = blank.or(rest.blank.map(|line| lines + line));
            let block = Block {
                first: rows,
                rows: rest.rows,
                bytes: rest.bytes,
                line: lines,
                missing: rest.missing,
            };
            lines += rest.lines;
            rows += rest.rows;
            if rest.rows == 0 && block.missing.is_empty() {
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
                    example: None,
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
    left_out: &'a [[u64; 2]],
    /// Field of the row, column of the batch, meaning, factor.
    fields: Vec<(usize, usize, Quantity, f64)>,
}

/// What is known of a block beside its numbers.
struct Rest {
    rows: usize,
    lines: usize,
    blank: Option<usize>,
    failed: Option<(usize, usize, Problem)>,
    missing: Vec<(usize, usize)>,
    bytes: [u64; 2],
}

struct Parsed {
    batch: Batch,
    lines: usize,
    /// Lines without a value: row before which they stand, how many.
    missing: Vec<(usize, usize)>,
    /// First empty line of those at the end.
    blank: Option<usize>,
    failed: Option<(usize, usize, Problem)>,
}

impl<'a> Plan<'a> {
    fn of(slice: &'a Slice) -> Self {
        let (layout, left_out) = (&slice.layout, &slice.left_out[..]);
        let columns = layout.fields.iter().enumerate();
        let mut fields: Vec<_> = columns
            .map(|(k, &(at, quantity, factor))| (at, k, quantity, factor))
            .collect();
        fields.sort_by_key(|f| f.0);
        Self {
            layout,
            left_out,
            fields,
        }
    }

    /// Parses the block that begins at byte `from`.
    fn block(&self, from: u64, bytes: &[u8]) -> Parsed {
        let guess = bytes.len() / (8 * self.fields.len()) + 1;
        let mut columns: Vec<Vec<f64>> = self
            .fields
            .iter()
            .map(|_| Vec::with_capacity(guess))
            .collect();
        let mut values = vec![0.0; columns.len()];
        let (mut at, mut rows, mut lines, mut blank, mut failed) = (0, 0, 0, None, None);
        let mut dates = Dates::default();
        let mut missing: Vec<(usize, usize)> = Vec::new();
        let first_hole = self.left_out.partition_point(|hole| hole[1] <= from);
        let mut holes = self.left_out[first_hole..].iter();
        let mut hole = holes.next();
        while at < bytes.len() {
            // Rows that were left out are lines still.
            if let Some(next) = hole.filter(|hole| hole[0] <= from + at as u64) {
                let end = bytes.len().min((next[1].saturating_sub(from)) as usize);
                let skipped = &bytes[at..end.max(at)];
                lines += memchr::memchr_iter(b'\n', skipped).count();
                at = end.max(at);
                hole = if end < bytes.len() {
                    holes.next()
                } else {
                    hole
                };
                continue;
            }
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
                    let words = line.trim_ascii_start();
                    if words.is_empty() || words.starts_with(b"#") || words.starts_with(b"%") {
                        blank = blank.or(Some(lines));
                        (at, lines) = (end, lines + 1);
                        continue;
                    }
                    match slow(self.layout, line, &mut values) {
                        Ok(true) => {}
                        Ok(false) => {
                            match missing.last_mut() {
                                Some((row, count)) if *row == rows => *count += 1,
                                _ => missing.push((rows, 1)),
                            }
                            (at, lines) = (end, lines + 1);
                            continue;
                        }
                        Err((column, problem)) => {
                            failed = Some((lines, column, problem));
                            break;
                        }
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
            missing,
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

/// Days since 1970 of the proleptic Gregorian calendar, years starting in March.
fn days(date: &str, order: DateOrder) -> Option<i64> {
    let mut date = date.split(['.', '/', '-']).map(|p| p.parse::<i64>().ok());
    let (a, b, c) = (date.next()??, date.next()??, date.next()??);
    let (day, month, year) = match order {
        DateOrder::DayMonthYear => (a, b, c),
        DateOrder::MonthDayYear => (b, a, c),
        DateOrder::YearMonthDay => (c, b, a),
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
            decimal_comma,
            ..Layout::new(super::super::Format::Columns, separator, 0, fields.to_vec())
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
            let mut fields: Vec<_> = layout
                .fields
                .iter()
                .enumerate()
                .map(|(k, f)| (f.0, k, f.1, f.2))
                .collect();
            fields.sort_by_key(|f| f.0);
            let plan = Plan {
                layout: &layout,
                left_out: &[],
                fields,
            };
            let [mut fast, mut slow_values] = [
                vec![0.0; layout.fields.len()],
                vec![0.0; layout.fields.len()],
            ];
            assert_eq!(
                plan.fast(row.as_bytes(), 0, &mut Dates::default(), &mut fast),
                Some(row.len()),
                "{row}"
            );
            assert_eq!(slow(&layout, row.as_bytes(), &mut slow_values), Ok(true));
            assert_eq!(fast, slow_values, "{row}");
            assert!(fast.iter().all(|v| *v != 0.0), "{row}: {fast:?}");
        }
    }

    #[test]
    fn days_are_those_of_the_calendar() {
        assert_eq!(days("01.01.1970", DateOrder::DayMonthYear), Some(0));
        assert_eq!(days("11/08/22", DateOrder::MonthDayYear), Some(19_304));
        assert_eq!(days("13/08/22", DateOrder::MonthDayYear), None);
        assert_eq!(days("1970-01-02", DateOrder::YearMonthDay), Some(1));
        let iso = |text| lenient::seconds(text, DateOrder::YearMonthDay);
        assert_eq!(iso("1970-01-02T01:02:03.5Z"), Some(90_123.5));
        assert_eq!(iso("1970-01-02 01:02:03,5+02:00"), Some(90_123.5));
        assert_eq!(iso("01:02:03"), Some(3723.0));
    }
}
