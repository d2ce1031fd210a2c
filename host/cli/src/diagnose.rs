//! `giotto diagnose`: what the simulation gets wrong, why, the extended model, the gain.
use super::choice::whole;
use super::destination::{Destination, Kind, quoted};
use super::failure::{Failure, plain};
use super::grid::Grid;
use super::output::Output;
use super::paragraph::sentence;
use super::plan::name;
use super::source::Source;
use giotto::diagnosis::recommendation::{Action, CAMPAIGN};
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
    /// Model whose table was at work while these circles were measured: what it corrects is counted back in, and the extended
    /// model replaces it.
    #[arg(long, value_name = "MODEL.toml", conflicts_with = "model")]
    corrected_by: Option<PathBuf>,
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
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u64>)]
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
    let given = args.model.as_deref().or(args.corrected_by.as_deref());
    let inputs = args.source.inputs(given);
    Destination::apart(&[args.output.as_deref(), args.report.as_deref()])?;
    Destination::maybe(args.output.as_deref(), Kind::Model, &inputs)?;
    let page = Destination::maybe(args.report.as_deref(), Kind::Html, &inputs)?;
    let (campaign, mislabelled) = if args.keep_all {
        (args.source.read(out)?, Vec::new())
    } else {
        args.source.read_labelled(out)?
    };
    let load = |path: &Option<PathBuf>| path.as_deref().map(ModelFile::load).transpose();
    let (model, corrected_by) = (load(&args.model)?, load(&args.corrected_by)?);
    let bar = out.spinner("diagnosing");
    let diagnosis = diagnose(
        &campaign,
        &Options {
            model,
            corrected_by,
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
    let steps = Steps {
        campaign: args.source.argument(),
        model: args.output.as_deref().filter(|_| diagnosis.model_written),
    };
    diagnosis.recommendation.command = steps.of(&diagnosis).pop();
    if let Some(page) = &page {
        let html = giotto_report::html(&campaign, &diagnosis).map_err(Failure::input)?;
        page.write(html)?;
        out.note(format_args!("wrote {}", page.path().display()));
    }
    if out.json {
        out.document(&diagnosis)?;
    } else {
        show(&campaign.name, &diagnosis, &steps, out);
    }
    refused.map_or(Ok(()), Err)
}

/// Why no model was written.
fn nothing_real(path: &Path, d: &Diagnosis) -> Failure {
    let why = match (&d.gain, d.findings.is_empty()) {
        _ if d.at_work => "a table was at work, and of what it leaves alone no model is made",
        (None, _) => "these runs prove nothing: nothing can be called real",
        (Some(_), true) => {
            "nothing was found beside circles that do not shrink with speed: nothing can be called real"
        }
        (Some(_), false) => {
            "what was found does not foretell runs left out better than before: nothing can be called real"
        }
    };
    Failure::check(format_args!("{}: not written; {why}", path.display()))
        .help(&d.recommendation.words)
}

/// The diagnosis as a person reads it.
fn show(name: &str, d: &Diagnosis, steps: &Steps<'_>, out: Output) {
    out.tell(
        0,
        format_args!(
            "Campaign {name}: noise {:.2} µm a sample, {:.2} µm between runs; seed {}",
            d.noise_um, d.spread_um, d.seed
        ),
    );
    out.tell(0, format_args!("Simulation: {}", d.baseline.name));
    let m = &d.misfit;
    let mut grid = Grid::new(&["misfit of the simulation", "µm rms"], 1, 1);
    for (kind, value) in [
        ("size of the circles", m.size_um),
        ("  of which follows campaign time", m.drift_um),
        ("harmonics 2–8, same both ways", m.harmonics_even_um),
        ("harmonics 2–8, flip with direction", m.harmonics_odd_um),
        ("at fixed places beyond these", m.localised_um),
        ("periodic in time", m.periodic_um),
        ("random and the rest", m.random_um),
    ] {
        grid.row([kind.to_string(), format!("{value:.2}")]);
    }
    grid.show(out);
    show_findings(d, out);
    show_doubts(d, out);
    if let Some(g) = d.gain.as_ref().filter(|_| !d.findings.is_empty()) {
        out.tell(
            0,
            format_args!(
                "On runs left out (each radius, each speed): {:.2} µm rms, before {:.2}; β1, β2 alone {:.2}; no model {:.2}.",
                g.extended_rms_um, g.baseline_rms_um, g.beta_rms_um, g.no_model_rms_um
            ),
        );
        out.tell(
            0,
            format_args!(
                "Gain {:.1} % ({:.1} to {:.1}), {:.1} % of what a perfect model would gain.",
                g.percent, g.ci95_percent[0], g.ci95_percent[1], g.of_perfect_percent
            ),
        );
    } else if let Some(g) = &d.gain {
        out.tell(
            0,
            format_args!(
                "On runs left out (each radius, each speed) the simulation is off by {:.2} µm rms; no model by {:.2}.",
                g.baseline_rms_um, g.no_model_rms_um
            ),
        );
    }
    out.tell(0, format_args!("Next: {}.", d.recommendation.words));
    for command in steps.of(d) {
        out.say(format_args!("  {command}"));
    }
}

/// What was found, as a table and in words.
fn show_findings(d: &Diagnosis, out: Output) {
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
        ];
        let mut grid = Grid::new(&header, 2, 2);
        d.findings.iter().for_each(|f| grid.row(row(f)));
        out.say("");
        grid.show(out);
        out.say("");
        d.findings.iter().for_each(|f| show_finding(f, out));
    }
}

/// What one cause does, what to turn and which way, and what it usually is.
fn show_finding(f: &Finding, out: Output) {
    let words = f.cause.model().words();
    let most = match &f.effect_um {
        most if most.max > 0.0 => format!(
            ": up to {:.1} µm on the circles, at R {} mm and {} mm/s",
            most.max,
            round(most.radius_mm),
            round(most.feed_mm_s)
        ),
        _ => String::new(),
    };
    let corrected = if f.compensable {
        "; the controller can correct it"
    } else {
        ""
    };
    out.tell(0, sentence(&format!("{}{most}{corrected}", f.title())));
    out.tell(2, sentence(&f.remedy));
    out.tell(
        2,
        format_args!(
            "{} Usually {}. In general: {}.",
            sentence(words.what),
            words.usual,
            words.adjust
        ),
    );
    if let Some(note) = &f.note {
        out.tell(2, sentence(note));
    }
    if !f.indistinguishable_from.is_empty() {
        let others: Vec<String> = f.indistinguishable_from.iter().map(|id| name(id)).collect();
        out.tell(
            2,
            format_args!(
                "Not to be told from: {}. Measure: {}.",
                others.join(", "),
                f.next_measurement
            ),
        );
    }
    if let (false, Some(why)) = (f.compensable, words.not_compensable) {
        out.tell(2, format_args!("The controller cannot correct it: {why}."));
    }
}

/// Millimetres as they were programmed, without what the conversion of units left.
fn round(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// What has no name, what was taken otherwise, what was left out and what cannot be told.
fn show_doubts(d: &Diagnosis, out: Output) {
    if d.unexplained.present {
        // The clock alone may show something, which has no µm.
        let um = d.unexplained.rms_um;
        if um < 0.005 {
            out.tell(0, "Unexplained, as no cause in the list does it:");
        } else {
            out.tell(
                0,
                format_args!("Unexplained: {um:.2} µm rms that match no cause in the list:"),
            );
        }
        for words in &d.unexplained.signature.words {
            out.tell(2, words);
        }
    }
    for note in &d.notes {
        out.tell(0, format_args!("Note: {note}."));
    }
    for run in &d.left_out {
        let reason = plain(&run.reason);
        out.tell(
            0,
            format_args!("Left out: {}: {reason} (--keep-all keeps it).", run.file),
        );
    }
    for missing in &d.cannot_tell {
        out.tell(0, format_args!("Cannot tell: {missing}."));
    }
}

fn row(f: &Finding) -> [String; 6] {
    let e = &f.estimate;
    let shown = giotto::units::shown(e.value, e.ci95, e.unit);
    [
        f.cause.model().words().name.to_string(),
        f.place(),
        format!("{} {}", shown.value, shown.unit),
        format!("{} … {}", shown.low, shown.high),
        format!("{:.0} %", f.share_percent),
        format!("{:.3}", f.probability),
    ]
}

/// The commands that come next, with the paths of this call.
struct Steps<'a> {
    /// The campaign, as it was typed.
    campaign: String,
    /// The extended model, if it was written.
    model: Option<&'a Path>,
}

impl Steps<'_> {
    fn of(&self, d: &Diagnosis) -> Vec<String> {
        match (d.recommendation.action, self.model) {
            (Action::Flash, Some(model)) => vec![flash(&quoted(model))],
            (Action::Flash, None) => vec![
                format!("giotto diagnose {} -o model.toml", self.campaign),
                flash("model.toml"),
            ],
            _ => {
                let command = d.recommendation.command.iter();
                command
                    .map(|c| c.replace(CAMPAIGN, &self.campaign))
                    .collect()
            }
        }
    }
}

/// The port is the one thing that nobody but the user knows.
fn flash(model: &str) -> String {
    format!("giotto flash {model} --port PORT")
}
