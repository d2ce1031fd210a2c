//! Recordings as runs of a campaign: every file is read and checked before anything of the campaign changes.
mod staged;

use staged::{Staged, commit, stage};

use super::detect::Format;
use super::rows::Slice;
use super::scan::{FoundTurn, Scan, scan};
use crate::campaign::manifest::{Entry, Manifest};
use crate::campaign::{CampaignError, Direction, Location, Note, Place, Plane, Problem};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// What the files themselves do not say.
#[derive(Clone, Debug)]
pub struct Options {
    /// Programmed radius, m.
    pub radius_m: f64,
    /// Programmed feed, m/s.
    pub feed_m_s: f64,
    /// Direction of travel; positions tell it themselves.
    pub direction: Option<Direction>,
    /// Layout, or [`Format::Auto`].
    pub format: Format,
    /// Columns by name.
    pub columns: Option<String>,
    /// Angle of the first sample, rad, for deviations over time.
    pub start_angle_rad: Option<f64>,
    /// Start since the campaign began, s.
    pub started_s: Option<f64>,
    /// Temperature, °C.
    pub temperature_c: Option<f64>,
    /// Centre in the machine, m.
    pub centre_m: Option<[f64; 3]>,
    /// Lengths without angle or time are evenly spaced over one turn.
    pub even_angles: bool,
    /// Plane of the circle; points in space tell it themselves.
    pub plane: Option<Plane>,
    /// Set-up that the run belongs to.
    pub setup: Option<String>,
    /// Machine, for a campaign that is new.
    pub machine: Option<String>,
    /// Which laps become runs.
    pub laps: Laps,
}

impl Options {
    /// A run of which the file is `path` and the rows are those of `slice`.
    pub(super) fn entry(&self, path: &Path, slice: Slice) -> Entry {
        Entry {
            file: path
                .file_name()
                .map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
            path: path.to_path_buf(),
            line: 0,
            radius_m: self.radius_m,
            feed_m_s: self.feed_m_s,
            direction: self.direction.unwrap_or(Direction::Ccw),
            start_angle_rad: self.start_angle_rad,
            started_s: self.started_s,
            temperature_c: self.temperature_c,
            centre_m: self.centre_m,
            plane: self.plane,
            setup: self.setup.clone(),
            arc_rad: None,
            slice: Some(slice),
        }
    }
}

impl Options {
    /// A circle of this radius and feed in an XY plane, all else as the file says it.
    pub const fn of_circle(radius_m: f64, feed_m_s: f64, direction: Direction) -> Self {
        Self {
            radius_m,
            feed_m_s,
            direction: Some(direction),
            format: Format::Auto,
            columns: None,
            start_angle_rad: None,
            started_s: None,
            temperature_c: None,
            centre_m: None,
            even_angles: false,
            plane: None,
            setup: None,
            machine: None,
            laps: Laps::First,
        }
    }
}

/// Which laps of a recording become runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Laps {
    /// The first whole one: laps of one recording share its set-up and are no repetitions of it.
    First,
    /// Each one, as a run of its own.
    Each,
}

impl Laps {
    /// Every choice with its name on a command line and what it is.
    pub const ALL: [(Self, &str, &str); 2] = [
        (
            Self::First,
            "first",
            "The first whole one: laps of one recording share its set-up and are no repetitions of it",
        ),
        (Self::Each, "each", "Each one, as a run of its own"),
    ];
}

/// A run that was added.
#[derive(Clone, Debug)]
pub struct Added {
    /// File in the campaign.
    pub file: String,
    /// Where it came from.
    pub source: PathBuf,
    /// Layout that was recognised.
    pub format: Format,
    /// Rows of the source.
    pub rows: usize,
    /// Lines of the source that became the run, first and last.
    pub lines: (usize, usize),
    /// Lap, and how many there are.
    pub lap: (usize, usize),
    /// Number of the passage in one direction, and how many there are.
    pub pass: (usize, usize),
    /// Rows before and after the circle.
    pub left_out: (usize, usize),
    /// All rows that are left out, with the reason.
    pub reasons: Vec<Reason>,
    /// Direction of travel.
    pub direction: Direction,
    /// Angle covered, rad, where it is no whole turn.
    pub arc_rad: Option<f64>,
    /// Angle of the first sample, rad, where it was given or follows from a run-in.
    pub start_angle_rad: Option<f64>,
    /// Coordinate plane of the circle; `None` for one between them.
    pub plane: Option<Plane>,
    /// Where the circle lies, for positions.
    pub location: Option<Location>,
    /// Measured duration of the turn, s.
    pub turn_s: Option<f64>,
    /// Radius of the circle that the controller wanted, m, where the file has it.
    pub target_radius_m: Option<f64>,
    /// What the reader should know.
    pub notes: Vec<Note>,
}

/// Why rows of a file are left out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reason {
    /// How many.
    pub rows: usize,
    /// Why, in words.
    pub why: String,
    /// First and last line, where they stand together within the turn.
    pub lines: Option<(usize, usize)>,
}

/// Adds files to the campaign in `dir`, made if missing.
///
/// # Errors
/// The first problem met, in the lines of the foreign file; the campaign is then as it was.
///
/// ```
/// use giotto::campaign::import::{Options, add};
/// use giotto::campaign;
///
/// let folder = tempfile::tempdir()?;
/// let file = folder.path().join("export.csv");
/// let mut rows = String::from("Angle (deg);Deviation (um)\n");
/// for degree in 0..360 {
///     rows += &format!("{degree},0;{}\n", -12 + degree % 2);
/// }
/// std::fs::write(&file, rows)?;
///
/// let options = Options {
///     machine: Some("mill".into()),
///     ..Options::of_circle(0.1, 0.05, campaign::Direction::Ccw)
/// };
/// let target = folder.path().join("campaign");
/// let added = add(&[file], &target, &options, &|_, _| {})?;
/// assert_eq!(added[0].rows, 360);
/// assert_eq!(campaign::read(&target)?.runs[0].samples.deviation_m.len(), 360);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn add(
    files: &[PathBuf],
    dir: &Path,
    options: &Options,
    progress: &dyn Fn(&Path, u64),
) -> Result<Vec<Added>, CampaignError> {
    let jobs: Vec<(PathBuf, Options)> =
        files.iter().map(|f| (f.clone(), options.clone())).collect();
    add_each(&jobs, dir, progress)
}

/// As [`add`], with options of its own for each file.
///
/// # Errors
/// As [`add`]; a file that the campaign holds already, or that is given twice.
pub fn add_each(
    jobs: &[(PathBuf, Options)],
    dir: &Path,
    progress: &dyn Fn(&Path, u64),
) -> Result<Vec<Added>, CampaignError> {
    let manifest_path = dir.join("campaign.toml");
    let old = if manifest_path.exists() {
        Some(Manifest::open(dir)?)
    } else {
        None
    };
    let io = |e: std::io::Error| CampaignError::io(dir, "made", "a place for a directory", &e);
    let fresh = !dir.exists();
    std::fs::create_dir_all(dir).map_err(io)?;
    let machine = jobs
        .iter()
        .find_map(|(_, options)| options.machine.as_deref());
    let staged = stage(jobs, dir, progress)
        .and_then(|staged| once(&staged, old.as_ref()).map(|()| staged))
        .and_then(|staged| commit(dir, old.as_ref(), machine, staged));
    if staged.is_err() && fresh {
        let _ = std::fs::remove_dir(dir); // only if still empty
    }
    staged
}

/// One measurement is one run: what is written for a file must not be there already.
fn once(staged: &[Staged], old: Option<&Manifest>) -> Result<(), CampaignError> {
    let io = |path: &Path, e: &std::io::Error| CampaignError::io(path, "read", "a run", e);
    let size = |path: &Path| std::fs::metadata(path).map_or(0, |m| m.len());
    let mut known: Vec<(PathBuf, String)> = Vec::new();
    known.extend(
        old.iter()
            .flat_map(|m| &m.runs)
            .map(|r| (r.path.clone(), r.file.clone())),
    );
    for Staged {
        file, added, noisy, ..
    } in staged
    {
        let path = file.path();
        let same = known.iter().find(|(other, _)| {
            *noisy && size(other) == size(path) && same_bytes(other, path).unwrap_or(false)
        });
        if let Some((_, other)) = same {
            let at = Place::at(&added.source, added.lines.0, 1);
            let problem = Problem::DuplicateData {
                other: other.clone(),
            };
            return Err(CampaignError::new(at, problem));
        }
        path.metadata().map_err(|e| io(path, &e))?;
        known.push((path.to_path_buf(), added.source.display().to_string()));
    }
    Ok(())
}

fn same_bytes(one: &Path, other: &Path) -> std::io::Result<bool> {
    let [mut one, mut other] =
        [File::open(one)?, File::open(other)?].map(|f| BufReader::with_capacity(1 << 16, f));
    loop {
        let (a, b) = (one.fill_buf()?, other.fill_buf()?);
        let n = a.len().min(b.len());
        if a[..n] != b[..n] || a.is_empty() != b.is_empty() {
            return Ok(false);
        }
        if n == 0 {
            return Ok(true);
        }
        one.consume(n);
        other.consume(n);
    }
}

/// A lap of a foreign file, found and not yet read.
struct Lap {
    entry: Entry,
    added: Added,
}

/// The turns of a file that become runs.
fn laps(path: &Path, options: &Options, progress: &dyn Fn(u64)) -> Result<Vec<Lap>, CampaignError> {
    let scan = scan(path, options, progress)?;
    let wanted = |turn: &&FoundTurn| options.laps == Laps::Each || first(turn, &scan);
    let laps: Result<Vec<Lap>, CampaignError> = scan
        .turns
        .iter()
        .filter(wanted)
        .map(|turn| lap(path, options, &scan, turn))
        .collect();
    laps
}

/// Whether a turn is the first in its direction.
fn first(turn: &FoundTurn, scan: &Scan) -> bool {
    let same = scan.turns.iter().find(|other| other.sign == turn.sign);
    same.is_some_and(|other| (other.pass, other.lap) == (turn.pass, turn.lap))
}

fn lap(
    path: &Path,
    options: &Options,
    scan: &Scan,
    turn: &FoundTurn,
) -> Result<Lap, CampaignError> {
    let both = scan.turns.iter().any(|other| other.sign != turn.sign);
    let seen = match turn.sign {
        sign if sign > 0.0 => Some(Direction::Ccw),
        sign if sign < 0.0 => Some(Direction::Cw),
        _ => None,
    };
    // What is said holds, unless the file goes both ways.
    let direction = options
        .direction
        .filter(|_| !both)
        .or(seen)
        .ok_or_else(|| {
            CampaignError::new(
                Place::at(path, scan.first_line, 1),
                Problem::DirectionUnknown,
            )
        })?;
    let slice = turn.slice.clone();
    let reason = |(why, rows, lines): &(super::turns::Why, usize, Option<[usize; 2]>)| Reason {
        rows: *rows,
        why: why.to_string(),
        lines: lines.map(|[from, to]| (from, to)),
    };
    let notes = scan.notes.iter().map(|text| Note {
        at: Place::at(path, scan.first_line, 1),
        text: text.clone(),
    });
    let same: Vec<&FoundTurn> = scan.turns.iter().filter(|t| t.sign == turn.sign).collect();
    let number = same
        .iter()
        .position(|t| (t.pass, t.lap) == (turn.pass, turn.lap));
    let added = Added {
        file: String::new(),
        source: path.to_path_buf(),
        format: scan.format,
        rows: scan.rows,
        lines: (slice.line(0), slice.line(slice.rows.saturating_sub(1))),
        lap: (number.unwrap_or(0) + 1, same.len()),
        pass: turn.pass,
        left_out: turn.outside,
        reasons: turn.left_out.iter().map(reason).collect(),
        direction,
        arc_rad: turn.arc_rad,
        start_angle_rad: None,
        plane: options.plane,
        location: None,
        turn_s: None,
        target_radius_m: turn.target_radius_m,
        notes: notes.collect(),
    };
    let start = options.start_angle_rad.unwrap_or(0.0) + turn.from_rad;
    let shifted = turn.from_rad != 0.0;
    let start_angle_rad = if shifted {
        Some(start.rem_euclid(std::f64::consts::TAU))
    } else {
        options.start_angle_rad
    };
    Ok(Lap {
        added: Added {
            start_angle_rad,
            ..added
        },
        entry: Entry {
            direction,
            arc_rad: turn.arc_rad,
            start_angle_rad,
            ..options.entry(path, slice)
        },
    })
}

/// A foreign file as a campaign of its first lap (or of each), which stays where it is: commands read it from there.
///
/// # Errors
/// As [`add`]; what only shows in the samples themselves shows when they are read.
pub fn open(
    path: &Path,
    options: &Options,
    progress: &dyn Fn(&Path, u64),
) -> Result<(Manifest, Vec<Added>), CampaignError> {
    let laps = laps(path, options, &|bytes| progress(path, bytes))?;
    let (runs, added) = laps.into_iter().map(|lap| (lap.entry, lap.added)).unzip();
    let name = path
        .file_name()
        .map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let machine = options
        .machine
        .clone()
        .unwrap_or_else(|| "unknown".to_owned());
    Ok((
        Manifest {
            path: path.to_path_buf(),
            name,
            machine,
            repeatability_m: None,
            table: None,
            kinematics: None,
            runs,
            notes: Vec::new(),
        },
        added,
    ))
}
