//! Point sets that can be walked again and again.
use super::CircleError;

/// Number of points that a source hands out at a time: two arrays of it sit in the L1 cache.
pub const BLOCK: usize = 512;

/// A sum that can be built from parts. Merging is done in the order of the points, so that a result
/// depends on the points alone and not on who summed which part.
pub trait Merge: Default + Send {
    /// Adds what `other` holds; `other` comes after `self`.
    fn merge(&mut self, other: &Self);
}

/// A finite sequence of points in the plane that may be walked more than once.
pub trait Points {
    /// Number of points.
    fn count(&self) -> usize;

    /// Calls `part` on consecutive blocks (x and y of equal length, at most [`BLOCK`]) and merges the results in order.
    fn sum<S: Merge>(&self, part: impl Fn(&[f64], &[f64]) -> S + Sync) -> S;

    /// The point at `index` (< [`count`](Self::count)), where it can be had without walking; `None` otherwise. Lets a fit
    /// of very many points start from a few of them.
    fn at(&self, index: usize) -> Option<[f64; 2]> {
        let _ = index;
        None
    }
}

/// Points as two slices of equal length. The fastest source.
#[derive(Clone, Copy, Debug)]
pub struct Xy<'a> {
    x: &'a [f64],
    y: &'a [f64],
}

impl<'a> Xy<'a> {
    /// Pairs up two slices.
    ///
    /// # Errors
    /// [`CircleError::Lengths`] when they differ in length.
    pub fn new(x: &'a [f64], y: &'a [f64]) -> Result<Self, CircleError> {
        if x.len() == y.len() {
            Ok(Self { x, y })
        } else {
            Err(CircleError::Lengths { x: x.len(), y: y.len() })
        }
    }

    /// All x.
    pub fn x(&self) -> &'a [f64] {
        self.x
    }

    /// All y.
    pub fn y(&self) -> &'a [f64] {
        self.y
    }
}

impl Points for Xy<'_> {
    fn count(&self) -> usize {
        self.x.len()
    }

    fn sum<S: Merge>(&self, part: impl Fn(&[f64], &[f64]) -> S + Sync) -> S {
        let mut total = S::default();
        for (x, y) in self.x.chunks(BLOCK).zip(self.y.chunks(BLOCK)) {
            total.merge(&part(x, y));
        }
        total
    }

    fn at(&self, index: usize) -> Option<[f64; 2]> {
        Some([*self.x.get(index)?, *self.y.get(index)?])
    }
}

impl Points for [[f64; 2]] {
    fn count(&self) -> usize {
        self.len()
    }

    fn sum<S: Merge>(&self, part: impl Fn(&[f64], &[f64]) -> S + Sync) -> S {
        Sampled::new(self.len(), |i| self[i]).sum(part)
    }
}

/// Points computed from their index on each walk: nothing is stored.
#[derive(Clone, Copy, Debug)]
pub struct Sampled<F> {
    count: usize,
    at: F,
}

impl<F: Fn(usize) -> [f64; 2]> Sampled<F> {
    /// Points `at(0)` … `at(count − 1)`; `at` must give the same point for the same index every time.
    pub fn new(count: usize, at: F) -> Self {
        Self { count, at }
    }
}

impl<F: Fn(usize) -> [f64; 2]> Points for Sampled<F> {
    fn count(&self) -> usize {
        self.count
    }

    fn sum<S: Merge>(&self, part: impl Fn(&[f64], &[f64]) -> S + Sync) -> S {
        let mut total = S::default();
        let (mut x, mut y) = ([0.0; BLOCK], [0.0; BLOCK]);
        for start in (0..self.count).step_by(BLOCK) {
            let len = BLOCK.min(self.count - start);
            for (i, (x, y)) in x[..len].iter_mut().zip(&mut y[..len]).enumerate() {
                [*x, *y] = (self.at)(start + i);
            }
            total.merge(&part(&x[..len], &y[..len]));
        }
        total
    }

    fn at(&self, index: usize) -> Option<[f64; 2]> {
        Some((self.at)(index))
    }
}
