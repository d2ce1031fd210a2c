//! `giotto import`: foreign measurements into a campaign, one by one or a whole session.
use super::choice::one_of;
use super::destination::quoted;
use super::source::{Foreign, Progress, tell};
use super::{Failure, Output};
use giotto::campaign::import::batch::{self, Said};
use giotto::campaign::import::{self, Added, Laps, Options, Reason};
use giotto::campaign::{Direction, Note};
use serde::Serialize;
use std::f64::consts::TAU;
use std::io::{BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};

/// Arguments of `giotto import`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Files of measurements, or folders of them; each file becomes a run, one that goes both ways two.
    #[arg(required_unless_present = "manifest")]
    files: Vec<PathBuf>,
    /// Directory of the campaign; made if missing.
    #[arg(short, long, value_name = "CAMPAIGN")]
    output: PathBuf,
    /// What the names of the files say, as in '{radius}_{feed}_{direction}'; {} stands for anything.
    #[arg(long, value_name = "PATTERN")]
    name: Option<String>,
    /// A CSV that lists files, with columns file, radius_mm, feed_mm_s, direction, plane, setup …
    #[arg(long, value_name = "CSV")]
    manifest: Option<PathBuf>,
    #[command(flatten)]
    foreign: Foreign,
    /// Laps that become runs.
    #[arg(long, value_parser = one_of(Laps::ALL), default_value = "first")]
    laps: Laps,
    /// Set-up that the runs belong to; runs of one set-up share their centre offset.
    #[arg(long, value_name = "NAME")]
    setup: Option<String>,
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

pub(super) fn centre(text: &str) -> Result<[f64; 3], String> {
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
    let jobs = jobs(&args, out)?;
    let files: Vec<PathBuf> = jobs.iter().map(|(file, _)| file.clone()).collect();
    let bar = Progress::new(out, &files);
    let added = import::add_each(&jobs, &args.output, &|path, bytes| bar.tell(path, bytes))?;
    bar.done();
    let options = |a: &Added| {
        jobs.iter()
            .find(|(file, _)| *file == a.source)
            .map(|(_, o)| o)
    };
    for a in &added {
        if let Some(options) = options(a) {
            tell(a, options, out);
        }
    }
    if out.json {
        let entry = |a: &Added| options(a).map(|o| Entry::of(a, o));
        return out.document(&Document {
            campaign: args.output.display().to_string(),
            runs: added.iter().filter_map(entry).collect(),
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
    out.note(format_args!(
        "next: giotto analyze {}",
        quoted(&args.output)
    ));
    Ok(())
}

/// The files with what is said of each, by the list, by their names, by the options, by who is asked.
fn jobs(args: &Args, out: Output) -> Result<Vec<(PathBuf, Options)>, Failure> {
    let mut files: Vec<(PathBuf, Said)> = match &args.manifest {
        Some(list) => batch::by_list(list)?,
        None => Vec::new(),
    };
    let given = batch::files(&args.files)?;
    files.extend(given.into_iter().map(|file| (file, Said::default())));
    let mut jobs = Vec::with_capacity(files.len());
    let mut asked = Said::default();
    for (file, mut said) in files {
        if let Some(pattern) = &args.name {
            let named = batch::by_name(pattern, &file)?;
            said = Said {
                radius_m: said.radius_m.or(named.radius_m),
                feed_m_s: said.feed_m_s.or(named.feed_m_s),
                direction: said.direction.or(named.direction),
                start_angle_rad: said.start_angle_rad.or(named.start_angle_rad),
                started_s: said.started_s.or(named.started_s),
                temperature_c: said.temperature_c.or(named.temperature_c),
                plane: said.plane.or(named.plane),
                setup: said.setup.or(named.setup),
            };
        }
        let mm = |m: f64| m * 1e3;
        let radius = said.radius_m.map(mm).or(args.foreign.radius);
        let feed = said.feed_m_s.map(mm).or(args.foreign.feed);
        let mut need = |value: Option<f64>, what: &str, kept: fn(&mut Said) -> &mut Option<f64>| {
            let before = *kept(&mut asked);
            match value {
                Some(value) => Ok(value),
                None => ask(&file, what, before, out).inspect(|v| *kept(&mut asked) = Some(*v)),
            }
        };
        let radius = need(radius, "radius in mm", |said| &mut said.radius_m)?;
        let feed = need(feed, "feed in mm/s", |said| &mut said.feed_m_s)?;
        let direction = said.direction.or(args.foreign.direction);
        let options = Options {
            started_s: args.started,
            temperature_c: args.temperature,
            centre_m: args.centre.map(|c| c.map(|mm| mm * 1e-3)),
            setup: args.setup.clone(),
            machine: args.machine.clone(),
            laps: args.laps,
            ..args.foreign.with(radius, feed, direction)
        };
        jobs.push((file, said.over(&options)));
    }
    Ok(jobs)
}

/// Asks on a terminal for what is missing, the last answer as the usual one; elsewhere it is a wrong usage.
fn ask(file: &Path, what: &str, usual: Option<f64>, out: Output) -> Result<f64, Failure> {
    let missing = || {
        let words = format!("{}: the programmed {what} is missing", file.display());
        let help = match batch::pattern_of(file) {
            Some(pattern) => format!("its name may say it: --name '{pattern}'"),
            None => {
                "add --radius MM --feed MM_S --direction ccw|cw, or --manifest LIST.csv".to_owned()
            }
        };
        Failure::usage(words).help(help)
    };
    let stdin = std::io::stdin();
    if out.json || out.non_interactive || !stdin.is_terminal() || !std::io::stderr().is_terminal() {
        return Err(missing());
    }
    loop {
        let usual_text = usual.map_or_else(String::new, |v| format!(" [{v}]"));
        eprint!("{}: programmed {what}{usual_text}? ", file.display());
        // A terminal that takes no words takes no answer either.
        let _ = std::io::stderr().flush();
        let mut line = String::new();
        if stdin.lock().read_line(&mut line).unwrap_or(0) == 0 {
            return Err(missing());
        }
        let answer = match (line.trim(), usual) {
            ("", Some(usual)) => Some(usual),
            (text, _) => super::source::length(&text.replace(',', ".")).ok(),
        };
        match answer {
            Some(answer) => return Ok(answer),
            None => eprintln!("expected a number above 0, up to 100000"),
        }
    }
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
    left_out: Vec<LeftOut>,
    plane: Option<&'static str>,
    start_angle_deg: Option<f64>,
    direction: Direction,
    arc_deg: Option<f64>,
    tilt_deg: Option<f64>,
    flatness_um: Option<f64>,
    target_radius_mm: Option<f64>,
    measured_feed_mm_s: Option<f64>,
    notes: Vec<String>,
}

#[derive(Serialize)]
struct LeftOut {
    rows: usize,
    reason: String,
    lines: Option<(usize, usize)>,
}

impl LeftOut {
    fn of(reason: &Reason) -> Self {
        Self {
            rows: reason.rows,
            reason: reason.why.clone(),
            lines: reason.lines,
        }
    }
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
            left_out: added.reasons.iter().map(LeftOut::of).collect(),
            plane: added.plane.map(|plane| plane.name()),
            start_angle_deg: added.start_angle_rad.map(f64::to_degrees),
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
