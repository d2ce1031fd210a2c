//! Explanations that compete: causes of the list and patterns without a name, and what each costs.
use super::design_column::Column;
use super::footing::freedom;
use super::low_orders::Low;
use super::pattern::Pattern;
use super::survey::Prepared;
use crate::causes::{Cause, Harmonics, Seat, Site};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Price of one listed column: ln(78 runs) + 2·ln(25 competitors), about 11, and a margin for the scatter
/// being estimated.
const PRICE: f64 = 14.0;
/// Further price of a second column.
const PRICE_OF_PHASE: f64 = 5.0;
/// Further price of a pattern: there are hundreds of them, and a name is worth more.
const PRICE_OF_PATTERN: f64 = 14.0;
/// Further price of the machine as a whole where its slides can be told apart.
const PRICE_OF_VAGUENESS: f64 = 0.5;
/// An explanation the search may choose.
#[derive(Clone, Debug)]
pub struct Hypothesis {
    /// What it is.
    pub kind: Kind,
    /// Its columns in the Gram matrices.
    pub columns: Vec<usize>,
    /// What it has to take off χ² to be worth while.
    pub price: f64,
    /// Beside which other columns its shape was fitted last.
    pub fitted_beside: Option<Vec<usize>>,
}

/// Cause or pattern.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// A cause of the list.
    Cause {
        /// Which.
        cause: Cause,
        /// Where.
        site: Site,
        /// Its shape parameters, in the order of the cause's names.
        shape: Vec<f64>,
    },
    /// Something without a name.
    Pattern(Pattern),
}

impl Hypothesis {
    /// Whether it is in the closed list.
    pub fn listed(&self) -> bool {
        matches!(self.kind, Kind::Cause { .. })
    }
}

impl Kind {
    /// Number of linear columns.
    pub fn columns(&self) -> usize {
        match self {
            Self::Cause { cause, .. } => cause.model().columns(),
            Self::Pattern(pattern) => pattern.columns(),
        }
    }

    /// Its columns over all runs, m per unit; 0 where a run hides its samples.
    pub fn columns_over(&self, runs: &[Prepared]) -> Vec<Column> {
        let low = |index: usize| {
            runs.iter()
                .map(|run| self.low(index, run))
                .collect::<Option<Vec<Low>>>()
        };
        match (0..self.columns()).map(low).collect::<Option<Vec<_>>>() {
            Some(low) => low.into_iter().map(Column::within).collect(),
            None => Column::split(runs, self.columns(), |run, out| self.samples(run, out)),
        }
    }

    /// Coordinates of one column in one run, where it is a few waves of the machine angle and nothing else.
    pub fn low(&self, index: usize, run: &Prepared) -> Option<Low> {
        self.harmonics(index, run).map(|waves| run.low_of(&waves))
    }

    fn harmonics(&self, index: usize, run: &Prepared) -> Option<Harmonics> {
        match self {
            Self::Cause { cause, site, shape } => cause.model().harmonics(*site, shape, &run.view),
            Self::Pattern(pattern) => pattern.harmonics(index, run),
        }
    }

    /// All columns at each sample of one run.
    pub fn samples(&self, run: &Prepared, out: &mut [&mut [f64]]) {
        match self {
            Self::Cause { cause, site, shape } => {
                cause.model().signatures(*site, shape, &run.view, out)
            }
            Self::Pattern(pattern) => out.iter_mut().for_each(|out| pattern.samples(run, out)),
        }
    }

    /// What it has to take off χ², chosen from `shapes` starting shapes; `scarcity` is that of the runs.
    pub fn price(&self, shapes: usize, scarcity: f64) -> f64 {
        let phase = PRICE_OF_PHASE * (self.columns() - 1) as f64;
        let own = match self {
            Self::Cause { cause, site, .. } => {
                let shapes = 2.0 * (shapes.max(1) as f64).ln();
                // Of two ways to say the same, the one that names the axes.
                let vague = *site == Site::Machine && cause.model().seat() == Seat::MachineOrOne;
                PRICE + phase + shapes + if vague { PRICE_OF_VAGUENESS } else { 0.0 }
            }
            Self::Pattern(_) => PRICE + PRICE_OF_PATTERN + phase,
        };
        scarcity * own
    }
}

/// Runs for which the prices are: the paper's campaign.
const USUAL_RUNS: usize = 78;
/// Share of the runs that are left to measure the scatter when laws have been fitted to them (see `spread`).
const LEFT: f64 = 2.0 / 3.0;

/// By how much more a column has to take off χ² where the scatter in the metric is known from few runs: the F quantile
/// of the same false-alarm rate, against that of the usual number of runs.
pub fn scarcity(runs: usize) -> f64 {
    let quantile = |runs: usize| {
        let dof = freedom(runs, (1.0 - LEFT) * runs as f64);
        // Two-sided: F(1, dof) is the square of t.
        let level = 0.5 * FALSE_COLUMN;
        StudentsT::new(0.0, 1.0, dof).map_or(1.0, |law| law.inverse_cdf(1.0 - level).powi(2))
    };
    (quantile(runs) / quantile(USUAL_RUNS)).clamp(1.0, MOST_SCARCE)
}

/// Chance with which one column of noise takes [`PRICE`] off χ²: the tail of χ²₁ there.
const FALSE_COLUMN: f64 = 1.83e-4;
/// Beyond, nothing can be found at all.
const MOST_SCARCE: f64 = 6.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_runs_ask_for_more() {
        assert_eq!(scarcity(USUAL_RUNS), 1.0);
        assert_eq!(
            scarcity(500),
            1.0,
            "many do not ask for less than was calibrated"
        );
        // t² for the 12 degrees of freedom of 18 runs against 52: by the tables of Student's t, 5.2² over 4.0².
        let few = scarcity(18);
        assert!((1.55..1.85).contains(&few), "{few}");
    }
}
