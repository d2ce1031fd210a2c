//! What the template is given: words and numbers, ready.
use super::chart::{Chart, Point, shape};
use super::map::{Map, map};
use super::number::{fixed, number, plain};
use super::verdict::{self, axis, look_alike, unit};
use giotto::analysis;
use giotto::campaign::{Campaign, Direction};
use giotto::diagnosis::survey::Response;
use giotto::diagnosis::{Diagnosis, Finding};
use serde::Serialize;

/// The whole page.
#[derive(Debug, Serialize)]
pub struct View {
    name: String,
    machine: String,
    grid: String,
    verdict: [String; 3],
    causes: Vec<CauseView>,
    unexplained: Option<UnexplainedView>,
    cannot_tell: Vec<String>,
    kinds: Vec<Kind>,
    gain: Option<GainView>,
    map: Map,
    radii: Vec<Legend>,
    collapse: String,
    residuals: String,
    iso: Vec<[String; 8]>,
    runs: Vec<[String; 9]>,
    version: &'static str,
    seed: u64,
    hash: String,
    baseline: String,
    /// JSON of the polar plot, safe inside a script.
    polar: String,
}

#[derive(Debug, Serialize)]
struct CauseView {
    name: String,
    value: String,
    low: String,
    high: String,
    unit: String,
    share: String,
    share_number: f64,
    probability: String,
    rms: String,
    params: Vec<[String; 2]>,
    what: &'static str,
    usual: &'static str,
    adjust: &'static str,
    look_alikes: Vec<String>,
    next: String,
    compensable: bool,
    why_not: Option<&'static str>,
}

#[derive(Debug, Serialize)]
struct UnexplainedView {
    rms: String,
    words: Vec<String>,
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

impl View {
    /// Of a campaign and its diagnosis.
    pub fn of(campaign: &Campaign, d: &Diagnosis) -> Self {
        let radii = radii(campaign);
        let iso = analysis::of_campaign(campaign)
            .map(|report| report.iso230_4)
            .unwrap_or_default();
        Self {
            name: campaign.name.clone(),
            machine: campaign.machine.clone(),
            grid: grid(campaign, &radii),
            verdict: verdict::sentences(d, campaign.runs.len()),
            causes: d.findings.iter().map(cause).collect(),
            unexplained: d.unexplained.present.then(|| UnexplainedView {
                rms: fixed(d.unexplained.rms_um, 2),
                words: d.unexplained.signature.words.clone(),
            }),
            cannot_tell: d.cannot_tell.clone(),
            kinds: kinds(d),
            gain: gain(d),
            map: map(campaign, &d.picture),
            collapse: collapse(campaign, d, &radii),
            residuals: residuals(campaign, d, &radii),
            radii: radii
                .iter()
                .enumerate()
                .map(|(i, r)| Legend {
                    shape: shape(i),
                    radius: plain(r * 1e3),
                })
                .collect(),
            iso: iso.iter().map(iso_row).collect(),
            runs: runs(campaign, d),
            version: env!("CARGO_PKG_VERSION"),
            seed: d.seed,
            hash: super::hash::of(campaign),
            baseline: d.baseline.name.clone(),
            polar: super::polar::json(campaign, &d.picture),
        }
    }
}

fn radii(campaign: &Campaign) -> Vec<f64> {
    let mut radii: Vec<f64> = campaign.runs.iter().map(|r| r.radius_m).collect();
    radii.sort_by(f64::total_cmp);
    radii.dedup();
    radii
}

fn ways(direction: Direction) -> &'static str {
    match direction {
        Direction::Ccw => "CCW",
        Direction::Cw => "CW",
    }
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
    format!(
        "{} runs ({} CCW, {} CW); radius {}{more} mm; feed {} to {} mm/s",
        campaign.runs.len(),
        of(Direction::Ccw),
        of(Direction::Cw),
        shown.join(", "),
        plain(low),
        plain(high)
    )
}

fn cause(f: &Finding) -> CauseView {
    let words = f.cause.model().words();
    CauseView {
        name: format!("{}{}", words.name, axis(f)),
        value: number(f.estimate.value),
        low: number(f.estimate.ci95[0]),
        high: number(f.estimate.ci95[1]),
        unit: unit(f.estimate.unit),
        share: fixed(f.share_percent, 0),
        share_number: f.share_percent,
        probability: fixed(f.probability, 3),
        rms: fixed(f.rms_um, 2),
        params: f
            .params
            .iter()
            .map(|(k, v)| [k.replace('_', " "), number(*v)])
            .collect(),
        what: words.what,
        usual: words.usual,
        adjust: words.adjust,
        look_alikes: f
            .indistinguishable_from
            .iter()
            .map(|id| look_alike(id))
            .collect(),
        next: f.next_measurement.clone(),
        compensable: f.compensable,
        why_not: words.not_compensable,
    }
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
    let g = d.gain.as_ref()?;
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

fn iso_row(pair: &analysis::Iso230) -> [String; 8] {
    let um = |v: f64| fixed(v * 1e6, 1);
    let maybe = |v: Option<f64>| v.map_or("–".to_string(), um);
    [
        plain(pair.radius_m * 1e3),
        plain(pair.feed_m_s * 1e3),
        maybe(pair.g_cw_m),
        maybe(pair.g_ccw_m),
        maybe(pair.g_b_m),
        um(pair.f_max_m),
        um(pair.f_min_m),
        maybe(pair.d_m),
    ]
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

fn shape_of(radii: &[f64], radius_m: f64) -> usize {
    radii.iter().position(|r| *r == radius_m).unwrap_or(0)
}

fn collapse(campaign: &Campaign, d: &Diagnosis, radii: &[f64]) -> String {
    let ratio = |size_m: f64, radius_m: f64| 1e3 * (size_m / radius_m).ln_1p();
    let points = d
        .picture
        .iter()
        .map(|p| {
            let run = &campaign.runs[p.index];
            let at = [p.omega_rad_s.powi(2), ratio(p.size_m[0], run.radius_m)];
            Point {
                at,
                shape: shape_of(radii, run.radius_m),
                class: if run.direction == Direction::Ccw {
                    "ccw"
                } else {
                    "cw"
                },
                label: format!(
                    "{}: R {} mm, {} mm/s, {}: ω² {} rad²/s², ln(Rm/R) {} · 10⁻³",
                    run.file,
                    plain(run.radius_m * 1e3),
                    plain(run.feed_m_s * 1e3),
                    ways(run.direction),
                    fixed(at[0], 2),
                    fixed(at[1], 4)
                ),
            }
        })
        .collect();
    // One curve each: both models shrink a circle by its ω alone, but for the named causes.
    let mut before: Vec<[f64; 2]> = d
        .picture
        .iter()
        .map(|p| {
            let radius = campaign.runs[p.index].radius_m;
            [
                p.omega_rad_s.powi(2),
                ratio(p.size_m[0] - p.size_m[1], radius),
            ]
        })
        .collect();
    before.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let fastest = d.picture.iter().map(|p| p.omega_rad_s).fold(0.0, f64::max);
    let response = Response::of(&d.model.servo);
    let after = (0..=60)
        .map(|i| fastest * f64::from(i) / 60.0)
        .map(|omega| [omega * omega, 1e3 * response.gain(omega).ln()])
        .collect();
    Chart {
        id: "collapse",
        description: format!(
            "ln(Rm/R) against ω² for {} runs. Values of each run are in the table of runs.",
            d.picture.len()
        ),
        titles: ["ω², rad²/s²".into(), "ln(Rm/R), 10⁻³".into()],
        points,
        curves: vec![("before", before), ("after", after)],
    }
    .svg()
}

fn residuals(campaign: &Campaign, d: &Diagnosis, radii: &[f64]) -> String {
    let mut points = Vec::new();
    for (k, class, words) in [
        (0, "measured", "measured"),
        (1, "before", "left before"),
        (2, "after", "left after"),
    ] {
        points.extend(d.picture.iter().map(|p| {
            let run = &campaign.runs[p.index];
            let at = [run.feed_m_s.powi(2) / run.radius_m, p.size_m[k] * 1e6];
            Point {
                at,
                shape: shape_of(radii, run.radius_m),
                class,
                label: format!(
                    "{}: R {} mm, {} mm/s, {}: {} m/s², {words} {} µm",
                    run.file,
                    plain(run.radius_m * 1e3),
                    plain(run.feed_m_s * 1e3),
                    ways(run.direction),
                    fixed(at[0], 3),
                    fixed(at[1], 2)
                ),
            }
        }));
    }
    Chart {
        id: "residuals",
        description: format!(
            "Radius error of {} runs over the programmed centripetal acceleration: as measured, and what the simulation leaves before and after. Values of each run are in the table of runs.",
            d.picture.len()
        ),
        titles: ["centripetal acceleration f²/R, m/s²".into(), "radius error, µm".into()],
        points,
        curves: Vec::new(),
    }
    .svg()
}
