//! A tolerance: pass or fail of each figure of ISO 230-4, and the largest feed that holds it.
use super::iso230::Iso230;
use super::report::Report;
use super::uncertainty::{Budget, Iso230Budget, Verdict, decide};
use serde::Serialize;

/// Names of the figures, as in the contract without the unit.
pub const FIGURES: [&str; 6] = ["g_cw", "g_ccw", "g_b", "f_max", "f_min", "d"];

/// A figure as the standard writes it.
pub fn name(id: &str) -> &'static str {
    const NAMES: [&str; 6] = ["G cw", "G ccw", "G(b)", "F max", "F min", "D"];
    let at = FIGURES.iter().position(|figure| *figure == id);
    at.map_or("?", |at| NAMES[at])
}

/// The figures of a pair with their budgets, in the order of [`FIGURES`]; nothing where one is missing.
pub fn figures(iso: &Iso230, budget: &Iso230Budget) -> [Option<(f64, Budget)>; 6] {
    [
        iso.g_cw_m.zip(budget.g_cw),
        iso.g_ccw_m.zip(budget.g_ccw),
        iso.g_b_m.zip(budget.g_b),
        Some((iso.f_max_m, budget.f)),
        Some((iso.f_min_m, budget.f)),
        iso.d_m.zip(budget.d),
    ]
}

/// A tolerance held against one pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held {
    /// Of each figure, in the order of [`FIGURES`].
    pub verdicts: [Option<Verdict>; 6],
}

impl Held {
    /// The worst of them.
    pub fn worst(&self) -> Verdict {
        let rank = |v: &Verdict| *v as u8;
        let found = self.verdicts.iter().flatten().copied();
        found.max_by_key(rank).unwrap_or(Verdict::Undecided)
    }
}

/// The largest feed of one radius.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LargestFeed {
    /// Radius, mm.
    pub radius_mm: f64,
    /// Largest measured feed up to which every figure lies within the tolerance, mm/s; `None`: not even the slowest.
    pub measured_mm_s: Option<f64>,
    /// Feed at which the worst figure reaches the tolerance, mm/s: linear in f² between the last feed that holds it and
    /// the first that does not. `None`: it holds up to the fastest, or not at the slowest.
    pub interpolated_mm_s: Option<f64>,
    /// The figure that is first to leave the tolerance.
    pub limited_by: Option<&'static str>,
}

/// Each pair of a report against a tolerance, m.
pub fn hold(report: &Report, budgets: &[Iso230Budget], tolerance_m: f64) -> Vec<Held> {
    let of = |(iso, budget): (&Iso230, &Iso230Budget)| Held {
        verdicts: figures(iso, budget).map(|figure| {
            figure.map(|(value, budget)| decide(value, budget.expanded_m(), tolerance_m))
        }),
    };
    report.iso230_4.iter().zip(budgets).map(of).collect()
}

/// The worst figure of a pair, m, and its name.
fn worst(iso: &Iso230) -> (f64, &'static str) {
    let values = [
        iso.g_cw_m,
        iso.g_ccw_m,
        iso.g_b_m,
        Some(iso.f_max_m),
        Some(iso.f_min_m),
        iso.d_m,
    ];
    let named = values.iter().zip(FIGURES);
    named
        .filter_map(|(v, name)| v.map(|v| (v.abs(), name)))
        .fold((0.0, FIGURES[0]), |a, b| if b.0 > a.0 { b } else { a })
}

/// The largest feed that holds a tolerance, radius by radius, by the figures themselves.
pub fn largest_feeds(report: &Report, tolerance_m: f64) -> Vec<LargestFeed> {
    let mut radii: Vec<f64> = report.iso230_4.iter().map(|iso| iso.radius_m).collect();
    radii.sort_by(f64::total_cmp);
    radii.dedup();
    radii
        .into_iter()
        .map(|r| of_radius(report, r, tolerance_m))
        .collect()
}

fn of_radius(report: &Report, radius_m: f64, tolerance_m: f64) -> LargestFeed {
    // The worst repeat of each feed, from slow to fast.
    let mut feeds: Vec<(f64, f64, &'static str)> = Vec::new();
    for iso in report
        .iso230_4
        .iter()
        .filter(|iso| iso.radius_m == radius_m)
    {
        let (size, name) = worst(iso);
        match feeds.iter_mut().find(|f| f.0 == iso.feed_m_s) {
            Some(feed) if feed.1 < size => *feed = (iso.feed_m_s, size, name),
            Some(_) => {}
            None => feeds.push((iso.feed_m_s, size, name)),
        }
    }
    feeds.sort_by(|a, b| a.0.total_cmp(&b.0));
    let beyond = feeds.iter().position(|feed| feed.1 > tolerance_m);
    let held = beyond
        .unwrap_or(feeds.len())
        .checked_sub(1)
        .map(|k| feeds[k]);
    let first = beyond.map(|k| feeds[k]);
    let between = held.zip(first).map(|(held, first)| {
        let share = (tolerance_m - held.1) / (first.1 - held.1).max(f64::MIN_POSITIVE);
        let [a, b] = [held.0 * held.0, first.0 * first.0];
        (a + share.clamp(0.0, 1.0) * (b - a)).sqrt()
    });
    let mm = |si: f64| (si * 1e9).round() / 1e6;
    LargestFeed {
        radius_mm: mm(radius_m),
        measured_mm_s: held.map(|held| mm(held.0)),
        interpolated_mm_s: between.map(|f| (f * 1e4).round() / 10.0),
        limited_by: first.map(|first| first.2),
    }
}
