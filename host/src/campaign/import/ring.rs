//! The circle that most points of a recording are on, whatever else the machine did: run-in, run-out, standing still.
use giotto_shared::circle::{self, Circle, Plane, Xy};

/// A point this far from the circle is not of it, share of the radius.
const OFF_CIRCLE: f64 = 0.002;
/// A point counts once the machine has gone on by this share of the radius: standing still makes no weight.
const STEP: f64 = 0.01;

/// A circle in its plane and how far from it a point of it may lie.
#[derive(Clone, Debug)]
pub(super) struct Ring {
    /// The plane seen from its positive side, as the reader of campaigns sees it.
    plane: Option<(Plane, f64)>,
    /// Without a plane: the two axes that there are, in the order of their plane.
    axes: [usize; 2],
    circle: Circle,
    limit: f64,
}

impl Ring {
    /// Radius of the circle, m.
    pub(super) fn radius_m(&self) -> f64 {
        self.circle.radius
    }

    /// Angle of a point about the centre, rad, and whether it lies on the circle.
    pub(super) fn at(&self, point: [f64; 3]) -> (f64, bool) {
        let [x, y] = flat(self.plane.as_ref(), self.axes, point);
        let (dx, dy) = (x - self.circle.centre[0], y - self.circle.centre[1]);
        (
            dy.atan2(dx),
            (dx.hypot(dy) - self.circle.radius).abs() <= self.limit,
        )
    }
}

fn flat(plane: Option<&(Plane, f64)>, axes: [usize; 2], point: [f64; 3]) -> [f64; 2] {
    plane.map_or(axes.map(|axis| point[axis]), |(plane, flip)| {
        let [u, v] = plane.project(point);
        [u, flip * v]
    })
}

/// The circle of `radius_m` that most of the points are on; z may be empty.
pub(super) fn ring(points: &[Vec<f64>; 3], radius_m: f64) -> Option<Ring> {
    let moved = apart(points, STEP * radius_m);
    // Few points apart are an odd file, for the fit to refuse.
    let count = |points: &[Vec<f64>; 3]| points.iter().map(Vec::len).max().unwrap_or(0);
    let points = if count(&moved) >= 16 { &moved } else { points };
    let rows = count(points);
    let point = |k: usize| [0, 1, 2].map(|axis| points[axis].get(k).copied().unwrap_or(0.0));
    let mut used: Vec<usize> = (0..rows).collect();
    let axes = match points.each_ref().map(|axis| axis.is_empty()) {
        [true, ..] => [1, 2],
        [_, true, _] => [2, 0],
        _ => [0, 1],
    };
    if points.iter().any(Vec::is_empty) {
        let (circle, limit) = robust_circle(&points[axes[0]], &points[axes[1]], &used, radius_m)?;
        return Some(Ring {
            plane: None,
            axes,
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
            .map(|k| flat(plane.as_ref(), axes, point(k)))
            .map(|[u, v]| (u, v))
            .unzip();
        let (circle, limit) = robust_circle(&u, &v, used, radius_m)?;
        Some(Ring {
            plane,
            axes,
            circle,
            limit,
        })
    };
    let ring = fit(&used)?;
    // The plane of the circle alone: a lift before it has tilted the first one.
    used.retain(|&k| ring.at(point(k)).1);
    fit(&used)
}

/// The points that lie at least `step` from the one before.
fn apart(points: &[Vec<f64>; 3], step: f64) -> [Vec<f64>; 3] {
    let mut kept: [Vec<f64>; 3] = Default::default();
    let mut last: Option<usize> = None;
    for k in 0..points.iter().map(Vec::len).max().unwrap_or(0) {
        let from = |l: usize| -> f64 {
            let along = points.iter().filter(|axis| !axis.is_empty());
            along
                .map(|axis| (axis[k] - axis[l]).powi(2))
                .sum::<f64>()
                .sqrt()
        };
        if last.is_none_or(|l| from(l) >= step) {
            last = Some(k);
            kept.iter_mut()
                .zip(points)
                .for_each(|(to, axis)| to.extend(axis.get(k)));
        }
    }
    kept
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
