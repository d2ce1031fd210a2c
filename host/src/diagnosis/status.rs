//! How sure a finding is, in words that were counted: a status is given for what held in generated campaigns.
use super::finding::Finding;
use serde::Serialize;

/// Classes of certainty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// What these few circles show; a longer session decides.
    #[default]
    Provisional,
    /// More likely than all else together, with something open.
    Likely,
    /// Nothing open: the evidence, the runs left out and the delay agree.
    Certain,
}

/// What a campaign allows to be said.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// Whether the scatter between runs is measured, by enough of them.
    pub measured_scatter: bool,
    /// Whether the runs left out are foretold better, the whole interval.
    pub proven: bool,
}

/// Probability above which a finding may be certain, and likely.
const CERTAIN: f64 = 0.99;
const LIKELY: f64 = 0.9;
/// Highest probability where the scatter between runs is assumed.
const HIGHEST_ASSUMED: f64 = 0.9;
/// Highest probability of what the runs left out do not prove.
pub(super) const HIGHEST_UNPROVEN: f64 = 0.98;
/// Even odds between two names are no finding.
pub const TIE: f64 = 0.55;

/// Sets probability and status of every finding by the ground they stand on.
pub fn settle(findings: &mut [Finding], ground: Ground) {
    for finding in findings {
        let highest = match (ground.measured_scatter, ground.proven) {
            (false, _) => HIGHEST_ASSUMED,
            (true, false) => HIGHEST_UNPROVEN,
            (true, true) => 1.0,
        };
        finding.probability = finding.probability.min(highest);
        finding.status = if !ground.measured_scatter || finding.probability < LIKELY {
            Status::Provisional
        } else if finding.probability < CERTAIN {
            Status::Likely
        } else {
            Status::Certain
        };
    }
}
