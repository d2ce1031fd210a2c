//! One look at all rows of a foreign file: which of them are the circle, lap by lap, and where in the file those stand.
//!
//! Memory is 8 bytes a row for positions and angles and 16 for deviations over time, and nothing of it outlives the scan:
//! what is kept of the rest is every n-th row (65 536 at most) and the moments of blocks.
use super::add::Options;
use super::detect::Format;
use super::layout::Quantity;
use super::recognise::rows_of;
use super::rows::Slice;
use super::sample;
use super::trim::{self, Ring, Turns};
use crate::campaign::samples::FEWEST;
use crate::campaign::table::Batch;
use crate::campaign::thinned::Thinned;
use crate::campaign::{CampaignError, Place, Problem};
use giotto_shared::circle::{Merge, Plane, Scatter};
use std::io::{Read, Seek, SeekFrom};
use std::ops::{ControlFlow, Range};
use std::path::Path;

/// What a scan finds.
pub(super) struct Scan {
    pub(super) format: Format,
    /// Rows of the file.
    pub(super) rows: usize,
    pub(super) turns: Turns,
    /// Where the laps stand.
    pub(super) slices: Vec<Slice>,
    /// Rows of each lap, by number in the file.
    pub(super) laps: Vec<Range<usize>>,
    /// Radius of the circle that the controller wanted, of each lap, m.
    pub(super) target_radius_m: Vec<Option<f64>>,
}

/// A block of rows gone by.
struct Mark {
    first: usize,
    bytes: [u64; 2],
    scatter: Scatter,
}

/// What is collected of the rows.
#[derive(Default)]
struct Seen {
    marks: Vec<Mark>,
    rows: usize,
    /// Angle about the circle or as measured; nothing for deviations over time.
    angle: Vec<f64>,
    /// All of it for deviations over time only.
    time: Vec<f64>,
    deviation: Vec<f64>,
    stretch: trim::Longest,
    times: Thinned<f64>,
    targets: Thinned<[f64; 3]>,
}

struct Columns {
    time: Option<usize>,
    angle: Option<usize>,
    radial: Option<(usize, f64)>,
    position: Option<[Option<usize>; 3]>,
    target: Option<[Option<usize>; 3]>,
}

impl Columns {
    fn of(slice: &Slice, radius_m: f64) -> Self {
        let quantities = slice.quantities();
        let find = |wanted: &dyn Fn(Quantity) -> bool| quantities.iter().position(|q| wanted(*q));
        let three = |make: fn(usize) -> Quantity| {
            let found = [0, 1, 2].map(|axis| find(&|q| q == make(axis)));
            (found[0].is_some() && found[1].is_some()).then_some(found)
        };
        let deviation = find(&|q| q == Quantity::Deviation).map(|f| (f, 0.0));
        Self {
            time: find(&|q| matches!(q, Quantity::Time | Quantity::Stamp(_))),
            angle: find(&|q| q == Quantity::Angle),
            radial: deviation.or_else(|| find(&|q| q == Quantity::Radius).map(|f| (f, radius_m))),
            position: three(Quantity::Position),
            target: three(Quantity::Target),
        }
    }
}

/// Looks through a file. `progress` is told the bytes read so far.
pub(super) fn scan(
    path: &Path,
    options: &Options,
    progress: &dyn Fn(u64),
) -> Result<Scan, CampaignError> {
    let all = rows_of(path, options.format, options.columns.as_deref())?;
    let refuse = |problem| CampaignError::new(Place::at(path, all.first_line, 1), problem);
    let columns = Columns::of(&all, options.radius_m);
    let ring = match columns.position {
        None => None,
        Some(position) => {
            let points = sample::points(path, &all, position)?;
            if points[0].len() < FEWEST {
                None // too few rows, as the look at all of them will say
            } else {
                let found = trim::ring(&points, options.radius_m);
                let rows = points[0].len();
                let radius_mm = (options.radius_m * 1e9).round() / 1e6;
                Some(found.ok_or_else(|| {
                    refuse(Problem::OffCircle {
                        found: 0,
                        rows,
                        radius_mm,
                    })
                })?)
            }
        }
    };
    let mut seen = look(path, &all, &columns, ring.as_ref(), progress)?;
    if seen.rows < FEWEST {
        return Err(refuse(Problem::TooFew {
            found: seen.rows,
            expected: FEWEST,
        }));
    }
    let turns = turns(&mut seen, path, &all, &columns, options).map_err(refuse)?;
    let (mut slices, mut targets) = (Vec::new(), Vec::new());
    for lap in &turns.laps {
        slices.push(slice(path, &all, &columns, &seen.marks, lap)?);
        targets.push(target_radius(&seen.targets, lap, columns.target));
    }
    let laps = turns.laps.clone();
    Ok(Scan {
        format: all.layout.format,
        rows: seen.rows,
        turns,
        slices,
        laps,
        target_radius_m: targets,
    })
}

fn look(
    path: &Path,
    all: &Slice,
    columns: &Columns,
    ring: Option<&Ring>,
    progress: &dyn Fn(u64),
) -> Result<Seen, CampaignError> {
    let by_time = columns.position.is_none() && columns.angle.is_none();
    let prepare = |batch: Batch| {
        let mut scatter = Scatter::default();
        let mut on = Vec::new();
        let mut angle = Vec::new();
        if let (Some(position), Some(ring)) = (columns.position, ring) {
            let column = |axis: usize| position[axis].map(|f| batch.columns[f].as_slice());
            if let (Some(x), Some(y)) = (column(0), column(1)) {
                let z = column(2);
                scatter = z.map_or_else(Scatter::default, |z| Scatter::of_block(x, y, z));
                angle.reserve_exact(batch.rows);
                on.reserve_exact(batch.rows);
                for k in 0..batch.rows {
                    let (a, inside) = ring.at([x[k], y[k], z.map_or(0.0, |z| z[k])]);
                    angle.push(a);
                    on.push(inside);
                }
            }
        } else if let Some(field) = columns.angle {
            angle.clone_from(&batch.columns[field]);
        }
        (batch, scatter, angle, on)
    };
    let mut seen = Seen::default();
    all.walk(path, prepare, |block, (batch, scatter, angle, on)| {
        if seen.angle.is_empty() && seen.deviation.is_empty() {
            // Rows are about as long as the first ones: reserve once, so that growing never doubles the memory.
            let size = std::fs::metadata(path).map_or(0, |m| m.len());
            let rows = size / ((block.bytes[1] - block.bytes[0]) / block.rows.max(1) as u64).max(1);
            let rows = usize::try_from(rows + rows / 64).unwrap_or(0);
            if by_time {
                seen.time.reserve_exact(rows);
                seen.deviation.reserve_exact(rows);
            } else {
                seen.angle.reserve_exact(rows);
            }
        }
        seen.marks.push(Mark {
            first: block.first,
            bytes: block.bytes,
            scatter,
        });
        seen.rows += block.rows;
        seen.angle.extend_from_slice(&angle);
        on.iter().for_each(|on| seen.stretch.push(*on));
        if by_time {
            let time = columns.time.map_or(&[][..], |f| &batch.columns[f]);
            let (radial, nominal) = columns
                .radial
                .map_or((&[][..], 0.0), |(f, r)| (&batch.columns[f], r));
            seen.time.extend_from_slice(time);
            seen.deviation.extend(radial.iter().map(|v| v - nominal));
        } else if let Some(field) = columns.time {
            batch.columns[field]
                .iter()
                .for_each(|t| seen.times.push(*t));
        }
        if let Some(target) = columns.target {
            for k in 0..batch.rows {
                seen.targets
                    .push(target.map(|f| f.map_or(0.0, |f| batch.columns[f][k])));
            }
        }
        progress(block.bytes[1]);
        Ok(ControlFlow::Continue(()))
    })?;
    Ok(seen)
}

fn turns(
    seen: &mut Seen,
    path: &Path,
    all: &Slice,
    columns: &Columns,
    options: &Options,
) -> Result<Turns, Problem> {
    if columns.position.is_some() {
        let (rows, stretch) = (seen.rows, seen.stretch.best());
        if stretch.len() * 4 < rows || stretch.len() < FEWEST {
            let radius_mm = (options.radius_m * 1e9).round() / 1e6;
            return Err(Problem::OffCircle {
                found: stretch.len(),
                rows,
                radius_mm,
            });
        }
        let mut angle = std::mem::take(&mut seen.angle);
        let angle = &mut angle[stretch.clone()];
        trim::unwrap(angle);
        let mut turns = trim::of_angles(angle, stretch.start, &seen.times)?;
        turns
            .laps
            .iter_mut()
            .for_each(|l| *l = l.start + stretch.start..l.end + stretch.start);
        turns.feed_in += stretch.start;
        turns.feed_out += rows - stretch.end;
        return Ok(turns);
    }
    if columns.angle.is_some() {
        let mut angle = std::mem::take(&mut seen.angle);
        trim::unwrap(&mut angle);
        return trim::of_angles(&angle, 0, &seen.times);
    }
    let (time, deviation) = (
        std::mem::take(&mut seen.time),
        std::mem::take(&mut seen.deviation),
    );
    trim::of_times(&time, &deviation, &options.entry(path, all.clone()))
}

/// Where the rows of a lap stand, and the moments of their points.
fn slice(
    path: &Path,
    all: &Slice,
    columns: &Columns,
    marks: &[Mark],
    lap: &Range<usize>,
) -> Result<Slice, CampaignError> {
    let byte = |row: usize| byte_of(path, marks, row);
    let bytes = [byte(lap.start)?, byte(lap.end)?];
    let first_line = all.line(lap.start);
    let of = |bytes: [u64; 2]| Slice {
        layout: all.layout.clone(),
        bytes,
        first_line,
        rows: lap.len(),
        scatter: None,
    };
    let mut slice = of(bytes);
    if let Some([Some(x), Some(y), Some(z)]) = columns.position {
        let mut sum = Scatter::default();
        let add = |from: u64, to: u64, sum: &mut Scatter| -> Result<(), CampaignError> {
            if from >= to {
                return Ok(());
            }
            let part = |b: Batch| Scatter::of_block(&b.columns[x], &b.columns[y], &b.columns[z]);
            of([from, to]).walk_all(path, part, |part| {
                sum.merge(&part);
                Ok(())
            })
        };
        // Whole blocks are known; the rows before and after them are read again.
        let inside: Vec<&Mark> = marks
            .iter()
            .filter(|m| m.bytes[0] >= bytes[0] && m.bytes[1] <= bytes[1])
            .collect();
        if let (Some(first), Some(last)) = (inside.first(), inside.last()) {
            add(bytes[0], first.bytes[0], &mut sum)?;
            inside.iter().for_each(|m| sum.merge(&m.scatter));
            add(last.bytes[1], bytes[1], &mut sum)?;
        } else {
            add(bytes[0], bytes[1], &mut sum)?;
        }
        slice.scatter = Some(sum);
    }
    Ok(slice)
}

/// The byte at which a row begins; one after the last row for the number of rows.
fn byte_of(path: &Path, marks: &[Mark], row: usize) -> Result<u64, CampaignError> {
    let io = |e: std::io::Error| CampaignError::io(path, "read", super::rows::EXPECTED, &e);
    let at = marks.partition_point(|m| m.first <= row).saturating_sub(1);
    let Some(mark) = marks.get(at) else {
        return Ok(0);
    };
    let ahead = row - mark.first;
    if ahead == 0 {
        return Ok(mark.bytes[0]);
    }
    let mut file = std::fs::File::open(path).map_err(io)?;
    file.seek(SeekFrom::Start(mark.bytes[0])).map_err(io)?;
    let mut text = Vec::new();
    file.take(mark.bytes[1] - mark.bytes[0])
        .read_to_end(&mut text)
        .map_err(io)?;
    // The last row of a file may have no end of line.
    let end = memchr::memchr_iter(b'\n', &text)
        .nth(ahead - 1)
        .map_or(text.len(), |p| p + 1);
    Ok(mark.bytes[0] + end as u64)
}

/// Radius of the circle through the controller's own positions of a lap; of every n-th where there are many.
fn target_radius(
    targets: &Thinned<[f64; 3]>,
    lap: &Range<usize>,
    columns: Option<[Option<usize>; 3]>,
) -> Option<f64> {
    let spatial = columns?[2].is_some();
    let mut points: [Vec<f64>; 3] = Default::default();
    for (_, point) in targets.iter().filter(|(row, _)| lap.contains(row)) {
        let axes = if spatial { 3 } else { 2 };
        points
            .iter_mut()
            .zip(point)
            .take(axes)
            .for_each(|(axis, v)| axis.push(v));
    }
    let (x, y) = if spatial {
        let [x, y, z] = &points;
        let plane = Plane::fit(x.iter().zip(y).zip(z).map(|((&x, &y), &z)| [x, y, z])).ok()?;
        x.iter()
            .zip(y)
            .zip(z)
            .map(|((&x, &y), &z)| plane.project([x, y, z]))
            .map(|[u, v]| (u, v))
            .unzip()
    } else {
        let [x, y, _] = points;
        (x, y)
    };
    crate::fit::fit_circle(&x, &y)
        .ok()
        .map(|fit| fit.circle.radius)
}
