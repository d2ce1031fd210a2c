//! The ISO 230-4 table with its uncertainties, and the budget of the worst pair.
use super::number::{fixed, plain};
use giotto::analysis;
use giotto::analysis::tolerance;
use giotto::analysis::uncertainty::{self, Conditions, Iso230Budget, Known, Source};
use serde::Serialize;

/// A line of the budget: the source, how it is known, its standard uncertainty in each kind of figure.
#[derive(Debug, Serialize)]
pub(super) struct BudgetView {
    source: &'static str,
    known: &'static str,
    g: String,
    f: String,
    d: String,
}

/// Rows in order of radius and feed, one group a radius.
pub(super) fn iso_groups(report: &analysis::Report) -> Vec<Vec<[String; 8]>> {
    let budgets = uncertainty::of_report(report, &Conditions::default());
    let mut pairs: Vec<_> = report.iso230_4.iter().zip(&budgets).collect();
    pairs.sort_by(|(a, _), (b, _)| {
        let by_radius = a.radius_m.total_cmp(&b.radius_m);
        by_radius.then(a.feed_m_s.total_cmp(&b.feed_m_s))
    });
    let mut out: Vec<(f64, Vec<[String; 8]>)> = Vec::new();
    for (iso, budget) in pairs {
        let row = iso_row(iso, budget);
        match out.last_mut() {
            Some((radius, rows)) if *radius == iso.radius_m => rows.push(row),
            _ => out.push((iso.radius_m, vec![row])),
        }
    }
    out.into_iter().map(|(_, rows)| rows).collect()
}

fn iso_row(pair: &analysis::Iso230, budget: &Iso230Budget) -> [String; 8] {
    let [g_cw, g_ccw, g_b, f_max, f_min, d] = tolerance::figures(pair, budget).map(|figure| {
        figure.map_or_else(
            || "–".to_string(),
            |(value, budget)| {
                format!(
                    "{} ± {}",
                    fixed(value * 1e6, 1),
                    fixed(budget.expanded_m() * 1e6, 1)
                )
            },
        )
    });
    let circle = [pair.radius_m, pair.feed_m_s].map(|si| plain(si * 1e3));
    let [radius, feed] = circle;
    [radius, feed, g_cw, g_ccw, g_b, f_max, f_min, d]
}

/// The budget of the pair with the largest uncertainty of F.
pub(super) fn budget(report: &analysis::Report) -> Option<Vec<BudgetView>> {
    let budgets = uncertainty::of_report(report, &Conditions::default());
    let worst = budgets
        .iter()
        .max_by(|a, b| a.f.standard_m().total_cmp(&b.f.standard_m()))?;
    let form = worst.g_b.or(worst.g_ccw).or(worst.g_cw)?;
    let um = |part: Option<&uncertainty::Part>| {
        part.map_or_else(|| "–".to_string(), |p| fixed(p.standard_m * 1e6, 2))
    };
    let lines = worst
        .f
        .parts
        .iter()
        .enumerate()
        .map(|(at, part)| BudgetView {
            source: match part.source {
                Source::Instrument => "instrument",
                Source::SetUp => "set-up",
                Source::Repeatability => "repeatability",
                Source::Temperature => "temperature",
                Source::Sampling => "sampling",
            },
            known: match part.known {
                Known::Measured => "measured here",
                Known::Given => "given",
                Known::Assumed => "assumed",
                Known::Missing => "not known, not counted",
            },
            g: um(Some(&form.parts[at])),
            f: um(Some(part)),
            d: um(worst.d.as_ref().map(|d| &d.parts[at])),
        });
    Some(lines.collect())
}
