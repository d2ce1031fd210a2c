//! The geometric circle fit on all cores.
use super::simd_sums;
use giotto_shared::circle::{self, CircleError, CircleFit, Merge, Part, Points, Walk, Xy};
use rayon::prelude::*;

/// Blocks that one task sums.
const BLOCKS_A_TASK: usize = 64;

/// Points summed in chunks on all cores. Chunks are fixed and merged in order: the result is the same bit for
/// bit whatever the number of threads.
#[derive(Clone, Copy, Debug)]
pub struct Parallel<'a>(pub Xy<'a>);

impl Points for Parallel<'_> {
    fn count(&self) -> usize {
        self.0.count()
    }

    fn sum<P: Part>(&self, walk: Walk, part: &P) -> P::Sum {
        let (x, y) = (self.0.x(), self.0.y());
        let chunk = BLOCKS_A_TASK * walk.stride();
        if x.len() <= chunk {
            return simd_sums::sum(part, walk, x, y);
        }
        let parts: Vec<P::Sum> = x
            .par_chunks(chunk)
            .zip(y.par_chunks(chunk))
            .map(|(x, y)| simd_sums::sum(part, walk, x, y))
            .collect();
        let mut total = P::Sum::default();
        for part in &parts {
            total.merge(part);
        }
        total
    }
}

/// Least-squares circle through points with coordinates `x` and `y`, m.
///
/// # Errors
/// As [`circle::fit`]; also [`CircleError::Lengths`].
///
/// ```
/// use giotto::fit::fit_circle;
///
/// let (x, y): (Vec<f64>, Vec<f64>) = (0..1000)
///     .map(|i| f64::from(i) * 0.1)
///     .map(|angle| (0.3 + 0.1 * angle.cos(), -0.2 + 0.1 * angle.sin()))
///     .unzip();
/// let fit = fit_circle(&x, &y)?;
/// assert!((fit.circle.radius - 0.1).abs() < 1e-12);
/// assert!((fit.circle.centre[0] - 0.3).abs() < 1e-12);
/// # Ok::<(), giotto_shared::circle::CircleError>(())
/// ```
pub fn fit_circle(x: &[f64], y: &[f64]) -> Result<CircleFit, CircleError> {
    circle::fit(&Parallel(Xy::new(x, y)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use giotto_shared::circle::BLOCK;

    #[test]
    fn threads_and_none_give_the_same_bits() {
        let at = |i: usize| (i as f64 * 0.618).sin_cos();
        let (x, y): (Vec<f64>, Vec<f64>) = (0..3003)
            .map(|i| (at(i).0 + 1e-3 * at(7 * i).1, at(i).1))
            .unzip();
        assert_eq!(fit_circle(&x, &y), circle::fit(&Xy::new(&x, &y).unwrap()));
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bits() {
        let n = 25 * BLOCKS_A_TASK * BLOCK + 12345;
        let at = |i: usize| (i as f64 * 0.618).sin_cos();
        let (x, y): (Vec<f64>, Vec<f64>) = (0..n)
            .map(|i| (0.1 * at(i).0 + 1e-6 * at(7 * i).1, 0.1 * at(i).1))
            .unzip();
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| fit_circle(&x, &y).unwrap())
        };
        let one = with(1);
        for threads in [2, 3, 5] {
            assert_eq!(with(threads), one);
        }
    }
}
