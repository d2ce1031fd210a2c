//! A clamp on the feed shows in the clock: the turn lasts longer than programmed.
use super::survey::believed_feed_m_s;
use crate::campaign::{Campaign, Run};

/// The controller keeps the centripetal acceleration of arcs below a limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clamp {
    /// Limit, m/s².
    pub limit_m_s2: f64,
    /// Standard error, m/s².
    pub se_m_s2: f64,
    /// Runs that were slowed.
    pub runs: usize,
}

/// What the durations say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Durations {
    /// Every turn lasted as long as programmed, or there are no time stamps.
    AsProgrammed,
    /// Slowed as by one limit of the centripetal acceleration.
    Clamped(Clamp),
    /// Slowed, but not so.
    Unexplained {
        /// Runs that were slowed.
        runs: usize,
        /// Smallest ratio of measured to programmed feed.
        smallest: f64,
    },
}

/// Reads the durations of the turns.
pub fn read(campaign: &Campaign) -> Durations {
    let runs: Vec<(f64, f64, f64)> = campaign
        .runs
        .iter()
        .map(|run| {
            let feed = believed_feed_m_s(run);
            (
                feed / run.feed_m_s,
                feed * feed / run.radius_m,
                run.feed_m_s.powi(2) / run.radius_m,
            )
        })
        .collect();
    let slowed: Vec<f64> = runs
        .iter()
        .filter(|run| run.0 < 1.0)
        .map(|run| run.1)
        .collect();
    let smallest = runs.iter().map(|run| run.0).fold(f64::INFINITY, f64::min);
    let odd = runs.iter().filter(|run| run.0 != 1.0).count();
    if odd == 0 {
        return Durations::AsProgrammed;
    }
    let n = slowed.len() as f64;
    let limit = slowed.iter().sum::<f64>() / n.max(1.0);
    let scatter = (slowed.iter().map(|a| (a - limit).powi(2)).sum::<f64>() / n.max(1.0)).sqrt();
    // All at one acceleration, none below it, and nothing above it left at full speed.
    let one_limit = slowed.len() >= 2 && slowed.len() == odd && scatter < 0.02 * limit;
    let no_other = runs
        .iter()
        .all(|run| (run.0 < 1.0) == (run.2 > 1.01 * limit) || (run.2 / limit - 1.0).abs() < 0.03);
    if one_limit && no_other {
        // A turn is timed to about a sample in a thousand.
        let se = (scatter / n.sqrt()).max(2e-4 * limit);
        Durations::Clamped(Clamp {
            limit_m_s2: limit,
            se_m_s2: se,
            runs: slowed.len(),
        })
    } else {
        Durations::Unexplained {
            runs: odd,
            smallest,
        }
    }
}

/// Fewest runs among which one can be said to be labelled wrongly.
const FEWEST: usize = 6;

/// The run whose turn lasted otherwise than its radius and feed say while all others lasted as theirs do, and that no clamp has
/// slowed: its label is wrong.
pub fn contradicted(campaign: &Campaign) -> Option<usize> {
    let off = |run: &Run| believed_feed_m_s(run) / run.feed_m_s;
    let mut odd = (0..campaign.runs.len()).filter(|&run| off(&campaign.runs[run]) != 1.0);
    let (only, None) = (odd.next()?, odd.next()) else {
        return None;
    };
    if campaign.runs.len() < FEWEST {
        return None;
    }
    let acceleration = |run: &Run| believed_feed_m_s(run).powi(2) / run.radius_m;
    let run = &campaign.runs[only];
    let others = campaign
        .runs
        .iter()
        .enumerate()
        .filter(|(other, _)| *other != only);
    let fastest = others.map(|(_, run)| acceleration(run)).fold(0.0, f64::max);
    (off(run) > 1.0 || acceleration(run) < 0.9 * fastest).then_some(only)
}

/// Why such a run is left out.
pub fn reason(run: &Run) -> String {
    let ratio = run.feed_m_s / believed_feed_m_s(run);
    let (times, than) = if ratio > 1.0 {
        (ratio, "longer")
    } else {
        (1.0 / ratio, "shorter")
    };
    format!(
        "its turn lasted {times:.2} times {than} than radius and feed say, and all others as theirs do: the label of another run?"
    )
}
