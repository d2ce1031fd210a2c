//! Low orders of the circle, orthonormal over the samples of one run.
//!
//! Between runs the low orders scatter by more than the noise within a run tells: the centre moves (order
//! 1), the size (order 0) and the oval (order 2) change from set-up to set-up. Giving each order a variance
//! of its own makes the run, not the sample, the unit of replication.

/// Highest order that may scatter between runs.
pub const ORDERS: usize = 8;
/// Columns: the mean, then cosine and sine of each order.
pub const COLUMNS: usize = 1 + 2 * ORDERS;

/// Orthonormal columns and the triangle that made them.
#[derive(Clone, Debug)]
pub struct Basis {
    /// Column k at sample i: `columns[k][i]`.
    columns: Vec<Vec<f64>>,
    /// R of the QR factorisation, upper triangle.
    triangle: [[f64; COLUMNS]; COLUMNS],
}

#[allow(
    clippy::needless_range_loop,
    reason = "columns, rows and orders are numbers here, not places in a list"
)]
impl Basis {
    /// Gram–Schmidt (twice) on 1, cosθ, sinθ, …; a column that the earlier ones already span is left out as zero.
    pub fn new(angle_rad: &[f64]) -> Self {
        Self::masked(angle_rad, &[])
    }

    /// The same over part of the samples: columns are 0 where `hidden` is true (empty: nowhere).
    pub fn masked(angle_rad: &[f64], hidden: &[bool]) -> Self {
        let mut columns: Vec<Vec<f64>> = Vec::with_capacity(COLUMNS);
        let mut triangle = [[0.0; COLUMNS]; COLUMNS];
        for k in 0..COLUMNS {
            let order = k.div_ceil(2) as f64;
            let mut column: Vec<f64> = match k {
                0 => vec![1.0; angle_rad.len()],
                _ if k % 2 == 1 => angle_rad.iter().map(|a| (order * a).cos()).collect(),
                _ => angle_rad.iter().map(|a| (order * a).sin()).collect(),
            };
            for (value, hidden) in column.iter_mut().zip(hidden) {
                if *hidden {
                    *value = 0.0;
                }
            }
            let length = dot(&column, &column).sqrt();
            for _ in 0..2 {
                for (j, earlier) in columns.iter().enumerate() {
                    let along = dot(&column, earlier);
                    triangle[j][k] += along;
                    axpy(-along, earlier, &mut column);
                }
            }
            let left = dot(&column, &column).sqrt();
            if left > 1e-9 * length {
                column.iter_mut().for_each(|c| *c /= left);
                triangle[k][k] = left;
            } else {
                column.fill(0.0);
            }
            columns.push(column);
        }
        Self { columns, triangle }
    }

    /// Coordinates of a vector of samples in the basis.
    pub fn coordinates(&self, samples: &[f64]) -> [f64; COLUMNS] {
        let mut out = [0.0; COLUMNS];
        for (out, column) in out.iter_mut().zip(&self.columns) {
            *out = dot(column, samples);
        }
        out
    }

    /// Adds `amount` of basis column `k` to `samples`.
    pub fn add(&self, k: usize, amount: f64, samples: &mut [f64]) {
        axpy(amount, &self.columns[k], samples);
    }

    /// Length of a column of ones over the samples seen.
    pub fn length_of_ones(&self) -> f64 {
        self.triangle[0][0]
    }

    /// Harmonics of the samples: `[mean, 0]`, then `[cos, sin]` of each order.
    pub fn harmonics(&self, samples: &[f64]) -> [[f64; 2]; ORDERS + 1] {
        self.harmonics_of(self.coordinates(samples))
    }

    /// The same from their coordinates.
    pub fn harmonics_of(&self, coordinates: [f64; COLUMNS]) -> [[f64; 2]; ORDERS + 1] {
        let mut x = coordinates;
        for k in (0..COLUMNS).rev() {
            let above: f64 = (k + 1..COLUMNS).map(|j| self.triangle[k][j] * x[j]).sum();
            x[k] = if self.triangle[k][k] > 0.0 { (x[k] - above) / self.triangle[k][k] } else { 0.0 };
        }
        let mut out = [[0.0; 2]; ORDERS + 1];
        out[0][0] = x[0];
        for order in 1..=ORDERS {
            out[order] = [x[2 * order - 1], x[2 * order]];
        }
        out
    }
}

/// Order that a basis column belongs to.
pub const fn order_of(column: usize) -> usize {
    column.div_ceil(2)
}

/// Sums that run side by side in a scalar product: additions of one sum wait for each other.
const LANES: usize = 16;

/// Scalar product.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    let (a_lanes, b_lanes) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f64 = a_lanes.remainder().iter().zip(b_lanes.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a_lanes.zip(b_lanes) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// y += a·x.
pub fn axpy(a: f64, x: &[f64], y: &mut [f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += a * x;
    }
}
