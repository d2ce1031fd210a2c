//! From the columns of a file to one turn of polar samples.
use super::check;
use super::error::{CampaignError, Place, Problem};
use super::manifest::Entry;
use super::table::{self, Column, Table, Unit};
use super::{Note, Run, Samples};
use giotto_shared::circle::{self, Circle, CircleError, Plane, Xy};
use std::f64::consts::TAU;

/// Fewest samples of a run.
pub(super) const FEWEST: usize = 8;

/// A run with what its file says beyond polar samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The run. Without `keep_time` its `time_s` is `None` whatever the file holds.
    pub run: Run,
    /// Where the circle lies in the coordinates of the file, for x, y (and z) files.
    pub frame: Option<Frame>,
    /// Duration of the turn, s, where the file has time stamps.
    pub turn_s: Option<f64>,
    /// What the reader should know.
    pub notes: Vec<Note>,
    /// Number of samples; stays when the samples themselves are dropped.
    pub rows: usize,
    /// Several laps are likely: how many. A slowed-down controller looks the same in one run.
    pub(super) laps: Option<u32>,
    /// Identifies the noise of the measurement; `None` where there is none.
    pub(super) fingerprint: Option<u64>,
}

/// Pole of the polar samples in the coordinates of a file with positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
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

/// Reads and checks one run.
pub(super) fn load(entry: &Entry, keep_time: bool) -> Result<Loaded, CampaignError> {
    let mut table = Table::read(&entry.path)?;
    let rows = table.rows();
    if rows < FEWEST {
        let at = Place::at(&entry.path, rows + 1, 1);
        return Err(CampaignError::new(at, Problem::TooFew { found: rows, expected: FEWEST }));
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
        samples: Samples {
            angle_rad: Vec::new(),
            deviation_m: Vec::new(),
            time_s: None,
            angle_inferred: false,
        },
    };
    let mut notes = Vec::new();
    let clock = match take(&mut table, |c| c == Column::Time) {
        None => None,
        Some((field, mut time)) => {
            let first = time[0];
            time.iter_mut().for_each(|t| *t -= first);
            Some((check::clock(entry, &time, field, first)?, time, field))
        }
    };
    let mut frame = None;
    let mut covered = TAU;
    if let Some((x_field, x)) = take(&mut table, |c| c == Column::Position(0)) {
        let positions = (x, take(&mut table, |c| c == Column::Position(1)).map_or_else(Vec::new, |(_, y)| y));
        let z = take(&mut table, |c| c == Column::Position(2)).map(|(_, z)| z);
        let (angle, deviation, found) = polar(entry, x_field, positions, z)?;
        check::deviation(entry, &deviation, x_field, "the distance from the circle")?;
        frame = Some(found);
        run.samples.angle_rad = angle;
        run.samples.deviation_m = deviation;
    } else if let Some((field, deviation)) =
        take(&mut table, |c| matches!(c, Column::Deviation(_) | Column::Radius))
    {
        if let (Some((clock, ..)), None) = (&clock, table.index(|c| c == Column::Angle)) {
            check::slowness(entry, clock.turn_s)?; // a wrong radius explains more than a wrong deviation
        }
        run.samples.deviation_m = deviations(entry, table.header[field], field, deviation)?;
        if let Some((_, mut angle)) = take(&mut table, |c| c == Column::Angle) {
            angle.iter_mut().for_each(|a| *a = a.to_radians());
            run.samples.angle_rad = angle;
        }
    }
    let mut laps = None;
    let mut kept = None;
    if run.samples.angle_rad.is_empty() {
        // A ballbar knows time only: the recorded lap is one turn.
        let Some((clock, mut time, field)) = clock else {
            unreachable!("the header was checked: time or angle")
        };
        laps = check::duration(entry, clock.turn_s, &run.samples.deviation_m, &mut notes)?;
        check::gaps(entry, &clock, &time, field, &mut notes)?;
        if keep_time {
            kept = Some(time.clone());
        }
        infer_angles(&mut time, entry, &clock);
        run.samples.angle_rad = time;
        run.samples.angle_inferred = true;
        let turn_s = Some(clock.turn_s);
        return finish(run, frame, turn_s, kept, notes, laps);
    }
    let field = table.index(|c| matches!(c, Column::Angle | Column::Position(0))).unwrap_or(0);
    if !unwrapped(&run.samples.angle_rad) {
        unwrap(&mut run.samples.angle_rad);
    }
    check::angles(entry, &run.samples.angle_rad, field, &mut covered, &mut notes)?;
    run.start_angle_rad = run.samples.angle_rad[0];
    let mut turn_s = None;
    if let Some((clock, time, _)) = clock {
        let turn = clock.turn_s * TAU / covered;
        check::feed(entry, turn, &mut notes)?;
        turn_s = Some(turn);
        kept = keep_time.then_some(time);
    }
    finish(run, frame, turn_s, kept, notes, laps)
}

fn finish(
    mut run: Run,
    frame: Option<Frame>,
    turn_s: Option<f64>,
    time: Option<Vec<f64>>,
    notes: Vec<Note>,
    laps: Option<u32>,
) -> Result<Loaded, CampaignError> {
    let fingerprint = check::fingerprint(&run.samples.deviation_m);
    run.samples.time_s = time;
    let rows = run.samples.deviation_m.len();
    Ok(Loaded { rows, run, frame, turn_s, notes, laps, fingerprint })
}

fn take(table: &mut Table, wanted: impl Fn(Column) -> bool) -> Option<(usize, Vec<f64>)> {
    let field = table.index(wanted)?;
    Some((field, std::mem::take(&mut table.columns[field])))
}

fn deviations(
    entry: &Entry,
    column: Column,
    field: usize,
    mut values: Vec<f64>,
) -> Result<Vec<f64>, CampaignError> {
    match column {
        Column::Deviation(Unit::Um) => values.iter_mut().for_each(|v| *v *= 1e-6),
        Column::Deviation(Unit::Mm) => values.iter_mut().for_each(|v| *v *= 1e-3),
        _ => values.iter_mut().for_each(|v| *v = *v * 1e-3 - entry.radius_m),
    }
    check::deviation(entry, &values, field, column.name())?;
    Ok(values)
}

/// Time stamps into angles, in place: one turn of evenly spaced samples, whatever the rounding of the
/// stamps; by the stamps themselves where samples were lost.
fn infer_angles(time: &mut [f64], entry: &Entry, clock: &check::Clock) {
    let (start, d) = (entry.start_angle_rad.unwrap_or(0.0), f64::from(entry.direction.sign()));
    let n = time.len() as f64;
    if clock.gap.is_none() {
        time.iter_mut().enumerate().for_each(|(k, t)| *t = start + d * TAU * k as f64 / n);
    } else {
        let rate = d * TAU / clock.turn_s;
        time.iter_mut().for_each(|t| *t = start + rate * *t);
    }
}

/// Points into polar samples about their least-squares circle, in place.
fn polar(
    entry: &Entry,
    field: usize,
    (mut x, mut y): (Vec<f64>, Vec<f64>),
    z: Option<Vec<f64>>,
) -> Result<(Vec<f64>, Vec<f64>, Frame), CampaignError> {
    let no_circle = |e: CircleError| {
        CampaignError::new(table::place(&entry.path, 0, field), Problem::NoCircle { reason: e.to_string() })
    };
    let mut plane = None;
    let scale = |v: &mut Vec<f64>| v.iter_mut().for_each(|v| *v *= 1e-3);
    scale(&mut x);
    scale(&mut y);
    if let Some(mut z) = z {
        scale(&mut z);
        let found = PlaneView::of(&x, &y, &z).map_err(no_circle)?;
        for ((x, y), z) in x.iter_mut().zip(&mut y).zip(&z) {
            [*x, *y] = found.project([*x, *y, *z]);
        }
        plane = Some(found);
    }
    let fit = Xy::new(&x, &y).and_then(|points| circle::fit(&points)).map_err(no_circle)?;
    let Circle { centre, radius } = fit.circle;
    let relative = radius / entry.radius_m;
    if (relative - 1.0).abs() > check::LARGEST_SIZE_ERROR {
        let problem = Problem::WrongRadius {
            fitted_mm: radius * 1e3,
            programmed_mm: entry.radius_m * 1e3,
            hint: check::unit_hint(relative),
        };
        return Err(CampaignError::new(table::place(&entry.path, 0, field), problem));
    }
    for (x, y) in x.iter_mut().zip(&mut y) {
        let (dx, dy) = (*x - centre[0], *y - centre[1]);
        *x = dy.atan2(dx);
        *y = dx.hypot(dy) - entry.radius_m;
    }
    let frame = match plane {
        None => Frame { origin_m: [centre[0], centre[1], 0.0], plane: None },
        Some(view) => Frame { origin_m: view.lift(centre), plane: Some(view.tilt()) },
    };
    Ok((x, y, frame))
}

/// A plane seen from the positive end of the axis nearest to its normal, so that CCW means what it means
/// in G17, G18 and G19.
struct PlaneView {
    plane: Plane,
    flip: f64,
}

impl PlaneView {
    fn of(x: &[f64], y: &[f64], z: &[f64]) -> Result<Self, CircleError> {
        let plane = Plane::fit(x.iter().zip(y).zip(z).map(|((&x, &y), &z)| [x, y, z]))?;
        let largest =
            plane.normal.iter().copied().fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        Ok(Self { plane, flip: largest.signum() })
    }

    fn project(&self, point: [f64; 3]) -> [f64; 2] {
        let [u, v] = self.plane.project(point);
        [u, self.flip * v]
    }

    fn lift(&self, [u, v]: [f64; 2]) -> [f64; 3] {
        self.plane.lift([u, self.flip * v])
    }

    fn tilt(&self) -> Tilt {
        let normal = self.plane.normal.map(|c| c * self.flip);
        let axis = normal.iter().copied().fold(0.0, f64::max);
        let across = normal.iter().map(|c| c * c).sum::<f64>() - axis * axis;
        Tilt { normal, tilt_rad: across.max(0.0).sqrt().atan2(axis), flatness_m: self.plane.flatness }
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
        turns -= TAU * (step / TAU).round();
        angle[k] += turns;
    }
}
