//! Small least-squares problems of the search, on normal equations that the Gram matrices have summed.
use super::products::Products;
use nalgebra::{DMatrix, DVector};

/// Solution of the normal equations for a set of columns.
#[derive(Clone, Debug, Default)]
pub struct Solution {
    /// Coefficients in the order of the set.
    pub coefficients: Vec<f64>,
    /// Inverse of the normal matrix.
    pub covariance: DMatrix<f64>,
    /// What the set takes off the sum of squares.
    pub gain: f64,
}

/// Solves for the columns `set` of the summed products (column 0 is the data). `None`: they are not
/// independent in these runs (scaled pivot below 1e-9).
pub fn solve(products: &Products, set: &[usize]) -> Option<Solution> {
    let n = set.len();
    if n == 0 {
        return Some(Solution {
            coefficients: Vec::new(),
            covariance: DMatrix::zeros(0, 0),
            gain: 0.0,
        });
    }
    let scale: Vec<f64> = set.iter().map(|&i| products.at(i, i).sqrt()).collect();
    if scale.iter().any(|s| !s.is_finite() || *s <= 0.0) {
        return None;
    }
    let matrix = DMatrix::from_fn(n, n, |i, j| {
        products.at(set[i], set[j]) / (scale[i] * scale[j])
    });
    let right = DVector::from_fn(n, |i, _| products.at(set[i], 0) / scale[i]);
    let factor = matrix.cholesky()?;
    if factor
        .l_dirty()
        .diagonal()
        .iter()
        .any(|pivot| pivot * pivot < 1e-9)
    {
        return None;
    }
    let solution = factor.solve(&right);
    let inverse = factor.inverse();
    Some(Solution {
        gain: solution.dot(&right),
        coefficients: solution.iter().zip(&scale).map(|(x, s)| x / s).collect(),
        covariance: DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] / (scale[i] * scale[j])),
    })
}

/// A set of columns factored once, to which candidates are added one at a time: n² for each instead of n³.
#[derive(Clone, Debug)]
pub struct Factor<'a> {
    products: &'a Products,
    set: Vec<usize>,
    /// Rows of L of the scaled normal matrix, one behind the other.
    rows: Vec<f64>,
    /// Of each member: the inverse of its length and of its pivot, and the forward solution.
    members: Vec<Member>,
    gain: f64,
}

#[derive(Clone, Copy, Debug)]
struct Member {
    per_length: f64,
    per_pivot: f64,
    forward: f64,
}

impl<'a> Factor<'a> {
    /// The columns `set` of the summed products (column 0 is the data). `None`: they are not independent.
    pub fn new(products: &'a Products, set: &[usize]) -> Option<Self> {
        let mut factor = Self {
            products,
            set: Vec::new(),
            rows: Vec::new(),
            members: Vec::new(),
            gain: 0.0,
        };
        set.iter()
            .all(|&column| factor.push(column))
            .then_some(factor)
    }

    /// What the set takes off the sum of squares.
    pub fn gain(&self) -> f64 {
        self.gain
    }

    /// The gain with further columns. `None`: they are not independent of the set.
    pub fn gain_with(&mut self, further: &[usize]) -> Option<f64> {
        self.with(further, |factor| factor.gain)
    }

    /// What is said about the set with further columns, which then leave it. `None`: they are not independent of the set.
    pub fn with<T>(&mut self, further: &[usize], say: impl FnOnce(&mut Self) -> T) -> Option<T> {
        let (size, gain) = (self.set.len(), self.gain);
        let said = further
            .iter()
            .all(|&column| self.push(column))
            .then(|| say(self));
        self.set.truncate(size);
        self.members.truncate(size);
        self.rows.truncate(size * (size + 1) / 2);
        self.gain = gain;
        said
    }

    fn push(&mut self, column: usize) -> bool {
        let p = self.products;
        let own = p.at(column, column);
        if !own.is_finite() || own <= 0.0 {
            return false;
        }
        let per_length = 1.0 / own.sqrt();
        let begin = self.rows.len();
        let (mut square, mut forward) = (0.0, p.at(column, 0) * per_length);
        for (i, (&other, member)) in self.set.iter().zip(&self.members).enumerate() {
            let (earlier, row) = self.rows.split_at(begin);
            let along: f64 = row
                .iter()
                .zip(&earlier[i * (i + 1) / 2..])
                .map(|(a, b)| a * b)
                .sum();
            let scaled = p.at(column, other) * (per_length * member.per_length);
            let entry = (scaled - along) * member.per_pivot;
            self.rows.push(entry);
            square += entry * entry;
            forward -= entry * member.forward;
        }
        let pivot = 1.0 - square;
        // The same bound as in `solve`; not a number fails it too.
        if pivot.is_nan() || pivot < 1e-9 {
            self.rows.truncate(begin);
            return false;
        }
        let per_pivot = 1.0 / pivot.sqrt();
        forward *= per_pivot;
        self.rows.push(pivot.sqrt());
        self.gain += forward * forward;
        self.set.push(column);
        self.members.push(Member {
            per_length,
            per_pivot,
            forward,
        });
        true
    }
}

/// Residual variance of `values` on the columns (those that add nothing are skipped).
pub fn residual_variance(columns: &[Vec<f64>], values: &[f64]) -> f64 {
    let (left, rank) = left_of(columns, values);
    let degrees = values.len().saturating_sub(rank);
    if degrees == 0 {
        0.0
    } else {
        left.iter().map(|x| x * x).sum::<f64>() / degrees as f64
    }
}

/// What the columns make of `values` by least squares.
pub fn fitted_values(columns: &[Vec<f64>], values: &[f64]) -> Vec<f64> {
    let (left, _) = left_of(columns, values);
    values
        .iter()
        .zip(&left)
        .map(|(value, left)| value - left)
        .collect()
}

/// What the columns leave of `values`, by Gram–Schmidt, and how many of them are independent.
fn left_of(columns: &[Vec<f64>], values: &[f64]) -> (Vec<f64>, usize) {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut left = values.to_vec();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let project = |vector: &mut Vec<f64>, basis: &[Vec<f64>]| {
        for _ in 0..2 {
            for q in basis {
                let along = dot(vector, q);
                vector.iter_mut().zip(q).for_each(|(v, q)| *v -= along * q);
            }
        }
    };
    for column in columns {
        let mut next = column.clone();
        let length = dot(&next, &next).sqrt();
        project(&mut next, &basis);
        let rest = dot(&next, &next).sqrt();
        if rest > 1e-8 * length && rest > 0.0 {
            next.iter_mut().for_each(|v| *v /= rest);
            basis.push(next);
        }
    }
    project(&mut left, &basis);
    (left, basis.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_a_line_through_the_origin_as_nist_certifies_it() {
        // NoInt1: y = 130…140 on x = 60…70, b 2.07438016528926, RSS 127.272727272727.
        let x: Vec<f64> = (60..=70).map(f64::from).collect();
        let y: Vec<f64> = (130..=140).map(f64::from).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let both = [&y, &x];
        let products = Products::from_fn(2, |i, j| dot(both[i], both[j]));
        let solution = solve(&products, &[1]).unwrap();
        assert!((solution.coefficients[0] / 2.074_380_165_289_26 - 1.0).abs() < 1e-12);
        assert!(((dot(&y, &y) - solution.gain) / 127.272_727_272_727 - 1.0).abs() < 1e-9);
    }

    #[test]
    fn dependent_columns_are_refused() {
        let products = Products::from_fn(3, |i, j| [2.0, 1.0, 2.0][i] * [2.0, 1.0, 2.0][j]);
        assert!(solve(&products, &[1, 2]).is_none());
    }

    #[test]
    fn a_factor_that_grows_gains_what_a_solution_gains() {
        let columns: [Vec<f64>; 5] = std::array::from_fn(|k| {
            (0..40)
                .map(|i| f64::from((i * (3 + 2 * k as i32) + i * i) % 17) - 6.0)
                .collect()
        });
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let products = Products::from_fn(5, |i, j| dot(&columns[i], &columns[j]));
        let mut factor = Factor::new(&products, &[3, 1]).unwrap();
        let direct = |set: &[usize]| solve(&products, set).unwrap().gain;
        assert!((factor.gain() / direct(&[1, 3]) - 1.0).abs() < 1e-12);
        for further in [vec![2], vec![4], vec![4, 2]] {
            let set: Vec<usize> = [3, 1].into_iter().chain(further.iter().copied()).collect();
            assert!(
                (factor.gain_with(&further).unwrap() / direct(&set) - 1.0).abs() < 1e-12,
                "{further:?}"
            );
        }
        assert_eq!(factor.gain_with(&[3]), None, "a column twice");
        assert!(
            (factor.gain() / direct(&[1, 3]) - 1.0).abs() < 1e-12,
            "as it was"
        );
    }

    #[test]
    fn residual_variance_counts_only_independent_columns() {
        let ones = vec![1.0; 8];
        let values: Vec<f64> = (0..8).map(|i| if i % 2 == 0 { 1.0 } else { 3.0 }).collect();
        // Mean 2, eight deviations of 1, seven degrees of freedom, though the column comes twice.
        assert!((residual_variance(&[ones.clone(), ones], &values) - 8.0 / 7.0).abs() < 1e-12);
    }
}
