//! Point sets that can be walked again and again.
use super::CircleError;
use super::lanes::{Lanes, Portable};

/// Number of points that a source hands out at a time: two arrays of it sit in the L1 cache.
pub const BLOCK: usize = 512;

/// A sum that can be built from parts. Merging is done in the order of the points, so that a result
/// depends on the points alone and not on who summed which part.
pub trait Merge: Default + Send {
    /// Adds what `other` holds; `other` comes after `self`.
    fn merge(&mut self, other: &Self);
}

/// Which points are walked over: the first `run` of each `of`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Walk {
    run: usize,
    of: usize,
}

impl Walk {
    /// All points.
    pub const ALL: Self = Self {
        run: BLOCK,
        of: BLOCK,
    };

    /// The first `run` of each `of` points; 1 ≤ `run` ≤ [`BLOCK`], and `of` is no less.
    pub(super) const fn some(run: usize, of: usize) -> Self {
        assert!(run >= 1 && run <= BLOCK && of >= run);
        Self { run, of }
    }

    /// Points from one block to the next.
    pub const fn stride(self) -> usize {
        self.of
    }

    /// The blocks of the points (`x`, `y`), x and y of equal length.
    #[inline(always)]
    pub fn blocks<'a>(
        self,
        x: &'a [f64],
        y: &'a [f64],
    ) -> impl Iterator<Item = (&'a [f64], &'a [f64])> {
        x.chunks(self.of).zip(y.chunks(self.of)).map(move |(x, y)| {
            let run = self.run.min(x.len());
            (&x[..run], &y[..run])
        })
    }
}

/// What is summed over points.
pub trait Part: Sync {
    /// Its sum.
    type Sum: Merge;

    /// The sum over one block of points, x and y of equal length. Has to be inlined always: what a processor can do
    /// beyond the least of its kind holds only within the function that asked it.
    fn of<L: Lanes>(&self, lanes: L, x: &[f64], y: &[f64]) -> Self::Sum;
}

/// The sum over the blocks of a walk over the points (`x`, `y`), in order.
#[inline(always)]
pub fn sum_blocks<P: Part, L: Lanes>(
    part: &P,
    lanes: L,
    walk: Walk,
    x: &[f64],
    y: &[f64],
) -> P::Sum {
    let mut total = P::Sum::default();
    for (x, y) in walk.blocks(x, y) {
        total.merge(&part.of(lanes, x, y));
    }
    total
}

/// A finite sequence of points in the plane that may be walked more than once.
pub trait Points {
    /// Number of points.
    fn count(&self) -> usize;

    /// Sums `part` over the blocks of a walk and merges the results in order.
    fn sum<P: Part>(&self, walk: Walk, part: &P) -> P::Sum;
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
            Err(CircleError::Lengths {
                x: x.len(),
                y: y.len(),
            })
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

    fn sum<P: Part>(&self, walk: Walk, part: &P) -> P::Sum {
        sum_blocks(part, Portable, walk, self.x, self.y)
    }
}

impl Points for [[f64; 2]] {
    fn count(&self) -> usize {
        self.len()
    }

    fn sum<P: Part>(&self, walk: Walk, part: &P) -> P::Sum {
        Sampled::new(self.len(), |i| self[i]).sum(walk, part)
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

    fn sum<P: Part>(&self, walk: Walk, part: &P) -> P::Sum {
        let mut total = P::Sum::default();
        let (mut x, mut y) = ([0.0; BLOCK], [0.0; BLOCK]);
        for start in (0..self.count).step_by(walk.of) {
            let len = walk.run.min(self.count - start);
            for (i, (x, y)) in x[..len].iter_mut().zip(&mut y[..len]).enumerate() {
                [*x, *y] = (self.at)(start + i);
            }
            total.merge(&part.of(Portable, &x[..len], &y[..len]));
        }
        total
    }
}
