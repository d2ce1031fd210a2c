//! Tall matrices brought to a triangle block by block (Householder), in two buffers that are allocated once.
//!
//! A block of rows under the triangle so far is reduced column by column: a reflection of column j touches row j of the
//! triangle and the rows of the block, nothing else, for what lies between is zero. Sums run in eight lanes whose
//! number is fixed, so the result does not depend on the processor.
use nalgebra::DMatrix;

/// Rows that are reduced at a time: with a dozen columns they stay in the L1 cache.
pub(super) const BLOCK_ROWS: usize = 256;
const LANES: usize = 8;

/// The triangle of all rows so far.
pub(super) struct Reduced {
    width: usize,
    /// Row by row, upper part.
    triangle: Vec<f64>,
    /// Column by column, [`BLOCK_ROWS`] each.
    rows: Vec<f64>,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    for (a, b) in a.iter().zip(b) {
        for ((lane, a), b) in lanes.iter_mut().zip(a).zip(b) {
            *lane += a * b;
        }
    }
    lanes.iter().sum::<f64>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f64>()
}

impl Reduced {
    pub(super) fn new(width: usize) -> Self {
        Self { width, triangle: vec![0.0; width * width], rows: vec![0.0; width * BLOCK_ROWS] }
    }

    /// Where the next rows of a column go.
    pub(super) fn block(&mut self, column: usize) -> &mut [f64] {
        &mut self.rows[column * BLOCK_ROWS..(column + 1) * BLOCK_ROWS]
    }

    /// Takes in the first `count` rows of the block.
    pub(super) fn take(&mut self, count: usize) {
        let width = self.width;
        for j in 0..width {
            let (own, rest) = self.rows[j * BLOCK_ROWS..].split_at_mut(BLOCK_ROWS);
            let own = &own[..count];
            let below = dot(own, own);
            if below == 0.0 {
                continue;
            }
            let head = self.triangle[j * width + j];
            let length = (head * head + below).sqrt();
            let corner = if head > 0.0 { -length } else { length };
            // v = (head − corner, own); 2/vᵀv = 1/(length² − head·corner).
            let first = head - corner;
            let twice = 1.0 / (length * length - head * corner);
            self.triangle[j * width + j] = corner;
            for (k, column) in rest.chunks_exact_mut(BLOCK_ROWS).enumerate() {
                let column = &mut column[..count];
                let above = &mut self.triangle[j * width + j + 1 + k];
                let along = twice * (first * *above + dot(own, column));
                *above -= along * first;
                column.iter_mut().zip(own).for_each(|(c, v)| *c -= along * v);
            }
        }
    }

    /// The first `rows` rows of the triangle.
    pub(super) fn triangle(&self, rows: usize) -> DMatrix<f64> {
        DMatrix::from_fn(rows, self.width, |i, j| if j < i { 0.0 } else { self.triangle[i * self.width + j] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_triangle_is_that_of_the_whole_matrix() {
        for (rows, width) in [(3, 5), (40, 4), (BLOCK_ROWS + 1, 6), (5 * BLOCK_ROWS + 77, 3)] {
            let value = |i: usize, j: usize| {
                ((i * 37 + j * 101) as f64 * 0.618).sin() + if i == j { 2.0 } else { 0.0 }
            };
            let mut reduced = Reduced::new(width);
            for start in (0..rows).step_by(BLOCK_ROWS) {
                let count = BLOCK_ROWS.min(rows - start);
                for j in 0..width {
                    reduced
                        .block(j)
                        .iter_mut()
                        .take(count)
                        .enumerate()
                        .for_each(|(i, to)| *to = value(start + i, j));
                }
                reduced.take(count);
            }
            let whole = DMatrix::from_fn(rows, width, value);
            let r = reduced.triangle(rows.min(width));
            // RᵀR = AᵀA, whatever the signs of the rows.
            let off = (r.transpose() * &r - whole.transpose() * &whole).amax();
            assert!(off <= 1e-12 * rows as f64, "{rows} × {width}: {off}");
        }
    }
}
