//! Gram matrices: for every run, the scalar products of all columns in play.
//!
//! Selection, folds, intervals and the bootstrap all work on sums of these small matrices over runs, so that
//! a thousand refits cost less than one pass over the samples. Two metrics are kept: `white` weighs by noise
//! and scatter between runs (evidence), `plain` is the energy on the circle with the centre free (misfit).
use super::design_column::Column;
use super::low_orders::{COLUMNS, Low};
use super::products::Products;
use super::spread::Spread;
use super::survey::Prepared;
use rayon::prelude::*;
use std::ops::Range;

/// Products of columns; column 0 is the data.
#[derive(Clone, Debug)]
pub struct Gram {
    columns: Vec<Column>,
    /// Per run: where its samples are in a column, and the discount of each basis column.
    places: Vec<Range<usize>>,
    discounts: Vec<Low>,
    noise_m2: f64,
    white: Vec<Products>,
    plain: Vec<Products>,
}

impl Gram {
    /// Gram matrices of the data alone.
    pub fn open(runs: &[Prepared], spread: &Spread, data: Column) -> Self {
        let mut gram = Self {
            columns: Vec::new(),
            places: runs.iter().map(|run| run.place.clone()).collect(),
            discounts: runs
                .iter()
                .map(|run| spread.discounts(run.visible()))
                .collect(),
            noise_m2: spread.noise_m2,
            white: vec![Products::default(); runs.len()],
            plain: vec![Products::default(); runs.len()],
        };
        gram.push(data);
        gram
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
        self.places
            .iter()
            .zip(weights)
            .map(|(place, weight)| weight * place.len() as f64)
            .sum()
    }

    /// Brings the products of some columns with all up to date: a run at a time, whose samples in all columns stay in the
    /// cache meanwhile.
    fn multiply(&mut self, changed: &[usize]) {
        let Self {
            columns,
            places,
            discounts,
            noise_m2,
            white,
            plain,
        } = self;
        let mut has_changed = vec![false; columns.len()];
        changed.iter().for_each(|&at| has_changed[at] = true);
        places
            .par_iter()
            .zip(&*discounts)
            .zip(white)
            .zip(plain)
            .enumerate()
            .for_each(|(run, (((place, discount), white), plain))| {
                white.grow(columns.len());
                plain.grow(columns.len());
                for &at in changed {
                    // Two that have changed meet once.
                    for other in
                        (0..columns.len()).filter(|&other| other <= at || !has_changed[other])
                    {
                        let [one, two] = [&columns[at], &columns[other]];
                        let outside = one.product_outside(two, place);
                        let [kept, whole] = products_within(one, two, run, discount);
                        *white.at_mut(at, other) = (kept + outside) / *noise_m2;
                        *plain.at_mut(at, other) = whole + outside;
                    }
                }
            });
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
    for ((a, b), discount) in a
        .iter()
        .zip(b)
        .zip(discount)
        .take(one.reach().min(other.reach()))
    {
        let product = a * b;
        white += (1.0 - discount) * product;
        whole += product;
    }
    // The centre, order 1, is the operator's, not the machine's.
    [white, whole - a[1] * b[1] - a[2] * b[2]]
}

/// Product of what scatter between runs leaves of the low orders.
pub fn kept(a: &Low, b: &Low, discount: &Low) -> f64 {
    (0..COLUMNS)
        .map(|k| (1.0 - discount[k]) * (a[k] * b[k]))
        .sum()
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

#[cfg(test)]
mod tests {
    use super::super::hypothesis::Kind;
    use super::super::pattern::Pattern;
    use super::super::spread;
    use super::super::survey::{Survey, misfit};
    use super::*;
    use crate::causes::Cause;
    use crate::causes::Site;
    use crate::model_file::Servo;
    use crate::simulation::{self, Plan};
    use giotto_shared::{Actuator, Plane};
    use std::path::Path;

    const PLAN: &str = r#"
[campaign]
name = "gram matrices"
[machine]
x = { backlash_um = 8.0 }
[instrument]
noise_um = 1.0
spread_um = 0.5
[grid]
radii_mm = [100.0, 150.0]
feeds_mm_s = [50.0, 200.0, 400.0]
directions = ["ccw", "cw"]
"#;

    /// Columns of both sorts: low orders only, and with samples of their own.
    fn kinds() -> Vec<Kind> {
        let cause = |cause, site, shape: &[f64]| Kind::Cause {
            cause,
            site,
            shape: shape.to_vec(),
        };
        let mut kinds = vec![
            cause(Cause::Squareness, Site::Pair(Plane::Xy), &[]),
            cause(Cause::Backlash, Site::One(Actuator::X), &[0.0, 0.0]),
            cause(Cause::CyclicError, Site::One(Actuator::Y), &[0.02]),
        ];
        kinds.extend(Pattern::sizes().into_iter().take(2).map(Kind::Pattern));
        kinds
    }

    #[test]
    fn columns_that_come_or_change_together_are_those_that_did_so_one_by_one() {
        let campaign = simulation::campaign(&Plan::parse(PLAN, Path::new("gram.toml")).unwrap(), 1);
        let (runs, _) =
            Survey::new(&campaign).prepare(&Servo::Lag { kv_per_s: 90.0 }.response(), 0.0);
        let data = misfit(&runs);
        let spread = spread::measure(&runs, &data.all_samples(&runs), false);
        let columns: Vec<Column> = kinds()
            .iter()
            .flat_map(|kind| kind.columns_over(&runs))
            .collect();
        assert!(
            columns
                .iter()
                .any(|column| column.outside(&runs[0]).is_empty())
        );
        assert!(
            columns
                .iter()
                .any(|column| !column.outside(&runs[0]).is_empty())
        );
        let mut one_by_one = Gram::open(&runs, &spread, data.clone());
        for column in &columns {
            one_by_one.push(column.clone());
        }
        let mut together = Gram::open(&runs, &spread, data.clone());
        assert_eq!(together.push_all(columns.clone()), 1..columns.len() + 1);
        let same = |a: &Gram, b: &Gram| a.white == b.white && a.plain == b.plain;
        assert!(same(&together, &one_by_one));
        let mut all = [vec![data], columns].concat();
        is_by_definition(&together, &all, &runs);
        // Others in their places, the last first.
        let changed = [
            (4, all[1].clone()),
            (1, all[2].clone()),
            (3, all[5].clone()),
        ];
        changed
            .iter()
            .for_each(|(at, column)| all[*at] = column.clone());
        together.replace_all(changed);
        is_by_definition(&together, &all, &runs);
    }

    /// White products weigh the low orders of a run by what scatter leaves of them, plain ones are without the centre.
    fn is_by_definition(gram: &Gram, all: &[Column], runs: &[Prepared]) {
        for (run, prepared) in runs.iter().enumerate() {
            let [white, plain] = [&gram.white[run], &gram.plain[run]];
            for (i, j) in (0..all.len()).flat_map(|i| (0..all.len()).map(move |j| (i, j))) {
                let (a, b) = (&all[i].low()[run], &all[j].low()[run]);
                let outside = all[i].product_outside(&all[j], &prepared.place);
                let low: f64 = (0..COLUMNS)
                    .filter(|k| ![1, 2].contains(k))
                    .map(|k| a[k] * b[k])
                    .sum();
                let close = |products: &Products, value: f64| {
                    let size = (products.at(i, i) * products.at(j, j)).sqrt();
                    (products.at(i, j) - value).abs() <= 1e-9 * size
                };
                assert!(close(plain, low + outside), "run {run}: {i}, {j}");
                let weighed = kept(a, b, gram.discounts(run)) + outside;
                assert!(close(white, weighed / gram.noise_m2), "run {run}: {i}, {j}");
            }
            assert!(
                (0..all.len()).all(|i| white.at(i, i) > 0.0 && plain.at(i, i) > 0.0),
                "run {run}"
            );
        }
    }
}
