//! Pages beside the report: a comparison of campaigns, the history of a machine.
use super::ReportError;
use super::chart::{Chart, Point};
use giotto::comparison::{Comparison, Fate, figure_name, title};
use giotto::history::History;
use giotto::units;
use serde::Serialize;

#[derive(Serialize)]
pub(super) struct Page {
    pub(super) title: String,
    pub(super) parts: Vec<Part>,
    pub(super) version: &'static str,
}

#[derive(Serialize)]
pub(super) struct Part {
    pub(super) title: String,
    pub(super) words: Vec<String>,
    pub(super) tables: Vec<Table>,
    pub(super) charts: Vec<Drawn>,
}

#[derive(Serialize)]
pub(super) struct Table {
    pub(super) caption: String,
    pub(super) header: Vec<&'static str>,
    pub(super) rows: Vec<Row>,
    /// Its words may go over several lines.
    pub(super) wraps: bool,
}

#[derive(Serialize)]
pub(super) struct Row {
    pub(super) cells: Vec<String>,
    pub(super) marked: bool,
}

#[derive(Serialize)]
pub(super) struct Drawn {
    pub(super) svg: String,
    pub(super) caption: String,
}

pub(super) fn render(page: &Page) -> Result<String, ReportError> {
    let mut environment = minijinja::Environment::new();
    environment.set_undefined_behavior(minijinja::UndefinedBehavior::Strict);
    environment.add_template("style.css", include_str!("style.css"))?;
    environment.add_template("page.html", include_str!("page.html"))?;
    let view = minijinja::value::Serde(page);
    Ok(environment.get_template("page.html")?.render(view)?)
}

/// Comparisons with one campaign as one page.
///
/// # Errors
/// As [`super::html`].
///
/// ```
/// use giotto::simulation::{self, Plan};
/// use giotto::diagnosis;
/// # use std::path::Path;
/// let plan = Plan::parse(
///     "[machine]\nboth = { kv_per_s = 50.0 }\ny = { backlash_um = 12.0 }\n\
///      [grid]\nradii_mm = [50.0, 150.0]\nfeeds_mm_s = [20.0, 100.0, 300.0]",
///     Path::new("plan.toml"),
/// )?;
/// let campaign = simulation::campaign(&plan, 1);
/// use giotto::{analysis, comparison::compare, summary::Summary};
///
/// let report = analysis::of_campaign(&campaign).map_err(|(_, error)| error)?;
/// let summary = Summary::of(&report, &diagnosis::diagnose(&campaign, &Default::default())?);
/// let page = giotto_report::comparison_page(&[compare(&summary, &summary)])?;
/// assert!(page.contains("before and after"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn comparison_page(comparisons: &[Comparison]) -> Result<String, ReportError> {
    let first = comparisons.first().map_or("", |c| c.before.as_str());
    let part = |c: &Comparison| Part {
        title: format!("{} → {}", c.before, c.after),
        words: c.words.clone(),
        tables: vec![causes(c), figures(c)],
        charts: Vec::new(),
    };
    render(&Page {
        title: format!("{first}: before and after"),
        parts: comparisons.iter().map(part).collect(),
        version: env!("CARGO_PKG_VERSION"),
    })
}

fn causes(c: &Comparison) -> Table {
    let row = |c: &giotto::comparison::CauseChange| {
        let shown = units::shown(c.change, c.ci95, &c.unit);
        let at = |v: Option<f64>| {
            v.map_or_else(
                || "–".to_owned(),
                |v| units::shown(v, c.ci95, &c.unit).value,
            )
        };
        Row {
            cells: vec![
                title(&c.name, &c.actuators),
                at(c.before),
                at(c.after),
                shown.value,
                format!("{} to {}", shown.low, shown.high),
                shown.unit,
                match c.fate {
                    Fate::Appeared => "appeared",
                    Fate::Gone => "gone",
                    Fate::Changed => "changed",
                    Fate::Same => "",
                }
                .to_owned(),
            ],
            marked: c.fate != Fate::Same,
        }
    };
    Table {
        caption: "Causes; – where one was not found".into(),
        header: vec!["Cause", "before", "after", "change", "95 %", "unit", ""],
        rows: c.causes.iter().map(row).collect(),
        wraps: false,
    }
}

fn figures(c: &Comparison) -> Table {
    let um = |v: f64| units::shown(v, [v; 2], "um").value;
    let row = |f: &giotto::comparison::FigureChange| Row {
        cells: vec![
            format!(
                "{}, R {} mm, {} mm/s",
                figure_name(f.figure),
                f.radius_mm,
                f.feed_mm_s
            ),
            um(f.before_um),
            um(f.after_um),
            um(f.change_um),
            format!("{} to {}", um(f.ci95_um[0]), um(f.ci95_um[1])),
            if f.changed { "changed" } else { "" }.to_owned(),
        ],
        marked: f.changed,
    };
    Table {
        caption: "Figures, µm; the same instrument is assumed for both".into(),
        header: vec!["Figure", "before", "after", "change", "95 %", ""],
        rows: c.figures.iter().map(row).collect(),
        wraps: false,
    }
}

/// Histories of machines as one page: a chart a series, with its control limits.
///
/// # Errors
/// As [`super::html`].
pub fn history_page(machines: &[History]) -> Result<String, ReportError> {
    let mut number = 0;
    let mut part = |machine: &History| {
        let mut words: Vec<String> = machine
            .series
            .iter()
            .flat_map(|s| s.words.iter().cloned())
            .collect();
        if words.is_empty() {
            words.push(
                "Nothing drifts and nothing stepped beyond what unchanged machines show.".into(),
            );
        }
        Part {
            title: format!("{}: {} campaigns", machine.machine, machine.campaigns.len()),
            words,
            tables: vec![campaigns(machine)],
            charts: machine
                .series
                .iter()
                .map(|series| {
                    number += 1;
                    chart(series, number)
                })
                .collect(),
        }
    };
    let parts = machines.iter().map(&mut part).collect();
    render(&Page {
        title: "History".into(),
        parts,
        version: env!("CARGO_PKG_VERSION"),
    })
}

fn campaigns(machine: &History) -> Table {
    let um = |v: f64| units::shown(v, [v; 2], "um").value;
    let row = |c: &giotto::history::CampaignRow| Row {
        cells: vec![
            c.date.to_string(),
            c.folder.clone(),
            c.runs.to_string(),
            um(c.g_um),
            um(c.g_b_um),
            um(c.d_um),
            um(c.spread_um),
            um(c.unexplained_um),
        ],
        marked: false,
    };
    Table {
        caption: "Campaigns; lengths in µm".into(),
        header: vec![
            "Day",
            "folder",
            "runs",
            "largest G",
            "largest G(b)",
            "mean D",
            "scatter",
            "no name",
        ],
        rows: machine.campaigns.iter().map(row).collect(),
        wraps: false,
    }
}

fn chart(series: &giotto::history::Series, number: usize) -> Drawn {
    let limits = &series.trend.limits;
    let middle = limits.last().map_or(0.0, |l| l[0]);
    let (factor, unit) = units::scale(&series.unit, middle.abs());
    let first = series.dates.first().map_or(0, |d| d.days);
    let x = |k: usize| {
        series
            .dates
            .get(k)
            .map_or(0.0, |d| f64::from(d.days - first))
    };
    let points = series.values.iter().enumerate().map(|(k, v)| Point {
        at: [x(k), v * factor],
        shape: 0,
        class: if series.trend.outside.contains(&k) {
            "after"
        } else {
            "measured"
        },
        label: format!("{}: {}", series.dates[k], units::number(v * factor)),
    });
    let line = |at: usize| -> Vec<[f64; 2]> {
        let finite = limits.iter().enumerate().filter(|(_, l)| l[at].is_finite());
        finite.map(|(k, l)| [x(k), l[at] * factor]).collect()
    };
    let start = series
        .dates
        .first()
        .map_or_else(String::new, |d| d.to_string());
    Drawn {
        svg: Chart {
            id: format!("series-{number}"),
            description: format!("{} over {} campaigns", series.title, series.values.len()),
            titles: [
                format!("days since {start}"),
                format!("{}, {unit}", series.title),
            ],
            points: points.collect(),
            curves: vec![("after", line(0)), ("before", line(1)), ("before", line(2))],
        }
        .svg(),
        caption: if series.words.is_empty() {
            format!("{}: no change", series.title)
        } else {
            series.words.join(" ")
        },
    }
}
