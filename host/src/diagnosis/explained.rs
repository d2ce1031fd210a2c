//! What a search found, with all that is needed to refit it.
use super::design_column::Column;
use super::gram::Gram;
use super::hypothesis::{Hypothesis, Kind, scarcity};
use super::linear::{Factor, Solution, solve};
use super::low_orders::Basis;
use super::roughness::Teeth;
use super::search::columns_of;
use super::spread::Spread;
use super::survey::{Lag, Prepared, Response};
use super::tangent::Tangents;
use super::tone::Tone;
use crate::causes::{Cause, CauseModel, Evidence, Site, shown_by};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// What the search found, with all that is needed to refit it.
#[derive(Clone, Debug)]
pub struct Explained {
    /// The runs, ready.
    pub runs: Arc<[Prepared]>,
    /// The low orders of each run with nothing hidden.
    pub bases: Vec<Arc<Basis>>,
    /// Shared response, as refined.
    pub response: Response,
    /// Lag of the machine behind the command.
    pub lag: Lag,
    /// Noise and scatter.
    pub spread: Spread,
    /// Products of all columns.
    pub gram: Gram,
    /// Columns of the model's own parameters: always free.
    pub nuisance: Vec<usize>,
    /// Every explanation considered.
    pub items: Vec<Hypothesis>,
    /// The chosen ones.
    pub chosen: Vec<usize>,
    /// Those of them that another cause explains as well to the last digit: fitted, but not stated.
    pub tied: Vec<usize>,
    /// The fit of nuisance and chosen.
    pub solution: Solution,
    /// The same with what their shapes and the lag may be off by.
    pub tangents: Option<Tangents>,
    /// By how much the lag is taken as longer than the set-up offset says, s.
    pub more_lag_s: f64,
    /// Axes that stick at low speed.
    pub teeth: Vec<Teeth>,
    /// Tones in time.
    pub tones: Vec<Tone>,
    /// Energy of what was taken out before the search, teeth and tone, m².
    pub apart_m2: f64,
}

impl Explained {
    /// Each run once.
    pub fn all(&self) -> Vec<f64> {
        vec![1.0; self.runs.len()]
    }

    /// The chosen causes that can be stated.
    pub fn stated(&self) -> impl Iterator<Item = usize> {
        self.chosen
            .iter()
            .copied()
            .filter(|item| self.items[*item].listed() && !self.tied.contains(item))
    }

    /// The causes beside `item` that concern an actuator of this site: chosen ones, and teeth.
    pub fn causes_on(&self, site: Site, item: usize) -> Vec<Cause> {
        let own = site.actuators();
        let chosen = self.chosen.iter().filter(|other| **other != item);
        let named = chosen.filter_map(|other| match &self.items[*other].kind {
            Kind::Cause { cause, site, .. } => {
                let shared = site.actuators().iter().any(|a| own.contains(a));
                shared.then_some(*cause)
            }
            Kind::Pattern(_) => None,
        });
        let teeth = self.teeth.iter().filter(|teeth| own.contains(&teeth.axis));
        let teeth = teeth.filter_map(|_| shown_by(Evidence::Roughness).map(CauseModel::cause));
        named.chain(teeth).collect()
    }

    /// Enters explanations, each chosen from so many starting shapes; gives their numbers.
    pub fn enter(&mut self, kinds: Vec<(Kind, usize)>) -> Range<usize> {
        let first = self.items.len();
        let columns: Vec<Vec<Column>> = kinds
            .par_iter()
            .map(|(kind, _)| kind.columns_over(&self.runs))
            .collect();
        let mut next = self.gram.size();
        let scarcity = scarcity(self.runs.len());
        for ((kind, shapes), columns) in kinds.into_iter().zip(&columns) {
            let own = (next..next + columns.len()).collect();
            next += columns.len();
            self.items.push(Hypothesis {
                price: kind.price(shapes, scarcity),
                columns: own,
                kind,
                fitted_beside: None,
            });
        }
        self.gram.push_all(columns.into_iter().flatten());
        first..self.items.len()
    }

    /// Brings the columns of items up to date with their kinds.
    pub fn relay(&mut self, items: &[usize]) {
        let columns: Vec<Vec<Column>> = items
            .par_iter()
            .map(|&item| self.items[item].kind.columns_over(&self.runs))
            .collect();
        let at = items
            .iter()
            .flat_map(|&item| self.items[item].columns.iter().copied());
        self.gram.replace_all(at.zip(columns.into_iter().flatten()));
    }
}

/// What nuisance and chosen explanations leave.
pub fn residual(found: &Explained) -> Column {
    let mut left = found.gram.column(0).clone();
    let columns = columns_of(&found.nuisance, &found.items, &found.chosen);
    for (&column, &amount) in columns.iter().zip(&found.solution.coefficients) {
        left.add(-amount, found.gram.column(column));
    }
    left
}

/// The chosen explanations, free of the Gram matrices they were found in.
pub fn chosen_kinds(found: &Explained) -> Vec<Kind> {
    found
        .chosen
        .iter()
        .map(|&i| found.items[i].kind.clone())
        .collect()
}

/// Energy (sum of squares, m²) that each chosen explanation alone accounts for, and all of them.
pub fn energies(found: &Explained, weights: &[f64]) -> (Vec<f64>, f64) {
    energies_of(found, weights, &found.chosen)
}

/// The same for any set.
pub fn energies_of(found: &Explained, weights: &[f64], set: &[usize]) -> (Vec<f64>, f64) {
    let products = found.gram.plain(weights);
    let gain = |set: &[usize]| {
        Factor::new(&products, &columns_of(&found.nuisance, &found.items, set))
            .map_or(0.0, |factor| factor.gain())
    };
    let whole = gain(set);
    let each = (0..set.len())
        .map(|at| {
            let rest: Vec<usize> = set
                .iter()
                .enumerate()
                .filter(|(i, _)| *i != at)
                .map(|(_, c)| *c)
                .collect();
            (whole - gain(&rest)).max(0.0)
        })
        .collect();
    (each, (whole - gain(&[])).max(0.0))
}

/// Fits nuisance and chosen again.
pub fn refit(found: &mut Explained, weights: &[f64]) {
    let products = found.gram.white(weights);
    let columns = columns_of(&found.nuisance, &found.items, &found.chosen);
    if let Some(solution) = solve(&products, &columns) {
        found.solution = solution;
    }
}
