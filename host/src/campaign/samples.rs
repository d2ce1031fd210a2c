//! From the columns of a file to one turn of polar samples.
use super::clock::{Clock, Stamps};
use super::error::{CampaignError, Place, Problem};
use super::import::Quantity;
use super::manifest::Entry;
use super::run_file::RunFile;
use super::table::Batch;
use super::{Frame, Note, Run, Samples, check};
use crate::fit::fit_circle;
use giotto_shared::circle::{Circle, CircleError, Merge, Plane, Scatter};
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

/// How a circle in space lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tilt {
    /// Unit normal of the plane; its largest component is positive, so CCW is seen from the positive axis.
    pub normal: [f64; 3],
    /// Angle between the normal and the nearest axis, rad.
    pub tilt_rad: f64,
    /// Highest minus lowest point over the plane, m.
    pub flatness_m: f64,
}

/// What is kept of the rows while they go by.
#[derive(Default)]
struct Rows {
    stamps: Stamps,
    time: Vec<f64>,
    /// x, or the angle.
    first: Vec<f64>,
    /// y, or the deviation.
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

/// Reads and checks one run. Of its rows the angle and the deviation (or x and y) are kept, and the time only if it is wanted
/// or stands for the angle; everything else goes by: 16 bytes a row are the memory of a run.
pub(super) fn load(entry: &Entry, keep_time: bool) -> Result<Loaded, CampaignError> {
    let file = RunFile::open(entry)?;
    let fields = file.fields();
    let index = |wanted: &dyn Fn(Quantity) -> bool| fields.iter().position(|f| wanted(f.quantity));
    let time_field = index(&|q| matches!(q, Quantity::Time | Quantity::Stamp(_)));
    let angle_field = index(&|q| q == Quantity::Angle);
    let radial_field = index(&|q| matches!(q, Quantity::Deviation | Quantity::Radius));
    let position = [0, 1, 2].map(|axis| index(&|q| q == Quantity::Position(axis)));
    let xy = position[0].zip(position[1]);
    let no_circle = |e: CircleError, field: usize| {
        CampaignError::new(
            entry.place(0, field),
            Problem::NoCircle {
                reason: e.to_string(),
            },
        )
    };
    let mut plane = None;
    if let ([Some(x), Some(y), Some(z)], true) = (position, xy.is_some()) {
        let scatter = scatter(entry, [x, y, z])?;
        if scatter.count < FEWEST {
            return Err(too_few(entry, scatter.count));
        }
        plane = Some((
            PlaneView::through(&scatter).map_err(|e| no_circle(e, x))?,
            z,
        ));
    }
    // Without angles the time becomes the angle.
    let polar_by_time = xy.is_none() && angle_field.is_none();
    let keep = keep_time || polar_by_time;
    let radius = match radial_field {
        Some(field) if fields[field].quantity == Quantity::Radius => entry.radius_m,
        _ => 0.0,
    };
    let mut rows = Rows::default();
    let expected = file.rows().unwrap_or(0);
    rows.first
        .reserve_exact(if polar_by_time { 0 } else { expected });
    rows.second.reserve_exact(expected);
    rows.time.reserve_exact(if keep && time_field.is_some() {
        expected
    } else {
        0
    });
    let prepare = |batch: Batch| {
        let mut columns = batch.columns;
        let mut column =
            |field: Option<usize>| field.map_or_else(Vec::new, |f| std::mem::take(&mut columns[f]));
        let time = column(time_field);
        let mut heights = [0.0_f64; 2];
        let (first, second) = match (xy, &plane) {
            (Some((x, y)), None) => (column(Some(x)), column(Some(y))),
            (Some((x, y)), Some((view, z))) => {
                let (mut x, mut y, z) = (column(Some(x)), column(Some(y)), column(Some(*z)));
                for ((x, y), z) in x.iter_mut().zip(&mut y).zip(&z) {
                    let height = view.plane.height([*x, *y, *z]);
                    heights = [heights[0].min(height), heights[1].max(height)];
                    [*x, *y] = view.project([*x, *y, *z]);
                }
                (x, y)
            }
            (None, _) => {
                let mut deviation = column(radial_field);
                if radius != 0.0 {
                    deviation.iter_mut().for_each(|v| *v -= radius);
                }
                (column(angle_field), deviation)
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
    let count = rows.second.len();
    if count < FEWEST {
        return Err(too_few(entry, count));
    }
    let mut run = Run {
        file: entry.file.clone(),
        radius_m: entry.radius_m,
        feed_m_s: entry.feed_m_s,
        direction: entry.direction,
        start_angle_rad: entry.start_angle_rad.unwrap_or(0.0),
        started_s: entry.started_s,
        temperature_c: entry.temperature_c,
        centre_m: entry.centre_m,
        frame: entry.frame_of(plane.as_ref().map(|(view, _)| view.frame))?,
        setup: entry.setup.clone(),
        samples: Samples {
            angle_rad: rows.first,
            deviation_m: rows.second,
            time_s: None,
            angle_inferred: false,
        },
    };
    let mut notes = Vec::new();
    // Coarse stamps of a foreign file say nothing that its angles do not say better.
    let useless = entry.slice.is_some() && !polar_by_time && rows.stamps.coarse();
    let clock = match time_field.filter(|_| !useless) {
        None => None,
        Some(field) => Some((rows.stamps.clock(entry, field)?, rows.time, field)),
    };
    let mut location = None;
    let mut covered = TAU;
    let noise_m = if let Some((x, _)) = xy {
        let plane = plane.map(|(view, _)| view.with_heights(rows.heights));
        location = Some(polar(entry, x, &mut run.samples, plane, &no_circle)?);
        check::deviation(
            entry,
            &run.samples.deviation_m,
            x,
            "the distance from the circle",
        )?
    } else if let Some(field) = radial_field {
        if let (Some((clock, ..)), true) = (&clock, polar_by_time) {
            check::slowness(entry, clock.turn_s)?; // a wrong radius explains more than a wrong deviation
        }
        check::deviation(entry, &run.samples.deviation_m, field, fields[field].name)?
    } else {
        unreachable!("the header was checked: positions or one length")
    };
    let mut laps = None;
    let mut kept = None;
    if polar_by_time {
        // A ballbar knows time only: the recorded lap is one turn.
        let Some((clock, mut time, field)) = clock else {
            unreachable!("the header was checked: time or angle")
        };
        laps = check::duration(entry, clock.turn_s, &run.samples.deviation_m, &mut notes)?;
        check::gaps(entry, &clock, count, field, &mut notes)?;
        let angle = inferred_angle(entry, &clock, count);
        if keep_time {
            run.samples.angle_rad = time.iter().enumerate().map(|(k, t)| angle(k, *t)).collect();
            kept = Some(time);
        } else {
            time.iter_mut()
                .enumerate()
                .for_each(|(k, t)| *t = angle(k, *t));
            run.samples.angle_rad = time;
        }
        run.samples.angle_inferred = true;
        let turn_s = Some(clock.turn_s);
        return Ok(finish(run, location, turn_s, kept, notes, laps, noise_m));
    }
    let field = index(&|q| matches!(q, Quantity::Angle | Quantity::Position(0))).unwrap_or(0);
    if !unwrapped(&run.samples.angle_rad) {
        unwrap(&mut run.samples.angle_rad);
    }
    check::angles(
        entry,
        &run.samples.angle_rad,
        field,
        &mut covered,
        &mut notes,
    )?;
    run.start_angle_rad = run.samples.angle_rad[0];
    let mut turn_s = None;
    if let Some((clock, time, _)) = clock {
        let turn = clock.turn_s * TAU / covered;
        check::feed(entry, turn, &mut notes)?;
        turn_s = Some(turn);
        kept = keep_time.then_some(time);
    }
    Ok(finish(run, location, turn_s, kept, notes, laps, noise_m))
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

/// The angle of sample `k` at time `t`: one turn of evenly spaced samples, whatever the rounding of the stamps; by the
/// stamps themselves where samples were lost.
fn inferred_angle(entry: &Entry, clock: &Clock, rows: usize) -> impl Fn(usize, f64) -> f64 {
    let (start, d) = (
        entry.start_angle_rad.unwrap_or(0.0),
        f64::from(entry.direction.sign()),
    );
    let (n, rate, whole) = (rows as f64, d * TAU / clock.turn_s, clock.gap.is_none());
    move |k, t| {
        if whole {
            start + d * TAU * k as f64 / n
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
    no_circle: &dyn Fn(CircleError, usize) -> CampaignError,
) -> Result<Location, CampaignError> {
    let (x, y) = (&mut samples.angle_rad, &mut samples.deviation_m);
    let fit = fit_circle(x, y).map_err(|e| no_circle(e, field))?;
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
            origin_m: [centre[0], centre[1], 0.0],
            plane: None,
        },
        Some(view) => Location {
            origin_m: view.lift(centre),
            plane: Some(view.tilt()),
        },
    })
}

/// A plane seen from the positive end of the axis nearest to its normal, so that CCW means what it means
/// in G17, G18 and G19, and angles run from the first axis of that plane.
struct PlaneView {
    plane: Plane,
    frame: Frame,
}

impl PlaneView {
    fn through(scatter: &Scatter) -> Result<Self, CircleError> {
        let plane = Plane::through(scatter)?;
        let frame = Frame::across(plane.normal).ok_or(CircleError::NonFinite)?;
        Ok(Self { plane, frame })
    }

    fn with_heights(mut self, [lowest, highest]: [f64; 2]) -> Self {
        self.plane.flatness = highest - lowest;
        self
    }

    fn project(&self, point: [f64; 3]) -> [f64; 2] {
        let from = [0, 1, 2].map(|k| point[k] - self.plane.centroid[k]);
        [self.frame.first(), self.frame.second()]
            .map(|axis| axis[0] * from[0] + axis[1] * from[1] + axis[2] * from[2])
    }

    fn lift(&self, [u, v]: [f64; 2]) -> [f64; 3] {
        let (first, second) = (self.frame.first(), self.frame.second());
        [0, 1, 2].map(|k| self.plane.centroid[k] + u * first[k] + v * second[k])
    }

    fn tilt(&self) -> Tilt {
        let normal = self.frame.normal();
        let axis = normal.iter().copied().fold(0.0, f64::max);
        let across = normal.iter().map(|c| c * c).sum::<f64>() - axis * axis;
        Tilt {
            normal,
            tilt_rad: across.max(0.0).sqrt().atan2(axis),
            flatness_m: self.plane.flatness,
        }
    }
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
