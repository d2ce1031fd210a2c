//! `giotto analyze`: least-squares circle, radius size error, out-of-roundness, harmonics, ISO 230-4 of each run.
use super::grid::Grid;
use super::source::{Source, length};
use super::{Failure, Output};
use giotto::analysis::tolerance::{self, Held};
use giotto::analysis::uncertainty::{self, Conditions, Iso230Budget, Verdict};
use giotto::analysis::{self, Assessment, Document, Harmonic, Report};
use giotto::campaign::import::ballbar20::{self, Ballbar20};
use giotto::campaign::{CampaignError, Direction};
use std::path::PathBuf;

/// Arguments of `giotto analyze`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(flatten)]
    source: Source,
    /// Results of Ballbar 20 to set beside giotto's own.
    #[arg(long, value_name = "FILE.b5r")]
    ballbar: Option<PathBuf>,
    /// Holds every figure of ISO 230-4 against this and names the largest feed that keeps it; exit 5 if one fails.
    #[arg(long, value_name = "UM", value_parser = length)]
    tolerance: Option<f64>,
    /// Expanded uncertainty (k = 2) of the instrument by its certificate; without it 0.7 µm is assumed.
    #[arg(long, value_name = "UM", value_parser = length)]
    instrument: Option<f64>,
    /// Half the range of temperature during the measurement; without it that of the runs, or 1 K.
    #[arg(long, value_name = "K", value_parser = length)]
    temperature: Option<f64>,
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let ballbar = args.ballbar.as_deref().map(ballbar20::read).transpose()?;
    let manifest = &args.source.open(out)?;
    let bar = if out.draws() {
        indicatif::ProgressBar::new(manifest.runs.len() as u64).with_message("runs")
    } else {
        indicatif::ProgressBar::hidden()
    };
    let report = analysis::of_files(manifest, || bar.inc(1));
    bar.finish_and_clear();
    let report = report?;
    report.notes.iter().for_each(|note| out.note(note));
    let conditions = Conditions {
        instrument_m: args.instrument.map(|um| um * 1e-6),
        temperature_k: args.temperature,
        repeatability_m: None,
    };
    let assessment = Assessment {
        budgets: uncertainty::of_report(&report, &conditions),
        tolerance_m: args.tolerance.map(|um| um * 1e-6),
    };
    if out.json {
        out.document(&Document::of(&report, ballbar.as_ref(), &assessment))?;
    } else {
        show(&report, &assessment, out);
        if let Some(ballbar) = ballbar {
            beside(&report, &ballbar, out);
        }
    }
    keeps(&report, &assessment)
}

/// The check that `--tolerance` asks for: no figure is certain to leave it.
fn keeps(report: &Report, assessment: &Assessment) -> Result<(), Failure> {
    let Some(tolerance_m) = assessment.tolerance_m else {
        return Ok(());
    };
    let held = tolerance::hold(report, &assessment.budgets, tolerance_m);
    let failed = |h: &Held| h.verdicts.contains(&Some(Verdict::Fail));
    match held.iter().filter(|h| failed(h)).count() {
        0 => Ok(()),
        n => Err(Failure::check(format_args!(
            "{n} of {} circles leave the tolerance of {} µm",
            held.len(),
            um(tolerance_m)
        ))
        .help("the largest feed that holds it stands above; giotto diagnose says what spoils the circles")),
    }
}

impl From<CampaignError> for Failure {
    fn from(error: CampaignError) -> Self {
        let help = error.help();
        Self::input(error).help(help)
    }
}

fn um(si: f64) -> String {
    let text = format!("{:.1}", si * 1e6);
    if text == "-0.0" {
        "0.0".to_owned()
    } else {
        text
    }
}

/// Thousandths of a millimetre, without a minus before nothing.
fn thousandths(si: f64) -> String {
    let text = format!("{:.3}", si * 1e3);
    match text.as_str() {
        "-0.000" => "0.000".to_owned(),
        _ => text,
    }
}

fn mm(si: f64) -> String {
    format!("{}", (si * 1e6).round() / 1e3)
}

fn show(report: &Report, assessment: &Assessment, out: Output) {
    let title = [&report.name, &report.machine]
        .map(String::as_str)
        .join(" — ");
    let s = if report.runs.len() == 1 { "" } else { "s" };
    out.say(format_args!("{title}: {} run{s}", report.runs.len()));
    out.say("");
    show_runs(report, out);
    for (run, frame) in report.runs.iter().zip(&report.frames) {
        if let Some(plane) = frame.and_then(|f| f.plane) {
            let (tilt, flat) = (plane.tilt_rad.to_degrees(), plane.flatness_m * 1e6);
            out.say(format_args!(
                "{}: plane tilted by {tilt:.3}°, flat within {flat:.1} µm",
                run.file
            ));
        }
    }
    out.say("");
    show_iso(report, &assessment.budgets, out);
    if let Some(tolerance_m) = assessment.tolerance_m {
        show_tolerance(report, &assessment.budgets, tolerance_m, out);
    }
}

pub(super) fn show_runs(report: &Report, out: Output) {
    let header = [
        "run",
        "R mm",
        "f mm/s",
        "way",
        "ΔR µm",
        "±95 %",
        "round µm",
        "2θ",
        "3θ",
        "4θ",
        "noise µm",
        "measured f",
        "centre mm",
    ];
    let mut runs = Grid::new(&header, 1, 1);
    for run in &report.runs {
        let size = |order: usize| {
            let found = run.harmonics.iter().find(|h| h.order == order);
            found.map_or_else(|| "–".to_owned(), |h: &Harmonic| um(h.cos_m.hypot(h.sin_m)))
        };
        let arc = run
            .arc_rad
            .map_or_else(String::new, |a| format!(" ({:.0}°)", a.to_degrees()));
        let way = if run.direction == Direction::Ccw {
            "ccw"
        } else {
            "cw"
        };
        runs.row([
            format!("{}{arc}", run.file),
            mm(run.radius_m),
            mm(run.feed_m_s),
            way.to_owned(),
            um(run.radius_error_m),
            format!("{:.2}", 1.96 * run.radius_error_se_m * 1e6),
            um(run.out_of_roundness_m),
            size(2),
            size(3),
            size(4),
            format!("{:.2}", run.noise_m * 1e6),
            run.measured_feed_m_s
                .map_or_else(|| "–".to_owned(), |f| format!("{:.1}", f * 1e3)),
            run.centre_m.map(thousandths).join(" "),
        ]);
    }
    runs.show(out);
}

/// Pairs in order of radius and feed.
fn by_circle(report: &Report) -> Vec<usize> {
    let mut order: Vec<usize> = (0..report.iso230_4.len()).collect();
    let of = |at: usize| &report.iso230_4[at];
    order.sort_by(|&a, &b| {
        let by_radius = of(a).radius_m.total_cmp(&of(b).radius_m);
        by_radius.then(of(a).feed_m_s.total_cmp(&of(b).feed_m_s))
    });
    order
}

/// The figures in order of radius and feed, with their expanded uncertainties.
fn show_iso(report: &Report, budgets: &[Iso230Budget], out: Output) {
    out.say("ISO 230-4, µm, each with its expanded uncertainty (k = 2)");
    let mut iso = Grid::new(
        &[
            "R mm", "f mm/s", "G cw", "G ccw", "G(b)", "F max", "F min", "D",
        ],
        0,
        2,
    );
    for at in by_circle(report) {
        let row = &report.iso230_4[at];
        let figures = tolerance::figures(row, &budgets[at]).map(|figure| {
            figure.map_or_else(
                || "–".to_owned(),
                |(value, budget)| format!("{} ±{}", um(value), um(budget.expanded_m())),
            )
        });
        iso.row(
            [mm(row.radius_m), mm(row.feed_m_s)]
                .into_iter()
                .chain(figures),
        );
    }
    iso.show(out);
    out.tell(0, "G is about the least-squares circle, F from the nominal circle as centred, D of both directions.");
    if let Some(budget) = budgets.first() {
        out.tell(0, uncertainty::words(&budget.f));
    }
}

fn show_tolerance(report: &Report, budgets: &[Iso230Budget], tolerance_m: f64, out: Output) {
    let held = tolerance::hold(report, budgets, tolerance_m);
    out.say("");
    out.say(format_args!("Tolerance {} µm", um(tolerance_m)));
    let header = [
        "R mm", "f mm/s", "G cw", "G ccw", "G(b)", "F max", "F min", "D",
    ];
    let mut grid = Grid::new(&header, 0, 2);
    for at in by_circle(report) {
        let (row, held) = (&report.iso230_4[at], &held[at]);
        let words = held.verdicts.map(|v| {
            match v {
                Some(Verdict::Pass) => "pass",
                Some(Verdict::Fail) => "FAIL",
                Some(Verdict::Undecided) => "within U",
                None => "–",
            }
            .to_owned()
        });
        grid.row(
            [mm(row.radius_m), mm(row.feed_m_s)]
                .into_iter()
                .chain(words),
        );
    }
    grid.show(out);
    out.tell(0, "pass and FAIL hold with the uncertainty counted in (ISO 14253-1); within U: it decides neither.");
    for feed in tolerance::largest_feeds(report, tolerance_m) {
        let limit = feed.limited_by.map_or_else(String::new, |name| {
            format!("; {} leaves it first", tolerance::name(name))
        });
        let words = match (feed.measured_mm_s, feed.interpolated_mm_s) {
            (None, _) => "no measured feed holds it".to_owned(),
            (Some(f), None) => format!("held up to {f} mm/s, the fastest measured"),
            (Some(f), Some(between)) => {
                format!("held up to {f} mm/s, about {between} mm/s between the measured feeds")
            }
        };
        out.tell(0, format_args!("R {} mm: {words}{limit}.", feed.radius_mm));
    }
}

/// Ballbar 20's figures with giotto's for the same, where a pair of runs gives them.
fn beside(report: &Report, ballbar: &Ballbar20, out: Output) {
    let of = |v: &Option<String>| v.clone().unwrap_or_else(|| "?".to_owned());
    out.say("");
    let (machine, plane, date) = (
        of(&ballbar.machine),
        of(&ballbar.plane),
        of(&ballbar.started),
    );
    out.say(format_args!(
        "Ballbar 20: {machine}, plane {plane}, {date} (its results; its samples are not read)"
    ));
    let pairs = analysis::counterparts(report);
    let mut header = vec![
        "result".to_owned(),
        "unit".to_owned(),
        "Ballbar 20".to_owned(),
    ];
    header.extend(pairs.iter().map(|p| {
        format!(
            "R{} f{}",
            (p.radius_m * 1e6).round() / 1e3,
            (p.feed_m_s * 1e6).round() / 1e3
        )
    }));
    let mut rows = Grid::new(&header.iter().map(String::as_str).collect::<Vec<_>>(), 1, 2);
    for feature in &ballbar.features {
        let mut row = vec![
            feature.name.clone(),
            feature.unit.clone(),
            format!("{}", feature.value),
        ];
        row.extend(pairs.iter().map(|p| {
            p.get(&feature.name, &feature.unit)
                .map_or_else(|| "–".to_owned(), |v| format!("{v:.3}"))
        }));
        rows.row(row);
    }
    rows.show(out);
}
