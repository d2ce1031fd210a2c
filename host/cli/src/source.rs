//! A campaign, or a foreign file where a campaign stands.
use super::choice::one_of;
use super::destination::quoted;
use super::{Failure, Output};
use giotto::campaign::import::{self, Added, Format, Laps, Options, Reason};
use giotto::campaign::{Campaign, Direction, Manifest, Plane};
use giotto::diagnosis::LeftOut;
use std::path::{Path, PathBuf};

/// Heading of these options; given one by one, since a heading for the struct would go on behind it.
const FOREIGN: &str = "What a foreign file does not say of itself";

/// What a foreign file does not say of itself.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct Foreign {
    /// Programmed radius.
    #[arg(long, help_heading = FOREIGN, value_name = "MM", value_parser = length)]
    pub(super) radius: Option<f64>,
    /// Programmed feed.
    #[arg(long, help_heading = FOREIGN, value_name = "MM_S", value_parser = length)]
    pub(super) feed: Option<f64>,
    /// Direction of travel; positions tell it themselves.
    #[arg(long, help_heading = FOREIGN, value_parser = direction, value_name = "ccw|cw")]
    pub(super) direction: Option<Direction>,
    /// Layout of the file.
    #[arg(long, help_heading = FOREIGN, value_parser = one_of(Format::ALL), default_value = "auto")]
    format: Option<Format>,
    /// Columns by name, - for one to skip, as in time_s,-,x_mm,y_mm.
    #[arg(long, help_heading = FOREIGN, value_name = "NAMES", allow_hyphen_values = true)]
    columns: Option<String>,
    /// Lengths without angles: evenly spaced readings over one turn.
    #[arg(long, help_heading = FOREIGN, value_parser = ["even"], value_name = "even")]
    angles: Option<String>,
    /// Plane of the circle, for files that do not tell it.
    #[arg(long, help_heading = FOREIGN, value_parser = plane, value_name = "xy|yz|zx")]
    plane: Option<Plane>,
    /// Polar angle of the first sample, for deviations over time.
    #[arg(long, help_heading = FOREIGN, value_name = "DEG", allow_negative_numbers = true)]
    start_angle: Option<f64>,
}

/// A campaign argument: its directory, or a foreign file with the rest given.
#[derive(clap::Args, Clone, Debug)]
pub struct Source {
    /// Directory of the campaign, or a file of measurements with --radius, --feed and --direction.
    campaign: PathBuf,
    #[command(flatten)]
    foreign: Foreign,
}

pub(super) fn length(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if v > 0.0 && v <= 1e5 => Ok(v),
        _ => Err("expected a number above 0, up to 100000".to_owned()),
    }
}

pub(super) fn direction(text: &str) -> Result<Direction, String> {
    match text {
        "ccw" => Ok(Direction::Ccw),
        "cw" => Ok(Direction::Cw),
        _ => Err("expected ccw or cw".to_owned()),
    }
}

pub(super) fn plane(text: &str) -> Result<Plane, String> {
    let lower = text.to_lowercase();
    let letters = |p: &Plane| lower == p.name() || lower.chars().rev().eq(p.name().chars());
    let found = Plane::ALL.into_iter().find(letters);
    found.ok_or_else(|| "expected xy, yz or zx".to_owned())
}

impl Foreign {
    /// The options of an import, if radius and feed were given.
    pub(super) fn options(&self) -> Option<Options> {
        Some(self.with(self.radius?, self.feed?, self.direction))
    }

    /// The options of an import with radius (mm), feed (mm/s) and direction.
    pub(super) fn with(&self, radius: f64, feed: f64, direction: Option<Direction>) -> Options {
        Options {
            radius_m: radius * 1e-3,
            feed_m_s: feed * 1e-3,
            direction,
            format: self.format.unwrap_or(Format::Auto),
            columns: self.columns.clone(),
            start_angle_rad: self.start_angle.map(f64::to_radians),
            started_s: None,
            temperature_c: None,
            centre_m: None,
            even_angles: self.angles.is_some(),
            plane: self.plane,
            setup: None,
            machine: None,
            laps: Laps::First,
        }
    }
}

impl Source {
    /// Every file that must not be written over: the campaign or file given, and `more`.
    pub(super) fn inputs<'a>(&'a self, more: Option<&'a Path>) -> Vec<&'a Path> {
        std::iter::once(self.campaign.as_path())
            .chain(more)
            .collect()
    }

    /// The same as it is typed: for the commands that are proposed next.
    pub(super) fn argument(&self) -> String {
        let mut text = quoted(&self.campaign);
        let given = &self.foreign;
        let mut add = |option: &str, value: Option<String>| {
            if let Some(value) = value {
                text += &format!(" --{option} {value}");
            }
        };
        add("radius", given.radius.map(|mm| mm.to_string()));
        add("feed", given.feed.map(|mm_s| mm_s.to_string()));
        let way = given.direction.map(|way| match way {
            Direction::Ccw => "ccw",
            Direction::Cw => "cw",
        });
        add("direction", way.map(str::to_owned));
        let format = given.format.filter(|format| *format != Format::Auto);
        let named = format.and_then(|f| Format::ALL.into_iter().find(|(of, ..)| *of == f));
        add("format", named.map(|(_, name, _)| name.to_owned()));
        add("columns", given.columns.as_ref().map(quoted));
        add("angles", given.angles.clone());
        add("plane", given.plane.map(|plane| plane.name().to_owned()));
        add("start-angle", given.start_angle.map(|deg| deg.to_string()));
        text
    }

    /// Opens the campaign, or the foreign file as a campaign of one run.
    pub fn open(&self, out: Output) -> Result<Manifest, Failure> {
        let path = &self.campaign;
        let own = path.is_dir() || !path.exists() || path.extension().is_some_and(|e| e == "toml");
        if own {
            return Ok(Manifest::open(path)?);
        }
        let Some(options) = self.foreign.options() else {
            // What is no measurement at all is bad input, whatever is missing beside it.
            let format = self.foreign.format.unwrap_or(Format::Auto);
            import::recognise(path, format, self.foreign.columns.as_deref())?;
            let text = format!(
                "{} is no campaign; a file of measurements needs --radius and --feed",
                path.display()
            );
            return Err(Failure::usage(text).help("add --radius MM --feed MM_S --direction ccw|cw"));
        };
        let bar = Progress::new(out, std::slice::from_ref(path));
        let (manifest, added) = import::open(path, &options, &|p, b| bar.tell(p, b))?;
        bar.done();
        added.iter().for_each(|a| tell(a, &options, out));
        Ok(manifest)
    }

    /// The campaign was read, but what was asked cannot be answered from it.
    pub(super) fn refused(&self, reason: &dyn std::fmt::Display) -> Failure {
        Failure::input(format_args!("{}: {reason}", self.campaign.display())).help(format_args!(
            "see what the runs hold: giotto analyze {}",
            self.argument()
        ))
    }

    /// As [`Source::read`], but leaves out the odd run whose file contradicts its label.
    pub fn read_labelled(&self, out: Output) -> Result<(Campaign, Vec<LeftOut>), Failure> {
        let (campaign, notes, left_out) = self.open(out)?.read_labelled()?;
        notes.iter().for_each(|note| out.note(note));
        let reason = |run: giotto::campaign::Mislabelled| LeftOut {
            reason: run.error.problem.to_string(),
            file: run.file,
        };
        Ok((campaign, left_out.into_iter().map(reason).collect()))
    }

    /// Reads the whole campaign into memory and prints its notes.
    pub fn read(&self, out: Output) -> Result<Campaign, Failure> {
        let (campaign, notes) = self.open(out)?.read()?;
        notes.iter().for_each(|note| out.note(note));
        Ok(campaign)
    }
}

/// A bar over the bytes of large files; nothing where nothing is drawn.
pub(super) struct Progress(indicatif::ProgressBar);

impl Progress {
    pub(super) fn new(out: Output, files: &[PathBuf]) -> Self {
        let bytes: u64 = files
            .iter()
            .filter_map(|f| std::fs::metadata(f).ok())
            .map(|m| m.len())
            .sum();
        if out.draws() && bytes > 1 << 24 {
            let style = indicatif::ProgressStyle::with_template(
                "{msg} {bar:40} {bytes}/{total_bytes} {eta}",
            );
            let bar = indicatif::ProgressBar::new(bytes);
            return Self(style.map_or_else(|_| bar.clone(), |s| bar.clone().with_style(s)));
        }
        Self(indicatif::ProgressBar::hidden())
    }

    pub(super) fn tell(&self, file: &Path, bytes: u64) {
        if self.0.message().is_empty() {
            self.0.set_message(
                file.file_name()
                    .map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
            );
        }
        self.0.set_position(bytes);
    }

    pub(super) fn done(self) {
        self.0.finish_and_clear();
    }
}

/// Says what was recognised and what was left out.
pub(super) fn tell(added: &Added, options: &Options, out: Output) {
    let mut text = format!(
        "{}: {}, {} rows",
        added.source.display(),
        added.format,
        added.rows
    );
    if added.lap.1 > 1 {
        text += &format!(", lap {} of {}", added.lap.0, added.lap.1);
    }
    if added.pass.1 > 1 {
        text += &format!(", direction {} of {}", added.pass.0, added.pass.1);
    }
    match added.left_out {
        (0, 0) => {}
        (before, after) => {
            text += &format!(", {before} rows before the circle and {after} after it left out")
        }
    }
    if !added.reasons.is_empty() {
        text += &format!(" ({})", reasons(&added.reasons));
    }
    if options.direction != Some(added.direction) {
        text += if added.direction == Direction::Ccw {
            ", counter-clockwise"
        } else {
            ", clockwise"
        };
    }
    if let Some(arc) = added.arc_rad {
        text += &format!(", an arc of {:.1}°", arc.to_degrees());
    }
    if let Some(plane) = added.location.and_then(|f| f.plane) {
        let (tilt, flat) = (plane.tilt_rad.to_degrees(), plane.flatness_m * 1e6);
        text += &format!(", plane tilted by {tilt:.3}° and flat within {flat:.1} µm");
    }
    if let Some(target) = added.target_radius_m {
        text += &format!(", the controller's own radius {:.4} mm", target * 1e3);
    }
    out.note(text);
    added.notes.iter().for_each(|note| out.note(note));
}

/// `12 rows off the circle, 30 rows: the machine stood still (lines 5 to 34)`.
fn reasons(reasons: &[Reason]) -> String {
    let one = |r: &Reason| {
        let lines = r
            .lines
            .map_or_else(String::new, |(from, to)| match to - from {
                0 => format!(", line {from}"),
                _ => format!(", lines {from} to {to}"),
            });
        format!("{}: {}{lines}", r.rows, r.why)
    };
    reasons.iter().map(one).collect::<Vec<_>>().join("; ")
}
