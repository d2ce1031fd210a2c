//! `giotto compare`: before and after, figure by figure and cause by cause, with intervals.
use super::choice::whole;
use super::destination::{Destination, Kind, quoted};
use super::grid::Grid;
use super::{Failure, Output};
use giotto::analysis;
use giotto::campaign::{self, Campaign};
use giotto::comparison::{self, Comparison, Fate, figure_name, title};
use giotto::diagnosis::{Options, diagnose};
use giotto::summary::Summary;
use giotto::units;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Arguments of `giotto compare`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The campaign that the others are held against.
    #[arg(value_name = "BEFORE")]
    before: PathBuf,
    /// Campaigns measured later, with the same instrument.
    #[arg(value_name = "AFTER", required = true)]
    after: Vec<PathBuf>,
    /// Write the comparison as a page.
    #[arg(long, value_name = "FILE.html")]
    html: Option<PathBuf>,
    /// Seed of the diagnoses.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u64>)]
    seed: u64,
}

#[derive(Serialize)]
struct Document<'a> {
    campaigns: Vec<Named<'a>>,
    comparisons: &'a [Comparison],
    seed: u64,
}

#[derive(Serialize)]
struct Named<'a> {
    path: &'a Path,
    name: &'a str,
    machine: &'a str,
    runs: usize,
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let paths: Vec<&Path> = std::iter::once(&args.before)
        .chain(&args.after)
        .map(PathBuf::as_path)
        .collect();
    let page = Destination::maybe(args.html.as_deref(), Kind::Html, &paths)?;
    let bar = out.spinner("diagnosing");
    let summaries: Result<Vec<Summary>, Failure> = paths
        .iter()
        .map(|path| {
            let (campaign, notes) = campaign::read_with_notes(path)?;
            notes.iter().for_each(|note| out.note(note));
            summary(&campaign, path, args.seed)
        })
        .collect();
    bar.finish_and_clear();
    let summaries = summaries?;
    let (first, later) = summaries
        .split_first()
        .ok_or_else(|| Failure::usage("giotto compare needs two campaigns"))?;
    for other in later.iter().filter(|other| other.machine != first.machine) {
        out.note(format_args!(
            "note: {} is of {}, {} of {}",
            first.name, first.machine, other.name, other.machine
        ));
    }
    let comparisons: Vec<Comparison> = later
        .iter()
        .map(|after| comparison::compare(first, after))
        .collect();
    if let Some(page) = &page {
        page.write(giotto_report::comparison_page(&comparisons).map_err(Failure::input)?)?;
        out.note(format_args!("wrote {}", page.path().display()));
    }
    if out.json {
        let campaigns = paths.iter().zip(&summaries).map(|(path, s)| Named {
            path,
            name: &s.name,
            machine: &s.machine,
            runs: s.runs,
        });
        return out.document(&Document {
            campaigns: campaigns.collect(),
            comparisons: &comparisons,
            seed: args.seed,
        });
    }
    for (comparison, path) in comparisons.iter().zip(&args.after) {
        show(comparison, &args.before, path, out);
    }
    Ok(())
}

/// Analyses and diagnoses a campaign.
pub(super) fn summary(campaign: &Campaign, path: &Path, seed: u64) -> Result<Summary, Failure> {
    let refused = |reason: &dyn std::fmt::Display| {
        Failure::input(format_args!("{}: {reason}", path.display())).help(format_args!(
            "see what the runs hold: giotto analyze {}",
            quoted(path)
        ))
    };
    let report = analysis::of_campaign(campaign).map_err(|(index, error)| {
        let file = campaign.runs.get(index).map_or("", |run| run.file.as_str());
        refused(&format_args!("{file}: {error}"))
    })?;
    let diagnosis = diagnose(
        campaign,
        &Options {
            seed,
            ..Options::default()
        },
    )
    .map_err(|e| refused(&e))?;
    Ok(Summary::of(&report, &diagnosis))
}

fn show(comparison: &Comparison, before: &Path, after: &Path, out: Output) {
    out.tell(
        0,
        format_args!(
            "{} ({}) → {} ({})",
            comparison.before,
            before.display(),
            comparison.after,
            after.display()
        ),
    );
    comparison.words.iter().for_each(|words| out.tell(0, words));
    out.say("");
    show_causes(comparison, out);
    show_figures(comparison, out);
}

fn show_causes(comparison: &Comparison, out: Output) {
    let mut causes = Grid::new(
        &[
            "cause",
            "before",
            "after",
            "change",
            "95 % from",
            "to",
            "unit",
            "",
        ],
        1,
        1,
    );
    for c in &comparison.causes {
        let shown = units::shown(c.change, c.ci95, &c.unit);
        let at = |v: Option<f64>| {
            v.map_or_else(
                || "–".to_owned(),
                |v| units::shown(v, c.ci95, &c.unit).value,
            )
        };
        let fate = match c.fate {
            Fate::Appeared => "appeared",
            Fate::Gone => "gone",
            Fate::Changed => "changed",
            Fate::Same => "",
        };
        causes.row([
            title(&c.name, &c.actuators),
            at(c.before),
            at(c.after),
            shown.value,
            shown.low,
            shown.high,
            shown.unit,
            fate.to_owned(),
        ]);
    }
    if !causes.is_empty() {
        causes.show(out);
        out.say("");
    }
}

fn show_figures(comparison: &Comparison, out: Output) {
    let header = [
        "figure",
        "R mm",
        "f mm/s",
        "before",
        "after",
        "change",
        "95 % from",
        "to",
        "",
    ];
    let mut figures = Grid::new(&header, 1, 3);
    for f in &comparison.figures {
        let um = |v: f64| units::shown(v, [v; 2], "um").value;
        figures.row([
            figure_name(f.figure).to_owned(),
            f.radius_mm.to_string(),
            f.feed_mm_s.to_string(),
            um(f.before_um),
            um(f.after_um),
            um(f.change_um),
            um(f.ci95_um[0]),
            um(f.ci95_um[1]),
            if f.changed { "changed" } else { "" }.to_owned(),
        ]);
    }
    if !figures.is_empty() {
        figures.show(out);
        out.say("Figures in µm; the same instrument is assumed for both.");
    }
}
