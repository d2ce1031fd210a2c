//! `giotto import`: foreign measurements into a campaign.
use super::choice::one_of;
use super::source::{Foreign, Progress, tell};
use super::{Failure, Output};
use giotto::campaign::import::{self, Added, Laps, Options};
use giotto::campaign::{Direction, Note};
use serde::Serialize;
use std::f64::consts::TAU;
use std::path::PathBuf;

/// Arguments of `giotto import`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Files of measurements; each becomes a run.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Directory of the campaign; made if missing.
    #[arg(short, long, value_name = "CAMPAIGN")]
    output: PathBuf,
    #[command(flatten)]
    foreign: Foreign,
    /// Laps that become runs.
    #[arg(long, value_parser = one_of(Laps::ALL), default_value = "first")]
    laps: Laps,
    /// Start of the run since the campaign began.
    #[arg(long, value_name = "S")]
    started: Option<f64>,
    /// Temperature of the machine.
    #[arg(long, value_name = "C", allow_negative_numbers = true)]
    temperature: Option<f64>,
    /// Where the circle lies in the machine.
    #[arg(long, value_name = "X,Y,Z", value_parser = centre, allow_hyphen_values = true)]
    centre: Option<[f64; 3]>,
    /// Machine under test, for a new campaign.
    #[arg(long)]
    machine: Option<String>,
}

fn centre(text: &str) -> Result<[f64; 3], String> {
    let parts: Option<Vec<f64>> = text
        .split(',')
        .map(|p| p.trim().parse().ok().filter(|v: &f64| v.is_finite()))
        .collect();
    parts
        .and_then(|p| p.try_into().ok())
        .ok_or_else(|| "expected three numbers in mm, as in -290,987,615".to_owned())
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let Some(options) = args.foreign.options() else {
        let words = "radius and feed of the programmed circle are missing";
        return Err(Failure::usage(words).help("add --radius MM --feed MM_S --direction ccw|cw"));
    };
    let options = Options {
        started_s: args.started,
        temperature_c: args.temperature,
        centre_m: args.centre.map(|c| c.map(|mm| mm * 1e-3)),
        machine: args.machine,
        laps: args.laps,
        ..options
    };
    let bar = Progress::new(out, &args.files);
    let added = import::add(&args.files, &args.output, &options, &|path, bytes| {
        bar.tell(path, bytes)
    })?;
    bar.done();
    added.iter().for_each(|a| tell(a, &options, out));
    if out.json {
        let runs = added.iter().map(|a| Entry::of(a, &options)).collect();
        return out.document(&Document {
            campaign: args.output.display().to_string(),
            runs,
        });
    }
    let folder = args.output.display();
    for a in &added {
        out.say(format_args!(
            "{} → {folder}/{} (lines {} to {})",
            a.source.display(),
            a.file,
            a.lines.0,
            a.lines.1
        ));
    }
    out.note(format_args!("next: giotto analyze {folder}"));
    Ok(())
}

#[derive(Serialize)]
struct Document {
    campaign: String,
    runs: Vec<Entry>,
}

#[derive(Serialize)]
struct Entry {
    file: String,
    source: String,
    format: String,
    rows: usize,
    lines: (usize, usize),
    lap: usize,
    laps: usize,
    rows_left_out: (usize, usize),
    direction: Direction,
    arc_deg: Option<f64>,
    tilt_deg: Option<f64>,
    flatness_um: Option<f64>,
    target_radius_mm: Option<f64>,
    measured_feed_mm_s: Option<f64>,
    notes: Vec<String>,
}

impl Entry {
    fn of(added: &Added, options: &Options) -> Self {
        let plane = added.location.and_then(|f| f.plane);
        Self {
            file: added.file.clone(),
            source: added.source.display().to_string(),
            format: added.format.to_string(),
            rows: added.rows,
            lines: added.lines,
            lap: added.lap.0,
            laps: added.lap.1,
            rows_left_out: added.left_out,
            direction: added.direction,
            arc_deg: added.arc_rad.map(f64::to_degrees),
            tilt_deg: plane.map(|p| p.tilt_rad.to_degrees()),
            flatness_um: plane.map(|p| p.flatness_m * 1e6),
            target_radius_mm: added.target_radius_m.map(|r| r * 1e3),
            measured_feed_mm_s: added.turn_s.map(|t| TAU * options.radius_m / t * 1e3),
            notes: added.notes.iter().map(Note::to_string).collect(),
        }
    }
}
