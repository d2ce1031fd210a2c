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
        pairs.collect::<Sums>().heldout()
    }
}

/// What [`Heldout`] is made of, so that parts can be put together.
#[derive(Clone, Copy, Default)]
pub(super) struct Sums {
    runs: usize,
    squares: f64,
    total: f64,
    max_m: f64,
}

impl FromIterator<(f64, f64)> for Sums {
    fn from_iter<I: IntoIterator<Item = (f64, f64)>>(pairs: I) -> Self {
        pairs
            .into_iter()
            .fold(Self::default(), |sums, (measured, predicted)| {
                let residual: f64 = measured - predicted;
                Self {
                    runs: sums.runs + 1,
                    squares: sums.squares + residual * residual,
                    total: sums.total + measured * measured,
                    max_m: sums.max_m.max(residual.abs()),
                }
            })
    }
}

impl Sums {
    pub(super) fn merge(&mut self, other: &Self) {
        self.runs += other.runs;
        self.squares += other.squares;
        self.total += other.total;
        self.max_m = self.max_m.max(other.max_m);
    }

    pub(super) fn heldout(&self) -> Option<Heldout> {
        (self.runs > 0).then(|| Heldout {
            runs: self.runs,
            rms_m: (self.squares / self.runs as f64).sqrt(),
            max_m: self.max_m,
            explained_percent: 100.0 * (1.0 - self.squares / self.total),
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
