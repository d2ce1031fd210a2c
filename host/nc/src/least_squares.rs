//! A few columns fitted to a curve so that the largest error is least: least squares, reweighted.

/// Unknowns at most.
pub(super) const MOST_UNKNOWNS: usize = 10;
/// Rounds of reweighting; the largest error has settled to a tenth of a percent.
const ROUNDS: usize = 8;

/// The combination of `parts` that is nearest to `target` at its worst place, and how far it is off there; `None` where the
/// parts are not independent.
pub(super) fn least_largest(
    parts: &[Vec<f64>],
    target: &[f64],
) -> Option<([f64; MOST_UNKNOWNS], f64)> {
    let mut weights = vec![1.0; target.len()];
    let mut best: Option<([f64; MOST_UNKNOWNS], f64)> = None;
    for _ in 0..ROUNDS {
        let Some(solved) = weighted(parts, target, &weights) else {
            break;
        };
        let left: Vec<f64> = target
            .iter()
            .enumerate()
            .map(|(k, target)| {
                let got: f64 = parts.iter().zip(solved).map(|(p, s)| s * p[k]).sum();
                (target - got).abs()
            })
            .collect();
        let most = left.iter().copied().fold(0.0, f64::max);
        if best.is_none_or(|(_, least)| most < least) {
            best = Some((solved, most));
        }
        let scale = most.max(f64::MIN_POSITIVE);
        weights
            .iter_mut()
            .zip(&left)
            .for_each(|(w, e)| *w *= e / scale + 1e-3);
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= sum);
    }
    best
}

/// A row of the normal equations with its right side.
type Row = [f64; MOST_UNKNOWNS + 1];

/// Weighted least squares of a few columns; `None` if they are not independent.
fn weighted(parts: &[Vec<f64>], target: &[f64], weights: &[f64]) -> Option<[f64; MOST_UNKNOWNS]> {
    let n = parts.len().min(MOST_UNKNOWNS);
    let mut rows = [[0.0; MOST_UNKNOWNS + 1]; MOST_UNKNOWNS];
    for (k, (w, t)) in weights.iter().zip(target).enumerate() {
        for (row, part) in rows.iter_mut().zip(parts) {
            let weighted = w * part[k];
            row[MOST_UNKNOWNS] += weighted * t;
            for (sum, other) in row.iter_mut().zip(parts) {
                *sum += weighted * other[k];
            }
        }
    }
    solve(&mut rows, n)
}

/// Elimination with the greatest pivot of each column.
fn solve(rows: &mut [Row; MOST_UNKNOWNS], n: usize) -> Option<[f64; MOST_UNKNOWNS]> {
    for i in 0..n {
        let pivot = (i..n).max_by(|a, b| rows[*a][i].abs().total_cmp(&rows[*b][i].abs()))?;
        rows.swap(i, pivot);
        let row = rows[i];
        if row[i].abs() < 1e-300 {
            return None;
        }
        for other in &mut rows[i + 1..n] {
            let factor = other[i] / row[i];
            other
                .iter_mut()
                .zip(row)
                .skip(i)
                .for_each(|(o, r)| *o -= factor * r);
        }
    }
    let mut solved = [0.0; MOST_UNKNOWNS];
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| rows[i][j] * solved[j]).sum();
        solved[i] = (rows[i][MOST_UNKNOWNS] - known) / rows[i][i];
    }
    solved.iter().all(|v| v.is_finite()).then_some(solved)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The best line through t² on 0 … 1 is t − 1/8, off by 1/8 at three places.
    #[test]
    fn the_best_line_through_a_parabola() {
        let at = |k: usize| k as f64 / 200.0;
        let parts = [
            (0..=200).map(|_| 1.0).collect(),
            (0..=200).map(at).collect::<Vec<f64>>(),
        ];
        let target: Vec<f64> = (0..=200).map(|k| at(k) * at(k)).collect();
        let (solved, most) = least_largest(&parts, &target).unwrap();
        assert!((most - 0.125).abs() < 0.01, "{most}");
        assert!((solved[0] + 0.125).abs() < 0.02 && (solved[1] - 1.0).abs() < 0.02);
        let same = [parts[0].clone(), parts[0].clone()];
        assert!(least_largest(&same, &target).is_none());
    }
}
