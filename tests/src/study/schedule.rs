//! Which campaigns the study runs.
use super::group::Group;
use super::recipe::{Recipe, Scatter};
use super::seeds::seed;
use crate::arm::{ARM_EFFECTS, Setting};
use crate::effects::{Kind, LISTED, Null, UNLISTED};
use crate::machine::base::Variety;
use crate::nuisance::Nuisance;
use std::ops::Range;

/// One campaign to be drawn and diagnosed.
#[derive(Clone, Debug)]
pub struct Job {
    /// Row.
    pub group: Group,
    /// What is hidden.
    pub kind: Recipe,
    /// In units of the noise.
    pub strength: f64,
    /// Seed.
    pub seed: u64,
}

/// Pairs that a machine could well have but that circles of one machine cannot hold apart, or where one
/// takes the place of the other.
const SENSELESS: [(&str, &str); 3] = [
    // The clamp keeps the runs away in which the other shows.
    ("higher_order_dynamics", "feed_clamp"),
    // Chords bring a κ4 of their own.
    ("higher_order_dynamics", "interpolation_chord"),
    // Both live in the same degrees after the same reversals.
    ("reversal_spike", "stick_slip"),
];

/// All pairs that make sense.
pub fn pairs() -> Vec<[&'static str; 2]> {
    let mut all = Vec::new();
    for (i, a) in LISTED.iter().enumerate() {
        for b in &LISTED[i + 1..] {
            if !SENSELESS.contains(&(*a, *b)) {
                all.push([*a, *b]);
            }
        }
    }
    all
}

/// Triples that belong together in practice: a robot, a worn machine tool, a badly tuned one, a warm one.
pub const TRIPLES: [[&str; 3]; 10] = [
    ["higher_order_dynamics", "scale_mismatch", "squareness"],
    ["servo_mismatch", "backlash", "squareness"],
    ["backlash", "lateral_play", "straightness"],
    ["servo_mismatch", "bandwidth_mismatch", "scale_mismatch"],
    ["thermal_drift", "scale_error", "squareness"],
    ["cyclic_error", "backlash", "servo_mismatch"],
    ["vibration", "reversal_spike", "squareness"],
    ["feed_clamp", "servo_mismatch", "scale_mismatch"],
    ["radius_offset", "straightness", "backlash"],
    ["thermal_drift", "vibration", "lateral_play"],
];

/// What nuisances are tried on: one effect of each family.
const FAMILIES: [&str; 8] = [
    "backlash",
    "reversal_spike",
    "squareness",
    "scale_mismatch",
    "servo_mismatch",
    "bandwidth_mismatch",
    "straightness",
    "radius_offset",
];

/// Campaigns a cause and strength of the full study.
pub const FULL: usize = 10;

/// What the study draws.
#[derive(Clone, Debug)]
pub struct Order {
    /// Seeds.
    pub range: Range<u64>,
    /// Which rows of them.
    pub round: u64,
    /// Campaigns a cause and strength ([`FULL`] in full).
    pub each: usize,
    /// Groups; all if empty.
    pub groups: Vec<Group>,
    /// Keeps the rows whose name contains this.
    pub only: Option<String>,
    /// At most so many campaigns a group, spread over its rows.
    pub most: Option<usize>,
}

/// One row: what, how strong, how many.
type Line = (Recipe, f64, usize);

fn named(names: &[&str]) -> Kind {
    Kind::Effects(names.iter().map(|s| (*s).to_owned()).collect())
}

fn plain(names: &[&str]) -> Recipe {
    Recipe::Plain(named(names), Variety::Broad)
}

/// The rows of a group.
fn lines(group: Group, each: usize) -> Vec<Line> {
    let half = each.div_ceil(2);
    let few = each.div_ceil(4);
    match group {
        Group::Single => LISTED
            .iter()
            .flat_map(|n| {
                [(3.0, each), (1.0, each), (10.0, half)].map(|(s, k)| (plain(&[n]), s, k))
            })
            .collect(),
        Group::Pair => pairs()
            .iter()
            .map(|p| (plain(p), 3.0, each.div_ceil(2 * FULL)))
            .collect(),
        Group::Triple => TRIPLES.iter().map(|t| (plain(t), 3.0, few)).collect(),
        Group::Null => [Null::Noise, Null::Spread, Null::Lag, Null::Model]
            .map(|n| (Recipe::Plain(Kind::Null(n), Variety::Broad), 0.0, 5 * each))
            .to_vec(),
        Group::Unlisted => UNLISTED
            .iter()
            .flat_map(|n| [(3.0, half), (10.0, few)].map(|(s, k)| (plain(&[n]), s, k)))
            .collect(),
        // Only what flips with the direction averages out when it is dealt to other runs.
        Group::Permuted => ["servo_mismatch", "lateral_play"]
            .map(|n| {
                (
                    Recipe::Plain(Kind::Permuted(n.to_owned()), Variety::Broad),
                    3.0,
                    few,
                )
            })
            .to_vec(),
        Group::Laws => ["two_mass_friction", "thermal_hook", "unlisted_sense_scale"]
            .iter()
            .chain(&FAMILIES)
            .map(|n| (Recipe::Plain(named(&[n]), Variety::Laws), 3.0, each))
            .collect(),
        Group::Scatter => [78, 30, 16, 10, 6, 4]
            .iter()
            .flat_map(|runs| Scatter::ALL.map(|s| (Recipe::Null(s, *runs), 0.0, 3 * each)))
            .collect(),
        Group::Wave => vec![
            (Recipe::Wave, 1.5, 20 * each),
            (Recipe::Wave, 3.0, 10 * each),
        ],
        Group::Delay => soiled(
            &[Nuisance::Centred, Nuisance::PerRadius, Nuisance::Moving],
            half,
        ),
        Group::Arc => soiled(&[180, 220, 270, 330, 359].map(Nuisance::Arc), few),
        Group::Spoilt => soiled(
            &[Nuisance::Bump, Nuisance::Label, Nuisance::Direction],
            half,
        ),
        Group::Override => soiled(&[Nuisance::Override], half),
        Group::Ramps => soiled(&[Nuisance::Ramps], half),
        Group::Robot => soiled(&[Nuisance::Robot], each),
        Group::Planes => [
            "backlash",
            "reversal_spike",
            "cyclic_error",
            "straightness",
            "servo_mismatch",
        ]
        .map(|n| (Recipe::Planes(vec![n]), 3.0, each))
        .into_iter()
        .chain([(Recipe::Six, 3.0, 2 * each)])
        .collect(),
        Group::Small => soiled(&[2, 4, 6, 8, 10].map(Nuisance::Few), few),
        Group::SmallNull => [2, 4, 6, 8, 10]
            .map(|n| {
                (
                    Recipe::Soiled(Kind::Null(Null::Lag), Nuisance::Few(n)),
                    0.0,
                    4 * each,
                )
            })
            .to_vec(),
        Group::ArmSound
        | Group::ArmSingle
        | Group::ArmPlaces
        | Group::ArmPair
        | Group::ArmAsSlides => arms(group, each),
    }
}

/// Each nuisance on each family.
fn soiled(nuisances: &[Nuisance], count: usize) -> Vec<Line> {
    FAMILIES
        .iter()
        .flat_map(|n| nuisances.iter().map(move |x| (n, *x)))
        .map(|(n, x)| (Recipe::Soiled(named(&[n]), x), 3.0, count))
        .collect()
}

fn arms(group: Group, each: usize) -> Vec<Line> {
    let sets: Vec<Vec<&str>> = match group {
        Group::ArmSound | Group::ArmAsSlides => vec![vec![]],
        Group::ArmSingle => ARM_EFFECTS.map(|n| vec![n]).to_vec(),
        Group::ArmPlaces => vec![vec!["joint_zero"], vec!["link_length"]],
        _ => vec![
            vec!["joint_backlash", "joint_lag_mismatch"],
            vec!["joint_reversal", "joint_cyclic_error"],
            vec!["joint_reversal", "joint_zero"],
            vec!["joint_lag_mismatch", "joint_zero"],
        ],
    };
    let count = if sets.len() == 1 { 5 * each } else { each };
    let mut out = Vec::new();
    for set in &sets {
        for (six, robot) in [(false, false), (true, false), (false, true), (true, true)] {
            let setting = Setting {
                six,
                effects: set.iter().map(|s| (*s).to_owned()).collect(),
                strength: 3.0,
                places: if group == Group::ArmPlaces { 4 } else { 1 },
                robot,
                given: group != Group::ArmAsSlides,
            };
            let strength = if set.is_empty() { 0.0 } else { 3.0 };
            out.push((Recipe::Arm(setting), strength, count));
        }
    }
    out
}

/// The whole study.
pub fn schedule(order: &Order) -> Vec<Job> {
    let mut jobs = Vec::new();
    for group in Group::ALL {
        if !order.groups.is_empty() && !order.groups.contains(&group) {
            continue;
        }
        let lines: Vec<Line> = lines(group, order.each)
            .into_iter()
            .filter(|l| {
                order
                    .only
                    .as_ref()
                    .is_none_or(|o| l.0.to_string().contains(o.as_str()))
            })
            .collect();
        // One of each row before a second of any, so that a short study sees all of them.
        let mut of_group = Vec::new();
        let longest = lines.iter().map(|l| l.2).max().unwrap_or(0);
        for index in 0..longest {
            for (kind, strength, count) in &lines {
                if index < *count {
                    let row = format!("{group:?} {kind} {strength}");
                    of_group.push(Job {
                        group,
                        kind: kind.clone(),
                        strength: *strength,
                        seed: seed(&order.range, order.round, &row, index as u64),
                    });
                }
            }
        }
        if let Some(most) = order.most.filter(|m| *m < of_group.len()) {
            // Evenly over the rows rather than the first of them, and not the same of every block of rows.
            let all = of_group.len().min(lines.len().max(most));
            of_group = (0..most)
                .map(|k| of_group[k * all / most].clone())
                .collect();
        }
        jobs.append(&mut of_group);
    }
    jobs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::seeds::{PUBLISHED, TUNING};

    fn order(range: Range<u64>, most: Option<usize>) -> Order {
        Order {
            range,
            round: 0,
            each: FULL,
            groups: Vec::new(),
            only: None,
            most,
        }
    }

    #[test]
    fn no_seed_is_tuned_on_and_published() {
        let tuned = schedule(&order(TUNING, None));
        let published = schedule(&order(PUBLISHED, None));
        assert_eq!(tuned.len(), published.len());
        assert!(tuned.iter().all(|j| TUNING.contains(&j.seed)));
        assert!(published.iter().all(|j| PUBLISHED.contains(&j.seed)));
        let nulls = published
            .iter()
            .filter(|j| matches!(j.group, Group::Scatter | Group::Null | Group::SmallNull));
        assert!(
            nulls.count() >= 1_000,
            "two in a hundred are only seen in hundreds"
        );
    }

    #[test]
    fn a_short_study_has_every_group() {
        let jobs = schedule(&order(TUNING, Some(3)));
        for group in Group::ALL {
            let of_group: Vec<_> = jobs.iter().filter(|j| j.group == group).collect();
            assert_eq!(of_group.len(), 3, "{group:?}");
        }
    }
}
