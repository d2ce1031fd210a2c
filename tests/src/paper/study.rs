//! The paper's campaign under many seeds.
use super::{Measurement, PAPER, campaign, fit};
use giotto::fit::{FitError, Heldout, Offset, Options};
use rayon::prelude::*;

/// One seed.
#[derive(Clone, Copy, Debug)]
pub struct Seed {
    /// Prediction of 150 and 300 mm by the fit at 100 mm.
    pub heldout: [Heldout; 2],
    /// Whether the true β1, β2 lie in their 95 % intervals.
    pub covered: [bool; 2],
    /// Whether both terms entered.
    pub both_entered: bool,
}

/// All seeds together.
#[derive(Clone, Copy, Debug)]
pub struct Summary {
    /// Seeds.
    pub seeds: usize,
    /// Least explained share at 150 and 300 mm over all seeds, percent.
    pub least_explained_percent: [f64; 2],
    /// Largest rms of the residuals at 150 and 300 mm over all seeds, µm, and its mean.
    pub rms_um: [(f64, f64); 2],
    /// Largest residual of all, µm.
    pub max_um: f64,
    /// Share of seeds with β1, β2 in their intervals, percent.
    pub coverage_percent: [f64; 2],
    /// Share of seeds in which both terms entered, percent.
    pub both_entered_percent: f64,
}

fn one(seed: u64, how: Measurement, offset: Offset) -> Result<Seed, FitError> {
    let fit = fit(
        &campaign(seed, how),
        Options {
            offset,
            ..Options::default()
        },
    )?;
    let inside = |ci: [f64; 2], truth: f64| ci[0] <= truth && truth <= ci[1];
    let of = |k: usize| fit.heldout_by_radius[k].1;
    Ok(Seed {
        heldout: [of(0), of(1)],
        covered: [
            inside(fit.ci95[0], PAPER.beta1_s2),
            inside(fit.ci95[1], PAPER.beta2_s4),
        ],
        both_entered: fit.entered(0) && fit.entered(1),
    })
}

/// Fits `seeds` campaigns with seeds `first`, `first + 1`, ….
///
/// # Errors
/// As [`fit`].
pub fn study(
    first: u64,
    seeds: usize,
    how: Measurement,
    offset: Offset,
) -> Result<Summary, FitError> {
    let all: Vec<Seed> = (0..seeds as u64)
        .into_par_iter()
        .map(|i| one(first + i, how, offset))
        .collect::<Result<_, _>>()?;
    let percent = |of: &dyn Fn(&Seed) -> bool| {
        100.0 * all.iter().filter(|s| of(s)).count() as f64 / seeds as f64
    };
    let fold = |of: &dyn Fn(&Seed) -> f64, with: fn(f64, f64) -> f64, from: f64| {
        all.iter().map(of).fold(from, with)
    };
    let largest = |of: &dyn Fn(&Seed) -> f64| fold(of, f64::max, 0.0);
    Ok(Summary {
        seeds,
        least_explained_percent: [0, 1]
            .map(|k| fold(&|s| s.heldout[k].explained_percent, f64::min, f64::INFINITY)),
        rms_um: [0, 1].map(|k| {
            let rms = |s: &Seed| s.heldout[k].rms_m * 1e6;
            (
                largest(&rms),
                all.iter().map(rms).sum::<f64>() / seeds as f64,
            )
        }),
        max_um: largest(&|s| 1e6 * s.heldout[0].max_m.max(s.heldout[1].max_m)),
        coverage_percent: [0, 1].map(|k| percent(&|s| s.covered[k])),
        both_entered_percent: percent(&|s| s.both_entered),
    })
}
