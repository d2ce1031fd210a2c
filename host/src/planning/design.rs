//! The choice of runs: Ds-optimality (the determinant of the information on the competing explanations, all
//! else free), greedy first and then by exchange; and what the choice is worth, pair by pair.
use super::grid::Circle;
use super::information::{self, Column};
use super::question::Question;
use crate::campaign::Campaign;
use crate::causes::{Cause, RunView};
use crate::diagnosis::Diagnosis;
use nalgebra::DMatrix;
use serde::Serialize;

/// What the runs are expected to tell about a pair.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Separation {
    /// Names: what the diagnosis named, and what it could not tell from it.
    pub pair: [String; 2],
    /// Expected χ² (one degree of freedom) against the second if the first is true at the size that was found,
    /// from the runs at hand.
    pub expected_chi2_before: f64,
    /// The same with the planned runs added.
    pub expected_chi2_after: f64,
    /// The words of the cause on what to measure.
    #[serde(skip)]
    pub test: String,
}

/// A price of 14 and a look-alike margin of 6: what the search of the diagnosis asks for.
const ENOUGH_CHI2: f64 = 25.0;
/// Below this the pair stays together.
const TOLD_CHI2: f64 = 9.0;
/// Fewest planned runs.
const FEWEST: usize = 4;
/// Amplitude thought possible beforehand, m: keeps determinants finite.
const PRIOR_M: f64 = 10e-6;
/// Most times that one circle is chosen.
const MOST_REPEATS: usize = 2;

impl Separation {
    /// Whether the planned runs tell the pair apart.
    pub fn told(&self) -> bool {
        self.expected_chi2_after >= TOLD_CHI2
    }
}

/// The runs that were chosen.
#[derive(Clone, Debug, Default)]
pub struct Chosen {
    /// Circles, not in order.
    pub circles: Vec<Circle>,
    /// What they are worth.
    pub separations: Vec<Separation>,
}

/// Everything the criterion needs.
struct Problem {
    columns: Vec<Column>,
    /// Indices of the columns that compete.
    open: Vec<usize>,
    /// Information of the runs at hand.
    known: DMatrix<f64>,
    /// Information of each candidate.
    candidates: Vec<DMatrix<f64>>,
}

/// Chooses at most `most` runs.
pub fn choose(
    campaign: &Campaign,
    diagnosis: &Diagnosis,
    question: &Question,
    circles: &[Circle],
    most: usize,
) -> Chosen {
    let problem = problem(campaign, diagnosis, question, circles);
    let pairs = pairs(&problem, diagnosis, question);
    let total = |picked: &[usize]| {
        picked.iter().fold(problem.known.clone(), |sum, &i| {
            sum + &problem.candidates[i]
        })
    };
    let may =
        |picked: &[usize], i: usize| picked.iter().filter(|p| **p == i).count() < MOST_REPEATS;
    let best = |picked: &[usize]| {
        let base = total(picked);
        (0..circles.len())
            .filter(|&i| may(picked, i))
            .map(|i| (problem.criterion(&(&base + &problem.candidates[i])), i))
            .max_by(|a, b| a.0.total_cmp(&b.0))
    };
    let enough = |picked: &[usize]| {
        let sum = total(picked);
        !pairs.is_empty() && pairs.iter().all(|p| problem.chi2(&sum, p) >= ENOUGH_CHI2)
    };
    let mut picked: Vec<usize> = Vec::new();
    while picked.len() < most && !(picked.len() >= FEWEST && enough(&picked)) {
        let Some((_, next)) = best(&picked) else {
            break;
        };
        picked.push(next);
    }
    // Exchange: each run in turn for the best one beside the others.
    for _ in 0..3 {
        let mut changed = false;
        for at in 0..picked.len() {
            let mut others = picked.clone();
            others.remove(at);
            if let Some((value, other)) = best(&others)
                && value > problem.criterion(&total(&picked)) + 1e-9
            {
                picked[at] = other;
                changed = true;
            }
        }
        if !changed {
            break;
        }
    }
    let after = total(&picked);
    let separations = pairs
        .iter()
        .map(|pair| Separation {
            pair: pair.names.clone(),
            expected_chi2_before: problem.chi2(&problem.known, pair),
            expected_chi2_after: problem.chi2(&after, pair),
            test: pair.test.clone(),
        })
        .collect();
    Chosen {
        circles: picked.iter().map(|&i| circles[i]).collect(),
        separations,
    }
}

/// A pair: the column of what was found, its amplitude in scaled units (m), and the columns of the other.
struct Pair {
    names: [String; 2],
    own: usize,
    amplitude_m: f64,
    others: Vec<usize>,
    test: String,
}

fn columns_of(cause: Cause, views: &[RunView]) -> Vec<Column> {
    let model = cause.model();
    let Some(shape) = model.shapes(views).into_iter().next() else {
        return Vec::new();
    };
    let mut out = Vec::new();
    for site in model.sites(views) {
        for at in 0..model.columns() {
            out.push(Column {
                cause: Some(cause),
                site,
                shape: shape.clone(),
                at,
                scale: 1.0,
            });
        }
    }
    out
}

fn problem(
    campaign: &Campaign,
    diagnosis: &Diagnosis,
    question: &Question,
    circles: &[Circle],
) -> Problem {
    let response = diagnosis.model.servo.response();
    let seen: Vec<Circle> = campaign
        .runs
        .iter()
        .map(|run| Circle {
            radius_m: run.radius_m,
            feed_m_s: run.feed_m_s,
            direction: run.direction,
            plane: super::grid::plane_of(run),
        })
        .collect();
    let last = (seen.len().max(2) - 1) as f64;
    let order: Vec<f64> = (0..seen.len()).map(|i| i as f64 / last).collect();
    let at_hand = information::views(&seen, &response, &order);
    let possible = information::views(circles, &response, &vec![0.5; circles.len()]);
    let mut columns = vec![Column {
        cause: None,
        site: crate::causes::Site::Machine,
        shape: Vec::new(),
        at: 0,
        scale: 1.0,
    }];
    let found = diagnosis.findings.iter().map(|f| f.cause);
    let members = question
        .classes
        .iter()
        .flat_map(|class| class.members.iter().copied());
    for cause in found.chain(members) {
        if !columns.iter().any(|c| c.cause == Some(cause)) {
            columns.extend(columns_of(cause, &at_hand));
        }
    }
    let everything: Vec<RunView> = at_hand.iter().chain(&possible).cloned().collect();
    information::scale(&mut columns, &everything);
    let spread = information::spread(diagnosis);
    let known = information::products(&columns, &at_hand, &spread)
        .into_iter()
        .fold(DMatrix::zeros(columns.len(), columns.len()), |sum, x| {
            sum + x
        });
    let candidates = information::products(&columns, &possible, &spread);
    let open = (0..columns.len())
        .filter(|&i| {
            question
                .classes
                .iter()
                .any(|c| c.members.iter().any(|m| columns[i].cause == Some(*m)))
        })
        .collect();
    Problem {
        columns,
        open,
        known,
        candidates,
    }
}

fn pairs(problem: &Problem, diagnosis: &Diagnosis, question: &Question) -> Vec<Pair> {
    let mut out = Vec::new();
    for finding in &diagnosis.findings {
        let Some(class) = question
            .classes
            .iter()
            .find(|c| c.members.first() == Some(&finding.cause))
        else {
            continue;
        };
        let Some(own) = problem.columns.iter().position(|c| {
            c.cause == Some(finding.cause)
                && (finding.axis.is_none() || c.site.axis() == finding.axis)
        }) else {
            continue;
        };
        for other in &class.members[1..] {
            let others: Vec<usize> = (0..problem.columns.len())
                .filter(|&i| problem.columns[i].cause == Some(*other))
                .collect();
            if !others.is_empty() {
                out.push(Pair {
                    names: [finding.cause.id().to_string(), other.id().to_string()],
                    own,
                    amplitude_m: finding.estimate.value * problem.columns[own].scale,
                    others,
                    test: finding.next_measurement.clone(),
                });
            }
        }
    }
    out
}

fn log_det(matrix: DMatrix<f64>) -> f64 {
    matrix.cholesky().map_or(f64::NEG_INFINITY, |c| {
        2.0 * c.l().diagonal().iter().map(|d| d.ln()).sum::<f64>()
    })
}

fn part(matrix: &DMatrix<f64>, rows: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), rows.len(), |i, j| matrix[(rows[i], rows[j])])
}

impl Problem {
    /// ln det of the information on the open columns, the others free.
    fn criterion(&self, information: &DMatrix<f64>) -> f64 {
        let mut with_prior = information.clone();
        for i in 0..with_prior.nrows() {
            with_prior[(i, i)] += PRIOR_M.powi(-2);
        }
        let rest: Vec<usize> = (0..self.columns.len())
            .filter(|i| !self.open.contains(i))
            .collect();
        let free = log_det(part(&with_prior, &rest));
        log_det(with_prior) - free
    }

    /// Expected χ² of the first of a pair when the second, the simulation and the other findings may take what
    /// they can: a²·(1/(M⁻¹)₁₁).
    fn chi2(&self, information: &DMatrix<f64>, pair: &Pair) -> f64 {
        let taken =
            |i: &usize| *i != pair.own && (pair.others.contains(i) || !self.open.contains(i));
        let rows: Vec<usize> = std::iter::once(pair.own)
            .chain((0..self.columns.len()).filter(taken))
            .collect();
        let mut m = part(information, &rows);
        let largest = m.diagonal().max().max(f64::MIN_POSITIVE);
        for i in 0..rows.len() {
            m[(i, i)] += 1e-10 * largest;
        }
        let left = m.cholesky().map_or(0.0, |c| 1.0 / c.inverse()[(0, 0)]);
        (pair.amplitude_m.powi(2) * (left - 1e-10 * largest)).max(0.0)
    }
}
