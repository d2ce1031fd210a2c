//! How well circles that were not fitted are predicted.

/// Prediction of runs that had no part in the coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heldout {
    /// Runs predicted and compared.
    pub runs: usize,
    /// Root mean square of measured minus predicted, m.
    pub rms_m: f64,
    /// Largest of them, m.
    pub max_m: f64,
    /// 100·(1 − Σ(measured − predicted)² / Σ measured²), about zero, the offset of each radius removed from both: what
    /// part of the servo's radius error is predicted. Can be negative.
    pub explained_percent: f64,
}

impl Heldout {
    /// From (measured without offset, predicted) pairs, m; `None` if there are none.
    pub fn of(pairs: impl Iterator<Item = (f64, f64)>) -> Option<Self> {
        let (mut runs, mut squares, mut total, mut max_m) = (0, 0.0, 0.0, 0.0_f64);
        for (measured, predicted) in pairs {
            let residual = measured - predicted;
            runs += 1;
            squares += residual * residual;
            total += measured * measured;
            max_m = max_m.max(residual.abs());
        }
        (runs > 0).then(|| Self {
            runs,
            rms_m: (squares / runs as f64).sqrt(),
            max_m,
            explained_percent: 100.0 * (1.0 - squares / total),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_follow_their_definition() {
        let h = Heldout::of([(3.0, 2.0), (-4.0, -4.0), (0.0, 2.0)].into_iter()).unwrap();
        assert_eq!((h.runs, h.max_m), (3, 2.0));
        assert!((h.rms_m - (5.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert!((h.explained_percent - 80.0).abs() < 1e-12);
        assert_eq!(Heldout::of(std::iter::empty()), None);
    }
}
