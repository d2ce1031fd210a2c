//! Vectors of samples, as wide as the processor has them.
//!
//! Which additions are made, and in which order, is fixed: [`LANES`] sums side by side, then their sum, every product
//! rounded before it is added. So the bits are the same on every processor.
use pulp::Arch;

/// Sums that run side by side: additions of one sum wait for each other.
const LANES: usize = 16;

/// Scalar product.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    Arch::new().dispatch(|| dot_here(a, b))
}

/// Scalar products of the first rows of a matrix, one row behind the other, with the same vector: as many as `out` has
/// places.
pub fn dots(rows: &[f64], b: &[f64], out: &mut [f64]) {
    Arch::new().dispatch(|| {
        let fours = rows[..out.len() * b.len()].chunks_exact((FOUR * b.len()).max(1));
        let rest = fours.remainder();
        let (four_out, rest_out) = out.split_at_mut(out.len().min(FOUR * fours.len()));
        for (rows, out) in fours.zip(four_out.chunks_exact_mut(FOUR)) {
            out.copy_from_slice(&four_here(rows, b));
        }
        for (row, out) in rest.chunks_exact(b.len().max(1)).zip(rest_out) {
            *out = dot_here(row, b);
        }
    });
}

/// y += a·x.
pub fn axpy(a: f64, x: &[f64], y: &mut [f64]) {
    Arch::new().dispatch(|| axpy_here(a, x, y));
}

/// y += Σ aₖ·xₖ.
pub fn axpys<'a>(terms: impl Iterator<Item = (f64, &'a [f64])>, y: &mut [f64]) {
    Arch::new().dispatch(|| {
        for (a, x) in terms {
            axpy_here(a, x, y);
        }
    });
}

/// Rows that share what is read of the other vector.
const FOUR: usize = 4;

/// Four scalar products, of [`HALF`] sums each.
#[inline(always)]
fn four_here(rows: &[f64], b: &[f64]) -> [f64; FOUR] {
    let n = b.len();
    let row = |k: usize| rows[k * n..(k + 1) * n].as_chunks::<HALF>();
    let ((r0, e0), (r1, e1), (r2, e2), (r3, e3)) = (row(0), row(1), row(2), row(3));
    let (parts, rest) = b.as_chunks::<HALF>();
    let mut sums = [[0.0; HALF]; FOUR];
    for ((((b, r0), r1), r2), r3) in parts.iter().zip(r0).zip(r1).zip(r2).zip(r3) {
        for lane in 0..HALF {
            sums[0][lane] += r0[lane] * b[lane];
            sums[1][lane] += r1[lane] * b[lane];
            sums[2][lane] += r2[lane] * b[lane];
            sums[3][lane] += r3[lane] * b[lane];
        }
    }
    let ends = [e0, e1, e2, e3].map(|end| end.iter().zip(rest).map(|(a, b)| a * b).sum::<f64>());
    std::array::from_fn(|k| sums[k].iter().sum::<f64>() + ends[k])
}

/// Sums side by side where four rows are.
const HALF: usize = 8;

/// Waves summed side by side.
const TURNS: usize = 8;

/// Σ xᵢ·e^{i·wave_rad·i}: real and imaginary part.
pub fn wave_sum(x: &[f64], wave_rad: f64) -> [f64; 2] {
    Arch::new().dispatch(|| {
        let at = |i: usize| (wave_rad * i as f64).sin_cos();
        let mut turn: [[f64; TURNS]; 2] =
            [std::array::from_fn(|k| at(k).1), std::array::from_fn(|k| at(k).0)];
        let (step_sin, step_cos) = at(TURNS);
        let mut sums = [[0.0; TURNS]; 2];
        let (parts, rest) = x.as_chunks::<TURNS>();
        for part in parts {
            let [re, im] = &mut turn;
            for k in 0..TURNS {
                sums[0][k] += part[k] * re[k];
                sums[1][k] += part[k] * im[k];
                (re[k], im[k]) = (re[k] * step_cos - im[k] * step_sin, im[k] * step_cos + re[k] * step_sin);
            }
        }
        for (k, x) in rest.iter().enumerate() {
            sums[0][k] += x * turn[0][k];
            sums[1][k] += x * turn[1][k];
        }
        sums.map(|sums| sums.iter().sum())
    })
}

#[inline(always)]
fn dot_here(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    let (a_lanes, a_rest) = a.as_chunks::<LANES>();
    let (b_lanes, b_rest) = b.as_chunks::<LANES>();
    for (a, b) in a_lanes.iter().zip(b_lanes) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

#[inline(always)]
fn axpy_here(a: f64, x: &[f64], y: &mut [f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += a * x;
    }
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
        let rows = [&a[..], &b, &a, &b, &b].concat();
        let mut five = [0.0; 5];
        dots(&rows, &b, &mut five);
        assert!((five[0] - plain).abs() < 1e-12 && five[0].to_bits() == five[2].to_bits());
        assert_eq!(five[4].to_bits(), dot(&b, &b).to_bits());
        let (mut one, mut all) = (a.clone(), a.clone());
        axpy(0.3, &b, &mut one);
        axpys([(0.3, &b[..])].into_iter(), &mut all);
        assert!(one.iter().zip(&a).zip(&b).all(|((y, a), b)| y.to_bits() == (a + 0.3 * b).to_bits()));
        assert_eq!(one, all);
    }

    #[test]
    fn a_wave_is_summed_as_sines_and_cosines_are() {
        let x: Vec<f64> = (0..1003).map(|i| f64::from((i * 7919) % 41) - 20.0).collect();
        for wave in [0.0, 0.013, 1.7, 3.0] {
            let plain = x.iter().enumerate().fold([0.0; 2], |[re, im], (i, x)| {
                let (sin, cos) = (wave * i as f64).sin_cos();
                [re + x * cos, im + x * sin]
            });
            let sum = wave_sum(&x, wave);
            assert!((sum[0] - plain[0]).hypot(sum[1] - plain[1]) < 1e-9, "{wave}: {sum:?} {plain:?}");
        }
    }
}
