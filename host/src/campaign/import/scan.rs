//! One look at all rows of a foreign file: which of them are the circle, turn by turn, and where in the file those stand.
//!
//! Memory is 8 bytes a row for positions and angles and 16 for deviations over time, and nothing of it outlives the scan:
//! what is kept of the rest is every n-th row (65 536 at most) and the moments of blocks.
use super::add::Options;
use super::clocked;
use super::detect::Format;
use super::layout::{Layout, Quantity};
use super::motion::Track;
use super::place::{Mark, Places};
use super::recognise::{Reading, rows_of};
use super::ring::{self, Ring};
use super::rows::Slice;
use super::sample;
use super::turns::{Turn, Turns, Why};
use crate::campaign::samples::FEWEST;
use crate::campaign::table::Batch;
use crate::campaign::thinned::Thinned;
use crate::campaign::{CampaignError, Place, Problem};
use giotto_shared::circle::{Plane, Scatter};
use std::f64::consts::TAU;
use std::ops::{ControlFlow, Range};
use std::path::Path;

/// What a scan finds.
pub(super) struct Scan {
    pub(super) format: Format,
    /// Rows of the file.
    pub(super) rows: usize,
    pub(super) turns: Vec<FoundTurn>,
    /// What is to be said of the file.
    pub(super) notes: Vec<String>,
    /// Line of the first row.
    pub(super) first_line: usize,
}

/// A turn and where it stands.
pub(super) struct FoundTurn {
    pub(super) slice: Slice,
    /// +1 counter-clockwise, −1 clockwise, 0 where it cannot be seen.
    pub(super) sign: f64,
    /// Number of the passage in one direction, and of the turn in it, with how many there are of each.
    pub(super) pass: (usize, usize),
    pub(super) lap: (usize, usize),
    pub(super) arc_rad: Option<f64>,
    /// Angle of its first row since the first row of the test, rad.
    pub(super) from_rad: f64,
    /// Rows before it and behind it.
    pub(super) outside: (usize, usize),
    /// Why rows are left out, with how many and the lines where they stand together.
    pub(super) left_out: Vec<(Why, usize, Option<[usize; 2]>)>,
    /// Radius of the circle that the controller wanted, m.
    pub(super) target_radius_m: Option<f64>,
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
    /// Rows on the circle.
    on: Vec<Range<usize>>,
    times: Thinned<f64>,
    targets: Thinned<[f64; 3]>,
    /// Lines without a value: row before which they stand, how many.
    missing: Vec<(usize, usize)>,
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
            (found.iter().flatten().count() >= 2).then_some(found)
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

    fn by_time(&self) -> bool {
        self.position.is_none() && self.angle.is_none()
    }
}

/// Looks through a file. `progress` is told the bytes read so far.
pub(super) fn scan(
    path: &Path,
    options: &Options,
    progress: &dyn Fn(u64),
) -> Result<Scan, CampaignError> {
    let sign = options.direction.map_or(1.0, |d| f64::from(d.sign()));
    let reading = Reading {
        format: options.format,
        columns: options.columns.as_deref(),
        even: options
            .even_angles
            .then_some((options.start_angle_rad.unwrap_or(0.0), sign)),
    };
    let mut all = rows_of(path, reading)?;
    let first_line = all.first_line;
    let refuse = |problem| CampaignError::new(Place::at(path, first_line, 1), problem);
    let columns = Columns::of(&all, options.radius_m);
    let ring = match columns.position {
        None => None,
        Some(position) => circle(path, &mut all, position, options.radius_m, &refuse)?,
    };
    let mut seen = look(path, &all, &columns, ring.as_ref(), progress)?;
    if seen.rows < FEWEST {
        return Err(refuse(Problem::TooFew {
            found: seen.rows,
            expected: FEWEST,
        }));
    }
    all.skipped = std::mem::take(&mut seen.missing).into();
    let mut notes = all.layout.notes.clone();
    let (turns, clocked) = if columns.by_time() {
        time_unit(
            &mut all.layout,
            seen.time.as_mut_slice(),
            options,
            &mut notes,
        );
        let entry = options.entry(path, all.clone());
        let found = clocked::turns(&seen.time, &seen.deviation, &entry).map_err(refuse)?;
        notes.extend(found.notes);
        seen.on = vec![found.inside];
        (found.turns, true)
    } else {
        (
            by_angle(&mut seen, &mut all, &columns, options, &mut notes).map_err(refuse)?,
            false,
        )
    };
    // Readings without angles look the same both ways.
    let told = options.direction.is_some() || !(clocked || options.even_angles);
    let mut found = Vec::new();
    let mut places = Places::new(path, &all, &seen.marks);
    for (p, pass) in turns.passes.iter().enumerate() {
        for (k, turn) in pass.turns.iter().enumerate() {
            let slice = if clocked && !turn.left_out.is_empty() {
                closed_up(&all, &seen, turn)
            } else {
                places.slice(turn, columns.position)?
            };
            found.push(FoundTurn {
                slice,
                sign: if told { pass.sign } else { 0.0 },
                pass: (p + 1, turns.passes.len()),
                lap: (k + 1, pass.turns.len()),
                arc_rad: pass.arc_rad,
                from_rad: turn.from_rad,
                outside: (turn.rows.start, seen.rows - turn.rows.end),
                left_out: reasons(&turns, [p, k], &seen, &all),
                target_radius_m: target_radius(&seen.targets, &turn.rows, columns.target),
            });
        }
    }
    Ok(Scan {
        format: all.layout.format,
        rows: seen.rows,
        turns: found,
        notes,
        first_line,
    })
}

/// The circle of positions, in the unit in which it has the programmed radius where the file gives none.
fn circle(
    path: &Path,
    all: &mut Slice,
    position: [Option<usize>; 3],
    radius_m: f64,
    refuse: &dyn Fn(Problem) -> CampaignError,
) -> Result<Option<Ring>, CampaignError> {
    const UNITS: [(f64, &str); 4] = [(1.0, "mm"), (1e3, "m"), (25.4, "inches"), (1e-3, "µm")];
    let points = sample::points(path, all, position)?;
    let rows = points.iter().map(Vec::len).max().unwrap_or(0);
    if rows < FEWEST {
        return Ok(None); // too few rows, as the look at all of them will say
    }
    let units = if all.layout.open.length {
        &UNITS[..]
    } else {
        &UNITS[..1]
    };
    for (unit, name) in units {
        let points = points
            .clone()
            .map(|axis| axis.iter().map(|v| v * unit).collect());
        let Some(ring) = ring::ring(&points, radius_m) else {
            continue;
        };
        let fits = (ring.radius_m() / radius_m - 1.0).abs() < 0.25;
        if units.len() == 1 || (fits && *unit == 1.0) {
            return Ok(Some(ring));
        }
        if fits {
            let is = |q| matches!(q, Quantity::Position(_) | Quantity::Target(_));
            let fields = all.layout.fields.iter_mut();
            fields.filter(|f| is(f.1)).for_each(|f| f.2 *= unit);
            let words = "no unit in the header: positions taken as";
            all.layout.notes.push(format!(
                "{words} {name}, with which the circle has the programmed radius"
            ));
            return Ok(Some(ring));
        }
    }
    // As millimetres, so that the refusal tells how far off it is.
    let ring = ring::ring(&points, radius_m);
    let radius_mm = (radius_m * 1e9).round() / 1e6;
    ring.map(Some).ok_or_else(|| {
        refuse(Problem::OffCircle {
            found: 0,
            rows,
            radius_mm,
        })
    })
}

/// The unit of time that makes the turn last about as long as programmed, where the file gives none.
fn time_unit(layout: &mut Layout, time: &mut [f64], options: &Options, notes: &mut Vec<String>) {
    let (Some(first), Some(last)) = (time.first(), time.last()) else {
        return;
    };
    let turn_s = TAU * options.radius_m / options.feed_m_s;
    if let Some(factor) = unit_of_time(layout, (last - first) / turn_s, notes) {
        time.iter_mut().for_each(|t| *t *= factor);
    }
}

/// The factor that brings `ratio`, measured over programmed duration, to about one; changes the layout.
fn unit_of_time(layout: &mut Layout, ratio: f64, notes: &mut Vec<String>) -> Option<f64> {
    const UNITS: [(f64, &str); 4] = [(1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"), (60.0, "minutes")];
    if !layout.open.time || (1.0 / 30.0..=30.0).contains(&ratio) {
        return None;
    }
    let (factor, name) = UNITS
        .into_iter()
        .find(|(factor, _)| (0.2..20.0).contains(&(ratio * factor)))?;
    let fields = layout.fields.iter_mut();
    fields
        .filter(|f| f.1 == Quantity::Time)
        .for_each(|f| f.2 *= factor);
    notes.push(format!("no unit in the header: time taken as {name}"));
    Some(factor)
}

/// Turns of positions or measured angles.
fn by_angle(
    seen: &mut Seen,
    all: &mut Slice,
    columns: &Columns,
    options: &Options,
    notes: &mut Vec<String>,
) -> Result<Turns, Problem> {
    if columns.position.is_some() {
        let on: usize = seen.on.iter().map(Range::len).sum();
        if on * 4 < seen.rows || on < FEWEST {
            let radius_mm = (options.radius_m * 1e9).round() / 1e6;
            return Err(Problem::OffCircle {
                found: on,
                rows: seen.rows,
                radius_mm,
            });
        }
    } else {
        seen.on = std::iter::once(0..seen.rows).collect();
        let (low, high) = seen
            .angle
            .iter()
            .fold((f64::MAX, f64::MIN), |(l, h), a| (l.min(*a), h.max(*a)));
        if all.layout.open.angle && (380.0..420.0).contains(&(high - low).to_degrees()) {
            seen.angle.iter_mut().for_each(|a| *a *= 0.9);
            let fields = all.layout.fields.iter_mut();
            fields
                .filter(|f| f.1 == Quantity::Angle)
                .for_each(|f| f.2 *= 0.9);
            notes.push("\"grad\" taken as a 400th of a turn: the angles end there".to_owned());
        }
    }
    let track = Track {
        angle: &mut seen.angle,
        on: &seen.on,
        time: &seen.times,
    };
    let turns = track.turns()?;
    if let Some(turn) = turns.passes.first().and_then(|p| p.turns.first()) {
        let t = |row: usize| seen.times.at(row).map(|(_, t)| t);
        if let (Some(from), Some(to)) = (t(turn.rows.start), t(turn.rows.end - 1)) {
            let turn_s = TAU * options.radius_m / options.feed_m_s;
            unit_of_time(&mut all.layout, (to - from) / turn_s, notes);
        }
    }
    Ok(turns)
}

impl Seen {
    /// Reserves once, so that growing never doubles the memory: the rows of `size` bytes are about as long as the first ones.
    fn reserve(&mut self, size: u64, first_bytes: u64, first_rows: usize, by_time: bool) {
        let rows = size / (first_bytes / first_rows.max(1) as u64).max(1);
        let rows = usize::try_from(rows + rows / 64).unwrap_or(0);
        if by_time {
            self.time.reserve_exact(rows);
            self.deviation.reserve_exact(rows);
        } else {
            self.angle.reserve_exact(rows);
        }
    }
}

fn look(
    path: &Path,
    all: &Slice,
    columns: &Columns,
    ring: Option<&Ring>,
    progress: &dyn Fn(u64),
) -> Result<Seen, CampaignError> {
    let by_time = columns.by_time();
    let prepare = |batch: Batch| {
        let mut scatter = Scatter::default();
        let mut on = Vec::new();
        let mut angle = Vec::new();
        if let (Some(position), Some(ring)) = (columns.position, ring) {
            let column = |axis: usize| position[axis].map(|f| batch.columns[f].as_slice());
            let value = |axis: usize, k: usize| column(axis).map_or(0.0, |c| c[k]);
            if let [Some(x), Some(y), Some(z)] = [0, 1, 2].map(column) {
                scatter = Scatter::of_block(x, y, z);
            }
            angle.reserve_exact(batch.rows);
            on.reserve_exact(batch.rows);
            for k in 0..batch.rows {
                let (a, inside) = ring.at([value(0, k), value(1, k), value(2, k)]);
                angle.push(a);
                on.push(inside);
            }
        } else if let Some(field) = columns.angle {
            angle.clone_from(&batch.columns[field]);
        }
        (batch, scatter, angle, on)
    };
    let mut seen = Seen::default();
    all.walk(path, prepare, |block, (batch, scatter, angle, on)| {
        if seen.angle.is_empty() && seen.deviation.is_empty() {
            let size = match &all.text {
                Some(text) => text.len() as u64,
                None => std::fs::metadata(path).map_or(0, |m| m.len()),
            };
            seen.reserve(size, block.bytes[1] - block.bytes[0], block.rows, by_time);
        }
        seen.marks.push(Mark {
            first: block.first,
            line: block.line,
            bytes: block.bytes,
            scatter,
        });
        let missing = block.missing.iter();
        seen.missing
            .extend(missing.map(|(row, lines)| (block.first + row, *lines)));
        on_circle(&mut seen.on, seen.rows, &on);
        seen.rows += block.rows;
        seen.angle.extend_from_slice(&angle);
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

/// Adds the rows of a block that lie on the circle to the stretches that do.
fn on_circle(stretches: &mut Vec<Range<usize>>, first: usize, on: &[bool]) {
    for (row, on) in (first..).zip(on) {
        if !on {
            continue;
        }
        match stretches.last_mut() {
            Some(last) if last.end == row => last.end += 1,
            _ => stretches.push(row..row + 1),
        }
    }
}

/// Why rows are left out of a turn: around it, within it, for want of a value.
fn reasons(
    turns: &Turns,
    at: [usize; 2],
    seen: &Seen,
    all: &Slice,
) -> Vec<(Why, usize, Option<[usize; 2]>)> {
    let turn = &turns.passes[at[0]].turns[at[1]];
    let mut counts: Vec<(Why, usize)> = Vec::new();
    let mut add = |why: Why, rows: usize| match counts.iter_mut().find(|c| c.0 == why) {
        Some(count) => count.1 += rows,
        None => counts.push((why, rows)),
    };
    let around = turns.outside(at, seen.rows, &seen.on);
    around
        .iter()
        .flatten()
        .for_each(|(why, rows)| add(*why, *rows));
    turn.left_out.iter().for_each(|l| add(l.why, l.rows.len()));
    let missing: usize = all.skipped.iter().map(|s| s.1).sum();
    if missing > 0 {
        add(Why::Missing, missing);
    }
    let lines = |why: Why| {
        let mut stretches = turn.left_out.iter().filter(|l| l.why == why);
        let one = stretches.next().filter(|_| stretches.next().is_none())?;
        Some([all.line(one.rows.start), all.line(one.rows.end - 1)])
    };
    let first_missing = all.skipped.first().map(|(row, lines)| {
        let line = all.line(*row) - lines;
        [line, line + lines - 1]
    });
    let place = |why: Why| match why {
        Why::Missing => first_missing.filter(|_| all.skipped.len() == 1),
        _ => lines(why),
    };
    let placed = |(why, rows): &(Why, usize)| {
        let inside: usize = turn
            .left_out
            .iter()
            .filter(|l| l.why == *why)
            .map(|l| l.rows.len())
            .sum();
        (
            *why,
            *rows,
            place(*why).filter(|_| *why == Why::Missing || inside == *rows),
        )
    };
    counts.iter().map(placed).collect()
}

/// A turn of deviations over time with its stops taken out, as a text of its own.
fn closed_up(all: &Slice, seen: &Seen, turn: &Turn) -> Slice {
    let mut text = String::new();
    let (mut shift, mut skipped, mut rows) = (0.0, Vec::new(), 0);
    let mut stops = turn.left_out.iter().peekable();
    let mut row = turn.rows.start;
    while row < turn.rows.end {
        if let Some(stop) = stops.next_if(|s| s.rows.start == row) {
            shift += seen.time[stop.rows.end] - seen.time[stop.rows.start];
            skipped.push((rows, stop.rows.len()));
            row = stop.rows.end;
            continue;
        }
        text += &format!("{:e};{:e}\n", seen.time[row] - shift, seen.deviation[row]);
        rows += 1;
        row += 1;
    }
    let fields = vec![(0, Quantity::Time, 1.0), (1, Quantity::Deviation, 1.0)];
    Slice {
        layout: Layout::new(all.layout.format, b';', all.layout.skip, fields),
        bytes: [0, u64::MAX],
        first_line: all.line(turn.rows.start),
        rows,
        scatter: None,
        text: Some(text.into_bytes().into()),
        left_out: Default::default(),
        skipped: skipped.into(),
    }
}

/// Radius of the circle through the controller's own positions of a turn; of every n-th where there are many.
fn target_radius(
    targets: &Thinned<[f64; 3]>,
    rows: &Range<usize>,
    columns: Option<[Option<usize>; 3]>,
) -> Option<f64> {
    let columns = columns?;
    let mut points: [Vec<f64>; 3] = Default::default();
    for (_, point) in targets.iter().filter(|(row, _)| rows.contains(row)) {
        points
            .iter_mut()
            .zip(point)
            .for_each(|(axis, v)| axis.push(v));
    }
    let (x, y) = if columns.iter().all(Option::is_some) {
        let [x, y, z] = &points;
        let plane = Plane::fit(x.iter().zip(y).zip(z).map(|((&x, &y), &z)| [x, y, z])).ok()?;
        x.iter()
            .zip(y)
            .zip(z)
            .map(|((&x, &y), &z)| plane.project([x, y, z]))
            .map(|[u, v]| (u, v))
            .unzip()
    } else {
        let mut axes = points.into_iter().zip(columns).filter(|(_, c)| c.is_some());
        (axes.next()?.0, axes.next()?.0)
    };
    crate::fit::fit_circle(&x, &y)
        .ok()
        .map(|fit| fit.circle.radius)
}
