//! The contract's JSON of `analyze`. Units end the names; what a run does not have is `null`.
use super::tolerance::{self, Held, LargestFeed};
use super::uncertainty::{self, Budget, Iso230Budget, Known, Source, Verdict};
use super::{Iso230, Report, RunAnalysis, counterparts};
use crate::campaign::import::ballbar20::{Ballbar20, Feature};
use crate::campaign::{Direction, Location};
use serde::Serialize;
use std::collections::BTreeMap;

/// The document.
#[derive(Debug, Serialize)]
pub struct Document {
    runs: Vec<RunEntry>,
    iso230_4: Vec<IsoEntry>,
    /// Only with `--ballbar`.
    #[serde(skip_serializing_if = "Option::is_none")]
    ballbar20: Option<BallbarEntry>,
    /// Only with `--tolerance`.
    #[serde(skip_serializing_if = "Option::is_none")]
    tolerance: Option<ToleranceEntry>,
}

/// What the figures of ISO 230-4 are worth, and what they are held against.
#[derive(Clone, Debug)]
pub struct Assessment {
    /// Budget of each pair, in their order.
    pub budgets: Vec<Iso230Budget>,
    /// The tolerance, m, if one was asked for.
    pub tolerance_m: Option<f64>,
}

#[derive(Debug, Serialize)]
struct ToleranceEntry {
    tolerance_um: f64,
    pass: bool,
    largest_feed: Vec<LargestFeed>,
}

#[derive(Debug, Serialize)]
struct BudgetEntry {
    standard_um: f64,
    known: Known,
}

#[derive(Debug, Serialize)]
struct BallbarEntry {
    machine: Option<String>,
    plane: Option<String>,
    started: Option<String>,
    results: Vec<ResultEntry>,
}

#[derive(Debug, Serialize)]
struct ResultEntry {
    name: String,
    unit: String,
    value: f64,
    /// The same by giotto for each pair of runs, in their order.
    giotto: Vec<Option<f64>>,
}

#[derive(Debug, Serialize)]
struct RunEntry {
    file: String,
    radius_mm: f64,
    feed_mm_s: f64,
    direction: Direction,
    measured_feed_mm_s: Option<f64>,
    centre_mm: [f64; 2],
    radius_error_um: f64,
    radius_error_se_um: f64,
    out_of_roundness_um: f64,
    harmonics_um: BTreeMap<usize, Coefficients>,
    noise_um: f64,
    samples: usize,
    /// Only for runs that do not cover the turn.
    #[serde(skip_serializing_if = "Option::is_none")]
    arc_deg: Option<f64>,
    /// Only for files with z.
    #[serde(skip_serializing_if = "Option::is_none")]
    plane: Option<PlaneEntry>,
}

#[derive(Debug, Serialize)]
struct Coefficients {
    cos: f64,
    sin: f64,
}

#[derive(Debug, Serialize)]
struct PlaneEntry {
    centre_mm: [f64; 3],
    normal: [f64; 3],
    tilt_deg: f64,
    flatness_um: f64,
}

#[derive(Debug, Serialize)]
struct IsoEntry {
    radius_mm: f64,
    feed_mm_s: f64,
    g_cw_um: Option<f64>,
    g_ccw_um: Option<f64>,
    g_b_um: Option<f64>,
    f_max_um: f64,
    f_min_um: f64,
    d_um: Option<f64>,
    /// Expanded uncertainty (k = 2) by figure.
    uncertainty_um: BTreeMap<&'static str, f64>,
    /// Its budget by figure and source.
    budget_um: BTreeMap<&'static str, BTreeMap<Source, BudgetEntry>>,
    /// Only with `--tolerance`: by figure.
    #[serde(skip_serializing_if = "Option::is_none")]
    verdict: Option<BTreeMap<&'static str, Verdict>>,
}

/// Radii and feeds were written in mm; 0.1 m × 1e3 must not become 100.00000000000001.
fn mm(si: f64) -> f64 {
    (si * 1e12).round() / 1e9
}

fn um(si: f64) -> f64 {
    si * 1e6
}

impl Document {
    /// The document of a report, with the results of Ballbar 20 if there are any.
    pub fn of(report: &Report, ballbar: Option<&Ballbar20>, assessment: &Assessment) -> Self {
        let held = assessment
            .tolerance_m
            .map(|tolerance| tolerance::hold(report, &assessment.budgets, tolerance));
        let pairs = counterparts(report);
        let result = |f: &Feature| ResultEntry {
            name: f.name.clone(),
            unit: f.unit.clone(),
            value: f.value,
            giotto: pairs.iter().map(|p| p.get(&f.name, &f.unit)).collect(),
        };
        Self {
            runs: report
                .runs
                .iter()
                .zip(&report.frames)
                .map(|(r, f)| run(r, f.as_ref()))
                .collect(),
            iso230_4: report
                .iso230_4
                .iter()
                .zip(&assessment.budgets)
                .enumerate()
                .map(|(at, (pair, budget))| {
                    iso(pair, budget, held.as_ref().and_then(|h| h.get(at)))
                })
                .collect(),
            tolerance: assessment
                .tolerance_m
                .zip(held.as_ref())
                .map(|(limit, held)| ToleranceEntry {
                    tolerance_um: um(limit),
                    pass: held.iter().all(|h| h.worst() == Verdict::Pass),
                    largest_feed: tolerance::largest_feeds(report, limit),
                }),
            ballbar20: ballbar.map(|b| BallbarEntry {
                machine: b.machine.clone(),
                plane: b.plane.clone(),
                started: b.started.clone(),
                results: b.features.iter().map(result).collect(),
            }),
        }
    }
}

fn run(run: &RunAnalysis, frame: Option<&Location>) -> RunEntry {
    RunEntry {
        file: run.file.clone(),
        radius_mm: mm(run.radius_m),
        feed_mm_s: mm(run.feed_m_s),
        direction: run.direction,
        measured_feed_mm_s: run.measured_feed_m_s.map(|f| f * 1e3),
        centre_mm: run.centre_m.map(|c| c * 1e3),
        radius_error_um: um(run.radius_error_m),
        radius_error_se_um: um(run.radius_error_se_m),
        out_of_roundness_um: um(run.out_of_roundness_m),
        harmonics_um: run
            .harmonics
            .iter()
            .map(|h| {
                (
                    h.order,
                    Coefficients {
                        cos: um(h.cos_m),
                        sin: um(h.sin_m),
                    },
                )
            })
            .collect(),
        noise_um: um(run.noise_m),
        samples: run.samples,
        arc_deg: run.arc_rad.map(f64::to_degrees),
        plane: frame.and_then(|f| {
            let plane = f.plane?;
            Some(PlaneEntry {
                centre_mm: f.origin_m.map(|c| c * 1e3),
                normal: plane.normal,
                tilt_deg: plane.tilt_rad.to_degrees(),
                flatness_um: um(plane.flatness_m),
            })
        }),
    }
}

fn iso(iso: &Iso230, budget: &Iso230Budget, held: Option<&Held>) -> IsoEntry {
    let figures = tolerance::figures(iso, budget);
    let named = || tolerance::FIGURES.into_iter().zip(&figures);
    let parts = |budget: &Budget| {
        let part = |p: &uncertainty::Part| {
            let entry = BudgetEntry {
                standard_um: um(p.standard_m),
                known: p.known,
            };
            (p.source, entry)
        };
        budget.parts.iter().map(part).collect()
    };
    IsoEntry {
        radius_mm: mm(iso.radius_m),
        feed_mm_s: mm(iso.feed_m_s),
        g_cw_um: iso.g_cw_m.map(um),
        g_ccw_um: iso.g_ccw_m.map(um),
        g_b_um: iso.g_b_m.map(um),
        f_max_um: um(iso.f_max_m),
        f_min_um: um(iso.f_min_m),
        d_um: iso.d_m.map(um),
        uncertainty_um: named()
            .filter_map(|(name, f)| f.map(|(_, budget)| (name, um(budget.expanded_m()))))
            .collect(),
        budget_um: named()
            .filter_map(|(name, f)| f.map(|(_, budget)| (name, parts(&budget))))
            .collect(),
        verdict: held.map(|held| {
            let named = tolerance::FIGURES.into_iter().zip(held.verdicts);
            named.filter_map(|(name, v)| v.map(|v| (name, v))).collect()
        }),
    }
}
