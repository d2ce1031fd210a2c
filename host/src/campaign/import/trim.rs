//! Which rows of a recording are the circle: feed-in and feed-out left out, laps told apart, arcs measured.
use crate::campaign::{Problem, SHORTEST_ARC_DEG};
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

/// Points seen in their plane from its positive side, as the reader of campaigns sees them.
pub(super) fn flatten(position: &[Vec<f64>; 3], rows: &[usize]) -> Option<(Vec<f64>, Vec<f64>)> {
    let [x, y, z] = position;
    if z.is_empty() {
        return Some((x.clone(), y.clone()));
    }
    let plane = Plane::fit(rows.iter().map(|&k| [x[k], y[k], z[k]])).ok()?;
    let largest = plane.normal.iter().copied().fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
    let flip = largest.signum();
    Some((0..x.len()).map(|k| plane.project([x[k], y[k], z[k]])).map(|[u, v]| (u, flip * v)).unzip())
}

/// Circle of most points: feed-in, feed-out and dwell do not bend it.
fn robust_circle(x: &[f64], y: &[f64], rows: &[usize], radius_m: f64) -> Option<(Circle, f64)> {
    let n = rows.len();
    let starts = [0..n, n / 4..n - n / 4, n / 2..n, 0..n / 2, n / 3..2 * n / 3];
    let spread = |c: &Circle| {
        let mut off: Vec<f64> =
            rows.iter().map(|&k| ((x[k] - c.centre[0]).hypot(y[k] - c.centre[1]) - c.radius).abs()).collect();
        off.sort_unstable_by(f64::total_cmp);
        off[off.len() / 2]
    };
    let fit = |rows: &[usize]| {
        let (x, y): (Vec<f64>, Vec<f64>) = rows.iter().map(|&k| (x[k], y[k])).unzip();
        Some(circle::fit(&Xy::new(&x, &y).ok()?).ok()?.circle)
    };
    let mut best = starts.into_iter().filter_map(|r| fit(&rows[r])).min_by(|a, b| {
        let far = |c: &Circle| spread(c) + (c.radius / radius_m - 1.0).abs().max(0.1) * radius_m;
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

/// Rows of points that make the circle of `radius_m`, and their unwrapped angles.
pub(super) fn of_points(position: &[Vec<f64>; 3], time_s: &[f64], radius_m: f64) -> Result<Turns, Problem> {
    let rows = position[0].len();
    let off = |found| Problem::OffCircle { found, rows, radius_mm: (radius_m * 1e9).round() / 1e6 };
    // A stride bounds the work of the robust start; the limits are then applied to every row.
    let stride = rows.div_ceil(20_000);
    let mut used: Vec<usize> = (0..rows).step_by(stride).collect();
    let (mut x, mut y) = flatten(position, &used).ok_or_else(|| off(0))?;
    let (mut circle, mut limit) = robust_circle(&x, &y, &used, radius_m).ok_or_else(|| off(0))?;
    if !position[2].is_empty() {
        // The plane of the circle alone: a lift before it has tilted the first one.
        used.retain(|&k| {
            ((x[k] - circle.centre[0]).hypot(y[k] - circle.centre[1]) - circle.radius).abs() <= limit
        });
        (x, y) = flatten(position, &used).ok_or_else(|| off(used.len()))?;
        (circle, limit) = robust_circle(&x, &y, &used, radius_m).ok_or_else(|| off(used.len()))?;
    }
    let on =
        |k: usize| ((x[k] - circle.centre[0]).hypot(y[k] - circle.centre[1]) - circle.radius).abs() <= limit;
    let stretch = longest(rows, on);
    if stretch.len() * 4 < rows || stretch.len() < 8 {
        return Err(off(stretch.len()));
    }
    let mut angle: Vec<f64> =
        stretch.clone().map(|k| (y[k] - circle.centre[1]).atan2(x[k] - circle.centre[0])).collect();
    unwrap(&mut angle);
    let time = if time_s.is_empty() { &[] } else { &time_s[stretch.clone()] };
    let mut turns = of_angles(&angle, time)?;
    turns.laps.iter_mut().for_each(|l| *l = l.start + stretch.start..l.end + stretch.start);
    turns.feed_in += stretch.start;
    turns.feed_out += rows - stretch.end;
    Ok(turns)
}

/// Turns of unwrapped angles. `time` may be empty.
pub(super) fn of_angles(angle: &[f64], time: &[f64]) -> Result<Turns, Problem> {
    let n = angle.len();
    let sign = (angle[n - 1] - angle[0]).signum();
    let block = (n / 200).max(1);
    let rate = |k: usize| {
        let to = (k + block).min(n - 1);
        let span = if time.is_empty() { (to - k) as f64 } else { time[to] - time[k] };
        if span > 0.0 { sign * (angle[to] - angle[k]) / span } else { 0.0 }
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
        while from + 2 * block < to && rate(to - 1 - block) < least * usual && long_enough(from, to - block) {
            to -= block;
        }
        from..to
    };
    let moving = steady(STANDING, false, 0..n);
    let range = steady(RAMPING, true, moving);
    let spacing = (angle[range.end - 1] - angle[range.start]).abs() / (range.len() - 1).max(1) as f64;
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
            return Err(Problem::ShortArc { covered_deg: around.to_degrees() });
        }
        arc_rad = Some(around);
        laps.push(range);
    }
    let end = laps.last().map_or(n, |l| l.end);
    Ok(Turns { feed_in: laps[0].start, feed_out: n - end, laps, arc_rad, sign })
}

/// Angle of a stretch, one spacing counted for its last row.
fn covered(angle: &[f64], range: Range<usize>) -> f64 {
    let n = range.len().max(2) as f64;
    (angle[range.end - 1] - angle[range.start]).abs() * n / (n - 1.0)
}

/// The longest stretch of rows that are `on`, up to three strays in a row forgiven.
fn longest(rows: usize, on: impl Fn(usize) -> bool) -> Range<usize> {
    let (mut best, mut start, mut last) = (0..0, None, 0);
    for k in 0..rows {
        if on(k) {
            if start.is_none() || k - last > 4 {
                start = Some(k);
            }
            last = k;
            let from = start.unwrap_or(k);
            if k + 1 - from > best.len() {
                best = from..k + 1;
            }
        }
    }
    best
}

/// Adds whole turns so that no step is half a turn or more.
pub(super) fn unwrap(angle: &mut [f64]) {
    let mut turns = 0.0;
    for k in 1..angle.len() {
        let step = angle[k] + turns - angle[k - 1];
        turns -= TAU * (step / TAU).round();
        angle[k] += turns;
    }
}
