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
    /// Neighbours among the runs given, in their order.
    stretches: Vec<&'a [Observation]>,
}

/// Radii ascending.
pub(super) fn by_radius<'a>(observations: &'a [Observation]) -> Vec<OfRadius<'a>> {
    let mut radii: Vec<f64> = Vec::new();
    // Runs of one radius mostly follow each other.
    let stretch = |runs: &'a [Observation]| Some((runs.first()?.radius_m, runs));
    let stretches: Vec<(f64, &[Observation])> = observations
        .chunk_by(|a, b| a.radius_m == b.radius_m)
        .filter_map(stretch)
        .collect();
    for (radius_m, _) in &stretches {
        if !radii[radii.len().saturating_sub(SEEN)..].contains(radius_m) {
            radii.push(*radius_m);
        }
    }
    radii.sort_by(f64::total_cmp);
    radii.dedup_by(|a, b| same_radius(*a, *b));
    let of = |&radius_m: &f64| OfRadius {
        radius_m,
        stretches: Vec::new(),
    };
    let mut groups: Vec<OfRadius<'a>> = radii.iter().map(of).collect();
    for (radius_m, stretch) in stretches {
        let at = radii.partition_point(|r| *r <= radius_m).saturating_sub(1);
        groups[at].stretches.push(stretch);
    }
    groups
}

impl<'a> OfRadius<'a> {
    /// In the order given.
    pub(super) fn runs(&self) -> impl Iterator<Item = &'a Observation> + Clone {
        self.stretches.iter().copied().flatten()
    }

    /// How many they are.
    pub(super) fn count(&self) -> usize {
        self.stretches.iter().map(|stretch| stretch.len()).sum()
    }

    /// Highest of the feeds that count as the lowest, m/s.
    pub(super) fn reference_m_s(&self) -> f64 {
        self.runs()
            .map(|o| o.feed_m_s)
            .fold(f64::INFINITY, f64::min)
            * (1.0 + SAME_FEED)
    }

    /// Mean radius error at the lowest feed, m.
    pub(super) fn lowest_m(&self) -> f64 {
        let highest = self.reference_m_s();
        mean(
            self.runs()
                .filter(|o| o.feed_m_s <= highest)
                .map(|o| o.radius_error_m),
        )
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
        let (off_m, count) = (lowest_m.unwrap_or(0.0), group.count());
        let reduce = |scales: [f64; WIDTH]| {
            let by = scales.map(f64::recip);
            let mut reduced = Reduced::new(WIDTH);
            // Nothing stands before the first column: no reflection changes it.
            reduced.block(0).fill(by[0]);
            let mut runs = group.runs();
            for first in (0..count).step_by(BLOCK_ROWS) {
                let rows = BLOCK_ROWS.min(count - first);
                let [_, x1, x2, y] = reduced.blocks();
                // A row comes before its run, so that none is taken for which there is no row.
                for (((x1, x2), y), o) in x1.iter_mut().zip(&mut *x2).zip(y).zip(&mut runs) {
                    *x1 = o.feed_m_s * o.feed_m_s;
                    *x2 = o.radius_m;
                    *y = (o.radius_error_m - off_m) * by[3];
                }
                // f²/R and f⁴/R³ of several runs at a time.
                for (x1, x2) in x1.iter_mut().zip(x2).take(rows) {
                    let per_m = 1.0 / *x2;
                    let f2_r = *x1 * per_m;
                    *x1 = f2_r * by[1];
                    *x2 = f2_r * f2_r * per_m * by[2];
                }
                reduced.take(rows);
            }
            // Further rows are rounding.
            std::array::from_fn(|i| {
                std::array::from_fn(|j| if i < count { reduced.at(i, j) } else { 0.0 })
            })
        };
        let plain = Self {
            r: reduce([1.0; WIDTH]),
            scales: [1.0; WIDTH],
            lowest_m,
            runs: count,
        };
        let safe = |j| {
            let norm = plain
                .r
                .iter()
                .map(|row| row[j] * row[j])
                .sum::<f64>()
                .sqrt();
            SAFE_NORMS.contains(&norm)
        };
        if (0..WIDTH).all(safe) {
            return plain;
        }
        let largest = group
            .runs()
            .map(|o| [1.0, o.f2_r(), o.f4_r3(), o.radius_error_m - off_m])
            .fold([0.0_f64; WIDTH], |top, row| {
                std::array::from_fn(|j| top[j].max(row[j].abs()))
            });
        let scales = largest.map(|top| if top > 0.0 { top } else { 1.0 });
        Self {
            r: reduce(scales),
            scales,
            ..plain
        }
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
    let scales: [f64; WIDTH] = std::array::from_fn(|j| {
        radii
            .iter()
            .map(|radius| radius.scales[j])
            .fold(0.0, f64::max)
    });
    let constants = radii
        .iter()
        .filter(|radius| radius.lowest_m.is_none())
        .count();
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
    let names = TERMS
        .into_iter()
        .chain(std::iter::repeat_n("the offset of a radius", constants));
    let scales = [x1, x2]
        .into_iter()
        .chain(std::iter::repeat_n(1.0, constants))
        .chain([y]);
    let runs = radii.iter().map(|radius| radius.runs).sum();
    Triangle::of_reduced(
        names.map(str::to_owned).collect(),
        r,
        scales.collect(),
        runs,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(radius_m: f64, feed_m_s: f64, radius_error_m: f64) -> Observation {
        Observation {
            radius_m,
            feed_m_s,
            radius_error_m,
            out_of_roundness_m: None,
        }
    }

    /// In turns, more than a block of each radius; errors times `size`.
    fn runs(size: f64) -> Vec<Observation> {
        let error = |k: usize| size * (1e-6 * (k as f64 * 0.618).sin() + 1e-5 * (k % 3) as f64);
        (0..3 * BLOCK_ROWS + 100)
            .map(|k| {
                run(
                    [0.3, 0.1, 0.15][k % 3],
                    0.02 + 0.68 * (k as f64 * 0.377).fract(),
                    error(k),
                )
            })
            .collect()
    }

    #[test]
    fn the_joined_triangle_solves_as_that_of_the_whole_matrix() {
        // Squares of the last two vanish and overflow.
        for size in [1.0, 1e-190, 1e190] {
            let runs = runs(size);
            let groups = by_radius(&runs);
            let reductions: Vec<Reduction> = groups
                .iter()
                .map(|group| Reduction::new(group, None))
                .collect();
            let column =
                |of: &dyn Fn(&Observation) -> f64| runs.iter().map(of).collect::<Vec<f64>>();
            let mut columns = vec![column(&Observation::f2_r), column(&Observation::f4_r3)];
            for group in &groups {
                columns.push(column(&|o| {
                    f64::from(u8::from(o.radius_m == group.radius_m))
                }));
            }
            let named: Vec<(&str, &[f64])> = columns.iter().map(|c| ("x", c.as_slice())).collect();
            let whole = Triangle::new(&named, &column(&|o| o.radius_error_m), false).unwrap();
            let joined = joined(&reductions.iter().collect::<Vec<_>>());
            for chosen in [&[2, 3, 4][..], &[2, 3, 4, 1], &[2, 3, 4, 0, 1]] {
                let (got, want) = (joined.solve(chosen).unwrap(), whole.solve(chosen).unwrap());
                assert_eq!(got.dof, want.dof);
                for j in 0..chosen.len() {
                    let off = got.coefficients[j] / want.coefficients[j] - 1.0;
                    assert!(off.abs() < 1e-11, "{size} {j}: {off}");
                    let off =
                        got.unscaled_covariance[(j, j)] / want.unscaled_covariance[(j, j)] - 1.0;
                    assert!(off.abs() < 1e-11, "{size} {j}: {off}");
                }
            }
        }
    }

    #[test]
    fn radii_that_differ_by_rounding_are_one_whatever_their_order() {
        let apart = 0.8e-9;
        // The third is too far from the first, however near to the second.
        let radii = [0.1, 0.1 + apart, 0.1 + 2.0 * apart, 0.3];
        for order in [[0, 1, 2, 3], [3, 2, 1, 0], [1, 3, 0, 2]] {
            let runs: Vec<Observation> = order
                .iter()
                .map(|&k| run(radii[k], 0.1, k as f64))
                .collect();
            let groups = by_radius(&runs);
            assert_eq!(
                groups.iter().map(|g| g.radius_m).collect::<Vec<_>>(),
                [radii[0], radii[2], radii[3]]
            );
            assert_eq!(
                groups.iter().map(|g| g.count()).collect::<Vec<_>>(),
                [2, 1, 1]
            );
        }
        assert!(by_radius(&[]).is_empty());
        assert_eq!(
            by_radius(&[run(f64::NAN, 0.1, 0.0), run(0.1, 0.1, 0.0)])[0].count(),
            2
        );
    }
}
