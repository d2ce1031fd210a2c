//! From the columns of a file to one turn of polar samples.
use super::clock::{Clock, Stamps};
use super::error::{CampaignError, Place, Problem};
use super::import::Quantity;
use super::manifest::Entry;
use super::plane_view::{PlaneView, Tilt};
use super::run_file::{Field, RunFile};
use super::table::Batch;
use super::thinned::Thinned;
use super::{Direction, Frame, Note, Plane as NamedPlane, Run, Samples, check, left_out, steady};
use crate::fit::fit_circle;
use giotto_shared::circle::{Circle, CircleError, Merge, Scatter};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Fewest samples of a run.
pub(super) const FEWEST: usize = 8;

/// Stamps that are looked at together: what is made of them stays in the cache.
const STAMPS: usize = 1 << 13;

/// A run with what its file says beyond polar samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The run. Without `keep_time` its `time_s` is `None` whatever the file holds.
    pub run: Run,
    /// Where the circle lies in the coordinates of the file, for x, y (and z) files.
    pub location: Option<Location>,
    /// Duration of the turn, s, where the file has time stamps.
    pub turn_s: Option<f64>,
    /// What the reader should know.
    pub notes: Vec<Note>,
    /// Number of samples; stays when the samples themselves are dropped.
    pub rows: usize,
    /// Whether the time stamps were of use.
    pub(super) clocked: bool,
    /// Several laps are likely: how many. A slowed-down controller looks the same in one run.
    pub(super) laps: Option<u32>,
    /// Identifies the noise of the measurement; `None` where there is none.
    pub(super) fingerprint: Option<u64>,
}

/// Pole of the polar samples in the coordinates of a file with positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Location {
    /// Centre of the least-squares circle, m.
    pub origin_m: [f64; 3],
    /// Tilt of the plane against the nearest coordinate plane and flatness (peak to valley, m), for 3-D points.
    pub plane: Option<Tilt>,
}

/// What is kept of the rows while they go by.
#[derive(Default)]
struct Rows {
    stamps: Stamps,
    time: Vec<f64>,
    /// Every n-th time, since the first.
    times: Thinned<f64>,
    /// First axis of the plane, or the angle.
    first: Vec<f64>,
    /// Second axis, or the deviation.
    second: Vec<f64>,
    /// Lowest and highest point over the plane.
    heights: [f64; 2],
}

/// A block of rows on its way to [`Rows`].
struct Part {
    time: Vec<f64>,
    first: Vec<f64>,
    second: Vec<f64>,
    heights: [f64; 2],
}

impl Rows {
    fn take(&mut self, part: Part, keep_time: bool) {
        let mut time = part.time;
        time.chunks_mut(STAMPS)
            .for_each(|stamps| self.stamps.take(stamps));
        self.times.extend(time.len(), |k| time[k]);
        if keep_time {
            append(&mut self.time, time);
        }
        append(&mut self.first, part.first);
        append(&mut self.second, part.second);
        self.heights = [
            self.heights[0].min(part.heights[0]),
            self.heights[1].max(part.heights[1]),
        ];
    }
}

/// Adds numbers behind others; those that come at once are not copied.
fn append(numbers: &mut Vec<f64>, more: Vec<f64>) {
    if numbers.capacity() > 0 {
        numbers.extend_from_slice(&more)
    } else {
        *numbers = more
    }
}

/// Which columns of a file hold what.
struct Columns {
    time: Option<usize>,
    angle: Option<usize>,
    radial: Option<usize>,
    /// Two axes in the order of their plane, and the third where there is one.
    position: Option<([usize; 2], Option<usize>)>,
    /// The plane that the names of two axes tell, other than XY.
    plane: Option<NamedPlane>,
    /// What the length is called.
    length: &'static str,
    /// The length is a radius.
    is_radius: bool,
}

impl Columns {
    fn of(fields: &[Field]) -> Self {
        let index =
            |wanted: &dyn Fn(Quantity) -> bool| fields.iter().position(|f| wanted(f.quantity));
        let axes = [0, 1, 2].map(|axis| index(&|q| q == Quantity::Position(axis)));
        let (position, plane) = match axes {
            [Some(x), Some(y), z] => (Some(([x, y], z)), None),
            [None, Some(y), Some(z)] => (Some(([y, z], None)), Some(NamedPlane::Yz)),
            [Some(x), None, Some(z)] => (Some(([z, x], None)), Some(NamedPlane::Zx)),
            _ => (None, None),
        };
        let radial = index(&|q| matches!(q, Quantity::Deviation | Quantity::Radius));
        Self {
            time: index(&|q| matches!(q, Quantity::Time | Quantity::Stamp(_))),
            angle: index(&|q| q == Quantity::Angle),
            radial,
            position,
            plane,
            length: radial.map_or("", |f| fields[f].name),
            is_radius: radial.is_some_and(|f| fields[f].quantity == Quantity::Radius),
        }
    }

    /// Without angles the time becomes the angle.
    fn by_time(&self) -> bool {
        self.position.is_none() && self.angle.is_none()
    }
}

/// Reads and checks one run. Of its rows the angle and the deviation (or x and y) are kept, and the time only if it is wanted
/// or stands for the angle; everything else goes by: 16 bytes a row are the memory of a run.
pub(super) fn load(entry: &Entry, keep_time: bool) -> Result<Loaded, CampaignError> {
    let file = RunFile::open(entry)?;
    let columns = Columns::of(&file.fields());
    let view = plane_view(entry, &columns)?;
    let mut rows = gather(entry, file, &columns, view.as_ref(), keep_time)?;
    if rows.second.len() < FEWEST {
        return Err(too_few(entry, rows.second.len()));
    }
    let named = columns.plane.map(Frame::of);
    let run = Run {
        file: entry.file.clone(),
        radius_m: entry.radius_m,
        feed_m_s: entry.feed_m_s,
        direction: entry.direction,
        start_angle_rad: entry.start_angle_rad.unwrap_or(0.0),
        started_s: entry.started_s,
        temperature_c: entry.temperature_c,
        centre_m: entry.centre_m,
        frame: entry.frame_of(view.as_ref().map(|view| view.frame).or(named))?,
        setup: entry.setup.clone(),
        samples: Samples {
            angle_rad: std::mem::take(&mut rows.first),
            deviation_m: std::mem::take(&mut rows.second),
            time_s: None,
            angle_inferred: columns.by_time(),
        },
    };
    if columns.by_time() {
        by_time(entry, &columns, run, rows, keep_time)
    } else {
        by_angle(entry, &columns, run, rows, view, keep_time)
    }
}

fn no_circle(entry: &Entry, error: CircleError, field: usize) -> CampaignError {
    let reason = error.to_string();
    CampaignError::new(entry.place(0, field), Problem::NoCircle { reason })
}

/// The plane through points in space.
fn plane_view(entry: &Entry, columns: &Columns) -> Result<Option<PlaneView>, CampaignError> {
    let Some(([x, y], Some(z))) = columns.position else {
        return Ok(None);
    };
    let scatter = scatter(entry, [x, y, z])?;
    if scatter.count < FEWEST {
        return Err(too_few(entry, scatter.count));
    }
    let view = PlaneView::through(&scatter).map_err(|e| no_circle(entry, e, x))?;
    Ok(Some(view))
}

/// Walks the rows of a file and keeps what becomes samples.
fn gather(
    entry: &Entry,
    file: RunFile<'_>,
    columns: &Columns,
    view: Option<&PlaneView>,
    keep_time: bool,
) -> Result<Rows, CampaignError> {
    let keep = keep_time || columns.by_time();
    let radius = if columns.is_radius {
        entry.radius_m
    } else {
        0.0
    };
    let mut rows = Rows::default();
    let expected = file.rows().unwrap_or(0);
    rows.first
        .reserve_exact(if columns.by_time() { 0 } else { expected });
    rows.second.reserve_exact(expected);
    rows.time.reserve_exact(if keep && columns.time.is_some() {
        expected
    } else {
        0
    });
    let prepare = |batch: Batch| {
        let mut all = batch.columns;
        let mut column =
            |field: Option<usize>| field.map_or_else(Vec::new, |f| std::mem::take(&mut all[f]));
        let time = column(columns.time);
        let mut heights = [0.0_f64; 2];
        let (first, second) = match columns.position {
            Some(([a, b], third)) => {
                let (mut x, mut y) = (column(Some(a)), column(Some(b)));
                if let (Some(view), Some(third)) = (view, third) {
                    let z = column(Some(third));
                    for ((x, y), z) in x.iter_mut().zip(&mut y).zip(&z) {
                        let height = view.height([*x, *y, *z]);
                        heights = [heights[0].min(height), heights[1].max(height)];
                        [*x, *y] = view.project([*x, *y, *z]);
                    }
                }
                (x, y)
            }
            None => {
                let mut deviation = column(columns.radial);
                if radius != 0.0 {
                    deviation.iter_mut().for_each(|v| *v -= radius);
                }
                (column(columns.angle), deviation)
            }
        };
        Part {
            time,
            first,
            second,
            heights,
        }
    };
    file.walk(prepare, |part| {
        rows.take(part, keep);
        Ok(())
    })?;
    Ok(rows)
}

/// A run of deviations over time. A ballbar knows time only: the recorded lap is one turn, or the arc that the campaign
/// declares.
fn by_time(
    entry: &Entry,
    columns: &Columns,
    mut run: Run,
    rows: Rows,
    keep_time: bool,
) -> Result<Loaded, CampaignError> {
    let (Some(field), Some(radial)) = (columns.time, columns.radial) else {
        unreachable!("the header was checked: time and a length")
    };
    let mut notes = Vec::new();
    let count = run.samples.deviation_m.len();
    let mut clock = rows.stamps.clock(entry, field)?;
    let covered = entry.arc_rad.unwrap_or(TAU);
    clock.turn_s *= TAU / covered;
    check::slowness(entry, clock.turn_s)?; // a wrong radius explains more than a wrong deviation
    let deviation = &run.samples.deviation_m;
    let noise_m = check::deviation(entry, deviation, radial, columns.length)?;
    check::called_um(
        entry,
        deviation,
        noise_m,
        radial,
        columns.is_radius,
        &mut notes,
    )?;
    let laps = check::duration(entry, clock.turn_s, deviation, &mut notes)?;
    check::gaps(entry, &clock, count, field, &mut notes)?;
    let mut time = rows.time;
    let angle = inferred_angle(entry, &clock, count, covered);
    let mut kept = None;
    if keep_time {
        run.samples.angle_rad = time.iter().enumerate().map(|(k, t)| angle(k, *t)).collect();
        kept = Some(time);
    } else {
        time.iter_mut()
            .enumerate()
            .for_each(|(k, t)| *t = angle(k, *t));
        run.samples.angle_rad = time;
    }
    left_out::strays(entry, &mut run, &mut kept, noise_m, &mut notes)?;
    let turn_s = Some(clock.turn_s);
    Ok(finish(run, None, turn_s, kept, notes, laps, noise_m))
}

/// A run of positions, or of lengths over measured angles.
fn by_angle(
    entry: &Entry,
    columns: &Columns,
    mut run: Run,
    rows: Rows,
    view: Option<PlaneView>,
    keep_time: bool,
) -> Result<Loaded, CampaignError> {
    let mut notes = Vec::new();
    // Coarse stamps of a foreign file say nothing that its angles do not say better.
    let useless = entry.slice.is_some() && rows.stamps.coarse();
    let clock = match columns.time.filter(|_| !useless) {
        None => None,
        Some(field) => Some(rows.stamps.clock(entry, field)?),
    };
    let mut kept = (keep_time && clock.is_some()).then_some(rows.time);
    let mut location = None;
    let field = columns.angle.or(columns.position.map(|(axes, _)| axes[0]));
    let field = field.unwrap_or(0);
    let noise_m = if let Some(([first, _], _)) = columns.position {
        let view = view.map(|view| view.with_heights(rows.heights));
        location = Some(polar(entry, first, &mut run.samples, view, run.frame)?);
        let from = "the distance from the circle";
        check::deviation(entry, &run.samples.deviation_m, first, from)?
    } else {
        let radial = columns.radial.unwrap_or(0);
        let deviation = &run.samples.deviation_m;
        let noise_m = check::deviation(entry, deviation, radial, columns.length)?;
        check::called_um(
            entry,
            deviation,
            noise_m,
            radial,
            columns.is_radius,
            &mut notes,
        )?;
        noise_m
    };
    if !unwrapped(&run.samples.angle_rad) {
        unwrap(&mut run.samples.angle_rad);
    }
    let timed = rows.times.iter();
    let points: Vec<(f64, f64)> = timed
        .filter_map(|(row, t)| Some((*run.samples.angle_rad.get(row)?, t)))
        .collect();
    left_out::strays(entry, &mut run, &mut kept, noise_m, &mut notes)?;
    let turned = seen_from_behind(entry, &run, &mut notes);
    let entry = turned.as_ref().unwrap_or(entry);
    run.direction = entry.direction;
    let mut covered = TAU;
    check::angles(
        entry,
        &run.samples.angle_rad,
        field,
        &mut covered,
        &mut notes,
    )?;
    run.start_angle_rad = run.samples.angle_rad[0];
    let mut turn_s = None;
    if let Some(clock) = clock {
        let mean = clock.turn_s * TAU / covered;
        let steady = steady::turn_s(&points).filter(|steady| *steady < 0.99 * mean);
        let turn = steady.unwrap_or(mean);
        check::feed(entry, turn, &mut notes)?;
        turn_s = Some(turn);
        left_out::keep_steady(entry, &points, &mut run, &mut kept, &mut notes);
    }
    Ok(finish(run, location, turn_s, kept, notes, None, noise_m))
}

/// Points in a plane other than XY go round as they do; which side of the plane was meant, a foreign file does not say.
fn seen_from_behind(entry: &Entry, run: &Run, notes: &mut Vec<Note>) -> Option<Entry> {
    let angle = &run.samples.angle_rad;
    let way = angle.last()? - angle.first()?;
    let other = way * f64::from(entry.direction.sign()) < 0.0;
    let [_, _, up] = run.frame.normal();
    if entry.slice.is_none() || entry.plane.is_some() || !other || up > 0.8 {
        return None;
    }
    let normal = run.frame.normal();
    let axis = if normal[0] > 0.8 { "+X" } else { "+Y" };
    let direction = match entry.direction {
        Direction::Ccw => Direction::Cw,
        Direction::Cw => Direction::Ccw,
    };
    let words = match direction {
        Direction::Ccw => "counter-clockwise",
        Direction::Cw => "clockwise",
    };
    notes.push(Note {
        at: entry.row(0),
        text: format!("the circle does not lie in XY; seen from {axis} it goes {words}"),
    });
    Some(Entry {
        direction,
        ..entry.clone()
    })
}

fn too_few(entry: &Entry, found: usize) -> CampaignError {
    let at = if found == 0 {
        Place::at(&entry.path, 1, 1)
    } else {
        entry.row(found - 1)
    };
    CampaignError::new(
        at,
        Problem::TooFew {
            found,
            expected: FEWEST,
        },
    )
}

/// Moments of the points of a run in space: a walk over the file of its own, unless an import has taken them already.
fn scatter(entry: &Entry, fields: [usize; 3]) -> Result<Scatter, CampaignError> {
    if let Some(scatter) = entry.slice.as_ref().and_then(|slice| slice.scatter) {
        return Ok(scatter);
    }
    let mut scatter = Scatter::default();
    let prepare = |batch: Batch| {
        let [x, y, z] = fields.map(|f| batch.columns[f].as_slice());
        Scatter::of_block(x, y, z)
    };
    RunFile::open(entry)?.walk(prepare, |part| {
        scatter.merge(&part);
        Ok(())
    })?;
    Ok(scatter)
}

fn finish(
    mut run: Run,
    location: Option<Location>,
    turn_s: Option<f64>,
    time: Option<Vec<f64>>,
    notes: Vec<Note>,
    laps: Option<u32>,
    noise_m: f64,
) -> Loaded {
    let fingerprint = check::fingerprint(&run.samples.deviation_m, noise_m);
    run.samples.time_s = time;
    let rows = run.samples.deviation_m.len();
    Loaded {
        rows,
        clocked: turn_s.is_some(),
        run,
        location,
        turn_s,
        notes,
        laps,
        fingerprint,
    }
}

/// The angle of sample `k` at time `t`: one turn (or the arc) of evenly spaced samples, whatever the rounding of the stamps;
/// by the stamps themselves where samples were lost.
fn inferred_angle(
    entry: &Entry,
    clock: &Clock,
    rows: usize,
    covered: f64,
) -> impl Fn(usize, f64) -> f64 {
    let (start, d) = (
        entry.start_angle_rad.unwrap_or(0.0),
        f64::from(entry.direction.sign()),
    );
    let (n, rate, whole) = (rows as f64, d * TAU / clock.turn_s, clock.gap.is_none());
    move |k, t| {
        if whole {
            start + d * covered * k as f64 / n
        } else {
            start + rate * t
        }
    }
}

/// Points (x as angle, y as deviation) into polar samples about their least-squares circle, in place.
fn polar(
    entry: &Entry,
    field: usize,
    samples: &mut Samples,
    plane: Option<PlaneView>,
    frame: Frame,
) -> Result<Location, CampaignError> {
    let (x, y) = (&mut samples.angle_rad, &mut samples.deviation_m);
    let fit = fit_circle(x, y).map_err(|e| no_circle(entry, e, field))?;
    let Circle { centre, radius } = fit.circle;
    let relative = radius / entry.radius_m;
    if (relative - 1.0).abs() > check::LARGEST_SIZE_ERROR {
        let problem = Problem::WrongRadius {
            fitted_mm: radius * 1e3,
            programmed_mm: entry.radius_m * 1e3,
            hint: check::unit_hint(relative),
        };
        return Err(CampaignError::new(entry.place(0, field), problem));
    }
    x.par_chunks_mut(1 << 16)
        .zip(y.par_chunks_mut(1 << 16))
        .for_each(|(x, y)| {
            for (x, y) in x.iter_mut().zip(y) {
                let (dx, dy) = (*x - centre[0], *y - centre[1]);
                *x = dy.atan2(dx);
                *y = dx.hypot(dy) - entry.radius_m;
            }
        });
    Ok(match plane {
        None => Location {
            origin_m: [0, 1, 2]
                .map(|k| centre[0] * frame.first()[k] + centre[1] * frame.second()[k]),
            plane: None,
        },
        Some(view) => Location {
            origin_m: view.lift(centre),
            plane: Some(view.tilt()),
        },
    })
}

fn unwrapped(angle: &[f64]) -> bool {
    angle.windows(2).all(|w| (w[1] - w[0]).abs() < TAU / 2.0)
}

/// Adds whole turns so that no step is half a turn or more.
fn unwrap(angle: &mut [f64]) {
    let mut turns = 0.0;
    for k in 1..angle.len() {
        let step = angle[k] + turns - angle[k - 1];
        if step.abs() >= TAU / 2.0 {
            turns -= TAU * (step / TAU).round();
        }
        angle[k] += turns;
    }
}
