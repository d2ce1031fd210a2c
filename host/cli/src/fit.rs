//! `giotto fit`: the radius model of the paper: stepwise partial F, intervals, prediction of other radii.
use super::destination::{Destination, Kind};
use super::failure::cannot_write;
use super::grid::Grid;
use super::source::Source;
use super::{Failure, Output};
use clap::ValueEnum;
use giotto::analysis;
use giotto::campaign::{Direction, Manifest, Run};
use giotto::fit::{
    Action, FitError, Observation, Offset, Options, PartialF, Point, RadiusFit, Step, TERMS,
};
use giotto::model_file::{FORMAT, ModelFile, Servo, Valid};
use giotto_report::figures::Figure;
use giotto_report::forms::Form;
use giotto_shared::model::Element;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};

/// Measured feeds further than this share from the programmed ones are worth a note.
const FEED_DEPARTURE: f64 = 0.02;

/// Arguments of `giotto fit`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(flatten)]
    source: Source,
    /// Fit on this radius alone and predict the others; else fit on all and predict each from the others.
    #[arg(long, value_name = "MM")]
    train_radius: Option<f64>,
    /// How the offset β0 of each radius is removed.
    #[arg(long, value_enum, default_value_t = OffsetArg::Joint)]
    offset: OffsetArg,
    /// Definition of partial F.
    #[arg(long, value_enum, default_value_t = PartialFArg::Textbook)]
    partial_f: PartialFArg,
    /// Significance for a term to enter and to stay.
    #[arg(long, default_value_t = 0.05)]
    alpha: f64,
    /// Write the model here.
    #[arg(short, long, value_name = "MODEL.toml")]
    output: Option<PathBuf>,
    /// Draw the paper's Figures 2 to 11 into this directory, as SVG with the numbers that they draw as CSV.
    #[arg(long, value_name = "DIR")]
    figures: Option<PathBuf>,
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum OffsetArg {
    /// One constant per radius, fitted together with β; the intervals account for it.
    Joint,
    /// The runs at the lowest feed of each radius are subtracted, as in the paper; the intervals come out too narrow.
    LowestSpeed,
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum PartialFArg {
    /// Gain of one term over MSE, against F(α; 1; n − p).
    Textbook,
    /// As the paper writes it: gain divided by p, all estimated parameters, against F(α; p; n − p).
    Paper,
}

impl From<FitError> for Failure {
    fn from(error: FitError) -> Self {
        let failure = match &error {
            FitError::NoSuchRadius { .. } | FitError::Quantile { .. } => Self::usage(&error),
            _ => Self::input(&error),
        };
        match error {
            FitError::NoSuchRadius { .. } => failure.help("give one of them to --train-radius"),
            FitError::TooFew { .. } => failure.help("measure more feeds, each in both directions"),
            FitError::Collinear { .. } => failure.help("measure at three or more different feeds"),
            FitError::Quantile { .. } => {
                failure.help("--alpha lies between 0 and 1; 0.05 is usual")
            }
            _ => failure,
        }
    }
}

impl Args {
    /// What to fit, and how.
    fn options(&self) -> Options {
        Options {
            train_radius_m: self.train_radius.map(|mm| mm * 1e-3),
            offset: match self.offset {
                OffsetArg::Joint => Offset::Joint,
                OffsetArg::LowestSpeed => Offset::LowestSpeed,
            },
            alpha: self.alpha,
            partial_f: match self.partial_f {
                PartialFArg::Textbook => PartialF::Textbook,
                PartialFArg::Paper => PartialF::Paper,
            },
        }
    }
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let inputs = args.source.inputs(None);
    Destination::maybe(args.output.as_deref(), Kind::Model, &inputs)?;
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
    for run in &report.runs {
        if let Some(feed) = run
            .measured_feed_m_s
            .filter(|f| (f / run.feed_m_s - 1.0).abs() > FEED_DEPARTURE)
        {
            out.note(format_args!(
                "note: {}: the turn ran at {:.1} mm/s where {:.1} were programmed; the fit takes the programmed feed",
                run.file,
                feed * 1e3,
                run.feed_m_s * 1e3
            ));
        }
    }
    let observations: Vec<Observation> = report
        .runs
        .iter()
        .map(|run| Observation {
            radius_m: run.radius_m,
            feed_m_s: run.feed_m_s,
            radius_error_m: run.radius_error_m,
            out_of_roundness_m: Some(run.out_of_roundness_m),
        })
        .collect();
    let fit = RadiusFit::new(&observations, args.options())?;
    if let Some(path) = &args.output {
        model_file(&fit, &observations, &report.name, &report.machine)
            .save(path)
            .map_err(|e| {
                Failure::input(e).help("choose another path with -o, or make room there")
            })?;
    }
    if let Some(directory) = &args.figures {
        let points = fit.points(&observations);
        let directions = directions(&points, &observations, &report);
        let mut figures = giotto_report::forms::forms(&forms(manifest)?);
        figures.extend(
            giotto_report::figures::figures(&points, &directions, &fit.model)
                .map_err(Failure::input)?,
        );
        draw(&figures, directory)?;
    }
    if out.json {
        return out.document(&document(&fit));
    }
    show(&fit, &observations, &report.name, out);
    if let Some(path) = &args.output {
        out.say(format_args!("\nmodel written to {}", path.display()));
    }
    if let Some(directory) = &args.figures {
        out.say(format_args!(
            "figures 2 to 11 written to {}",
            directory.display()
        ));
    }
    Ok(())
}

fn draw(figures: &[Figure], directory: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(directory).map_err(|e| cannot_write(directory, &e))?;
    for figure in figures {
        let path = directory.join(&figure.file);
        Destination::new(&path, Kind::Svg, &[])?.write(&figure.svg)?;
        let path = path.with_extension("csv");
        Destination::new(&path, Kind::Csv, &[])?.write(&figure.csv)?;
    }
    Ok(())
}

/// The direction of each point; points stand radius by radius, runs as they were measured.
fn directions(
    points: &[Point],
    observations: &[Observation],
    report: &analysis::Report,
) -> Vec<Direction> {
    let mut taken = vec![false; observations.len()];
    let of = |point: &Point| {
        let found = (0..observations.len())
            .find(|&i| !taken[i] && observations[i] == point.observation)
            .unwrap_or(0);
        taken[found] = true;
        report.runs[found].direction
    };
    points.iter().map(of).collect()
}

/// The form errors of the runs: deviations from the nominal circle about the least-squares centre.
fn forms(manifest: &Manifest) -> Result<Vec<Form>, Failure> {
    let (campaign, _) = manifest.read()?;
    let form = |run: Run| {
        let centre = analysis::of_run(&run, None).map_or([0.0; 2], |a| a.set_up_m);
        let place = |(angle, deviation): (&f64, &f64)| {
            let ((sin, cos), r) = (angle.sin_cos(), run.radius_m + deviation);
            let (x, y) = (r * cos - centre[0], r * sin - centre[1]);
            (y.atan2(x), x.hypot(y) - run.radius_m)
        };
        let samples = run.samples.angle_rad.iter().zip(&run.samples.deviation_m);
        let (angle_rad, deviation_m) = samples.map(place).unzip();
        Form {
            file: run.file.clone(),
            radius_m: run.radius_m,
            feed_m_s: run.feed_m_s,
            direction: run.direction,
            angle_rad,
            deviation_m,
        }
    };
    Ok(campaign.runs.into_iter().map(form).collect())
}

fn model_file(fit: &RadiusFit, runs: &[Observation], campaign: &str, machine: &str) -> ModelFile {
    let range = |of: fn(&Observation) -> f64| {
        let values = runs.iter().map(|run| of(run) * 1e3);
        let rounded = |v: f64| (v * 1e6).round() / 1e6;
        [
            rounded(values.clone().fold(f64::INFINITY, f64::min)),
            rounded(values.fold(0.0, f64::max)),
        ]
    };
    ModelFile {
        format: FORMAT,
        campaign: campaign.to_owned(),
        machine: machine.to_owned(),
        servo: Servo::Beta {
            beta1_s2: fit.model.beta1_s2,
            beta2_s4: fit.model.beta2_s4,
            half_width95: fit.ci95.map(|[low, high]| 0.5 * (high - low)),
        },
        valid: Valid {
            radius_mm: range(|o| o.radius_m),
            feed_mm_s: range(|o| o.feed_m_s),
            centre_mm: None,
        },
        kinematics: None,
        effects: Vec::new(),
        delay_s: None,
    }
}

/// A radius in mm as a key: `100`, `12.5`.
fn mm(radius_m: f64) -> String {
    format!("{}", (radius_m * 1e9).round() / 1e6)
}

fn offset_name(offset: Offset) -> &'static str {
    match offset {
        Offset::Joint => "joint",
        Offset::LowestSpeed => "lowest-speed",
    }
}

/// The contract's document; `offset`, `not_entered`, `heldout.by` and the ratio beside it.
fn document(fit: &RadiusFit) -> Value {
    let step = |s: &Step| {
        let word = match s.action {
            Action::Enter => "enter",
            Action::Remove => "remove",
            Action::Reject => "term",
        };
        json!({ word: TERMS[s.column], "partial_f": s.partial_f, "critical_f": s.critical_f, "dof": [s.dof.0, s.dof.1] })
    };
    let steps = |rejected: bool| -> Vec<Value> {
        fit.steps
            .iter()
            .filter(|s| (s.action == Action::Reject) == rejected)
            .map(step)
            .collect()
    };
    let heldout = fit.heldout.as_ref();
    let offsets: Map<String, Value> = fit
        .offsets_m
        .iter()
        .map(|(radius, offset)| (mm(*radius), json!(offset * 1e6)))
        .collect();
    let cumulants = fit.cumulants();
    json!({
        "model": { "beta1_s2": fit.model.beta1_s2, "beta2_s4": fit.model.beta2_s4 },
        "ci95": { "beta1_s2": fit.ci95[0], "beta2_s4": fit.ci95[1] },
        "stepwise": steps(false),
        "not_entered": steps(true),
        "train": { "runs": fit.train.0, "rms_um": fit.train.1 * 1e6 },
        "heldout": {
            "runs": heldout.map_or(0, |h| h.runs),
            "rms_um": heldout.map(|h| h.rms_m * 1e6),
            "max_um": heldout.map(|h| h.max_m * 1e6),
            "explained_percent": heldout.map(|h| h.explained_percent),
            "by": if fit.options.train_radius_m.is_some() { "training radius" } else { "each radius from the others" },
        },
        "offset": offset_name(fit.options.offset),
        "offset_um": offsets,
        "cumulants": {
            "kappa2_s2": cumulants.kappa2_s2,
            "kappa4_s4": cumulants.kappa4_s4,
            "class": fit.classes.to_string(),
            "ratio_ci95": fit.ratio95,
        },
    })
}

fn show(fit: &RadiusFit, runs: &[Observation], campaign: &str, out: Output) {
    out.say(format_args!("{campaign}: ΔR = β0(R) + β1 f²/R + β2 f⁴/R³"));
    out.say(match fit.options.offset {
        Offset::Joint => "offsets β0: one per radius, fitted together with β",
        Offset::LowestSpeed => {
            "offsets β0: mean of the runs at the lowest feed of each radius, subtracted (as the paper does; the intervals\n\
             do not know of the scatter of those runs and are too narrow)"
        }
    });
    out.say(match fit.options.partial_f {
        PartialF::Textbook => "partial F: gain of the term over MSE, against F(α; 1; n − p)",
        PartialF::Paper => {
            "partial F: as the paper writes it, gain divided by p, against F(α; p; n − p); the textbook divides by 1"
        }
    });
    out.say("");
    show_steps(fit, out);
    out.say("");
    show_coefficients(fit, out);
    out.say("");
    show_radii(fit, runs, out);
    out.say("");
    show_prediction(fit, out);
    show_chain(fit, out);
}

/// β1 and β2 with their intervals.
fn show_coefficients(fit: &RadiusFit, out: Output) {
    let header = ["coefficient", "estimate", "95 % from", "to", "unit"];
    let mut coefficients = Grid::new(&header, 1, 1);
    let mut remarks = Vec::new();
    for (name, unit, value, ci, term) in [
        ("β1", "1e-6 s²", fit.model.beta1_s2, fit.ci95[0], 0),
        ("β2", "1e-6 s⁴", fit.model.beta2_s4, fit.ci95[1], 1),
    ] {
        let micro = |v: f64| format!("{:.4}", v * 1e6);
        if !fit.entered(term) {
            remarks.push(format!(
                "{name} is not in the model; its interval is that with both terms in."
            ));
        }
        coefficients.row([
            name.to_owned(),
            micro(value),
            micro(ci[0]),
            micro(ci[1]),
            unit.to_owned(),
        ]);
    }
    coefficients.show(out);
    remarks.iter().for_each(|remark| out.say(remark));
}

/// Radius by radius: its offset, and how well it is predicted.
fn show_radii(fit: &RadiusFit, runs: &[Observation], out: Output) {
    let header = [
        "R mm",
        "part",
        "β0 µm",
        "runs",
        "rms µm",
        "largest µm",
        "explained %",
    ];
    let mut radii = Grid::new(&header, 0, 1);
    for (radius, offset) in &fit.offsets_m {
        let of_radius = |r: &f64| (r - radius).abs() < 1e-9;
        let trained = fit.options.train_radius_m.is_none_or(|r| of_radius(&r));
        let part = if trained && fit.options.train_radius_m.is_some() {
            "fitted"
        } else {
            "predicted"
        };
        let mut row = vec![mm(*radius), part.to_owned(), format!("{:.2}", offset * 1e6)];
        match fit.heldout_by_radius.iter().find(|(r, _)| of_radius(r)) {
            Some((_, h)) => row.extend([
                h.runs.to_string(),
                format!("{:.2}", h.rms_m * 1e6),
                format!("{:.2}", h.max_m * 1e6),
                format!("{:.3}", h.explained_percent),
            ]),
            None => row.extend([
                runs.iter()
                    .filter(|run| of_radius(&run.radius_m))
                    .count()
                    .to_string(),
                "–".to_owned(),
                "–".to_owned(),
                "–".to_owned(),
            ]),
        }
        radii.row(row);
    }
    radii.show(out);
}

/// What the fit leaves of the runs it has seen and of those it has not.
fn show_prediction(fit: &RadiusFit, out: Output) {
    let (runs, rms) = fit.train;
    out.tell(
        0,
        format_args!("fitted: {runs} runs, residuals {:.2} µm rms", rms * 1e6),
    );
    match &fit.heldout {
        Some(h) => out.tell(0, format_args!(
            "predicted ({}): {} runs, residuals {:.2} µm rms, largest {:.2} µm, {:.3} % of the radius error explained",
            if fit.options.train_radius_m.is_some() {
                "radii not fitted; only their β0 is their own"
            } else {
                "each radius from the others; only its β0 is its own"
            },
            h.runs,
            h.rms_m * 1e6,
            h.max_m * 1e6,
            h.explained_percent
        )),
        None => out.tell(0, "predicted: nothing; a second radius would show whether the model carries over"),
    }
}

fn show_steps(fit: &RadiusFit, out: Output) {
    let header = ["step", "term", "partial F", "critical F", "dof"];
    let mut steps = Grid::new(&header, 1, 2);
    for s in &fit.steps {
        let action = match s.action {
            Action::Enter => "enters",
            Action::Remove => "leaves",
            Action::Reject => "stays out",
        };
        steps.row([
            action.to_owned(),
            ["f²/R", "f⁴/R³"][s.column].to_owned(),
            format!("{:.2}", s.partial_f),
            format!("{:.2}", s.critical_f),
            format!("{}, {}", s.dof.0, s.dof.1),
        ]);
    }
    steps.show(out);
}

fn show_chain(fit: &RadiusFit, out: Output) {
    let [low, high] = fit.ratio95;
    let classes = if fit.classes.is_any() {
        "any lag, filter, average or second order: too little to tell".to_owned()
    } else {
        fit.classes.to_string().replace('_', " ")
    };
    out.say("");
    out.tell(
        0,
        format_args!("κ4/κ2² between {low:.1} and {high:.1} (95 %): the chain may be {classes}"),
    );
    match fit.cumulants().equivalent() {
        Some(Element::SecondOrder { omega_n_rad_s, zeta }) => out.tell(0, format_args!(
            "a second order with the same κ2 and κ4: ωn {omega_n_rad_s:.1} rad/s, ζ {zeta:.3} (an equivalent, not a finding)"
        )),
        Some(Element::FeedForwardLag { kv_per_s, feed_forward }) => out.tell(0, format_args!(
            "a lag with feed-forward of the same κ2 and κ4: kv {kv_per_s:.1} 1/s, a {feed_forward:.2} (an equivalent, not a finding)"
        )),
        Some(_) | None => {}
    }
}
