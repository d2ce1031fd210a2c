//! One line a group: what was named, what was invented, what was promised and kept.
use super::Group;
use super::bars::Rate;
use super::sheet::Row;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Rates of one group.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Every effect named, on its slide or joint, nothing false; in groups without a name nothing named (and nothing
    /// left unexplained where nothing is hidden, called unexplained where something is).
    pub right: Rate,
    /// Anything named that is not there.
    pub false_names: Rate,
    /// Anything called unexplained.
    pub unexplained: Rate,
    /// 95 % intervals that cover the truth.
    pub covered: Rate,
    /// Findings stated above 0.99 that are there.
    pub sure: Rate,
    /// Gains that reach 95 % of what a perfect model gains.
    pub gain: Rate,
    /// Findings with a negative gain.
    pub negative: Rate,
    /// Flashing recommended where it gains nothing.
    pub bad_flash: Rate,
    /// Exactly the spoilt run left out.
    pub spoilt: Rate,
    /// Campaigns without an answer.
    pub refused: usize,
}

/// Whether a campaign was answered as its group asks.
pub fn right(row: &Row) -> bool {
    let v = &row.verdict;
    let nothing_hidden = matches!(
        row.job.group,
        Group::Null | Group::Permuted | Group::Scatter | Group::ArmSound | Group::SmallNull
    );
    match row.job.group {
        // An arm seen as slides may well be called unexplained.
        Group::ArmAsSlides => v.stated.is_empty(),
        _ if nothing_hidden => v.stated.is_empty() && !v.unexplained,
        _ => v.exact && v.axis.iter().all(|a| *a),
    }
}

/// Counts the rows of each group; `refused` are groups of campaigns without an answer.
pub fn tally(rows: &[Row], refused: &[Group]) -> BTreeMap<Group, Tally> {
    let mut all: BTreeMap<Group, Tally> = BTreeMap::new();
    for row in rows {
        let t = all.entry(row.job.group).or_default();
        let v = &row.verdict;
        t.right.add(right(row));
        t.false_names.add(!v.false_findings.is_empty());
        t.unexplained.add(v.unexplained);
        v.covered.iter().for_each(|c| t.covered.add(c.1));
        let sure = v.stated.iter().filter(|s| s.0 > 0.99);
        sure.for_each(|s| t.sure.add(s.1));
        if let Some(share) = v.gain_share {
            t.gain.add(share >= 0.95);
        }
        t.negative.add(v.negative_gain);
        t.bad_flash.add(v.bad_flash);
        if let Some(named) = v.spoilt_named {
            t.spoilt.add(named);
        }
    }
    for group in refused {
        all.entry(*group).or_default().refused += 1;
    }
    all
}

/// Hits of trials and the share, short.
fn short(rate: &Rate) -> String {
    if rate.of == 0 {
        "–".into()
    } else {
        format!("{}/{} ({:.0} %)", rate.hits, rate.of, rate.percent())
    }
}

/// Bar of a group, of the issues that ask for it.
fn bar(group: Group) -> &'static str {
    match group {
        Group::Single => "≥ 98 % at ≥ 3×",
        Group::Pair | Group::Triple => "≥ 90 %",
        Group::Null | Group::Scatter | Group::SmallNull => "named ≤ 2 %, unexplained ≤ 3 %",
        Group::Unlisted => "≥ 90 %",
        Group::Permuted | Group::Override | Group::Ramps | Group::Small => "–",
        Group::Laws => "as without",
        Group::Wave => "≥ 95 %",
        Group::Delay => "≥ 85 %, false ≤ 3 %",
        Group::Arc => "≥ 85 %, coverage ≥ 93 %",
        Group::Spoilt => "file ≥ 95 %",
        Group::Robot => "coverage 93–97 %",
        Group::Planes => "≥ 98 %, coverage 93–97 %",
        Group::ArmSound => "≥ 98 %",
        Group::ArmSingle => "≥ 95 %",
        Group::ArmPlaces => "≥ 90 %",
        Group::ArmPair => "≥ 85 %",
        Group::ArmAsSlides => "≥ 95 %",
    }
}

/// The table of groups.
pub fn table(rows: &[Row], refused: &[Group], out: &mut String) {
    out.push_str(
        "\n## By group\n\nRight: every effect named on its slide or joint and nothing false; where nothing has a name, nothing named (and \
         nothing called\nunexplained if nothing is hidden). Gain: campaigns that reach 95 % of what the true machine would gain on runs left \
         out. Worse flash:\nflashing recommended where runs left out gain nothing. No answer: refused by the reader.\n\n\
         | group | bar | right | false names | unexplained | covers | > 0.99 right | gain | negative gain | worse flash | no answer |\n\
         |---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for (group, t) in tally(rows, refused) {
        let spoilt = if t.spoilt.of > 0 {
            format!("; file named {}", short(&t.spoilt))
        } else {
            String::new()
        };
        let _ = writeln!(
            out,
            "| {} | {} | {}{spoilt} | {} | {} | {} | {} | {} | {} | {} | {} |",
            group.words(),
            bar(group),
            short(&t.right),
            short(&t.false_names),
            short(&t.unexplained),
            short(&t.covered),
            short(&t.sure),
            short(&t.gain),
            short(&t.negative),
            short(&t.bad_flash),
            t.refused
        );
    }
}
