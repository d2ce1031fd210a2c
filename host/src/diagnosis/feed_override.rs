//! One override for all: every turn lasts longer, or shorter, than programmed by the same factor.
use super::survey::measured_feed_m_s;
use crate::campaign::Campaign;

/// Share of the timed runs that must show the factor.
const MOST: f64 = 0.75;
/// How far a turn may be off the common factor: its ends are timed to about a sample in a thousand.
const TOLERANCE: f64 = 0.003;
/// A factor that the clock of the instrument explains, and that changes f²/R by less than any table resolves.
const CLOCK: f64 = 0.002;
/// Fewest timed runs that show a factor to be common.
const FEWEST: usize = 3;

/// Measured by programmed feed, where nearly all runs agree on a factor that is not 1.
pub fn find(campaign: &Campaign) -> Option<f64> {
    let mut ratios: Vec<f64> = campaign
        .runs
        .iter()
        .filter_map(|run| measured_feed_m_s(run).map(|feed| feed / run.feed_m_s))
        .collect();
    if ratios.len() < FEWEST || ratios.len() < campaign.runs.len() {
        return None;
    }
    ratios.sort_by(f64::total_cmp);
    let middle = ratios[ratios.len() / 2];
    let agree = ratios
        .iter()
        .filter(|ratio| (*ratio / middle - 1.0).abs() < TOLERANCE);
    let common = agree.count() as f64 >= MOST * ratios.len() as f64;
    (common && (middle - 1.0).abs() > CLOCK).then_some(middle)
}

/// The campaign with the feed that the clock shows in place of the programmed one.
pub fn applied(campaign: &Campaign, factor: f64) -> Campaign {
    let mut out = campaign.clone();
    for run in &mut out.runs {
        run.feed_m_s *= factor;
    }
    out
}

/// What a person is told.
pub fn words(factor: f64) -> String {
    format!(
        "every turn lasted {:.1} % {} than programmed: an override of {:.1} %; the measured feed is used throughout",
        100.0 * (1.0 / factor - 1.0).abs(),
        if factor < 1.0 { "longer" } else { "shorter" },
        100.0 * factor
    )
}
