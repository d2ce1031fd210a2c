//! `giotto diagnose`: what the simulation gets wrong, why, the extended model, the gain.
use super::destination::{Destination, Kind, quoted};
use super::failure::Failure;
use super::grid::Grid;
use super::output::Output;
use super::source::Source;
use comfy_table::{CellAlignment, Table, presets};
use giotto::diagnosis::{Diagnosis, Finding, Options, diagnose};
use giotto::model_file::ModelFile;
use std::path::{Path, PathBuf};

/// Arguments of `giotto diagnose`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(flatten)]
    source: Source,
    /// Simulation to start from; without it one servo lag with fitted kv.
    #[arg(long, value_name = "MODEL.toml")]
    model: Option<PathBuf>,
    /// Write the extended model here.
    #[arg(short, long, value_name = "EXTENDED.toml")]
    output: Option<PathBuf>,
    /// Write an HTML report here.
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Known scatter of a circle's size between runs, µm; for sessions too short to show it.
    #[arg(long, value_name = "UM", value_parser = repeatability)]
    repeatability: Option<f64>,
    /// Look at every run, also one that does not fit the others.
    #[arg(long)]
    keep_all: bool,
    /// Seed of the bootstrap.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

fn repeatability(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(um) if um > 0.0 && um <= 1e4 => Ok(um),
        _ => Err("a scatter of more than 0 and at most 10000 µm is expected".into()),
    }
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let inputs = args.source.inputs(args.model.as_deref());
    Destination::maybe(args.output.as_deref(), Kind::Model, &inputs)?;
    let page = Destination::maybe(args.report.as_deref(), Kind::Html, &inputs)?;
    let (campaign, mislabelled) = if args.keep_all {
        (args.source.read(out)?, Vec::new())
    } else {
        args.source.read_labelled(out)?
    };
    let model = args.model.as_deref().map(ModelFile::load).transpose()?;
    let bar = out.spinner("diagnosing");
    let diagnosis = diagnose(
        &campaign,
        &Options {
            model,
            seed: args.seed,
            repeatability_m: args.repeatability.map(|um| um * 1e-6),
            keep_all: args.keep_all,
        },
    );
    bar.finish_and_clear();
    let mut diagnosis = diagnosis.map_err(|e| args.source.refused(&e))?;
    diagnosis.left_out.splice(0..0, mislabelled);
    let mut refused = None;
    match &args.output {
        Some(path) if diagnosis.worth_writing => {
            diagnosis.model.save(path)?;
            diagnosis.model_written = true;
            out.note(format_args!("wrote {}", path.display()));
        }
        Some(path) => refused = Some(nothing_real(path, &diagnosis)),
        None => {}
    }
    if let Some(page) = &page {
        let html = giotto_report::html(&campaign, &diagnosis).map_err(Failure::input)?;
        page.write(html)?;
        out.note(format_args!("wrote {}", page.path().display()));
    }
    if out.json {
        out.document(&diagnosis)?;
    } else {
        show(&campaign.name, &diagnosis, args.output.as_deref(), &out);
    }
    refused.map_or(Ok(()), Err)
}

/// Why no model was written.
fn nothing_real(path: &Path, d: &Diagnosis) -> Failure {
    let why = match (&d.gain, d.findings.is_empty()) {
        (None, _) => "these runs prove nothing: ",
        (Some(_), true) => "nothing was found beside circles that do not shrink with speed: ",
        (Some(_), false) => "what was found does not foretell runs left out better than before: ",
    };
    Failure::check(format_args!(
        "{}: not written; {why}nothing can be called real",
        path.display()
    ))
    .help(&d.recommendation.words)
}

/// The diagnosis as a person reads it.
fn show(name: &str, d: &Diagnosis, extended: Option<&Path>, out: &Output) {
    out.say(format_args!(
        "Campaign {name}: noise {:.2} µm a sample, {:.2} µm between runs; seed {}",
        d.noise_um, d.spread_um, d.seed
    ));
    out.say(format_args!("Simulation: {}", d.baseline.name));
    let m = &d.misfit;
    let mut table = Table::new();
    table
        .load_style(presets::NOTHING)
        .set_header(["misfit of the simulation", "µm rms"]);
    for (kind, value) in [
        ("size of the circles", m.size_um),
        ("  of which follows campaign time", m.drift_um),
        ("harmonics 2–8, same both ways", m.harmonics_even_um),
        ("harmonics 2–8, flip with direction", m.harmonics_odd_um),
        ("at fixed places beyond these", m.localised_um),
        ("periodic in time", m.periodic_um),
        ("random and the rest", m.random_um),
    ] {
        table.add_row([kind.to_string(), format!("{value:.2}")]);
    }
    right(&mut table, 1);
    out.say(&table);
    show_findings(d, out);
    show_doubts(d, out);
    if let Some(g) = &d.gain {
        out.say(format_args!(
            "On runs left out (each radius, each speed): {:.2} µm rms, before {:.2}; β1, β2 alone {:.2}; no model {:.2}.",
            g.extended_rms_um, g.baseline_rms_um, g.beta_rms_um, g.no_model_rms_um
        ));
        out.say(format_args!(
            "Gain {:.1} % ({:.1} to {:.1}), {:.1} % of what a perfect model would gain.",
            g.percent, g.ci95_percent[0], g.ci95_percent[1], g.of_perfect_percent
        ));
    }
    out.say(format_args!("Next: {}", recommendation(d, extended)));
}

/// What was found, as a table and in words.
fn show_findings(d: &Diagnosis, out: &Output) {
    if d.findings.is_empty() && !d.unexplained.present && d.cannot_tell.is_empty() {
        out.say("Nothing found: the simulation explains the data.");
    } else if !d.findings.is_empty() {
        let header = [
            "cause",
            "of",
            "size",
            "95 % interval",
            "share",
            "probability",
            "correctable",
        ];
        let mut grid = Grid::new(&header, 2, 2);
        d.findings.iter().for_each(|f| grid.row(row(f)));
        out.say("");
        grid.show(*out);
        out.say("");
        for f in &d.findings {
            let words = f.cause.model().words();
            out.say(format_args!(
                "{}: {}. Usually {}. Remedy: {}.",
                words.name, words.what, words.usual, words.adjust
            ));
            if let Some(note) = &f.note {
                out.say(format_args!("  {note}."));
            }
            if !f.indistinguishable_from.is_empty() {
                out.say(format_args!(
                    "  Not to be told from: {}. Measure: {}.",
                    f.indistinguishable_from.join(", "),
                    f.next_measurement
                ));
            }
            if let (false, Some(why)) = (f.compensable, words.not_compensable) {
                out.say(format_args!("  The controller cannot correct it: {why}."));
            }
        }
    }
}

/// What has no name, what was taken otherwise, what was left out and what cannot be told.
fn show_doubts(d: &Diagnosis, out: &Output) {
    if d.unexplained.present {
        // The clock alone may show something, which has no µm.
        let um = d.unexplained.rms_um;
        if um < 0.005 {
            out.say("Unexplained, as no cause in the list does it:");
        } else {
            out.say(format_args!(
                "Unexplained: {um:.2} µm rms that match no cause in the list:"
            ));
        }
        for words in &d.unexplained.signature.words {
            out.say(format_args!("  {words}"));
        }
    }
    for note in &d.notes {
        out.say(format_args!("Note: {note}."));
    }
    for run in &d.left_out {
        out.say(format_args!(
            "Left out: {}: {} (`--keep-all` keeps it).",
            run.file, run.reason
        ));
    }
    for missing in &d.cannot_tell {
        out.say(format_args!("Cannot tell: {missing}."));
    }
}

/// Numbers to the right: every column from `first` on.
fn right(table: &mut Table, first: usize) {
    table
        .column_iter_mut()
        .skip(first)
        .for_each(|column| column.set_cell_alignment(CellAlignment::Right));
}

fn row(f: &Finding) -> [String; 7] {
    let e = &f.estimate;
    let shown = giotto::units::shown(e.value, e.ci95, e.unit);
    [
        f.cause.model().words().name.to_string(),
        f.place(),
        format!("{} {}", shown.value, shown.unit),
        format!("{} … {}", shown.low, shown.high),
        format!("{:.0} %", f.share_percent),
        format!("{:.3}", f.probability),
        if f.compensable { "yes" } else { "no" }.to_string(),
    ]
}

/// The one thing to do now, with the file that was written.
fn recommendation(d: &Diagnosis, extended: Option<&Path>) -> String {
    let words = &d.recommendation.words;
    match extended.filter(|_| d.model_written) {
        Some(path) => words
            .replace(
                "write the extended model with -o EXTENDED.toml and flash it",
                "flash it",
            )
            .replace("EXTENDED.toml", &quoted(path)),
        None => words.clone(),
    }
}
