//! The geometric circle fit on all cores.
use giotto_shared::circle::{self, BLOCK, CircleError, CircleFit, Merge, Points, Xy};
use rayon::prelude::*;

/// Points that one task sums. A whole number of blocks, so that the blocks are the same as without threads.
pub const PARALLEL_CHUNK: usize = 64 * BLOCK;

/// Points summed in chunks on all cores. Chunks are fixed and merged in order: the result is the same bit for
/// bit whatever the number of threads.
#[derive(Clone, Copy, Debug)]
pub struct Parallel<'a>(pub Xy<'a>);

impl Points for Parallel<'_> {
    fn count(&self) -> usize {
        self.0.count()
    }

    fn at(&self, index: usize) -> Option<[f64; 2]> {
        self.0.at(index)
    }

    fn sum<S: Merge>(&self, part: impl Fn(&[f64], &[f64]) -> S + Sync) -> S {
        let chunk = |(x, y): (&[f64], &[f64])| {
            let mut total = S::default();
            for (x, y) in x.chunks(BLOCK).zip(y.chunks(BLOCK)) {
                total.merge(&part(x, y));
            }
            total
        };
        let (x, y) = (self.0.x(), self.0.y());
        if x.len() <= PARALLEL_CHUNK {
            return chunk((x, y));
        }
        let parts: Vec<S> =
            x.par_chunks(PARALLEL_CHUNK).zip(y.par_chunks(PARALLEL_CHUNK)).map(chunk).collect();
        let mut total = S::default();
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
pub fn fit_circle(x: &[f64], y: &[f64]) -> Result<CircleFit, CircleError> {
    circle::fit(&Parallel(Xy::new(x, y)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_and_none_give_the_same_bits() {
        let at = |i: usize| (i as f64 * 0.618).sin_cos();
        let (x, y): (Vec<f64>, Vec<f64>) = (0..3000).map(|i| (at(i).0 + 1e-3 * at(7 * i).1, at(i).1)).unzip();
        assert_eq!(fit_circle(&x, &y), circle::fit(&Xy::new(&x, &y).unwrap()));
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bits() {
        let n = 5 * PARALLEL_CHUNK + 12345;
        let at = |i: usize| (i as f64 * 0.618).sin_cos();
        let (x, y): (Vec<f64>, Vec<f64>) =
            (0..n).map(|i| (0.1 * at(i).0 + 1e-6 * at(7 * i).1, 0.1 * at(i).1)).unzip();
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| fit_circle(&x, &y).unwrap())
        };
        let one = with(1);
        for threads in [2, 3, 5] {
            assert_eq!(with(threads), one);
        }
    }
}
