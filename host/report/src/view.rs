//! What the template is given: words and numbers, ready.
use super::alone::Alone;
use super::chart::{Chart, Point, shape};
use super::map::{Map, map};
use super::number::{fixed, number, plain};
use super::portrait::{self, Curve};
use super::verdict::{self, look_alike};
use giotto::analysis;
use giotto::analysis::tolerance;
use giotto::analysis::uncertainty::{self, Conditions, Iso230Budget, Known, Source};
use giotto::campaign::{Campaign, Direction, Run};
use giotto::diagnosis::picture::RunPicture;
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
    /// The cause alone on the circle where it does most, and which that is.
    picture: Option<[String; 2]>,
}

#[derive(Debug, Serialize)]
struct UnexplainedView {
    rms: String,
    words: Vec<String>,
    picture: Option<String>,
}

/// A line of the budget: the source, how it is known, its standard uncertainty in each kind of figure.
#[derive(Debug, Serialize)]
struct BudgetView {
    source: &'static str,
    known: &'static str,
    g: String,
    f: String,
    d: String,
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
        let report = analysis::of_campaign(campaign).ok();
        let alone = Alone::of(campaign, d);
        Self {
            name: campaign.name.clone(),
            machine: campaign.machine.clone(),
            grid: grid(campaign, &radii),
            verdict: verdict::sentences(d, report.as_ref()),
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
                .map(|(f, _)| verdict::title(f))
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
            polar: super::polar::json(campaign, d, &alone),
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

fn cause(campaign: &Campaign, alone: &Alone, at: usize, f: &Finding) -> CauseView {
    let words = f.cause.model().words();
    let shown = verdict::shown(&f.estimate);
    CauseView {
        name: verdict::title(f),
        value: shown.value,
        low: shown.low,
        high: shown.high,
        unit: shown.unit,
        share: fixed(f.share_percent, 0),
        share_number: f.share_percent,
        probability: fixed(f.probability, 3),
        rms: fixed(f.rms_um, 2),
        params: f
            .params
            .iter()
            .filter_map(|(name, value)| parameter(name, *value))
            .collect(),
        picture: alone_on_circle(campaign, alone, at, f),
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

/// A further parameter of a cause in words; one that only the simulation understands is left to the model's file.
fn parameter(name: &str, value: f64) -> Option<[String; 2]> {
    let (words, factor, unit) = match name {
        "pitch_m" => ("pitch", 1e3, "mm"),
        "pitch_mm" => ("pitch", 1.0, "mm"),
        "decay_s" => ("dies away in", 1e3, "ms"),
        "rise_s" => ("rises in", 1e3, "ms"),
        "presliding_m" => ("begins after", 1e6, "µm of travel"),
        "presliding_mm" => ("begins after", 1e3, "µm of travel"),
        "play_m" => ("play", 1e6, "µm"),
        "play_mm" => ("play", 1e3, "µm"),
        "phase_rad" => ("phase", 180.0 / std::f64::consts::PI, "°"),
        _ => return None,
    };
    Some([
        words.to_string(),
        format!("{} {unit}", number(value * factor)),
    ])
}

/// Profiles of both directions at the circle where a cause does most.
fn alone_on_circle(
    campaign: &Campaign,
    alone: &Alone,
    at: usize,
    f: &Finding,
) -> Option<[String; 2]> {
    let (index, most_m) = alone.largest(at)?;
    let runs = alone.profiles.get(at)?.as_ref()?;
    let chosen = &campaign.runs[index];
    let same = |run: &Run| run.radius_m == chosen.radius_m && run.feed_m_s == chosen.feed_m_s;
    let mut curves: Vec<Curve<'_>> = Vec::new();
    for (run, profile) in campaign.runs.iter().zip(runs).filter(|(run, _)| same(run)) {
        let class = ways(run.direction);
        if !curves.iter().any(|c| c.0 == class) {
            curves.push((class, profile));
        }
    }
    let where_ = format!(
        "Alone it makes up to {} µm, at radius {} mm and {} mm/s",
        fixed(most_m * 1e6, 1),
        plain(chosen.radius_m * 1e3),
        plain(chosen.feed_m_s * 1e3)
    );
    let words = format!("{} alone on the circle. {where_}.", verdict::title(f));
    Some([
        portrait::svg(&format!("alone-{at}"), &words, &curves),
        where_,
    ])
}

/// What is left of the circle where most is left.
fn unexplained(campaign: &Campaign, d: &Diagnosis) -> Option<String> {
    let worst = d
        .picture
        .iter()
        .max_by(|a, b| a.rms_m[1].total_cmp(&b.rms_m[1]))?;
    let run = &campaign.runs[worst.index];
    let of = |p: &&RunPicture| {
        let other = &campaign.runs[p.index];
        other.radius_m == run.radius_m && other.feed_m_s == run.feed_m_s
    };
    let mut curves: Vec<Curve<'_>> = Vec::new();
    for p in d.picture.iter().filter(of) {
        let class = ways(campaign.runs[p.index].direction);
        if !curves.iter().any(|c| c.0 == class) {
            curves.push((class, &p.profile_m[2]));
        }
    }
    let words = format!(
        "What has no name, at radius {} mm and {} mm/s.",
        plain(run.radius_m * 1e3),
        plain(run.feed_m_s * 1e3)
    );
    Some(portrait::svg("no-name", &words, &curves))
}

/// Sizes or forms of all runs over the centripetal acceleration, directions apart.
fn over_acceleration(report: Option<&analysis::Report>, radii: &[f64], id: &str) -> String {
    let size = id == "sizes";
    let words = if size {
        "radius error"
    } else {
        "out-of-roundness"
    };
    let point = |run: &analysis::RunAnalysis| {
        let value = if size {
            run.radius_error_m
        } else {
            run.out_of_roundness_m
        } * 1e6;
        let at = [run.feed_m_s.powi(2) / run.radius_m, value];
        Point {
            at,
            shape: shape_of(radii, run.radius_m),
            class: if run.direction == Direction::Ccw {
                "ccw"
            } else {
                "cw"
            },
            label: format!(
                "{}: R {} mm, {} mm/s, {}: {} m/s², {words} {} µm",
                run.file,
                plain(run.radius_m * 1e3),
                plain(run.feed_m_s * 1e3),
                ways(run.direction),
                fixed(at[0], 3),
                fixed(value, 1)
            ),
        }
    };
    let runs = report
        .map(|report| report.runs.as_slice())
        .unwrap_or_default();
    Chart {
        id: id.into(),
        description: format!(
            "{words} of {} runs over the programmed centripetal acceleration, both directions.",
            runs.len()
        ),
        titles: [
            "centripetal acceleration f²/R, m/s²".into(),
            format!("{words}, µm"),
        ],
        points: runs.iter().map(point).collect(),
        curves: Vec::new(),
    }
    .svg()
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

/// Rows in order of radius and feed, one group a radius.
fn iso_groups(report: &analysis::Report) -> Vec<Vec<[String; 8]>> {
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
fn budget(report: &analysis::Report) -> Option<Vec<BudgetView>> {
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
        id: "collapse".into(),
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
        id: "residuals".into(),
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
