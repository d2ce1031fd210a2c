//! Sums over points, four at a time.
//!
//! Four independent lanes hide the latency of the adder and fill the vector registers. Their number is fixed, and every
//! product is rounded before it is added, so the bits are the same on every processor. What a processor can do beyond
//! the least of its kind is known only where the program runs: [`Lanes`] leaves that to the caller, and [`Portable`] is
//! what this crate is compiled for. Written with explicit vectors because the compiler does not find them by itself here.
use core::ops::{Add, Div, Mul, Sub};
use wide::f64x4;

/// Four numbers that are worked on at once.
pub trait Four:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// Square roots.
    fn sqrt(self) -> Self;
    /// The larger ones; `other` where one of a pair is not a number.
    fn max(self, other: Self) -> Self;
    /// The four by themselves.
    fn to_array(self) -> [f64; 4];
}

/// How a processor makes and works on [`Four`].
pub trait Lanes: Copy {
    /// Its four numbers.
    type Four: Four;
    /// Takes up four numbers.
    fn four(self, numbers: [f64; 4]) -> Self::Four;
    /// One number, four times.
    #[inline(always)]
    fn splat(self, number: f64) -> Self::Four {
        self.four([number; 4])
    }
}

/// What every processor has that this crate is compiled for.
#[derive(Clone, Copy, Debug)]
pub struct Portable;

impl Lanes for Portable {
    type Four = f64x4;

    #[inline(always)]
    fn four(self, numbers: [f64; 4]) -> f64x4 {
        f64x4::new(numbers)
    }
}

impl Four for f64x4 {
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.fast_max(other)
    }

    #[inline(always)]
    fn to_array(self) -> [f64; 4] {
        self.to_array()
    }
}

/// Quantities of a point that are summed.
pub(super) trait Terms<const N: usize> {
    /// Those of four points. Has to be inlined always, as [`Part::of`](super::Part::of).
    fn of<L: Lanes>(&self, lanes: L, x: L::Four, y: L::Four) -> [L::Four; N];
}

/// Sums over the points (`x`, `y`), of equal length.
#[inline(always)]
pub(super) fn sums<L: Lanes, const N: usize>(
    lanes: L,
    x: &[f64],
    y: &[f64],
    terms: &impl Terms<N>,
) -> [f64; N] {
    let (x4, x_rest) = x.as_chunks::<4>();
    let (y4, y_rest) = y.as_chunks::<4>();
    let mut totals = [lanes.splat(0.0); N];
    for (x, y) in x4.iter().zip(y4) {
        let of_four = terms.of(lanes, lanes.four(*x), lanes.four(*y));
        for k in 0..N {
            totals[k] = totals[k] + of_four[k];
        }
    }
    let mut sums = totals.map(|total| total.to_array().iter().sum::<f64>());
    for (x, y) in x_rest.iter().zip(y_rest) {
        let of_one = terms.of(lanes, lanes.splat(*x), lanes.splat(*y));
        for k in 0..N {
            sums[k] += of_one[k].to_array()[0];
        }
    }
    sums
}
