//! Vectors of samples, as wide as the processor has them.
//!
//! Which additions are made, and in which order, is fixed: `LANES` sums side by side, then their sum, every product
//! rounded before it is added. So the bits are the same on every processor.
use pulp::{Arch, Simd, WithSimd};

/// Sums that run side by side: additions of one sum wait for each other.
const LANES: usize = 16;
/// Waves that are summed side by side.
const WAVES: usize = 8;

/// Scalar product.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    Arch::new().dispatch(Dot(a, b))
}

/// Scalar products of the first rows of a matrix, one row behind the other, with the same vector: as many as `out` has
/// places.
pub fn dots(rows: &[f64], b: &[f64], out: &mut [f64]) {
    Arch::new().dispatch(Dots(&rows[..out.len() * b.len()], b, out));
}

/// y += a·x.
pub fn axpy(a: f64, x: &[f64], y: &mut [f64]) {
    Arch::new().dispatch(Axpys(&[a], x, y));
}

/// y += Σ aₖ·xₖ over the first rows of a matrix, one row behind the other.
pub fn axpys(a: &[f64], rows: &[f64], y: &mut [f64]) {
    Arch::new().dispatch(Axpys(a, rows, y));
}

/// Σ xᵢ·e^{i·wave_rad·i}: real and imaginary part.
pub fn wave_sum(x: &[f64], wave_rad: f64) -> [f64; 2] {
    let at = |i: usize| (wave_rad * i as f64).sin_cos();
    let first = std::array::from_fn(at).map(|(sin, cos)| [cos, sin]);
    let (sin, cos) = at(WAVES);
    Arch::new().dispatch(WaveSum {
        x,
        first,
        step: [cos, sin],
    })
}

// What is dispatched has to be inlined into the function that may use all of the processor, or it is made for the least.

struct Dot<'a>(&'a [f64], &'a [f64]);

impl WithSimd for Dot<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let (a_lanes, a_rest) = self.0.as_chunks::<LANES>();
        let (b_lanes, b_rest) = self.1.as_chunks::<LANES>();
        let mut sums = [0.0; LANES];
        for (a, b) in a_lanes.iter().zip(b_lanes) {
            for lane in 0..LANES {
                sums[lane] += a[lane] * b[lane];
            }
        }
        total(&sums) + rest(a_rest, b_rest)
    }
}

struct Dots<'a>(&'a [f64], &'a [f64], &'a mut [f64]);

impl WithSimd for Dots<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self(rows, b, out) = self;
        for (row, out) in rows.chunks_exact(b.len().max(1)).zip(out) {
            *out = Dot(row, b).with_simd(simd);
        }
    }
}

struct Axpys<'a>(&'a [f64], &'a [f64], &'a mut [f64]);

impl WithSimd for Axpys<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self(amounts, rows, y) = self;
        for (a, x) in amounts.iter().zip(rows.chunks_exact(y.len().max(1))) {
            for (y, x) in y.iter_mut().zip(x) {
                *y += a * x;
            }
        }
    }
}

struct WaveSum<'a> {
    x: &'a [f64],
    /// e^{i·wave·k} of the first samples; `step` leads on by as many.
    first: [[f64; 2]; WAVES],
    step: [f64; 2],
}

impl WithSimd for WaveSum<'_> {
    type Output = [f64; 2];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [f64; 2] {
        let (mut re, mut im) = (
            self.first.map(|turn| turn[0]),
            self.first.map(|turn| turn[1]),
        );
        let [step_re, step_im] = self.step;
        let [mut sum_re, mut sum_im] = [[0.0; WAVES]; 2];
        let (parts, rest) = self.x.as_chunks::<WAVES>();
        for part in parts {
            for k in 0..WAVES {
                sum_re[k] += part[k] * re[k];
                sum_im[k] += part[k] * im[k];
                (re[k], im[k]) = (
                    re[k] * step_re - im[k] * step_im,
                    im[k] * step_re + re[k] * step_im,
                );
            }
        }
        for (k, x) in rest.iter().enumerate() {
            sum_re[k] += x * re[k];
            sum_im[k] += x * im[k];
        }
        [total(&sum_re), total(&sum_im)]
    }
}

#[inline(always)]
fn total(sums: &[f64]) -> f64 {
    sums.iter().sum()
}

#[inline(always)]
fn rest(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_those_of_the_plain_order_bit_for_bit() {
        let wave = |k: f64| -> Vec<f64> { (0..1003).map(|i| (f64::from(i) * k).sin()).collect() };
        let (a, b) = (wave(0.37), wave(0.011));
        let mut lanes = [0.0; LANES];
        for (i, (a, b)) in a[..992].iter().zip(&b).enumerate() {
            lanes[i % LANES] += a * b;
        }
        let rest: f64 = a[992..].iter().zip(&b[992..]).map(|(a, b)| a * b).sum();
        let plain = lanes.iter().sum::<f64>() + rest;
        assert_eq!(dot(&a, &b).to_bits(), plain.to_bits());
        let mut several = [0.0; 2];
        dots(&[&a[..], &b, &a, &a, &a].concat(), &b, &mut several);
        assert_eq!(several[0].to_bits(), plain.to_bits());
        assert_eq!(several[1].to_bits(), dot(&b, &b).to_bits());
        let (mut one, mut all) = (a.clone(), a.clone());
        axpy(0.3, &b, &mut one);
        axpys(&[0.3], &b, &mut all);
        assert!(
            one.iter()
                .zip(&a)
                .zip(&b)
                .all(|((y, a), b)| y.to_bits() == (a + 0.3 * b).to_bits())
        );
        assert_eq!(one, all);
    }

    #[test]
    fn a_wave_is_summed_as_sines_and_cosines_are() {
        let x: Vec<f64> = (0..1003)
            .map(|i| f64::from((i * 7919) % 41) - 20.0)
            .collect();
        for wave in [0.0, 0.013, 1.7, 3.0] {
            let plain = x.iter().enumerate().fold([0.0; 2], |[re, im], (i, x)| {
                let (sin, cos) = (wave * i as f64).sin_cos();
                [re + x * cos, im + x * sin]
            });
            let sum = wave_sum(&x, wave);
            assert!(
                (sum[0] - plain[0]).hypot(sum[1] - plain[1]) < 1e-9,
                "{wave}: {sum:?} {plain:?}"
            );
        }
    }
}
