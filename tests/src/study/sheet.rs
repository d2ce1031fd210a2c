//! The study as a page: the bars, then where it goes wrong.
use super::bars::Rate;
use super::{Group, Job, Verdict, groups};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// One judged campaign.
#[derive(Clone, Debug)]
pub struct Row {
    /// What was asked.
    pub job: Job,
    /// What came of it.
    pub verdict: Verdict,
    /// Seconds `diagnose` took.
    pub seconds: f64,
}

fn rate<'a>(rows: impl Iterator<Item = &'a Row>, hit: impl Fn(&Row) -> bool) -> Rate {
    let mut r = Rate::default();
    rows.for_each(|row| r.add(hit(row)));
    r
}

/// Median of a list; not a number if empty.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The bars of the study, as lines of a Markdown table: what, bar, measured.
pub fn bars(rows: &[Row]) -> Vec<[String; 3]> {
    let group = |g: Group| rows.iter().filter(move |r| r.job.group == g);
    let single = |low: f64, high: f64| {
        group(Group::Single).filter(move |r| r.job.strength >= low && r.job.strength < high)
    };
    let mut covered = Rate::default();
    let mut axis = Rate::default();
    for row in rows {
        row.verdict.covered.iter().for_each(|c| covered.add(c.1));
        row.verdict.axis.iter().for_each(|a| axis.add(*a));
    }
    let gains: Vec<f64> = rows
        .iter()
        .filter(|r| r.job.strength >= 3.0)
        .filter_map(|r| r.verdict.gain_share)
        .collect();
    let enough = gains.iter().filter(|g| **g >= 0.95).count();
    let null = |r: &Row| !r.verdict.stated.is_empty();
    [
        (
            "single effect at ≥ 3× noise: first finding right",
            "≥ 98 %",
            rate(single(3.0, 1e9), |r| r.verdict.top_right).to_string(),
        ),
        (
            "single effect at 1× noise: first finding right",
            "≥ 90 %",
            rate(single(0.0, 3.0), |r| r.verdict.top_right).to_string(),
        ),
        (
            "single effect at ≥ 3×: nothing false beside it",
            "–",
            rate(single(3.0, 1e9), |r| r.verdict.exact).to_string(),
        ),
        (
            "exact set, pairs and triples at 3×",
            "≥ 90 %",
            rate(
                rows.iter()
                    .filter(|r| matches!(r.job.group, Group::Pair | Group::Triple)),
                |r| r.verdict.exact,
            )
            .to_string(),
        ),
        (
            "– pairs",
            "–",
            rate(group(Group::Pair), |r| r.verdict.exact).to_string(),
        ),
        (
            "– triples",
            "–",
            rate(group(Group::Triple), |r| r.verdict.exact).to_string(),
        ),
        (
            "nulls with any finding",
            "≤ 2 %",
            rate(group(Group::Null), null).to_string(),
        ),
        (
            "nulls called unexplained",
            "–",
            rate(group(Group::Null), |r| {
                r.verdict.said.ends_with("unexplained")
            })
            .to_string(),
        ),
        (
            "unlisted effect: `unexplained`, nothing named",
            "≥ 90 %",
            rate(group(Group::Unlisted), |r| {
                r.verdict.exact && r.verdict.stated.is_empty()
            })
            .to_string(),
        ),
        (
            "residuals dealt to other runs: nothing named",
            "–",
            rate(group(Group::Permuted), |r| !null(r)).to_string(),
        ),
        ("right axis, of those found", "–", axis.to_string()),
        (
            "95 % interval covers the truth",
            "93–97 %",
            covered.to_string(),
        ),
        (
            "gain on runs left out, of the perfect model's (median, ≥ 3×)",
            "≥ 95 %",
            format!(
                "{:.1} % ({} of {} campaigns reach 95 %)",
                100.0 * median(gains.clone()),
                enough,
                gains.len()
            ),
        ),
        (
            "seconds a campaign (median, longest; as many at once as cores)",
            "≤ 2 s",
            format!(
                "{:.2}, {:.2}",
                median(rows.iter().map(|r| r.seconds).collect()),
                rows.iter().map(|r| r.seconds).fold(0.0, f64::max)
            ),
        ),
    ]
    .into_iter()
    .map(|(a, b, c)| [a.to_owned(), b.to_owned(), c])
    .collect()
}

/// What the page says of itself.
#[derive(Clone, Debug)]
pub struct Heading {
    /// The command that wrote it.
    pub command: String,
    /// Where the seeds come from, in words.
    pub seeds: String,
    /// What was left out to save time, in words.
    pub short: Option<String>,
}

/// The page; `refused` are the groups of campaigns without an answer.
pub fn page(rows: &[Row], refused: &[Group], heading: &Heading) -> String {
    let mut out = String::from("# Hidden effects: the power study\n\n");
    let _ = writeln!(
        out,
        "{} campaigns of simulated machines that are independent of the simulation under test. Written by\n`{}`.\n{}\n\n\
         Strength is the rms misfit of the effect alone in units of the sample noise (of all noise for robots and arms), after each\n\
         run's centre has been taken off and one servo lag fitted again. Brackets: hits/trials and Wilson's 95 % interval.\n",
        rows.len(),
        heading.command,
        heading.seeds
    );
    if let Some(short) = &heading.short {
        let _ = writeln!(out, "**{short}**\n");
    }
    out.push_str("| | bar | measured |\n|---|---|---|\n");
    for [a, b, c] in bars(rows) {
        let _ = writeln!(out, "| {a} | {b} | {c} |");
    }
    groups::table(rows, refused, &mut out);
    causes(rows, &mut out);
    confusion(rows, &mut out);
    reliability(rows, &mut out);
    sets(rows, &mut out);
    failures(rows, &mut out);
    out
}

fn causes(rows: &[Row], out: &mut String) {
    out.push_str("\n## By cause\n\nFirst finding right at three strengths; interval covers the truth (all campaigns in which it was found).\n\n| cause | 1× | 3× | 10× | covers |\n|---|---|---|---|---|\n");
    let mut names: Vec<String> = rows
        .iter()
        .filter(|r| r.job.group == Group::Single)
        .map(|r| r.job.kind.to_string())
        .collect();
    names.dedup();
    for name in names {
        let at = |strength: f64| {
            rate(
                rows.iter().filter(|r| {
                    r.job.group == Group::Single
                        && r.job.strength == strength
                        && r.job.kind.to_string() == name
                }),
                |r| r.verdict.top_right,
            )
        };
        let mut covers = Rate::default();
        rows.iter()
            .flat_map(|r| &r.verdict.covered)
            .filter(|c| c.0 == name)
            .for_each(|c| covers.add(c.1));
        let short = |r: Rate| {
            if r.of == 0 {
                "–".into()
            } else {
                format!("{}/{}", r.hits, r.of)
            }
        };
        let _ = writeln!(
            out,
            "| {name} | {} | {} | {} | {covers} |",
            short(at(1.0)),
            short(at(3.0)),
            short(at(10.0))
        );
    }
}

fn confusion(rows: &[Row], out: &mut String) {
    out.push_str("\n## Confusion\n\nHidden effect (alone, any strength) and what came first.\n\n| hidden | came first |\n|---|---|\n");
    let mut table: BTreeMap<String, BTreeMap<&str, usize>> = BTreeMap::new();
    for row in rows.iter().filter(|r| {
        matches!(
            r.job.group,
            Group::Single | Group::Unlisted | Group::Null | Group::Permuted
        )
    }) {
        *table
            .entry(row.job.kind.to_string())
            .or_default()
            .entry(&row.verdict.top)
            .or_default() += 1;
    }
    for (name, said) in table {
        let mut said: Vec<_> = said.into_iter().collect();
        said.sort_by_key(|s| std::cmp::Reverse(s.1));
        let words: Vec<String> = said.iter().map(|(what, n)| format!("{what} {n}")).collect();
        let _ = writeln!(out, "| {name} | {} |", words.join(", "));
    }
}

fn reliability(rows: &[Row], out: &mut String) {
    out.push_str(
        "\n## Reliability of the stated probability\n\n| stated | mean stated | there |\n|---|---|---|\n",
    );
    let all: Vec<(f64, bool)> = rows
        .iter()
        .flat_map(|r| r.verdict.stated.iter().copied())
        .collect();
    for edge in [
        [0.0, 0.5],
        [0.5, 0.8],
        [0.8, 0.9],
        [0.9, 0.95],
        [0.95, 0.99],
        [0.99, 1.01],
    ] {
        let inside: Vec<_> = all
            .iter()
            .filter(|s| s.0 >= edge[0] && s.0 < edge[1])
            .collect();
        let mut there = Rate::default();
        inside.iter().for_each(|s| there.add(s.1));
        let mean = 100.0 * inside.iter().map(|s| s.0).sum::<f64>() / inside.len() as f64;
        let mean = if inside.is_empty() {
            "–".to_owned()
        } else {
            format!("{mean:.1} %")
        };
        let _ = writeln!(
            out,
            "| {:.0}–{:.0} % | {mean} | {there} |",
            100.0 * edge[0],
            (100.0 * edge[1]).min(100.0)
        );
    }
}

fn sets(rows: &[Row], out: &mut String) {
    out.push_str("\n## Row by row\n\nCampaigns answered right, as in the table of groups.\n\n| hidden | strength | exact |\n|---|---|---|\n");
    let mut table: BTreeMap<(Group, String, u64), Rate> = BTreeMap::new();
    for row in rows.iter().filter(|r| r.job.group != Group::Single) {
        table
            .entry((
                row.job.group,
                row.job.kind.to_string(),
                row.job.strength.to_bits(),
            ))
            .or_default()
            .add(groups::right(row));
    }
    // Pairs that always come out right say nothing one by one.
    for ((_, name, strength), r) in table
        .iter()
        .filter(|(k, r)| k.0 != Group::Pair || r.hits < r.of)
    {
        let strength = f64::from_bits(*strength);
        let strength = if strength == 0.0 {
            "–".to_owned()
        } else {
            format!("{strength}×")
        };
        let _ = writeln!(out, "| {name} | {strength} | {}/{} |", r.hits, r.of);
    }
}

fn failures(rows: &[Row], out: &mut String) {
    out.push_str("\n## Failures\n\nUp to three a row of the study; `hide --row NAME --strength K --seed SEED` writes the campaign.\n\n");
    let mut shown: BTreeMap<(String, u64), usize> = BTreeMap::new();
    for row in rows
        .iter()
        .filter(|r| !groups::right(r) || (r.job.group == Group::Single && !r.verdict.top_right))
    {
        let n = shown
            .entry((row.job.kind.to_string(), row.job.strength.to_bits()))
            .or_default();
        *n += 1;
        if *n > 3 {
            continue;
        }
        let said = if row.verdict.said.is_empty() {
            "nothing"
        } else {
            &row.verdict.said
        };
        let _ = writeln!(
            out,
            "- {} at {}×, seed {}: {said}",
            row.job.kind, row.job.strength, row.job.seed
        );
    }
}
