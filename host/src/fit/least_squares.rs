//! Linear least squares by Householder QR on centred, scaled columns (Eq. 2–3, 20–21).
//!
//! All candidate columns and the observations are reduced once to a triangle; any subset of the columns is then a
//! small problem on that triangle, with the same residuals. No normal equations anywhere.
use super::FitError;
use super::reduced::{BLOCK_ROWS, Reduced};
use nalgebra::{DMatrix, DVector};

/// Column norms are 1: a diagonal of R below this is rounding, not information.
const RANK_TOLERANCE: f64 = 1e-11;

/// Observations and all candidate columns, reduced to a triangle.
#[derive(Clone, Debug)]
pub struct Triangle {
    names: Vec<String>,
    /// R of [columns, observations], columns of unit norm.
    r: DMatrix<f64>,
    scales: Vec<f64>,
    /// Means that were taken off, if there is an intercept.
    means: Option<Vec<f64>>,
    observations: usize,
    /// Σy² (about the mean with an intercept).
    total: f64,
}

/// A least-squares solution.
#[derive(Clone, Debug, PartialEq)]
pub struct LeastSquares {
    /// Estimates; the intercept, if there is one, comes first, then the columns in the order asked for.
    pub coefficients: Vec<f64>,
    /// (JᵀJ)⁻¹ in the same order: times σ² it is the covariance.
    pub unscaled_covariance: DMatrix<f64>,
    /// Sum of squared residuals, SSE of Eq. 7.
    pub rss: f64,
    /// Σy², about the mean (SST, Eq. 8) with an intercept, about zero without.
    pub total: f64,
    /// n − p, p counting the intercept.
    pub dof: usize,
}

impl LeastSquares {
    /// Residual variance σ², Eq. 21 (equal to Eq. 6), NaN without a degree of freedom.
    pub fn variance(&self) -> f64 {
        if self.dof == 0 {
            f64::NAN
        } else {
            self.rss / self.dof as f64
        }
    }

    /// Residual standard deviation.
    pub fn deviation(&self) -> f64 {
        self.variance().sqrt()
    }

    /// Standard error of coefficient `j`.
    pub fn standard_error(&self, j: usize) -> f64 {
        (self.variance() * self.unscaled_covariance[(j, j)]).sqrt()
    }

    /// Covariance of coefficients `i` and `j`.
    pub fn covariance(&self, i: usize, j: usize) -> f64 {
        self.variance() * self.unscaled_covariance[(i, j)]
    }

    /// R²: share of the total that is explained; uncentred without an intercept.
    pub fn r_squared(&self) -> f64 {
        1.0 - self.rss / self.total
    }
}

impl Triangle {
    /// Reduces `columns` (name, values) and `observations`. With `intercept`, a constant is part of every model.
    ///
    /// # Errors
    /// [`FitError`] for values that are not finite or columns of another length, and where there are no observations.
    pub fn new(
        columns: &[(&str, &[f64])],
        observations: &[f64],
        intercept: bool,
    ) -> Result<Self, FitError> {
        let n = observations.len();
        if n == 0 {
            return Err(FitError::TooFew {
                observations: 0,
                parameters: columns.len(),
            });
        }
        for (name, values) in columns
            .iter()
            .copied()
            .chain([("the observations", observations)])
        {
            if values.len() != n {
                return Err(FitError::Length {
                    column: name.to_owned(),
                    expected: n,
                    found: values.len(),
                });
            }
            if let Some(index) = values.iter().position(|v| !v.is_finite()) {
                return Err(FitError::NonFinite {
                    column: name.to_owned(),
                    index,
                });
            }
        }
        let width = columns.len() + 1;
        let all: Vec<&[f64]> = columns.iter().map(|c| c.1).chain([observations]).collect();
        let means: Vec<f64> = all
            .iter()
            .map(|values| if intercept { mean(values) } else { 0.0 })
            .collect();
        // Largest values first to 1: squares neither overflow nor vanish.
        let largest: Vec<f64> = all
            .iter()
            .zip(&means)
            .map(|(values, mean)| {
                values
                    .iter()
                    .fold(0.0, |top: f64, v| top.max((v - mean).abs()))
            })
            .map(|top| if top > 0.0 { top } else { 1.0 })
            .collect();
        let mut reduced = Reduced::new(width);
        for start in (0..n).step_by(BLOCK_ROWS) {
            let rows = BLOCK_ROWS.min(n - start);
            for (j, values) in all.iter().enumerate() {
                let (mean, by) = (means[j], 1.0 / largest[j]);
                for (to, value) in reduced
                    .block(j)
                    .iter_mut()
                    .zip(&values[start..start + rows])
                {
                    *to = (value - mean) * by;
                }
            }
            reduced.take(rows);
        }
        let names = columns.iter().map(|c| c.0.to_owned()).collect();
        let triangle = Self::of_reduced(names, reduced.triangle(n.min(width)), largest, n);
        Ok(Self {
            means: intercept.then_some(means),
            ..triangle
        })
    }

    /// From columns already reduced: `r` has the scalar products of the columns, each divided by its scale, the observations
    /// last.
    pub(super) fn of_reduced(
        names: Vec<String>,
        mut r: DMatrix<f64>,
        mut scales: Vec<f64>,
        observations: usize,
    ) -> Self {
        for (mut column, scale) in r.column_iter_mut().zip(&mut scales) {
            let norm = column.norm();
            if norm > 0.0 {
                column /= norm;
                *scale *= norm;
            } else {
                *scale = 1.0;
            }
        }
        let last = names.len();
        let total = if r.column(last).amax() > 0.0 {
            scales[last].powi(2)
        } else {
            0.0
        };
        Self {
            names,
            r,
            scales,
            means: None,
            observations,
            total,
        }
    }

    /// Number of observations.
    pub fn observations(&self) -> usize {
        self.observations
    }

    /// Name of a column.
    pub fn name(&self, column: usize) -> &str {
        &self.names[column]
    }

    /// Parameters of a model with `columns` columns, the intercept counted.
    pub fn parameters(&self, columns: usize) -> usize {
        columns + usize::from(self.means.is_some())
    }

    /// Least squares on the given columns.
    ///
    /// # Errors
    /// [`FitError::TooFew`] for more parameters than observations, [`FitError::Collinear`] for columns that
    /// depend on each other.
    pub fn solve(&self, columns: &[usize]) -> Result<LeastSquares, FitError> {
        let (n, k) = (self.observations, columns.len());
        let parameters = self.parameters(k);
        if n < parameters {
            return Err(FitError::TooFew {
                observations: n,
                parameters,
            });
        }
        let last = self.scales.len() - 1;
        let part = self.r.select_columns(columns);
        let y = self.r.column(last).into_owned();
        let (solution, inverse, rss) = if k == 0 {
            (DVector::zeros(0), DMatrix::zeros(0, 0), y.norm_squared())
        } else {
            if self.r.nrows() < k {
                return Err(FitError::TooFew {
                    observations: n,
                    parameters,
                });
            }
            let qr = part.qr();
            let r = qr.r();
            for (j, &column) in columns.iter().enumerate() {
                if r[(j, j)].abs() < RANK_TOLERANCE {
                    return Err(FitError::Collinear {
                        column: self.names[column].clone(),
                    });
                }
            }
            let mut rotated = y;
            qr.q_tr_mul(&mut rotated);
            let head = rotated.rows(0, k).into_owned();
            let singular = || FitError::Collinear {
                column: self.names[columns[k - 1]].clone(),
            };
            let solution = r.solve_upper_triangular(&head).ok_or_else(singular)?;
            let inverse = r
                .solve_upper_triangular(&DMatrix::identity(k, k))
                .ok_or_else(singular)?;
            (
                solution,
                inverse,
                rotated.rows(k, rotated.len() - k).norm_squared(),
            )
        };
        let y_scale = self.scales[last];
        let slopes = DVector::from_fn(k, |j, _| solution[j] * y_scale / self.scales[columns[j]]);
        let scaled = DMatrix::from_fn(k, k, |i, j| inverse[(i, j)] / self.scales[columns[i]]);
        let covariance = &scaled * scaled.transpose();
        let (coefficients, unscaled_covariance) = match &self.means {
            None => (slopes.iter().copied().collect(), covariance),
            Some(means) => with_intercept(
                &slopes,
                &covariance,
                &columns.iter().map(|&c| means[c]).collect::<Vec<_>>(),
                means[last],
                n,
            ),
        };
        let rss = rss * y_scale * y_scale;
        Ok(LeastSquares {
            coefficients,
            unscaled_covariance,
            rss,
            total: self.total,
            dof: n - parameters,
        })
    }
}

/// Puts the constant back that centring took out.
fn with_intercept(
    slopes: &DVector<f64>,
    covariance: &DMatrix<f64>,
    means: &[f64],
    mean: f64,
    n: usize,
) -> (Vec<f64>, DMatrix<f64>) {
    let means = DVector::from_column_slice(means);
    let cross = -(covariance * &means);
    let k = slopes.len();
    let intercept = mean - slopes.dot(&means);
    let full = DMatrix::from_fn(k + 1, k + 1, |i, j| match (i, j) {
        (0, 0) => 1.0 / n as f64 - cross.dot(&means),
        (0, j) => cross[j - 1],
        (i, 0) => cross[i - 1],
        (i, j) => covariance[(i - 1, j - 1)],
    });
    (
        std::iter::once(intercept)
            .chain(slopes.iter().copied())
            .collect(),
        full,
    )
}

/// Mean, its rounding removed by a second pass.
fn mean(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let rough = values.iter().sum::<f64>() / n;
    rough + values.iter().map(|v| v - rough).sum::<f64>() / n
}
