//! What the chosen signatures do when their shapes, or the lag of the machine, move a little.
//!
//! Fitted beside the chosen columns, these tangents tell how far each shape is from its best (a Gauss–Newton step with
//! the sizes projected out), and how much of each size hangs on a shape that is itself only estimated: intervals count
//! them in. A weak prior keeps what the runs cannot tell within a few of its steps.
use super::design_column::Column;
use super::explained::{Explained, refit};
use super::hypothesis::Kind;
use super::linear::{Solution, solve};
use super::search::columns_of;
use super::survey::Prepared;
use crate::causes::Bend;
use nalgebra::DMatrix;
use std::sync::Arc;

/// One shape parameter of one chosen explanation.
#[derive(Clone, Copy, Debug)]
struct Shape {
    item: usize,
    which: usize,
    step: f64,
    /// Standard deviation about where it is, in steps.
    prior: f64,
}

/// Nuisance, chosen and their tangents, fitted together.
#[derive(Clone, Debug)]
pub struct Tangents {
    shapes: Vec<Shape>,
    lag: bool,
    /// All columns: nuisance, chosen, shapes, lag.
    pub columns: Vec<usize>,
    /// Their fit.
    pub solution: Solution,
}

/// Standard deviation of an amount about where it is, in steps.
const PRIOR: f64 = 20.0;
/// The same of a choice: the other value is one step away.
const PRIOR_OF_CHOICE: f64 = 0.6;
/// Longest move of a shape at once, in steps.
const LONGEST: f64 = 8.0;
/// Step of the lag, s.
const LAG_STEP_S: f64 = 1e-4;
/// Longest move of the lag at once, s.
const LONGEST_LAG_S: f64 = 5e-3;
/// χ² below which a move is not worth while.
const WORTH: f64 = 0.3;

/// Adds the tangents to the Gram matrices, behind the columns that are there, and fits all together: the amounts, or the
/// `whole` with choices and the lag. Take them out again
/// with [`Gram::truncate`](super::gram::Gram::truncate).
fn lay(found: &mut Explained, weights: &[f64], whole: bool) -> Option<Tangents> {
    let runs = Arc::clone(&found.runs);
    let travel_m = 2.0
        * runs
            .iter()
            .map(|run| run.view.radius_m)
            .fold(1e-3, f64::max);
    let mut columns = columns_of(&found.nuisance, &found.items, &found.chosen);
    let amounts: Vec<(usize, Vec<f64>)> = found
        .chosen
        .iter()
        .map(|&item| {
            let amount = |column: &usize| {
                let at = columns.iter().position(|c| c == column);
                at.map_or(0.0, |at| found.solution.coefficients[at])
            };
            (item, found.items[item].columns.iter().map(amount).collect())
        })
        .collect();
    let mut shapes = Vec::new();
    for (item, amounts) in &amounts {
        let Kind::Cause { cause, site, shape } = found.items[*item].kind.clone() else {
            continue;
        };
        for which in 0..shape.len() {
            let (step, prior) = match cause.model().bend(which, shape[which], travel_m) {
                Bend::Amount(step) => (step, PRIOR),
                Bend::Choice(other) if whole => (other - shape[which], PRIOR_OF_CHOICE),
                _ => continue,
            };
            let mut shape = shape.clone();
            shape[which] += step;
            let moved = Kind::Cause { cause, site, shape };
            let tangent = difference(found, *item, amounts, &moved, &runs);
            columns.push(found.gram.push(tangent));
            shapes.push(Shape {
                item: *item,
                which,
                step,
                prior,
            });
        }
    }
    // Angles that were measured hold no lag.
    let lag = whole && runs.iter().any(|run| run.turned_rad != 0.0) && found.lag.se_s > 0.0;
    if lag {
        let mut late = runs.to_vec();
        for run in &mut late {
            run.turn_to(run.view.lag_rad + LAG_STEP_S * run.view.omega_rad_s);
        }
        let mut tangent = Column::zero(runs.len());
        for (item, amounts) in &amounts {
            let kind = found.items[*item].kind.clone();
            tangent.add(1.0, &difference(found, *item, amounts, &kind, &late));
        }
        columns.push(found.gram.push(tangent));
    }
    if shapes.is_empty() && !lag {
        return None;
    }
    let mut products = found.gram.white(weights);
    let own = columns.len() - shapes.len() - usize::from(lag);
    for (&column, shape) in columns[own..].iter().zip(&shapes) {
        *products.at_mut(column, column) += shape.prior.powi(-2);
    }
    if lag {
        // About what the set-up offset says.
        let column = columns[columns.len() - 1];
        let stiff = (LAG_STEP_S / found.lag.se_s).powi(2);
        *products.at_mut(column, column) += stiff;
        *products.at_mut(column, 0) -= stiff * found.more_lag_s / LAG_STEP_S;
    }
    let solution = solve(&products, &columns)?;
    Some(Tangents {
        shapes,
        lag,
        columns,
        solution,
    })
}

/// What the explanation `item` does as `moved` on `runs`, beyond what it does now, at its present amounts.
fn difference(
    found: &Explained,
    item: usize,
    amounts: &[f64],
    moved: &Kind,
    runs: &[Prepared],
) -> Column {
    let mut out = Column::zero(runs.len());
    let columns = found.items[item]
        .columns
        .iter()
        .zip(moved.columns_over(runs));
    for (&amount, (&now, moved)) in amounts.iter().zip(columns) {
        out.add(amount, &moved);
        out.add(-amount, found.gram.column(now));
    }
    out
}

/// Moves the shapes of the chosen explanations to their best beside each other.
pub fn polish(found: &mut Explained, weights: &[f64]) {
    for _ in 0..4 {
        let size = found.gram.size();
        let tangents = lay(found, weights, false);
        found.gram.truncate(size);
        let Some(tangents) = tangents else { return };
        if tangents.solution.gain - found.solution.gain < WORTH || !step(found, weights, &tangents)
        {
            return;
        }
    }
}

/// One move along the tangents, shortened until it gains; `false`: there is none.
fn step(found: &mut Explained, weights: &[f64], tangents: &Tangents) -> bool {
    let first = tangents.columns.len() - tangents.shapes.len() - usize::from(tangents.lag);
    let before: Vec<Kind> = found.items.iter().map(|item| item.kind.clone()).collect();
    let solution = found.solution.clone();
    for share in [1.0, 0.4, 0.1] {
        for (shape, steps) in tangents
            .shapes
            .iter()
            .zip(&tangents.solution.coefficients[first..])
        {
            if let Kind::Cause { shape: values, .. } = &mut found.items[shape.item].kind {
                values[shape.which] += share * steps.clamp(-LONGEST, LONGEST) * shape.step;
            }
        }
        for shape in &tangents.shapes {
            if let Kind::Cause { cause, shape, .. } = &mut found.items[shape.item].kind {
                cause.model().tidy(shape);
            }
        }
        relay(found, &tangents.shapes);
        refit(found, weights);
        if found.solution.gain > solution.gain + 0.1 * WORTH {
            return true;
        }
        for (item, kind) in found.items.iter_mut().zip(&before) {
            item.kind = kind.clone();
        }
    }
    relay(found, &tangents.shapes);
    found.solution = solution;
    false
}

/// Brings the columns of the moved shapes up to date.
fn relay(found: &mut Explained, shapes: &[Shape]) {
    let mut items: Vec<usize> = shapes.iter().map(|shape| shape.item).collect();
    items.dedup();
    found.relay(&items);
}

/// Lays the tangents for good, so that intervals count them in, and says how much longer the lag ought to be, s.
pub fn finish(found: &mut Explained, weights: &[f64]) -> f64 {
    found.tangents = lay(found, weights, true);
    match &found.tangents {
        Some(Tangents {
            lag: true,
            solution,
            ..
        }) => {
            let steps = solution.coefficients.last().copied().unwrap_or(0.0);
            (LAG_STEP_S * steps).clamp(-LONGEST_LAG_S, LONGEST_LAG_S)
        }
        _ => 0.0,
    }
}

/// Standard error of the delay beside all that is chosen, s; `None`: it was not fitted.
pub fn lag_se_s(found: &Explained) -> Option<f64> {
    let tangents = found.tangents.as_ref().filter(|tangents| tangents.lag)?;
    let last = tangents.columns.len().checked_sub(1)?;
    Some(LAG_STEP_S * tangents.solution.covariance[(last, last)].sqrt())
}

/// Covariance and columns with the tangents, or without where there are none.
pub fn covariance(found: &Explained) -> (&DMatrix<f64>, Vec<usize>, Vec<f64>) {
    match &found.tangents {
        Some(tangents) => (
            &tangents.solution.covariance,
            tangents.columns.clone(),
            tangents.solution.coefficients.clone(),
        ),
        None => (
            &found.solution.covariance,
            columns_of(&found.nuisance, &found.items, &found.chosen),
            found.solution.coefficients.clone(),
        ),
    }
}
