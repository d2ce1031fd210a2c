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
        let at = self.columns.len();
        self.columns.push(column);
        for (run, [white, plain]) in self.rows(at).into_iter().enumerate() {
            self.white[run].push(white.into_iter());
            self.plain[run].push(plain.into_iter());
        }
        at
    }

    /// Replaces a column.
    pub fn replace(&mut self, at: usize, column: Column) {
        self.columns[at] = column;
        for (run, rows) in self.rows(at).into_iter().enumerate() {
            for (products, row) in [&mut self.white[run], &mut self.plain[run]].into_iter().zip(rows) {
                for (other, value) in row.into_iter().enumerate() {
                    *products.at_mut(at, other) = value;
                }
            }
        }
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

    /// White and plain products of a column with all columns, run by run.
    fn rows(&self, at: usize) -> Vec<[Vec<f64>; 2]> {
        let row = |run: usize| {
            let mut rows = [Vec::with_capacity(self.columns.len()), Vec::with_capacity(self.columns.len())];
            let (own, discount) = (&self.columns[at], &self.discounts[run]);
            for other in &self.columns {
                let (a, b) = (&own.low()[run], &other.low()[run]);
                let outside = own.product_outside(other, &self.places[run]);
                let reach = own.reach().min(other.reach());
                let [mut white, mut whole] = [0.0; 2];
                for ((a, b), discount) in a.iter().zip(b).zip(discount).take(reach) {
                    white += (1.0 - discount) * a * b;
                    whole += a * b;
                }
                // The centre, order 1, is the operator's, not the machine's.
                let plain = whole - a[1] * b[1] - a[2] * b[2];
                rows[0].push((white + outside) / self.noise_m2);
                rows[1].push(plain + outside);
            }
            rows
        };
        (0..self.places.len()).into_par_iter().map(row).collect()
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

/// Product of what scatter between runs leaves of the low orders.
pub fn kept(a: &Low, b: &Low, discount: &Low) -> f64 {
    (0..COLUMNS).map(|k| (1.0 - discount[k]) * a[k] * b[k]).sum()
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
