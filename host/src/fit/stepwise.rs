//! Stepwise selection by partial F: the strongest term enters, the weakest leaves (Eq. 4–11, 17–19).
use super::{FitError, LeastSquares, Triangle, critical_f};

/// How the partial F of a term is formed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum PartialF {
    /// (SSR gained / terms gained) / MSE against F_{α; terms gained; n − p}: the textbook's (Draper and Smith). One term
    /// at a time, so the numerator has one degree of freedom; it is the square of the term's t.
    #[default]
    Textbook,
    /// As the paper writes it (Eq. 18 and the text under Eq. 3): SSR gained divided by p, the number of all
    /// estimated parameters, against F_{α; p; n − p}. For p = 2 it halves F and lowers the bar only from 4.26
    /// to 3.40 (n = 26): harder to enter. The paper's own numbers use F_{0.05;1;24}, the textbook's.
    Paper,
}

/// Rules of the selection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepwiseOptions {
    /// Significance to enter.
    pub enter: f64,
    /// Significance to stay; not below `enter`, or a term could go in and out for ever.
    pub remove: f64,
    /// Definition of partial F.
    pub partial_f: PartialF,
}

impl Default for StepwiseOptions {
    fn default() -> Self {
        Self {
            enter: 0.05,
            remove: 0.05,
            partial_f: PartialF::Textbook,
        }
    }
}

/// What happened to a term.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// It came in: partial F ≥ critical F.
    Enter,
    /// It went out: partial F < critical F with the others in.
    Remove,
    /// The strongest term outside was too weak: the end.
    Reject,
}

/// One step of the selection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// What was done.
    pub action: Action,
    /// Column of the triangle.
    pub column: usize,
    /// Partial F of the column.
    pub partial_f: f64,
    /// The bar it was held against.
    pub critical_f: f64,
    /// Degrees of freedom of numerator and denominator.
    pub dof: (usize, usize),
}

/// Outcome of a selection.
#[derive(Clone, Debug, PartialEq)]
pub struct Selection {
    /// Columns in the model: the forced ones first, then in order of entry.
    pub columns: Vec<usize>,
    /// What was done, in order.
    pub steps: Vec<Step>,
    /// The fit on `columns`.
    pub fit: LeastSquares,
}

/// F of what `full` explains beyond `reduced` (one column fewer), with its degrees of freedom.
fn partial_f(
    rule: PartialF,
    reduced: &LeastSquares,
    full: &LeastSquares,
    parameters: usize,
) -> (f64, (usize, usize)) {
    let numerator = match rule {
        PartialF::Textbook => 1,
        PartialF::Paper => parameters,
    };
    let gained = (reduced.rss - full.rss).max(0.0);
    let f = if gained == 0.0 {
        0.0
    } else {
        gained / numerator as f64 / full.variance()
    };
    (f, (numerator, full.dof))
}

/// Selects among `candidates`; the `forced` columns are always in.
///
/// A candidate that depends on columns already in is passed over.
///
/// # Errors
/// [`FitError`] where the forced columns cannot be fitted or significances are outside (0, 1).
pub fn stepwise(
    triangle: &Triangle,
    forced: &[usize],
    candidates: &[usize],
    options: StepwiseOptions,
) -> Result<Selection, FitError> {
    let mut columns = forced.to_vec();
    let mut fit = triangle.solve(&columns)?;
    let mut steps: Vec<Step> = Vec::new();
    let remove = options.remove.max(options.enter);
    // Each round raises the explained sum of squares beyond the bar, so rounds cannot repeat; the limit is for safety.
    for _ in 0..4 * candidates.len() + 4 {
        let Some((enter, with)) = strongest(triangle, &columns, candidates, &fit, options)? else {
            break;
        };
        steps.push(enter);
        if enter.action == Action::Reject {
            break;
        }
        columns.push(enter.column);
        fit = with;
        // The only one there is the one that has just come in.
        while columns.len() > forced.len() + 1 {
            match weakest(
                triangle,
                &columns,
                forced.len(),
                &fit,
                remove,
                options.partial_f,
            )? {
                Some(leave) if leave.column != enter.column => {
                    steps.push(leave);
                    columns.retain(|&c| c != leave.column);
                    fit = triangle.solve(&columns)?;
                }
                Some(_) | None => break,
            }
        }
    }
    Ok(Selection {
        columns,
        steps,
        fit,
    })
}

/// The outside candidate with the largest F, marked as entering or rejected; none if none is left.
fn strongest(
    triangle: &Triangle,
    columns: &[usize],
    candidates: &[usize],
    fit: &LeastSquares,
    options: StepwiseOptions,
) -> Result<Option<(Step, LeastSquares)>, FitError> {
    let mut best: Option<(Step, LeastSquares)> = None;
    let parameters = triangle.parameters(columns.len() + 1);
    if triangle.observations() <= parameters {
        return Ok(None);
    }
    let mut trial = columns.to_vec();
    trial.push(0);
    for &column in candidates.iter().filter(|c| !columns.contains(c)) {
        trial[columns.len()] = column;
        let with = match triangle.solve(&trial) {
            Ok(with) => with,
            Err(FitError::Collinear { .. }) => continue,
            Err(error) => return Err(error),
        };
        let (f, dof) = partial_f(options.partial_f, fit, &with, parameters);
        if best.as_ref().is_none_or(|(step, _)| f > step.partial_f) {
            let step = Step {
                action: Action::Enter,
                column,
                partial_f: f,
                critical_f: 0.0,
                dof,
            };
            best = Some((step, with));
        }
    }
    if let Some((step, _)) = &mut best {
        step.critical_f = critical_f(options.enter, step.dof.0, step.dof.1)?;
        if step.partial_f < step.critical_f {
            step.action = Action::Reject;
        }
    }
    Ok(best)
}

/// The column with the smallest F, if that is below the bar. What a column explains beyond the others is b²/C, without
/// another fit.
fn weakest(
    triangle: &Triangle,
    columns: &[usize],
    forced: usize,
    fit: &LeastSquares,
    remove: f64,
    rule: PartialF,
) -> Result<Option<Step>, FitError> {
    let parameters = triangle.parameters(columns.len());
    let constant = parameters - columns.len();
    let numerator = match rule {
        PartialF::Textbook => 1,
        PartialF::Paper => parameters,
    };
    let gained = |place: usize| {
        let j = constant + place;
        fit.coefficients[j].powi(2) / fit.unscaled_covariance[(j, j)]
    };
    let Some(place) = (forced..columns.len()).min_by(|&a, &b| gained(a).total_cmp(&gained(b)))
    else {
        return Ok(None);
    };
    let partial_f = gained(place) / numerator as f64 / fit.variance();
    let dof = (numerator, fit.dof);
    let critical_f = critical_f(remove, dof.0, dof.1)?;
    let step = Step {
        action: Action::Remove,
        column: columns[place],
        partial_f,
        critical_f,
        dof,
    };
    Ok((partial_f < critical_f).then_some(step))
}
