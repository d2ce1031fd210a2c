//! What the runs of a campaign allow to be said at all.
use super::baseline::Size;
use super::duration::Durations;
use crate::campaign::{Campaign, Run};

/// Fewest runs whose scatter says anything.
pub(super) const FEWEST_RUNS: usize = 6;
/// Degrees of freedom of a scatter that a person states or that is assumed: as if it were known to a quarter (1/√(2·10)).
pub(super) const ASSUMED_FREEDOM: f64 = 10.0;

/// Degrees of freedom of the scatter between so many runs to which so many columns were fitted.
pub(super) fn freedom(runs: usize, columns: f64) -> f64 {
    if runs < FEWEST_RUNS {
        ASSUMED_FREEDOM
    } else {
        (runs as f64 - columns).max(1.0)
    }
}

/// Scatter of the size between runs that is assumed where it is neither measured nor known, m: a ballbar set up with care.
pub const ASSUMED_REPEATABILITY_M: f64 = 1.5e-6;

/// What these runs allow to be said at all.
pub(super) struct Footing {
    pub(super) cannot_tell: Vec<String>,
    /// Whether the labels can be believed.
    pub(super) believable: bool,
    /// Whether the scatter between runs is measured.
    pub(super) measured_scatter: bool,
}

impl Footing {
    pub(super) fn of(campaign: &Campaign, durations: &Durations, repeatability_m: f64) -> Self {
        let mut cannot_tell = poverty(campaign, repeatability_m);
        // Labels that the clock contradicts, and not as a clamp would: nothing that depends on them can be believed.
        let contradicted = matches!(durations, Durations::Unexplained { runs, .. } if 4 * runs > campaign.runs.len());
        if contradicted {
            cannot_tell.push("the turns did not last as the programmed radius and feed say: check which file belongs to which run".into());
        }
        Self {
            cannot_tell,
            believable: !contradicted,
            measured_scatter: campaign.runs.len() >= FEWEST_RUNS,
        }
    }
}

/// What the campaign is too poor to tell.
fn poverty(campaign: &Campaign, repeatability_m: f64) -> Vec<String> {
    let distinct = |key: &dyn Fn(&Run) -> f64| {
        let mut values: Vec<f64> = campaign.runs.iter().map(key).collect();
        values.sort_by(f64::total_cmp);
        values.dedup_by(|a, b| (*a - *b).abs() < 1e-6 * b.abs().max(1e-12));
        values.len()
    };
    let mut out = Vec::new();
    if campaign.runs.len() < FEWEST_RUNS {
        let runs = campaign.runs.len();
        let s = if runs == 1 { "" } else { "s" };
        out.push(format!(
            "{runs} run{s}: the scatter between runs cannot be measured and is taken as {:.1} µm (--repeatability states another), so what is listed is provisional and nothing can be called real; measure at least {FEWEST_RUNS}, better 26",
            repeatability_m * 1e6
        ));
    }
    if distinct(&|run| run.feed_m_s) < 2 {
        let size = |run: &Run| Size::of(run, run.feed_m_s).error_m;
        let mean_m =
            campaign.runs.iter().map(size).sum::<f64>() / campaign.runs.len().max(1) as f64;
        out.push(format!(
            "the circles are {:.0} µm too {}, and at one speed a servo that lags, an offset of the radius and a scale look alike",
            (mean_m * 1e6).abs(),
            if mean_m < 0.0 { "small" } else { "large" }
        ));
    }
    if distinct(&|run| run.radius_m) < 2 {
        out.push("one radius: an offset of the radius, a scale error and a misfit of the servo's size law look alike; measure a second radius, at least half or twice as large".into());
    }
    if distinct(&|run| run.feed_m_s) < 3 {
        out.push("fewer than three speeds: what grows with the speed cannot be told from what does not; measure from slow to the highest safe speed".into());
    }
    if distinct(&|run| run.sign()) < 2 {
        out.push("one direction: what flips with the direction (backlash, play, servo mismatch) cannot be told from geometry; measure both directions".into());
    }
    if campaign.runs.iter().all(|run| run.started_s.is_none()) {
        out.push("no start times: drift can only be seen in the order of the runs".into());
    }
    out
}
