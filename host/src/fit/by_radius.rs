//! Runs by radius, and the triangle of each radius: all that a fit, on whichever radii, has to know of the runs.
use super::least_squares::Triangle;
use super::radius::{Observation, TERMS};
use super::reduced::{BLOCK_ROWS, Reduced};
use nalgebra::DMatrix;

/// Programmed radii closer than this are one radius, m.
const SAME_RADIUS_M: f64 = 1e-9;
/// Feeds closer than this share are one feed.
const SAME_FEED: f64 = 1e-9;
/// A radius is looked for among so many that were seen last before it counts as new: campaigns go in turns.
const SEEN: usize = 8;
/// Squares of columns with norms in between neither overflow nor vanish.
const SAFE_NORMS: std::ops::Range<f64> = 1e-120..1e120;
/// 1, f²/R, f⁴/R³, radius error.
const WIDTH: usize = 4;

/// Whether two programmed radii are the same.
pub(super) fn same_radius(a: f64, b: f64) -> bool {
    (a - b).abs() <= SAME_RADIUS_M
}

/// The runs of one radius.
pub(super) struct OfRadius<'a> {
    /// The smallest of its radii, which differ by rounding at most, m.
    pub radius_m: f64,
    /// In the order given.
    pub runs: Vec<&'a Observation>,
}

/// Radii ascending.
pub(super) fn by_radius(observations: &[Observation]) -> Vec<OfRadius<'_>> {
    let mut radii: Vec<f64> = Vec::new();
    for o in observations {
        if !radii[radii.len().saturating_sub(SEEN)..].contains(&o.radius_m) {
            radii.push(o.radius_m);
        }
    }
    radii.sort_by(f64::total_cmp);
    radii.dedup_by(|a, b| same_radius(*a, *b));
    let room = observations.len() / radii.len().max(1) + 1;
    let of = |&radius_m: &f64| OfRadius { radius_m, runs: Vec::with_capacity(room) };
    let mut groups: Vec<OfRadius<'_>> = radii.iter().map(of).collect();
    let (mut at, mut own) = (0, f64::INFINITY..f64::INFINITY);
    for o in observations {
        if !own.contains(&o.radius_m) {
            at = radii.partition_point(|r| *r <= o.radius_m).saturating_sub(1);
            own = radii[at]..radii.get(at + 1).copied().unwrap_or(f64::INFINITY);
        }
        groups[at].runs.push(o);
    }
    groups
}

impl OfRadius<'_> {
    /// Highest of the feeds that count as the lowest, m/s.
    pub(super) fn reference_m_s(&self) -> f64 {
        self.runs.iter().map(|o| o.feed_m_s).fold(f64::INFINITY, f64::min) * (1.0 + SAME_FEED)
    }

    /// Mean radius error at the lowest feed, m.
    pub(super) fn lowest_m(&self) -> f64 {
        let highest = self.reference_m_s();
        mean(self.runs.iter().filter(|o| o.feed_m_s <= highest).map(|o| o.radius_error_m))
    }
}

/// Mean.
pub(super) fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), v| (sum + v, n + 1.0));
    sum / n
}

/// R of [1, f²/R, f⁴/R³, radius error] over the runs of one radius, each column divided by its scale.
pub(super) struct Reduction {
    r: [[f64; WIDTH]; WIDTH],
    scales: [f64; WIDTH],
    /// Mean radius error at the lowest feed, m, if that is what is taken off.
    pub lowest_m: Option<f64>,
    pub runs: usize,
}

impl Reduction {
    /// `lowest_m` is taken off each radius error.
    pub(super) fn new(group: &OfRadius<'_>, lowest_m: Option<f64>) -> Self {
        let columns =
            |o: &Observation| [1.0, o.f2_r(), o.f4_r3(), o.radius_error_m - lowest_m.unwrap_or(0.0)];
        let reduce = |scales: [f64; WIDTH]| {
            let by = scales.map(f64::recip);
            let mut reduced = Reduced::new(WIDTH);
            for runs in group.runs.chunks(BLOCK_ROWS) {
                let blocks = reduced.blocks::<WIDTH>();
                for (i, o) in runs.iter().enumerate() {
                    let row = columns(o);
                    for j in 0..WIDTH {
                        blocks[j][i] = row[j] * by[j];
                    }
                }
                reduced.take(runs.len());
            }
            // Further rows are rounding.
            std::array::from_fn(|i| {
                std::array::from_fn(|j| if i < group.runs.len() { reduced.at(i, j) } else { 0.0 })
            })
        };
        let plain = Self { r: reduce([1.0; WIDTH]), scales: [1.0; WIDTH], lowest_m, runs: group.runs.len() };
        let safe = |j| {
            let norm = plain.r.iter().map(|row| row[j] * row[j]).sum::<f64>().sqrt();
            SAFE_NORMS.contains(&norm)
        };
        if (0..WIDTH).all(safe) {
            return plain;
        }
        let largest = group
            .runs
            .iter()
            .map(|o| columns(o))
            .fold([0.0_f64; WIDTH], |top, row| std::array::from_fn(|j| top[j].max(row[j].abs())));
        let scales = largest.map(|top| if top > 0.0 { top } else { 1.0 });
        Self { r: reduce(scales), scales, ..plain }
    }

    /// Whether all numbers in it are.
    pub(super) fn is_finite(&self) -> bool {
        self.r.iter().flatten().all(|v| v.is_finite())
    }
}

/// The triangle of all runs of `radii`: columns f²/R, f⁴/R³ and, unless the offsets have been taken off, one constant per
/// radius.
///
/// Constants of different radii have no run in common: the first row of each radius is a row of the whole, and only the
/// others have to be reduced further.
pub(super) fn joined(radii: &[&Reduction]) -> Triangle {
    let scales: [f64; WIDTH] =
        std::array::from_fn(|j| radii.iter().map(|radius| radius.scales[j]).fold(0.0, f64::max));
    let constants = radii.iter().filter(|radius| radius.lowest_m.is_none()).count();
    let last = 2 + constants;
    let mut r = DMatrix::zeros(constants + 3, constants + 3);
    let mut reduced = Reduced::new(3);
    for (k, radius) in radii.iter().enumerate() {
        let row = |i: usize| -> [f64; WIDTH] {
            std::array::from_fn(|j| radius.r[i][j] * (radius.scales[j] / scales[j]))
        };
        let own = usize::from(radius.lowest_m.is_none());
        if own == 1 {
            let [one, x1, x2, y] = row(0);
            for (column, value) in [(2 + k, one), (0, x1), (1, x2), (last, y)] {
                r[(k, column)] = value;
            }
        }
        for i in own..WIDTH {
            let [_, x1, x2, y] = row(i);
            for (column, value) in [x1, x2, y].into_iter().enumerate() {
                reduced.block(column)[i - own] = value;
            }
        }
        reduced.take(WIDTH - own);
    }
    for i in 0..3 {
        for (j, column) in [0, 1, last].into_iter().enumerate() {
            r[(constants + i, column)] = reduced.at(i, j);
        }
    }
    let [_, x1, x2, y] = scales;
    let names = TERMS.into_iter().chain(std::iter::repeat_n("the offset of a radius", constants));
    let scales = [x1, x2].into_iter().chain(std::iter::repeat_n(1.0, constants)).chain([y]);
    let runs = radii.iter().map(|radius| radius.runs).sum();
    Triangle::of_reduced(names.map(str::to_owned).collect(), r, scales.collect(), runs)
}
