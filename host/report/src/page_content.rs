//! What the template is given: words and numbers, ready.
use super::cause_view::{CauseView, cause, unexplained};
use super::chart::shape;
use super::each_cause_alone::Alone;
use super::iso::{BudgetView, budget, iso_groups};
use super::misfit_map::{Map, map};
use super::number::{fixed, plain};
use super::plots::{collapse, over_acceleration, residuals};
use super::verdict;
use giotto::analysis;
use giotto::campaign::{Campaign, Direction};
use giotto::diagnosis::Diagnosis;
use serde::Serialize;

/// The whole page.
#[derive(Debug, Serialize)]
pub struct PageContent<'a> {
    name: String,
    machine: String,
    grid: String,
    verdict: [String; 3],
    causes: Vec<CauseView<'a>>,
    /// Causes that can be ticked off.
    whatif: Vec<String>,
    unexplained: Option<UnexplainedView>,
    cannot_tell: Vec<String>,
    kinds: Vec<Kind>,
    gain: Option<GainView>,
    map: Map,
    radii: Vec<Legend>,
    collapse: String,
    residuals: String,
    sizes: String,
    forms: String,
    /// Rows of ISO 230-4, one group a radius.
    iso: Vec<Vec<[String; 8]>>,
    budget: Option<Vec<BudgetView>>,
    runs: Vec<[String; 9]>,
    version: &'static str,
    seed: u64,
    hash: String,
    baseline: String,
    /// JSON of the polar plot, safe inside a script.
    polar: String,
}

#[derive(Debug, Serialize)]
struct UnexplainedView {
    rms: String,
    words: Vec<String>,
    picture: Option<String>,
}

#[derive(Debug, Serialize)]
struct Kind {
    name: &'static str,
    um: String,
    width: f64,
}

#[derive(Debug, Serialize)]
struct GainView {
    rows: Vec<[String; 2]>,
    percent: String,
    low: String,
    high: String,
    of_perfect: String,
    folds: [usize; 2],
}

#[derive(Debug, Serialize)]
struct Legend {
    shape: &'static str,
    radius: String,
}

impl<'a> PageContent<'a> {
    /// Of a campaign and its diagnosis.
    pub fn of(campaign: &Campaign, d: &'a Diagnosis) -> Self {
        let radii = radii(campaign);
        let report = analysis::of_campaign(campaign).ok();
        let alone = Alone::of(campaign, d);
        Self {
            name: campaign.name.clone(),
            machine: campaign.machine.clone(),
            grid: grid(campaign, &radii),
            verdict: verdict::sentences(campaign, d),
            causes: d
                .findings
                .iter()
                .enumerate()
                .map(|(at, f)| cause(campaign, &alone, at, f))
                .collect(),
            whatif: d
                .findings
                .iter()
                .zip(&alone.profiles)
                .filter(|(_, profiles)| profiles.is_some())
                .map(|(f, _)| f.title())
                .collect(),
            unexplained: d.unexplained.present.then(|| UnexplainedView {
                rms: fixed(d.unexplained.rms_um, 2),
                words: d.unexplained.signature.words.clone(),
                picture: unexplained(campaign, d),
            }),
            cannot_tell: d.cannot_tell.clone(),
            kinds: kinds(d),
            gain: gain(d),
            map: map(campaign, &d.picture),
            collapse: collapse(campaign, d, &radii),
            residuals: residuals(campaign, d, &radii),
            sizes: over_acceleration(report.as_ref(), &radii, "sizes"),
            forms: over_acceleration(report.as_ref(), &radii, "forms"),
            radii: radii
                .iter()
                .enumerate()
                .map(|(i, r)| Legend {
                    shape: shape(i),
                    radius: plain(r * 1e3),
                })
                .collect(),
            iso: report.as_ref().map(iso_groups).unwrap_or_default(),
            budget: report.as_ref().and_then(budget),
            runs: runs(campaign, d),
            version: env!("CARGO_PKG_VERSION"),
            seed: d.seed,
            hash: super::hash::of(campaign),
            baseline: d.baseline.name.clone(),
            polar: super::polar::json(
                campaign,
                d,
                &alone,
                verdict::worst(d)
                    .map(|worst| &campaign.runs[worst.index])
                    .map(|run| (run.radius_m, run.feed_m_s)),
            ),
        }
    }
}

fn radii(campaign: &Campaign) -> Vec<f64> {
    let mut radii: Vec<f64> = campaign.runs.iter().map(|r| r.radius_m).collect();
    radii.sort_by(f64::total_cmp);
    radii.dedup();
    radii
}

fn grid(campaign: &Campaign, radii: &[f64]) -> String {
    let feeds = || campaign.runs.iter().map(|r| r.feed_m_s * 1e3);
    let (low, high) = (
        feeds().fold(f64::INFINITY, f64::min),
        feeds().fold(0.0, f64::max),
    );
    let shown: Vec<String> = radii.iter().take(8).map(|r| plain(r * 1e3)).collect();
    let more = if radii.len() > 8 {
        format!(" and {} more", radii.len() - 8)
    } else {
        String::new()
    };
    let of = |d| campaign.runs.iter().filter(|r| r.direction == d).count();
    let count = campaign.runs.len();
    let s = if count == 1 { "" } else { "s" };
    let ways: Vec<String> = [Direction::Ccw, Direction::Cw]
        .into_iter()
        .filter(|way| of(*way) > 0)
        .map(|way| format!("{} {}", of(way), ways(way)))
        .collect();
    let feeds = if low == high {
        plain(low)
    } else {
        format!("{} to {}", plain(low), plain(high))
    };
    format!(
        "{count} run{s} ({}); radius {}{more} mm; feed {feeds} mm/s",
        ways.join(", "),
        shown.join(", "),
    )
}

fn kinds(d: &Diagnosis) -> Vec<Kind> {
    let m = &d.misfit;
    [
        ("size of the circles", m.size_um),
        ("of which follows campaign time", m.drift_um),
        ("harmonics 2–8, the same both ways", m.harmonics_even_um),
        ("harmonics 2–8, flip with direction", m.harmonics_odd_um),
        ("at fixed places beyond these", m.localised_um),
        ("periodic in time", m.periodic_um),
        ("random and the rest", m.random_um),
    ]
    .map(|(name, um)| Kind {
        name,
        um: fixed(um, 2),
        width: (100.0 * um / m.total_um.max(f64::MIN_POSITIVE)).min(100.0),
    })
    .into()
}

fn gain(d: &Diagnosis) -> Option<GainView> {
    let g = d.gain.as_ref().filter(|_| !d.findings.is_empty())?;
    let rows = [
        ("no model", g.no_model_rms_um),
        ("β1 and β2 of the paper", g.beta_rms_um),
        ("the simulation as it stood", g.baseline_rms_um),
        ("the extended simulation", g.extended_rms_um),
        (
            "noise and scatter between runs: a perfect model",
            g.floor_rms_um,
        ),
    ]
    .map(|(name, um)| [name.to_string(), fixed(um, 2)]);
    Some(GainView {
        rows: rows.into(),
        percent: fixed(g.percent, 1),
        low: fixed(g.ci95_percent[0], 1),
        high: fixed(g.ci95_percent[1], 1),
        of_perfect: fixed(g.of_perfect_percent, 1),
        folds: g.folds,
    })
}

fn runs(campaign: &Campaign, d: &Diagnosis) -> Vec<[String; 9]> {
    let um = |v: f64| fixed(v * 1e6, 2);
    d.picture
        .iter()
        .map(|p| {
            let run = &campaign.runs[p.index];
            [
                run.file.clone(),
                plain(run.radius_m * 1e3),
                plain(run.feed_m_s * 1e3),
                ways(run.direction).to_string(),
                um(p.size_m[0]),
                um(p.size_m[1]),
                um(p.size_m[2]),
                um(p.rms_m[0]),
                um(p.rms_m[1]),
            ]
        })
        .collect()
}

pub(super) fn ways(direction: Direction) -> &'static str {
    match direction {
        Direction::Ccw => "CCW",
        Direction::Cw => "CW",
    }
}
