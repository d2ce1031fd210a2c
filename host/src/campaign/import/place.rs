//! Where the rows of a turn stand in a file, byte by byte, and the moments of their points.
use super::rows::Slice;
use super::turns::Turn;
use crate::campaign::CampaignError;
use crate::campaign::table::Batch;
use giotto_shared::circle::{Merge, Scatter};
use std::path::Path;

/// A block of rows gone by.
pub(super) struct Mark {
    /// Rows and lines before it.
    pub(super) first: usize,
    pub(super) line: usize,
    pub(super) bytes: [u64; 2],
    pub(super) scatter: Scatter,
}

/// Finds bytes of rows; the block that was looked at last is remembered.
pub(super) struct Places<'a> {
    path: &'a Path,
    all: &'a Slice,
    marks: &'a [Mark],
    /// Block and the bytes at which its lines begin.
    last: Option<(usize, Vec<u64>)>,
}

impl<'a> Places<'a> {
    pub(super) fn new(path: &'a Path, all: &'a Slice, marks: &'a [Mark]) -> Self {
        Self {
            path,
            all,
            marks,
            last: None,
        }
    }

    /// The rows of a turn.
    pub(super) fn slice(
        &mut self,
        turn: &Turn,
        position: Option<[Option<usize>; 3]>,
    ) -> Result<Slice, CampaignError> {
        let bytes = [self.byte(turn.rows.start)?, self.byte(turn.rows.end)?];
        let mut left_out = Vec::with_capacity(turn.left_out.len());
        for l in &turn.left_out {
            left_out.push([self.byte(l.rows.start)?, self.byte(l.rows.end)?]);
        }
        let mut slice = Slice {
            bytes,
            first_line: self.all.line(turn.rows.start),
            rows: turn.rows.len() - turn.left_out.iter().map(|l| l.rows.len()).sum::<usize>(),
            left_out: left_out.into(),
            skipped: self.skipped(turn).into(),
            ..self.all.clone()
        };
        if let Some([Some(x), Some(y), Some(z)]) = position {
            slice.scatter = Some(self.scatter(&slice, [x, y, z])?);
        }
        Ok(slice)
    }

    /// Lines of the turn that hold none of its rows: before which of its rows, and how many.
    fn skipped(&self, turn: &Turn) -> Vec<(usize, usize)> {
        let mut found: Vec<(usize, usize)> = Vec::new();
        let missing = self.all.skipped.iter();
        let missing = missing.filter(|(row, _)| *row > turn.rows.start && *row < turn.rows.end);
        let mut events: Vec<(usize, usize, bool)> =
            missing.map(|(row, n)| (*row, *n, false)).collect();
        events.extend(
            turn.left_out
                .iter()
                .map(|l| (l.rows.start, l.rows.len(), true)),
        );
        events.sort_unstable();
        let mut out = 0;
        for (row, lines, is_out) in events {
            found.push((row.saturating_sub(turn.rows.start + out), lines));
            out += if is_out { lines } else { 0 };
        }
        found
    }

    fn scatter(&self, slice: &Slice, [x, y, z]: [usize; 3]) -> Result<Scatter, CampaignError> {
        let mut sum = Scatter::default();
        let add = |from: u64, to: u64, sum: &mut Scatter| -> Result<(), CampaignError> {
            if from >= to {
                return Ok(());
            }
            let part = |b: Batch| Scatter::of_block(&b.columns[x], &b.columns[y], &b.columns[z]);
            let piece = Slice {
                bytes: [from, to],
                ..slice.clone()
            };
            piece.walk_all(self.path, part, |part| {
                sum.merge(&part);
                Ok(())
            })
        };
        let [from, to] = slice.bytes;
        // Whole blocks are known; the rows before and after them are read again.
        let inside: Vec<&Mark> = self
            .marks
            .iter()
            .filter(|m| m.bytes[0] >= from && m.bytes[1] <= to)
            .collect();
        match (inside.first(), inside.last()) {
            (Some(first), Some(last)) if slice.left_out.is_empty() => {
                add(from, first.bytes[0], &mut sum)?;
                inside.iter().for_each(|m| sum.merge(&m.scatter));
                add(last.bytes[1], to, &mut sum)?;
            }
            _ => add(from, to, &mut sum)?,
        }
        Ok(sum)
    }

    /// The byte at which a row begins; one after the last row for the number of rows.
    fn byte(&mut self, row: usize) -> Result<u64, CampaignError> {
        let at = self
            .marks
            .partition_point(|m| m.first <= row)
            .saturating_sub(1);
        let Some(mark) = self.marks.get(at) else {
            return Ok(0);
        };
        let ahead = self.all.line(row) - self.all.first_line - mark.line;
        if ahead == 0 {
            return Ok(mark.bytes[0]);
        }
        if self.last.as_ref().is_none_or(|(block, _)| *block != at) {
            let text = self.all.read(self.path, mark.bytes)?;
            let ends = memchr::memchr_iter(b'\n', &text).map(|p| mark.bytes[0] + p as u64 + 1);
            self.last = Some((at, ends.collect()));
        }
        let ends = self.last.as_ref().map_or(&[][..], |(_, ends)| ends);
        // The last row of a file may have no end of line.
        Ok(ends.get(ahead - 1).copied().unwrap_or(mark.bytes[1]))
    }
}
