//! What a diagnosis says: findings with their class, what is left unexplained, what stays open.
use super::delay::Explanation;
use super::duration::{Clamp, Durations};
use super::explained::Explained;
use super::finding::{Finding, Unexplained};
use super::footing::Footing;
use super::status::{self, Ground};
use super::survey::believed_feed_m_s;
use super::{
    Gain, arm, hypothesis, like_arm, omnibus, statement, static_size, unexplained, verdict,
};
use crate::campaign::Campaign;
use crate::causes::Cause;
use giotto_shared::Actuator;

/// What is said.
pub(super) struct Stated {
    pub(super) findings: Vec<Finding>,
    pub(super) unexplained: Unexplained,
}

pub(super) fn state(
    explanation: &Explanation,
    campaign: &Campaign,
    clamp: Option<Clamp>,
    durations: &Durations,
    footing: &Footing,
    proof: Option<&Gain>,
) -> Stated {
    let found = &explanation.found;
    if !footing.believable {
        return Stated {
            findings: Vec::new(),
            unexplained: Unexplained::default(),
        };
    }
    let mut findings = verdict::findings(
        found,
        clamp.map(|clamp| (clamp, clamp_energy_m2(campaign, found))),
    );
    explanation.doubt(&mut findings);
    static_size::doubt(&static_size::untested(found), &mut findings);
    arm::name_both(&mut findings, campaign.kinematics.as_ref());
    status::settle(
        &mut findings,
        Ground {
            measured_scatter: footing.measured_scatter,
            proven: proof.is_some_and(|gain| gain.ci95_percent[0] > 0.0),
        },
    );
    // Where the scatter is assumed, an interval that holds zero shows nothing.
    let shown = |[low, high]: [f64; 2]| footing.measured_scatter || !(low <= 0.0 && high >= 0.0);
    let all: Vec<(Cause, Vec<Actuator>)> = findings
        .iter()
        .map(|finding| (finding.cause, finding.actuators.clone()))
        .collect();
    findings.retain(|finding| {
        let on_same = all
            .iter()
            .filter(|(_, actuators)| actuators.iter().any(|a| finding.actuators.contains(a)));
        let others: Vec<Cause> = on_same.map(|(cause, _)| *cause).collect();
        let value = finding.estimate.value;
        finding.probability > status::TIE
            && finding.cause.model().allows_beside(value, &others)
            && shown(finding.estimate.ci95)
    });
    let unexplained = if footing.measured_scatter {
        let mut unexplained = unexplained::describe(found, durations);
        omnibus::report(&mut unexplained, &omnibus::test(found));
        unexplained
    } else {
        Unexplained::default()
    };
    Stated {
        findings,
        unexplained,
    }
}

/// What the slower feed of a clamp explains, m².
fn clamp_energy_m2(campaign: &Campaign, found: &Explained) -> f64 {
    campaign
        .runs
        .iter()
        .map(|run| {
            let gain = |feed_m_s: f64| found.response.gain(feed_m_s / run.radius_m);
            let off = run.radius_m * (gain(run.feed_m_s) - gain(believed_feed_m_s(run)));
            off * off * run.samples.deviation_m.len() as f64
        })
        .sum()
}

/// What these runs leave open, the weightiest first.
pub(super) fn open_questions(
    poverty: Vec<String>,
    explanation: &Explanation,
    ties: &[(usize, Cause)],
    like_arm: bool,
) -> Vec<String> {
    let of_tie = |(item, other): &(usize, Cause)| tie_words(&explanation.found, *item, *other);
    let arm = like_arm.then(|| like_arm::WORDS.to_owned());
    arm.into_iter()
        .chain(poverty)
        .chain(explanation.words())
        .chain(static_size::words(&static_size::untested(
            &explanation.found,
        )))
        .chain(ties.iter().map(of_tie))
        .collect()
}

/// Two names for one thing.
fn tie_words(found: &Explained, item: usize, other: Cause) -> String {
    let largest = statement::largest(found, item);
    let hypothesis::Kind::Cause { cause, .. } = found.items[item].kind else {
        return String::new();
    };
    format!(
        "up to {:.1} µm are {} or {}, which do the same to these circles: {}",
        largest.max,
        cause.model().words().name,
        other.model().words().name,
        cause.model().words().next
    )
}
