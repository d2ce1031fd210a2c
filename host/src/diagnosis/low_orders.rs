//! Low orders of the circle, orthonormal over the samples of one run.
//!
//! Between runs the low orders scatter by more than the noise within a run tells: the centre moves (order
//! 1), the size (order 0) and the oval (order 2) change from set-up to set-up. Giving each order a variance
//! of its own makes the run, not the sample, the unit of replication.
use super::vector::{axpys, dot, dots};
use crate::causes::Harmonics;
/// Highest order that may scatter between runs.
pub use crate::causes::ORDERS;

/// Columns: the mean, then cosine and sine of each order.
pub const COLUMNS: usize = 1 + 2 * ORDERS;

/// Columns in the order in which they are made orthogonal: the centre, which is the operator's, before the mean, so that
/// on an arc the size is what the centre cannot do.
const SEQUENCE: [usize; COLUMNS] = sequence();

const fn sequence() -> [usize; COLUMNS] {
    let mut out = [0; COLUMNS];
    let mut at = 3;
    (out[0], out[1], out[2]) = (1, 2, 0);
    while at < COLUMNS {
        out[at] = at;
        at += 1;
    }
    out
}

/// Columns that come before one in that order.
const fn earlier(column: usize) -> std::ops::Range<usize> {
    match column {
        0 => 1..3,
        1 | 2 => 1..column,
        _ => 0..column,
    }
}

/// Of a column that keeps so much of its length the rest is orthogonal at once.
const NEARLY_ALL: f64 = 0.9;

/// Coordinates in the low orders of one run.
pub type Low = [f64; COLUMNS];

/// Orthonormal columns and the triangle that made them.
#[derive(Clone, Debug)]
pub struct Basis {
    /// One column behind the other.
    columns: Vec<f64>,
    samples: usize,
    /// R of the QR factorisation, upper triangle.
    triangle: [Low; COLUMNS],
}

#[allow(
    clippy::needless_range_loop,
    reason = "columns, rows and orders are numbers here, not places in a list"
)]
impl Basis {
    /// Gram–Schmidt (twice where it takes much) on 1, cosθ, sinθ, …; a column that the earlier ones already span is left out as zero.
    pub fn new(angle_rad: &[f64]) -> Self {
        Self::masked(angle_rad, &[])
    }

    /// The same over part of the samples: columns are 0 where `hidden` is true (empty: nowhere).
    pub fn masked(angle_rad: &[f64], hidden: &[bool]) -> Self {
        let samples = angle_rad.len();
        let mut triangle = [[0.0; COLUMNS]; COLUMNS];
        let mut columns = waves(angle_rad, hidden);
        for k in SEQUENCE {
            let before = earlier(k);
            let (first, rest) = columns.split_at_mut(samples * if k == 0 { 1 } else { k });
            // The mean comes behind the centre, everything else behind what has a smaller number.
            let (column, earlier): (&mut [f64], &[f64]) = if k == 0 {
                (first, &rest[..before.len() * samples])
            } else {
                (
                    &mut rest[..samples],
                    &first[before.start * samples..before.end * samples],
                )
            };
            let length = dot(column, column).sqrt();
            let mut left = length;
            for _ in 0..2 {
                let last = left;
                let mut along = [0.0; COLUMNS];
                dots(earlier, column, &mut along[..before.len()]);
                axpys(&along.map(|a| -a)[..before.len()], earlier, column);
                for (j, along) in before.clone().zip(along) {
                    triangle[j][k] += along;
                }
                left = dot(column, column).sqrt();
                // What has lost little has lost no digits.
                if left > NEARLY_ALL * last {
                    break;
                }
            }
            if left > 1e-9 * length {
                column.iter_mut().for_each(|c| *c /= left);
                triangle[k][k] = left;
            } else {
                column.fill(0.0);
            }
        }
        Self {
            columns,
            samples,
            triangle,
        }
    }

    /// Coordinates of a vector of samples in the basis.
    pub fn coordinates(&self, samples: &[f64]) -> Low {
        let mut out = [0.0; COLUMNS];
        dots(&self.columns, samples, &mut out);
        out
    }

    /// Coordinates along the two columns of the first order: the centre.
    pub fn centre(&self, samples: &[f64]) -> [f64; 2] {
        let mut out = [0.0; 2];
        dots(&self.columns[self.samples..], samples, &mut out);
        out
    }

    /// Adds a vector of these coordinates to `samples`.
    pub fn add(&self, coordinates: &Low, samples: &mut [f64]) {
        axpys(coordinates, &self.columns, samples);
    }

    /// Takes the low orders out of `samples`; their coordinates.
    pub fn take_out(&self, samples: &mut [f64]) -> Low {
        let coordinates = self.coordinates(samples);
        self.add(&coordinates.map(|c| -c), samples);
        coordinates
    }

    /// Harmonics of the samples about the angle of the basis.
    pub fn harmonics(&self, samples: &[f64]) -> Harmonics {
        self.harmonics_of(&self.coordinates(samples))
    }

    /// The same from their coordinates.
    pub fn harmonics_of(&self, coordinates: &Low) -> Harmonics {
        let mut x = *coordinates;
        for (at, k) in SEQUENCE.into_iter().enumerate().rev() {
            let above: f64 = SEQUENCE[at + 1..]
                .iter()
                .map(|&j| self.triangle[k][j] * x[j])
                .sum();
            x[k] = if self.triangle[k][k] > 0.0 {
                (x[k] - above) / self.triangle[k][k]
            } else {
                0.0
            };
        }
        let mut out = Harmonics::default();
        out.0[0][0] = x[0];
        for order in 1..=ORDERS {
            out.0[order] = [x[2 * order - 1], x[2 * order]];
        }
        out
    }

    /// Coordinates of harmonics about the angle of the basis: the way back.
    pub fn coordinates_of(&self, harmonics: &Harmonics) -> Low {
        let mut out = [0.0; COLUMNS];
        for (order, [c, s]) in harmonics.0.into_iter().enumerate() {
            let first = (2 * order).saturating_sub(1);
            for (column, amount) in [(first, c), (first + 1, s)] {
                // Sine of the mean: there is none.
                if amount != 0.0 && !(order == 0 && column > 0) {
                    for row in earlier(column).chain([column]) {
                        out[row] += self.triangle[row][column] * amount;
                    }
                }
            }
        }
        out
    }
}

/// 1, cosθ, sinθ, cos2θ, …, one behind the other; 0 where hidden. By the addition theorem: eight steps of it lose less than
/// a digit of sixteen.
fn waves(angle_rad: &[f64], hidden: &[bool]) -> Vec<f64> {
    let samples = angle_rad.len();
    let mut columns = vec![0.0; COLUMNS * samples];
    for (i, angle) in angle_rad.iter().enumerate() {
        if hidden.get(i).copied().unwrap_or(false) {
            continue;
        }
        let (sin, cos) = angle.sin_cos();
        let (mut s, mut c) = (0.0, 1.0);
        columns[i] = 1.0;
        for order in 1..=ORDERS {
            (c, s) = (c * cos - s * sin, s * cos + c * sin);
            columns[(2 * order - 1) * samples + i] = c;
            columns[2 * order * samples + i] = s;
        }
    }
    columns
}

/// Order that a basis column belongs to.
pub const fn order_of(column: usize) -> usize {
    column.div_ceil(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn angles() -> Vec<f64> {
        (0..997).map(|i| 0.4 + f64::from(i) * 0.0063).collect()
    }

    #[test]
    fn waves_are_sines_and_cosines() {
        let angles = angles();
        let columns = waves(&angles, &[]);
        for (i, angle) in angles.iter().enumerate() {
            for order in 1..=ORDERS {
                let (sin, cos) = (order as f64 * angle).sin_cos();
                assert!((columns[(2 * order - 1) * angles.len() + i] - cos).abs() < 1e-14);
                assert!((columns[2 * order * angles.len() + i] - sin).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn harmonics_and_coordinates_are_two_ways_to_say_it() {
        let angles = angles();
        let hidden: Vec<bool> = (0..angles.len()).map(|i| i % 50 < 9).collect();
        let harmonics = Harmonics::mean(0.7)
            .with(1, [0.1, -0.2])
            .with(3, [0.0, 0.5])
            .with(8, [0.3, 0.0]);
        for hidden in [&[][..], &hidden] {
            let basis = Basis::masked(&angles, hidden);
            let mut samples: Vec<f64> = angles.iter().map(|angle| harmonics.at(*angle)).collect();
            for (sample, hidden) in samples.iter_mut().zip(hidden) {
                *sample = if *hidden { 0.0 } else { *sample };
            }
            let low = basis.coordinates(&samples);
            let said = basis.coordinates_of(&harmonics);
            assert!(
                low.iter().zip(&said).all(|(a, b)| (a - b).abs() < 1e-12),
                "{low:?} {said:?}"
            );
            let back = basis.harmonics_of(&said);
            assert!(
                back.0
                    .iter()
                    .zip(&harmonics.0)
                    .all(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-12)
            );
            assert_eq!(basis.take_out(&mut samples), low);
            assert!(samples.iter().all(|left| left.abs() < 1e-12));
        }
    }
}
