//! The ledger: for every run, the scalar products of all columns in play.
//!
//! Selection, folds, intervals and the bootstrap all work on sums of these small matrices over runs, so that
//! a thousand refits cost less than one pass over the samples. Two metrics are kept: `white` weighs by noise
//! and scatter between runs (evidence), `plain` is the energy on the circle with the centre free (misfit).
use super::basis::{COLUMNS, Low};
use super::column::Column;
use super::products::Products;
use super::spread::Spread;
use super::survey::Prepared;
use rayon::prelude::*;
use std::ops::Range;

/// Products of columns; column 0 is the data.
#[derive(Clone, Debug)]
pub struct Ledger {
    columns: Vec<Column>,
    /// Per run: where its samples are in a column, and the discount of each basis column.
    places: Vec<Range<usize>>,
    discounts: Vec<Low>,
    noise_m2: f64,
    white: Vec<Products>,
    plain: Vec<Products>,
}

impl Ledger {
    /// Opens a ledger on the data.
    pub fn open(runs: &[Prepared], spread: &Spread, data: Column) -> Self {
        let mut ledger = Self {
            columns: Vec::new(),
            places: runs.iter().map(|run| run.place.clone()).collect(),
            discounts: runs.iter().map(|run| spread.discounts(run.visible())).collect(),
            noise_m2: spread.noise_m2,
            white: vec![Products::default(); runs.len()],
            plain: vec![Products::default(); runs.len()],
        };
        ledger.push(data);
        ledger
    }

    /// Adds a column and gives its number.
    pub fn push(&mut self, column: Column) -> usize {
        self.push_all([column]).start
    }

    /// Adds columns and gives their numbers.
    pub fn push_all(&mut self, columns: impl IntoIterator<Item = Column>) -> Range<usize> {
        let first = self.columns.len();
        self.columns.extend(columns);
        let new = first..self.columns.len();
        self.multiply(&new.clone().collect::<Vec<_>>());
        new
    }

    /// Replaces columns.
    pub fn replace_all(&mut self, columns: impl IntoIterator<Item = (usize, Column)>) {
        let mut replaced = Vec::new();
        for (at, column) in columns {
            self.columns[at] = column;
            replaced.push(at);
        }
        self.multiply(&replaced);
    }

    /// Takes out all columns from number `size` on.
    pub fn truncate(&mut self, size: usize) {
        self.columns.truncate(size);
        for products in self.white.iter_mut().chain(&mut self.plain) {
            products.truncate(size);
        }
    }

    /// Number of columns, that of the data included.
    pub fn size(&self) -> usize {
        self.columns.len()
    }

    /// A column.
    pub fn column(&self, at: usize) -> &Column {
        &self.columns[at]
    }

    /// Number of samples of all runs, each so many times.
    pub fn samples(&self, weights: &[f64]) -> f64 {
        self.places.iter().zip(weights).map(|(place, weight)| weight * place.len() as f64).sum()
    }

    /// Brings the products of some columns with all up to date: a run at a time, whose samples in all columns stay in the
    /// cache meanwhile.
    fn multiply(&mut self, changed: &[usize]) {
        let Self { columns, places, discounts, noise_m2, white, plain } = self;
        let mut both = vec![false; columns.len()];
        changed.iter().for_each(|&at| both[at] = true);
        places.par_iter().zip(&*discounts).zip(white).zip(plain).enumerate().for_each(
            |(run, (((place, discount), white), plain))| {
                white.grow(columns.len());
                plain.grow(columns.len());
                for &at in changed {
                    // Two that have changed meet once.
                    for other in (0..columns.len()).filter(|&other| other <= at || !both[other]) {
                        let (own, other_column) = (&columns[at], &columns[other]);
                        let outside = own.product_outside(other_column, place);
                        let [within, plain_within] = products_within(own, other_column, run, discount);
                        *white.at_mut(at, other) = (within + outside) / *noise_m2;
                        *plain.at_mut(at, other) = plain_within + outside;
                    }
                }
            },
        );
    }

    /// Evidence products summed over runs with the given weights (1 keep, 0 leave out, bootstrap counts).
    pub fn white(&self, weights: &[f64]) -> Products {
        total(&self.white, weights)
    }

    /// Energy products summed over runs.
    pub fn plain(&self, weights: &[f64]) -> Products {
        total(&self.plain, weights)
    }

    /// Evidence products of one run.
    pub fn white_of(&self, run: usize) -> &Products {
        &self.white[run]
    }

    /// Discount of each basis column in one run.
    pub fn discounts(&self, run: usize) -> &Low {
        &self.discounts[run]
    }

    /// Variance of a sample, m².
    pub const fn noise_m2(&self) -> f64 {
        self.noise_m2
    }
}

/// White and plain product of the low orders of two columns in one run, the same from either side.
fn products_within(one: &Column, other: &Column, run: usize, discount: &Low) -> [f64; 2] {
    let (a, b) = (&one.low()[run], &other.low()[run]);
    let [mut white, mut whole] = [0.0; 2];
    for ((a, b), discount) in a.iter().zip(b).zip(discount).take(one.reach().min(other.reach())) {
        let product = a * b;
        white += (1.0 - discount) * product;
        whole += product;
    }
    // The centre, order 1, is the operator's, not the machine's.
    [white, whole - a[1] * b[1] - a[2] * b[2]]
}

/// Product of what scatter between runs leaves of the low orders.
pub fn kept(a: &Low, b: &Low, discount: &Low) -> f64 {
    (0..COLUMNS).map(|k| (1.0 - discount[k]) * (a[k] * b[k])).sum()
}

fn total(products: &[Products], weights: &[f64]) -> Products {
    let mut sum = Products::zeros(products.first().map_or(0, Products::size));
    for (products, &weight) in products.iter().zip(weights) {
        if weight != 0.0 {
            sum.add(weight, products);
        }
    }
    sum
}
