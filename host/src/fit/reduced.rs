//! Tall matrices brought to a triangle block by block (Householder), in two buffers that are allocated once.
//!
//! A block of rows under the triangle so far is reduced column by column: a reflection of column j touches row j of the
//! triangle and the rows of the block, nothing else, for what lies between is zero. Sums run in sixteen lanes whose
//! number is fixed, every product rounded before it is added, so the result does not depend on the processor.
use nalgebra::DMatrix;
use pulp::{Arch, Simd, WithSimd};

/// Rows that are reduced at a time: with a dozen columns they stay in the L1 cache.
pub(super) const BLOCK_ROWS: usize = 256;
const LANES: usize = 16;

/// The triangle of all rows so far.
pub(super) struct Reduced {
    width: usize,
    /// Row by row, upper part.
    triangle: Vec<f64>,
    /// Column by column, [`BLOCK_ROWS`] each.
    rows: Vec<f64>,
}

#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    for (a, b) in a.iter().zip(b) {
        for lane in 0..LANES {
            lanes[lane] += a[lane] * b[lane];
        }
    }
    lanes.iter().sum::<f64>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f64>()
}

impl Reduced {
    pub(super) fn new(width: usize) -> Self {
        Self {
            width,
            triangle: vec![0.0; width * width],
            rows: vec![0.0; width * BLOCK_ROWS],
        }
    }

    /// Where the next rows of a column go.
    pub(super) fn block(&mut self, column: usize) -> &mut [f64] {
        &mut self.rows[column * BLOCK_ROWS..(column + 1) * BLOCK_ROWS]
    }

    /// Where the next rows of the first `N` columns go.
    pub(super) fn blocks<const N: usize>(&mut self) -> [&mut [f64]; N] {
        let mut columns = self.rows.chunks_exact_mut(BLOCK_ROWS);
        std::array::from_fn(|_| columns.next().unwrap_or_default())
    }

    /// Takes in the first `count` rows of the block.
    pub(super) fn take(&mut self, count: usize) {
        Arch::new().dispatch(Take(self, count));
    }

    /// Row `i`, column `j` of the triangle.
    pub(super) fn at(&self, i: usize, j: usize) -> f64 {
        if j < i {
            0.0
        } else {
            self.triangle[i * self.width + j]
        }
    }

    /// The first `rows` rows of the triangle.
    pub(super) fn triangle(&self, rows: usize) -> DMatrix<f64> {
        DMatrix::from_fn(rows, self.width, |i, j| self.at(i, j))
    }
}

/// What is dispatched has to be inlined into the function that may use all of the processor.
struct Take<'a>(&'a mut Reduced, usize);

impl WithSimd for Take<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self(reduced, count) = self;
        let width = reduced.width;
        for j in 0..width {
            let (own, rest) = reduced.rows[j * BLOCK_ROWS..].split_at_mut(BLOCK_ROWS);
            let own = &own[..count];
            let below = dot(own, own);
            if below == 0.0 {
                continue;
            }
            let head = reduced.triangle[j * width + j];
            let length = (head * head + below).sqrt();
            let corner = if head > 0.0 { -length } else { length };
            // v = (head − corner, own); 2/vᵀv = 1/(length² − head·corner).
            let first = head - corner;
            let twice = 1.0 / (length * length - head * corner);
            reduced.triangle[j * width + j] = corner;
            for (k, column) in rest.chunks_exact_mut(BLOCK_ROWS).enumerate() {
                let column = &mut column[..count];
                let above = &mut reduced.triangle[j * width + j + 1 + k];
                let along = twice * (first * *above + dot(own, column));
                *above -= along * first;
                column
                    .iter_mut()
                    .zip(own)
                    .for_each(|(c, v)| *c -= along * v);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_triangle_is_that_of_the_whole_matrix() {
        for (rows, width) in [
            (3, 5),
            (40, 4),
            (BLOCK_ROWS + 1, 6),
            (5 * BLOCK_ROWS + 77, 3),
        ] {
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
