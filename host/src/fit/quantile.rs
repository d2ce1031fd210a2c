//! Critical values of the F and t distributions.
use super::FitError;
use statrs::distribution::{Continuous, ContinuousCDF, FisherSnedecor, Normal, StudentsT};

/// F_{α; numerator, denominator}: exceeded by chance with probability `alpha`.
///
/// # Errors
/// [`FitError::Quantile`] for `alpha` outside (0, 1) or no degrees of freedom.
///
/// ```
/// use giotto::fit::{critical_f, critical_t, FitError};
///
/// // The bar of the paper's partial F: F_{0.05; 1; 24} = 4.26, the square of t.
/// assert!((critical_f(0.05, 1, 24)? - 4.26).abs() < 0.005);
/// assert!((critical_t(0.05, 24)?.powi(2) - critical_f(0.05, 1, 24)?).abs() < 1e-12);
/// assert!(critical_f(0.05, 0, 24).is_err());
/// # Ok::<(), FitError>(())
/// ```
pub fn critical_f(alpha: f64, numerator: usize, denominator: usize) -> Result<f64, FitError> {
    let error = FitError::Quantile {
        alpha,
        dof: (numerator, denominator),
    };
    if !(alpha > 0.0 && alpha < 1.0) || numerator == 0 || denominator == 0 {
        return Err(error);
    }
    if numerator == 1 {
        // F with one degree of freedom is the square of t, whose quantile is good to more digits.
        let t = critical_t(alpha, denominator)?;
        return Ok(t * t);
    }
    let f = FisherSnedecor::new(numerator as f64, denominator as f64).map_err(|_| error)?;
    Ok(f.inverse_cdf(1.0 - alpha))
}

/// Two-sided t_{α/2; dof}: |t| exceeds it by chance with probability `alpha`.
///
/// # Errors
/// As [`critical_f`].
pub fn critical_t(alpha: f64, dof: usize) -> Result<f64, FitError> {
    let error = FitError::Quantile {
        alpha,
        dof: (1, dof),
    };
    if !(alpha > 0.0 && alpha < 1.0) || dof == 0 {
        return Err(error);
    }
    let t = StudentsT::new(0.0, 1.0, dof as f64).map_err(|_| error)?;
    Ok(refined(&t, 0.5 * alpha, dof as f64).unwrap_or_else(|| t.inverse_cdf(1.0 - 0.5 * alpha)))
}

/// t with a tail of `tail` above it: the normal quantile stretched by the expansion in 1/dof (Abramowitz and Stegun 26.7.5),
/// then Halley's steps on the tail; nothing where they do not settle (few degrees of freedom, extreme tails). One step does
/// from twenty degrees of freedom on, for a hundredth of the time that the inverse of the beta function takes.
fn refined(t: &StudentsT, tail: f64, dof: f64) -> Option<f64> {
    let z = Normal::standard().inverse_cdf(1.0 - tail);
    let square = z * z;
    let terms = [
        (square + 1.0) / 4.0,
        ((5.0 * square + 16.0) * square + 3.0) / 96.0,
        (((3.0 * square + 19.0) * square + 17.0) * square - 15.0) / 384.0,
        ((((79.0 * square + 776.0) * square + 1482.0) * square - 1920.0) * square - 945.0)
            / 92_160.0,
    ];
    let mut x = z + z * terms.iter().rev().fold(0.0, |sum, term| (sum + term) / dof);
    for _ in 0..6 {
        let newton = (t.sf(x) - tail) / t.pdf(x);
        // −p'/p of the density p.
        let bend = x * (dof + 1.0) / (dof + x * x);
        let step = newton / (1.0 - 0.5 * newton * bend);
        x += step;
        // A step leaves an error of its third power.
        if step.abs() <= 1e-5 * x.abs() {
            return x.is_finite().then_some(x);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn critical_values_are_those_of_the_tables() {
        // Printed tables of F and t, and the paper's own 4.26.
        for (alpha, n, d, want) in [
            (0.05, 1, 24, 4.259677),
            (0.05, 2, 24, 3.402826),
            (0.10, 1, 9, 3.360303),
            (0.05, 1, 9, 5.117355),
            (0.01, 3, 10, 6.552313),
        ] {
            let got = critical_f(alpha, n, d).unwrap();
            assert!(
                (got / want - 1.0).abs() < 1e-6,
                "F({alpha}; {n}, {d}) = {got}"
            );
        }
        for (alpha, d, want) in [
            (0.05, 1, 12.7062047362),
            (0.05, 24, 2.0638985616),
            (0.05, 9997, 1.960201311),
        ] {
            let got = critical_t(alpha, d).unwrap();
            assert!((got / want - 1.0).abs() < 1e-8, "t({alpha}; {d}) = {got}");
        }
    }

    #[test]
    fn the_short_way_and_the_long_way_agree() {
        for dof in [1, 2, 3, 5, 10, 27, 300, 9_997] {
            for alpha in [0.5, 0.1, 0.05, 0.01, 1e-4] {
                let long = StudentsT::new(0.0, 1.0, f64::from(dof))
                    .unwrap()
                    .inverse_cdf(1.0 - 0.5 * alpha);
                let short = critical_t(alpha, dof as usize).unwrap();
                assert!(
                    (short / long - 1.0).abs() < 1e-9,
                    "t({alpha}; {dof}) = {short}, not {long}"
                );
            }
        }
    }

    #[test]
    fn nonsense_is_an_error_not_a_panic() {
        for (alpha, n, d) in [
            (0.0, 1, 5),
            (1.0, 1, 5),
            (f64::NAN, 1, 5),
            (0.05, 0, 5),
            (0.05, 1, 0),
        ] {
            assert!(critical_f(alpha, n, d).is_err());
        }
    }
}
