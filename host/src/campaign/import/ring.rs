//! Which rows of a recording are the circle: feed-in and feed-out left out, laps told apart, arcs measured.
use crate::campaign::manifest::Entry;
use crate::campaign::thinned::Thinned;
use crate::campaign::{Problem, SHORTEST_ARC_DEG, check};
use giotto_shared::circle::{self, Circle, Plane, Xy};
use std::f64::consts::TAU;
use std::ops::Range;

/// A point this far from the circle is not of it, share of the radius.
const OFF_CIRCLE: f64 = 0.002;
/// Blocks slower than this share of the usual rate are starts and stops.
const STANDING: f64 = 0.5;
const RAMPING: f64 = 0.97;

/// The turns of a recording.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Turns {
    /// Rows of each whole turn; of the one arc where there is no whole turn.
    pub(super) laps: Vec<Range<usize>>,
    /// Angle covered where there is no whole turn, rad.
    pub(super) arc_rad: Option<f64>,
    /// Rows before and after the circle.
    pub(super) feed_in: usize,
    pub(super) feed_out: usize,
    /// +1 counter-clockwise, −1 clockwise.
    pub(super) sign: f64,
}

/// A circle in its plane and how far from it a point of it may lie.
#[derive(Clone, Debug)]
pub(super) struct Ring {
    /// The plane seen from its positive side, as the reader of campaigns sees it.
    plane: Option<(Plane, f64)>,
    circle: Circle,
    limit: f64,
}

impl Ring {
    /// Angle of a point about the centre, rad, and whether it lies on the circle.
    pub(super) fn at(&self, point: [f64; 3]) -> (f64, bool) {
        let [x, y] = flat(self.plane.as_ref(), point);
        let (dx, dy) = (x - self.circle.centre[0], y - self.circle.centre[1]);
        (
            dy.atan2(dx),
            (dx.hypot(dy) - self.circle.radius).abs() <= self.limit,
        )
    }
}

fn flat(plane: Option<&(Plane, f64)>, point: [f64; 3]) -> [f64; 2] {
    plane.map_or([point[0], point[1]], |(plane, flip)| {
        let [u, v] = plane.project(point);
        [u, flip * v]
    })
}

/// The circle of `radius_m` that most of the points are on; z may be empty.
pub(super) fn ring(points: &[Vec<f64>; 3], radius_m: f64) -> Option<Ring> {
    let [x, y, z] = points;
    let rows = x.len();
    let point = |k: usize| [x[k], y[k], z.get(k).copied().unwrap_or(0.0)];
    let mut used: Vec<usize> = (0..rows).collect();
    if z.is_empty() {
        let (circle, limit) = robust_circle(x, y, &used, radius_m)?;
        return Some(Ring {
            plane: None,
            circle,
            limit,
        });
    }
    let fit = |used: &[usize]| {
        let plane = Plane::fit(used.iter().map(|&k| point(k))).ok()?;
        let largest = plane
            .normal
            .iter()
            .copied()
            .fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        let plane = Some((plane, largest.signum()));
        let (u, v): (Vec<f64>, Vec<f64>) = (0..rows)
            .map(|k| flat(plane.as_ref(), point(k)))
            .map(|[u, v]| (u, v))
            .unzip();
        let (circle, limit) = robust_circle(&u, &v, used, radius_m)?;
        Some(Ring {
            plane,
            circle,
            limit,
        })
    };
    let ring = fit(&used)?;
    // The plane of the circle alone: a lift before it has tilted the first one.
    used.retain(|&k| ring.at(point(k)).1);
    fit(&used)
}

/// Circle of most points: feed-in, feed-out and dwell do not bend it.
fn robust_circle(x: &[f64], y: &[f64], rows: &[usize], radius_m: f64) -> Option<(Circle, f64)> {
    let n = rows.len();
    let starts = [0..n, n / 4..n - n / 4, n / 2..n, 0..n / 2, n / 3..2 * n / 3];
    let spread = |c: &Circle| {
        let mut off: Vec<f64> = rows
            .iter()
            .map(|&k| ((x[k] - c.centre[0]).hypot(y[k] - c.centre[1]) - c.radius).abs())
            .collect();
        off.sort_unstable_by(f64::total_cmp);
        off[off.len() / 2]
    };
    let fit = |rows: &[usize]| {
        let (x, y): (Vec<f64>, Vec<f64>) = rows.iter().map(|&k| (x[k], y[k])).unzip();
        Some(circle::fit(&Xy::new(&x, &y).ok()?).ok()?.circle)
    };
    let mut best = starts
        .into_iter()
        .filter_map(|r| fit(&rows[r]))
        .min_by(|a, b| {
            let far =
                |c: &Circle| spread(c) + (c.radius / radius_m - 1.0).abs().max(0.1) * radius_m;
            far(a).total_cmp(&far(b))
        })?;
    let mut limit = 0.0;
    for _ in 0..10 {
        limit = (6.0 * 1.4826 * spread(&best)).max(OFF_CIRCLE * best.radius);
        let on = |k: &&usize| {
            ((x[**k] - best.centre[0]).hypot(y[**k] - best.centre[1]) - best.radius).abs() <= limit
        };
        let kept: Vec<usize> = rows.iter().filter(on).copied().collect();
        let Some(next) = fit(&kept) else { break };
        let moved = (next.radius - best.radius).abs()
            + (next.centre[0] - best.centre[0]).hypot(next.centre[1] - best.centre[1]);
        best = next;
        if moved < 1e-9 * best.radius {
            break;
        }
    }
    Some((best, limit))
}

/// Turns of unwrapped angles. `time` may be empty; its row `offset` is the first of `angle`.
pub(super) fn of_angles(
    angle: &[f64],
    offset: usize,
    time: &Thinned<f64>,
) -> Result<Turns, Problem> {
    let n = angle.len();
    let sign = (angle[n - 1] - angle[0]).signum();
    let block = (n / 200).max(1);
    // Of long recordings every n-th time was kept: the rate is that between the rows of these.
    let timed = |k: usize| {
        let kept = time.at(offset + k);
        kept.filter(|(row, _)| *row >= offset)
            .map_or((k, k as f64), |(row, t)| (row - offset, t))
    };
    let rate = |k: usize| {
        let ((from, a), (to, b)) = (timed(k), timed((k + block).min(n - 1)));
        if b > a {
            sign * (angle[to] - angle[from]) / (b - a)
        } else {
            0.0
        }
    };
    let mut rates: Vec<f64> = (0..n - 1).step_by(block).map(rate).collect();
    rates.sort_unstable_by(f64::total_cmp);
    // Dwell can be most of a recording: the rate of travel is that of the faster blocks.
    let usual = rates[rates.len() * 3 / 4];
    let steady = |least: f64, whole: bool, range: Range<usize>| {
        let (mut from, mut to) = (range.start, range.end);
        let long_enough = |from: usize, to: usize| !whole || covered(angle, from..to) >= TAU;
        while from + 2 * block < to && rate(from) < least * usual && long_enough(from + block, to) {
            from += block;
        }
        while from + 2 * block < to
            && rate(to - 1 - block) < least * usual
            && long_enough(from, to - block)
        {
            to -= block;
        }
        from..to
    };
    let moving = steady(STANDING, false, 0..n);
    let range = steady(RAMPING, true, moving);
    let spacing =
        (angle[range.end - 1] - angle[range.start]).abs() / (range.len() - 1).max(1) as f64;
    let around = covered(angle, range.clone());
    let mut laps = Vec::new();
    let mut from = range.start;
    loop {
        let ahead = |k: &usize| sign * (angle[*k] - angle[from]) >= TAU - 0.5 * spacing;
        let end = (from + 1..range.end).find(ahead);
        let closes = covered(angle, from..range.end) >= TAU - 2.0 * spacing - 1f64.to_radians();
        match end {
            Some(end) => {
                laps.push(from..end);
                from = end;
            }
            None if closes && range.end - from > 2 => {
                laps.push(from..range.end);
                break;
            }
            None => break,
        }
    }
    let mut arc_rad = None;
    if laps.is_empty() {
        if around < SHORTEST_ARC_DEG.to_radians() {
            return Err(Problem::ShortArc {
                covered_deg: around.to_degrees(),
            });
        }
        arc_rad = Some(around);
        laps.push(range);
    }
    let end = laps.last().map_or(n, |l| l.end);
    Ok(Turns {
        feed_in: laps[0].start,
        feed_out: n - end,
        laps,
        arc_rad,
        sign,
    })
}

/// Angle of a stretch, one spacing counted for its last row.
fn covered(angle: &[f64], range: Range<usize>) -> f64 {
    let n = range.len().max(2) as f64;
    (angle[range.end - 1] - angle[range.start]).abs() * n / (n - 1.0)
}

/// Finds the longest stretch of rows that are on the circle, up to three strays in a row forgiven.
#[derive(Clone, Debug, Default)]
pub(super) struct Longest {
    row: usize,
    start: Option<usize>,
    last: usize,
    best: Range<usize>,
}

impl Longest {
    /// The next row.
    pub(super) fn push(&mut self, on: bool) {
        let k = self.row;
        self.row += 1;
        if !on {
            return;
        }
        let from = match self.start {
            Some(start) if k - self.last <= 4 => start,
            _ => k,
        };
        (self.start, self.last) = (Some(from), k);
        if k + 1 - from > self.best.len() {
            self.best = from..k + 1;
        }
    }

    /// The longest so far.
    pub(super) fn best(&self) -> Range<usize> {
        self.best.clone()
    }
}

/// Turns of deviations over time: readings beyond the range at either end are feed-in and feed-out.
pub(super) fn of_times(time: &[f64], deviation: &[f64], entry: &Entry) -> Result<Turns, Problem> {
    let rows = deviation.len();
    let inside = |k: usize| deviation[k].abs() < check::INSTRUMENT_LIMIT_M;
    let (mut from, mut to) = (0, rows);
    if (0..rows).filter(|&k| inside(k)).count() * 2 > rows {
        from = (0..rows).find(|&k| inside(k)).unwrap_or(0);
        to = (0..rows).rfind(|&k| inside(k)).map_or(rows, |k| k + 1);
    }
    let time = &time[from..to];
    let n = time.len();
    let last = time[n - 1] - time[0];
    let turn_s = last * n as f64 / (n as f64 - 1.0);
    let found = check::duration(entry, turn_s, &deviation[from..to], &mut Vec::new())
        .map_err(|e| *e.problem)?;
    let count = found.unwrap_or(1) as usize;
    let edge = |k: usize| from + n * k / count;
    let laps: Vec<Range<usize>> = (0..count).map(|k| edge(k)..edge(k + 1)).collect();
    Ok(Turns {
        laps,
        arc_rad: None,
        feed_in: from,
        feed_out: rows - to,
        sign: 0.0,
    })
}

/// Adds whole turns so that no step is half a turn or more.
pub(super) fn unwrap(angle: &mut [f64]) {
    let mut turns = 0.0;
    for k in 1..angle.len() {
        let step = angle[k] + turns - angle[k - 1];
        if step.abs() >= TAU / 2.0 {
            turns -= TAU * (step / TAU).round();
        }
        angle[k] += turns;
    }
}
