//! `giotto campaign`: the runs of a campaign, listed, changed and removed with the checks of an import.
use super::import::centre;
use super::source::{direction, length, plane};
use super::{Failure, Output};
use comfy_table::{Table, presets};
use giotto::campaign::edit::{self, Change};
use giotto::campaign::{Direction, Entry, Manifest, Plane};
use serde::Serialize;
use std::path::PathBuf;

/// Arguments of `giotto campaign`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(subcommand)]
    action: Action,
}

#[derive(clap::Subcommand, Debug)]
enum Action {
    /// The runs with what the campaign says of each.
    List {
        /// Directory of the campaign.
        campaign: PathBuf,
    },
    /// Change what the campaign says of runs.
    Set(Box<Set>),
    /// Take runs off the campaign; their files stay.
    Remove {
        /// Directory of the campaign.
        campaign: PathBuf,
        /// Files of the runs, as `list` shows them.
        #[arg(required = true)]
        runs: Vec<String>,
    },
}

#[derive(clap::Args, Debug)]
struct Set {
    /// Directory of the campaign.
    campaign: PathBuf,
    /// Files of the runs, as `list` shows them.
    #[arg(required = true)]
    runs: Vec<String>,
    /// Programmed radius.
    #[arg(long, value_name = "MM", value_parser = length)]
    radius: Option<f64>,
    /// Programmed feed.
    #[arg(long, value_name = "MM_S", value_parser = length)]
    feed: Option<f64>,
    /// Direction of travel.
    #[arg(long, value_parser = direction, value_name = "ccw|cw")]
    direction: Option<Direction>,
    /// Polar angle of the first sample.
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    start_angle: Option<f64>,
    /// Start of the run since the campaign began.
    #[arg(long, value_name = "S")]
    started: Option<f64>,
    /// Temperature of the machine.
    #[arg(long, value_name = "C", allow_negative_numbers = true)]
    temperature: Option<f64>,
    /// Where the circle lies in the machine.
    #[arg(long, value_name = "X,Y,Z", value_parser = centre, allow_hyphen_values = true)]
    centre: Option<[f64; 3]>,
    /// Plane of the circle.
    #[arg(long, value_parser = plane, value_name = "xy|yz|zx")]
    plane: Option<Plane>,
    /// Set-up that the runs belong to.
    #[arg(long, value_name = "NAME")]
    setup: Option<String>,
}

impl Set {
    fn change(&self) -> Change {
        Change {
            radius_m: self.radius.map(|mm| mm * 1e-3),
            feed_m_s: self.feed.map(|mm_s| mm_s * 1e-3),
            direction: self.direction,
            start_angle_rad: self.start_angle.map(f64::to_radians),
            started_s: self.started,
            temperature_c: self.temperature,
            centre_m: self.centre.map(|c| c.map(|mm| mm * 1e-3)),
            plane: self.plane,
            setup: self.setup.clone(),
        }
    }
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let manifest = match args.action {
        Action::List { campaign } => Manifest::open(&campaign)?,
        Action::Set(set) => {
            let change = set.change();
            if change == Change::default() {
                return Err(Failure::usage("nothing to change")
                    .help("for example --direction cw, --feed MM_S or --plane zx"));
            }
            let mut after = Manifest::open(&set.campaign)?;
            for run in &set.runs {
                after = edit::set(&set.campaign, run, &change)?;
            }
            after
        }
        Action::Remove { campaign, runs } => {
            let mut after = Manifest::open(&campaign)?;
            for run in &runs {
                after = edit::remove(&campaign, run)?;
            }
            after
        }
    };
    manifest.notes.iter().for_each(|note| out.note(note));
    if out.json {
        let runs = manifest.runs.iter().map(Row::of).collect();
        return out.document(&Document {
            campaign: manifest.name,
            machine: manifest.machine,
            runs,
        });
    }
    show(&manifest, out);
    Ok(())
}

#[derive(Serialize)]
struct Document {
    campaign: String,
    machine: String,
    runs: Vec<Row>,
}

#[derive(Serialize)]
struct Row {
    file: String,
    radius_mm: f64,
    feed_mm_s: f64,
    direction: Direction,
    start_angle_deg: Option<f64>,
    started_s: Option<f64>,
    temperature_c: Option<f64>,
    centre_mm: Option<[f64; 3]>,
    plane: Option<&'static str>,
    arc_deg: Option<f64>,
    setup: Option<String>,
}

/// What the conversion of units left behind goes.
fn tidy(v: f64) -> f64 {
    (v * 1e9).round() / 1e9
}

impl Row {
    fn of(entry: &Entry) -> Self {
        Self {
            file: entry.file.clone(),
            radius_mm: tidy(entry.radius_m * 1e3),
            feed_mm_s: tidy(entry.feed_m_s * 1e3),
            direction: entry.direction,
            start_angle_deg: entry.start_angle_rad.map(|a| tidy(a.to_degrees())),
            started_s: entry.started_s,
            temperature_c: entry.temperature_c,
            centre_mm: entry.centre_m.map(|c| c.map(|m| tidy(m * 1e3))),
            plane: entry.plane.map(Plane::name),
            arc_deg: entry.arc_rad.map(|a| tidy(a.to_degrees())),
            setup: entry.setup.clone(),
        }
    }
}

fn show(manifest: &Manifest, out: Output) {
    let title = format!("{} — {}", manifest.name, manifest.machine);
    out.say(format_args!("{title}: {} runs", manifest.runs.len()));
    let rows: Vec<Row> = manifest.runs.iter().map(Row::of).collect();
    let number = |v: Option<f64>| v.map_or_else(String::new, |v| v.to_string());
    // Columns that no run fills are left away.
    type Column = (&'static str, Box<dyn Fn(&Row) -> String>);
    let columns: Vec<Column> = vec![
        ("run", Box::new(|r| r.file.clone())),
        ("R mm", Box::new(|r| r.radius_mm.to_string())),
        ("feed mm/s", Box::new(|r| r.feed_mm_s.to_string())),
        (
            "direction",
            Box::new(|r| match r.direction {
                Direction::Ccw => "ccw".to_owned(),
                Direction::Cw => "cw".to_owned(),
            }),
        ),
        ("plane", Box::new(|r| r.plane.unwrap_or("").to_owned())),
        ("start °", Box::new(move |r| number(r.start_angle_deg))),
        ("arc °", Box::new(move |r| number(r.arc_deg))),
        ("set-up", Box::new(|r| r.setup.clone().unwrap_or_default())),
        ("started s", Box::new(move |r| number(r.started_s))),
        ("°C", Box::new(move |r| number(r.temperature_c))),
    ];
    let used: Vec<&Column> = columns
        .iter()
        .filter(|(_, text)| rows.iter().any(|r| !text(r).is_empty()))
        .collect();
    let mut table = Table::new();
    table
        .load_style(presets::NOTHING)
        .set_header(used.iter().map(|(name, _)| *name));
    for row in &rows {
        table.add_row(used.iter().map(|(_, text)| text(row)));
    }
    out.say(table);
}
