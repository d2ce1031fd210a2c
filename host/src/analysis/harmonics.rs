//! Fourier coefficients of a profile sampled at any angles, by least squares.
//!
//! With even spacing this is the discrete Fourier transform; with uneven spacing the orders are solved
//! together. The normal matrix needs only Σcos mφ and Σsin mφ up to twice the highest order, for
//! cos jφ·cos kφ = ½[cos(j−k)φ + cos(j+k)φ]: one pass, constant memory.
use super::points::Polar;
use giotto_shared::circle::Merge;
use nalgebra::{DMatrix, DVector};

/// Highest order reported for a full turn of enough samples.
pub const HIGHEST_ORDER: usize = 16;
const MOMENTS: usize = 2 * HIGHEST_ORDER + 1;
/// Samples that each order needs.
const SAMPLES_AN_ORDER: usize = 4;

/// One order of the profile about the least-squares circle: `cos·cos(kθ) + sin·sin(kθ)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Harmonic {
    /// k.
    pub order: usize,
    /// Cosine amplitude, m.
    pub cos_m: f64,
    /// Sine amplitude, m.
    pub sin_m: f64,
}

/// Σcos mφ, Σsin mφ, Σv cos kφ, Σv sin kφ, Σv².
#[derive(Clone, Debug)]
struct Sums {
    cos: [f64; MOMENTS],
    sin: [f64; MOMENTS],
    v_cos: [f64; HIGHEST_ORDER + 1],
    v_sin: [f64; HIGHEST_ORDER + 1],
}

impl Default for Sums {
    fn default() -> Self {
        Self {
            cos: [0.0; MOMENTS],
            sin: [0.0; MOMENTS],
            v_cos: [0.0; HIGHEST_ORDER + 1],
            v_sin: [0.0; HIGHEST_ORDER + 1],
        }
    }
}

impl Merge for Sums {
    fn merge(&mut self, other: &Self) {
        let add = |a: &mut [f64], b: &[f64]| a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        add(&mut self.cos, &other.cos);
        add(&mut self.sin, &other.sin);
        add(&mut self.v_cos, &other.v_cos);
        add(&mut self.v_sin, &other.v_sin);
    }
}

/// Orders 0 to K of `residual(angle, deviation)` over the samples of one run, K at most [`HIGHEST_ORDER`] and as
/// the number of samples allows. The samples must cover the whole turn.
pub(super) fn solve(
    points: &Polar<'_>,
    residual: impl Fn(f64, f64) -> f64 + Sync,
) -> Vec<Harmonic> {
    let samples: usize = points.parts.iter().map(|(a, _)| a.len()).sum();
    let highest = HIGHEST_ORDER.min(samples / SAMPLES_AN_ORDER);
    let sums: Sums = points.fold(|angle, deviation| {
        let mut sums = Sums::default();
        for (a, v) in angle.iter().zip(deviation) {
            let v = residual(*a, *v);
            let (s1, c1) = a.sin_cos();
            let (mut c, mut s) = (1.0, 0.0);
            for m in 0..MOMENTS {
                sums.cos[m] += c;
                sums.sin[m] += s;
                if m <= HIGHEST_ORDER {
                    sums.v_cos[m] += v * c;
                    sums.v_sin[m] += v * s;
                }
                (c, s) = (c * c1 - s * s1, s * c1 + c * s1);
            }
        }
        sums
    });
    // Unknowns: order 0, then cos and sin of each order.
    let size = 2 * highest + 1;
    let place = |k: usize, sine: bool| {
        if k == 0 {
            0
        } else {
            2 * k - 1 + usize::from(sine)
        }
    };
    let mut matrix = DMatrix::zeros(size, size);
    let mut right = DVector::zeros(size);
    for j in 0..=highest {
        right[place(j, false)] = sums.v_cos[j];
        if j > 0 {
            right[place(j, true)] = sums.v_sin[j];
        }
        for k in 0..=highest {
            let (low, high) = (j.abs_diff(k), j + k);
            let sine_of_difference = if k >= j {
                sums.sin[low]
            } else {
                -sums.sin[low]
            };
            matrix[(place(j, false), place(k, false))] = 0.5 * (sums.cos[low] + sums.cos[high]);
            if k > 0 {
                matrix[(place(j, false), place(k, true))] =
                    0.5 * (sums.sin[high] + sine_of_difference);
            }
            if j > 0 {
                matrix[(place(j, true), place(k, false))] =
                    0.5 * (sums.sin[high] - sine_of_difference);
            }
            if j > 0 && k > 0 {
                matrix[(place(j, true), place(k, true))] = 0.5 * (sums.cos[low] - sums.cos[high]);
            }
        }
    }
    let Some(solved) = matrix.cholesky().map(|c| c.solve(&right)) else {
        return Vec::new();
    };
    (0..=highest)
        .map(|order| Harmonic {
            order,
            cos_m: solved[place(order, false)],
            sin_m: if order == 0 {
                0.0
            } else {
                solved[place(order, true)]
            },
        })
        .collect()
}

/// Value of a sum of harmonics at an angle.
pub(super) fn evaluate(harmonics: &[Harmonic], angle: f64) -> f64 {
    let (s1, c1) = angle.sin_cos();
    let (mut c, mut s, mut order, mut value) = (1.0, 0.0, 0, 0.0);
    for h in harmonics {
        while order < h.order {
            (c, s) = (c * c1 - s * s1, s * c1 + c * s1);
            order += 1;
        }
        value += h.cos_m * c + h.sin_m * s;
    }
    value
}

/// A form as a table with lines between its entries, for long runs: with 2¹⁴ entries the error is below
/// k²(2π/2¹⁴)²/8 = 5e-6 of the amplitude at the highest order.
pub(super) struct Tabulated(Vec<f64>);

impl Tabulated {
    const ENTRIES: usize = 1 << 14;

    pub(super) fn of(harmonics: &[Harmonic]) -> Self {
        let angle = |k: usize| std::f64::consts::TAU * k as f64 / Self::ENTRIES as f64;
        Self(
            (0..=Self::ENTRIES + 1)
                .map(|k| evaluate(harmonics, angle(k)))
                .collect(),
        )
    }

    pub(super) fn at(&self, angle: f64) -> f64 {
        let turns = angle * (1.0 / std::f64::consts::TAU);
        let place = (turns - turns.floor()) * Self::ENTRIES as f64;
        let k = place as usize;
        self.0[k] + (self.0[k + 1] - self.0[k]) * (place - k as f64)
    }
}
