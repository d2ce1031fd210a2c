//! Sums and bounds of long columns, eight side by side: one alone waits for itself. The order is fixed, so are the bits.

const LANES: usize = 8;

/// Σ values.
pub(super) fn sum(values: &[f64]) -> f64 {
    let (chunks, rest) = values.as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for chunk in chunks {
        for (sum, value) in sums.iter_mut().zip(chunk) {
            *sum += value;
        }
    }
    sums.iter().chain(rest).sum()
}

/// The lowest and the highest of finite values; [∞, −∞] of none.
pub(super) fn bounds(values: &[f64]) -> [f64; 2] {
    let (chunks, rest) = values.as_chunks::<LANES>();
    // One instruction each, other than `f64::min`, which looks for NaN as well.
    let lower = |a: f64, b: f64| if b < a { b } else { a };
    let higher = |a: f64, b: f64| if b > a { b } else { a };
    let (mut lowest, mut highest) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
    for chunk in chunks {
        for k in 0..LANES {
            lowest[k] = lower(lowest[k], chunk[k]);
            highest[k] = higher(highest[k], chunk[k]);
        }
    }
    let least = lowest
        .iter()
        .chain(rest)
        .fold(f64::INFINITY, |a, b| lower(a, *b));
    let most = highest
        .iter()
        .chain(rest)
        .fold(f64::NEG_INFINITY, |a, b| higher(a, *b));
    [least, most]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn are_those_of_the_values() {
        for n in [0, 1, 7, 8, 9, 100] {
            let values: Vec<f64> = (0..n)
                .map(|k| f64::from((k * 37 + 11) % 101) - 50.0)
                .collect();
            assert_eq!(sum(&values), values.iter().sum::<f64>());
            let least = values.iter().copied().fold(f64::INFINITY, f64::min);
            let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            assert_eq!(bounds(&values), [least, most]);
        }
    }
}
