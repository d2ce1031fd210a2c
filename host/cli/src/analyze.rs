//! `giotto analyze`: least-squares circle, radius size error, out-of-roundness, harmonics, ISO 230-4 of each run.
use super::source::Source;
use super::{Failure, Output};
use comfy_table::{CellAlignment, Table, presets};
use giotto::analysis::{self, Document, Harmonic, Report};
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
    if out.json {
        return out.document(&Document::of(&report, ballbar.as_ref()));
    }
    show(&report, out);
    if let Some(ballbar) = ballbar {
        beside(&report, &ballbar, out);
    }
    Ok(())
}

impl From<CampaignError> for Failure {
    fn from(error: CampaignError) -> Self {
        let help = error.help();
        Self::input(error).help(help)
    }
}

fn table(header: &[&str]) -> Table {
    let mut table = Table::new();
    table
        .load_style(presets::NOTHING)
        .set_header(header.iter().copied());
    for (k, column) in table.column_iter_mut().enumerate() {
        column.set_cell_alignment(if k == 0 {
            CellAlignment::Left
        } else {
            CellAlignment::Right
        });
    }
    table
}

fn um(si: f64) -> String {
    format!("{:.1}", si * 1e6)
}

fn show(report: &Report, out: Output) {
    let title = [&report.name, &report.machine]
        .map(String::as_str)
        .join(" — ");
    out.say(format_args!("{title}: {} runs", report.runs.len()));
    out.say("");
    let mut runs = table(&[
        "run",
        "R mm",
        "feed mm/s",
        "",
        "measured",
        "ΔR µm",
        "±95 %",
        "roundness µm",
        "2θ",
        "3θ",
        "4θ",
        "noise µm",
        "centre mm",
    ]);
    for run in &report.runs {
        let size = |order: usize| {
            let found = run.harmonics.iter().find(|h| h.order == order);
            found.map_or_else(|| "–".to_owned(), |h: &Harmonic| um(h.cos_m.hypot(h.sin_m)))
        };
        let arc = run
            .arc_rad
            .map_or_else(String::new, |a| format!(" ({:.0}°)", a.to_degrees()));
        runs.add_row([
            format!("{}{arc}", run.file),
            format!("{}", (run.radius_m * 1e6).round() / 1e3),
            format!("{}", (run.feed_m_s * 1e6).round() / 1e3),
            if run.direction == Direction::Ccw {
                "ccw"
            } else {
                "cw"
            }
            .to_owned(),
            run.measured_feed_m_s
                .map_or_else(|| "–".to_owned(), |f| format!("{:.1}", f * 1e3)),
            um(run.radius_error_m),
            format!("{:.2}", 1.96 * run.radius_error_se_m * 1e6),
            um(run.out_of_roundness_m),
            size(2),
            size(3),
            size(4),
            format!("{:.2}", run.noise_m * 1e6),
            format!("{:.3} {:.3}", run.centre_m[0] * 1e3, run.centre_m[1] * 1e3),
        ]);
    }
    out.say(runs);
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
    out.say("ISO 230-4, µm (G about the least-squares circle, F from the nominal circle as centred, D of both directions)");
    let mut iso = table(&[
        "R mm",
        "feed mm/s",
        "G cw",
        "G ccw",
        "G(b)",
        "F max",
        "F min",
        "D",
    ]);
    let maybe = |v: Option<f64>| v.map_or_else(|| "–".to_owned(), um);
    for row in &report.iso230_4 {
        iso.add_row([
            format!("{}", (row.radius_m * 1e6).round() / 1e3),
            format!("{}", (row.feed_m_s * 1e6).round() / 1e3),
            maybe(row.g_cw_m),
            maybe(row.g_ccw_m),
            maybe(row.g_b_m),
            um(row.f_max_m),
            um(row.f_min_m),
            maybe(row.d_m),
        ]);
    }
    out.say(iso);
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
    let mut rows = table(&header.iter().map(String::as_str).collect::<Vec<_>>());
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
        rows.add_row(row);
    }
    out.say(rows);
}
