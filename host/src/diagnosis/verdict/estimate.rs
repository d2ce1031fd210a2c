//! The size of an explanation and half its interval.
use crate::diagnosis::explained::Explained;
use crate::diagnosis::footing::{FEWEST_RUNS, freedom};
use crate::diagnosis::hypothesis::Kind;
use crate::diagnosis::search::columns_of;
use crate::diagnosis::tangent;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Ratio of variances, by the runs and by the model, above which the former is believed.
const ROBUST: f64 = 1.5;

/// Value and half-width of its 95 % interval, in the contract's unit.
pub(super) fn estimate(found: &Explained, item: usize) -> (f64, f64) {
    let columns = columns_of(&found.nuisance, &found.items, &found.chosen);
    let own = &found.items[item].columns;
    let at: Vec<usize> = own
        .iter()
        .filter_map(|c| columns.iter().position(|other| other == c))
        .collect();
    let dof = freedom(found.runs.len(), columns.len() as f64);
    let t = StudentsT::new(0.0, 1.0, dof).map_or(2.0, |t| t.inverse_cdf(0.975));
    // Nuisance and chosen come first with the tangents, too.
    let (covariance, ..) = tangent::covariance(found);
    // Of a few runs the pulls say nothing: their scatter is not measured.
    let robust = if found.runs.len() < FEWEST_RUNS {
        Vec::new()
    } else {
        robust_variances(found)
    };
    let value: Vec<f64> = at.iter().map(|&i| found.solution.coefficients[i]).collect();
    // The scatter of the runs' pulls is itself uncertain by a quarter or so: it counts where it says clearly more.
    let variance = |i: usize| {
        let robust = robust.get(i).copied().unwrap_or(0.0);
        if robust > ROBUST * covariance[(i, i)] {
            robust
        } else {
            covariance[(i, i)]
        }
    };
    let doubt = match &found.items[item].kind {
        Kind::Cause { cause, .. } => cause.model().relative_doubt(),
        Kind::Pattern(_) => 0.0,
    };
    let half = |value: f64, se: f64| (t * se).hypot(1.96 * doubt * value);
    match (value.as_slice(), at.as_slice()) {
        ([only], [i]) => (*only, half(*only, variance(*i).sqrt())),
        ([a, b], [i, j]) => {
            let size = a.hypot(*b).max(f64::MIN_POSITIVE);
            let se = ((a / size).powi(2) * variance(*i) + (b / size).powi(2) * variance(*j)).sqrt();
            (size, half(size, se))
        }
        _ => (f64::NAN, f64::NAN),
    }
}

/// Variances of the coefficients by the scatter of the runs' pulls (sandwich, with the run as the cluster).
fn robust_variances(found: &Explained) -> Vec<f64> {
    let (bread, columns, coefficients) = tangent::covariance(found);
    let n = columns.len();
    let mut meat = nalgebra::DMatrix::<f64>::zeros(n, n);
    for run in 0..found.runs.len() {
        let white = found.gram.white_of(run);
        let pull: Vec<f64> = columns
            .iter()
            .map(|&a| {
                let fitted: f64 = columns
                    .iter()
                    .zip(&coefficients)
                    .map(|(&b, x)| white.at(a, b) * x)
                    .sum();
                white.at(a, 0) - fitted
            })
            .collect();
        for i in 0..n {
            for j in 0..n {
                meat[(i, j)] += pull[i] * pull[j];
            }
        }
    }
    let runs = found.runs.len() as f64;
    let small = runs / (runs - n as f64).max(1.0);
    let sandwich = bread * meat * bread * small;
    (0..n).map(|i| sandwich[(i, i)]).collect()
}
