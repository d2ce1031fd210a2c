//! Recordings as runs of a campaign: every file is read and checked before anything of the campaign changes.
use super::Quantity;
use super::detect::Format;
use super::rows::Slice;
use super::scan::{FoundTurn, Scan, scan};
use crate::campaign::manifest::{Entry, Manifest};
use crate::campaign::run_file::RunFile;
use crate::campaign::table::Batch;
use crate::campaign::{
    CampaignError, Direction, Location, Note, Place, Plane, Problem, samples, write,
};
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;
use toml_edit::{ArrayOfTables, DocumentMut, Item, Table, value};

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

/// A run on disk under a temporary name.
struct Staged {
    file: NamedTempFile,
    added: Added,
    options: Options,
    /// Two measurements of it would differ.
    noisy: bool,
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
    let start_angle_rad = options
        .start_angle_rad
        .or(shifted.then_some(0.0))
        .map(|_| start.rem_euclid(std::f64::consts::TAU));
    Ok(Lap {
        added: Added {
            start_angle_rad: if shifted {
                start_angle_rad
            } else {
                options.start_angle_rad
            },
            ..added
        },
        entry: Entry {
            direction,
            arc_rad: turn.arc_rad,
            start_angle_rad: if shifted {
                start_angle_rad
            } else {
                options.start_angle_rad
            },
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

fn stage(
    jobs: &[(PathBuf, Options)],
    dir: &Path,
    progress: &dyn Fn(&Path, u64),
) -> Result<Vec<Staged>, CampaignError> {
    let mut staged = Vec::new();
    for (path, options) in jobs {
        for Lap { entry, mut added } in laps(path, options, &|bytes| progress(path, bytes))? {
            // Read as any command would read it; what it is refused for it is refused for here.
            let loaded = samples::load(&entry, false)?;
            (added.location, added.turn_s) = (loaded.location, loaded.turn_s);
            (added.direction, added.plane) = (loaded.run.direction, loaded.run.frame.plane());
            added.notes.extend(loaded.notes);
            drop(loaded.run);
            let file = write_rows(&entry, loaded.clocked, dir)?;
            staged.push(Staged {
                file,
                added,
                options: options.clone(),
                noisy: loaded.fingerprint.is_some(),
            });
        }
    }
    Ok(staged)
}

/// No field: the column is zero.
const ZERO: usize = usize::MAX;

/// A run as a CSV of the contract under a temporary name in the campaign; `clocked` with its time stamps.
fn write_rows(entry: &Entry, clocked: bool, dir: &Path) -> Result<NamedTempFile, CampaignError> {
    let io = |e: std::io::Error| CampaignError::io(dir, "written", "a place for a file", &e);
    let fields = RunFile::open(entry)?.fields();
    let degrees = 180.0 / std::f64::consts::PI;
    let mut columns: Vec<(usize, &str, f64, usize)> = Vec::new();
    for (field, quantity) in fields.iter().map(|f| f.quantity).enumerate() {
        let (name, factor, places) = match quantity {
            Quantity::Time | Quantity::Stamp(_) if clocked => ("time_s", 1.0, 9),
            Quantity::Position(axis) => (["x_mm", "y_mm", "z_mm"][axis], 1e3, 9),
            Quantity::Angle => ("angle_deg", degrees, 9),
            Quantity::Deviation => ("deviation_um", 1e6, 6),
            Quantity::Radius => ("radius_mm", 1e3, 9),
            _ => continue,
        };
        if !columns.iter().any(|c| c.1 == name) {
            columns.push((field, name, factor, places));
        }
    }
    // The contract takes one shape: positions before angles before deviations over time.
    let has = |name: &str| columns.iter().any(|c| c.1 == name);
    let axes = ["x_mm", "y_mm", "z_mm"].map(has);
    let (planar, deviation) = (
        axes.iter().filter(|has| **has).count() >= 2,
        has("deviation_um"),
    );
    // A circle in another plane is one in space, the third coordinate of which stays at zero.
    if planar && !(axes[0] && axes[1]) {
        let missing = usize::from(axes[0]);
        columns.push((ZERO, ["x_mm", "y_mm"][missing], 0.0, 9));
    }
    columns.retain(|c| match c.1 {
        "x_mm" | "y_mm" | "z_mm" => planar,
        "angle_deg" => !planar,
        "deviation_um" => !planar,
        "radius_mm" => !planar && !deviation,
        _ => true,
    });
    columns.sort_by_key(|c| {
        ["time_s", "x_mm", "y_mm", "z_mm", "angle_deg"]
            .iter()
            .position(|n| *n == c.1)
            .unwrap_or(9)
    });
    let mut origin = 0.0;
    if let Some(&(field, ..)) = columns.iter().find(|c| c.1 == "time_s") {
        origin = first_of(entry, field)?;
    }
    let mut file = tempfile::Builder::new()
        .prefix(".import-")
        .suffix(".csv")
        .tempfile_in(dir)
        .map_err(io)?;
    let names: Vec<&str> = columns.iter().map(|c| c.1).collect();
    writeln!(file, "{}", names.join(",")).map_err(io)?;
    let text = |batch: Batch| {
        let mut text = String::with_capacity(batch.rows * 16 * columns.len());
        for k in 0..batch.rows {
            for (index, (field, name, factor, places)) in columns.iter().enumerate() {
                let shift = if *name == "time_s" { origin } else { 0.0 };
                let end = if index + 1 == columns.len() {
                    b'\n'
                } else {
                    b','
                };
                let si = batch.columns.get(*field).map_or(0.0, |column| column[k]);
                write::number(&mut text, (si - shift) * factor, *places, end);
            }
        }
        text
    };
    RunFile::open(entry)?.walk(text, |text| file.write_all(text.as_bytes()).map_err(io))?;
    Ok(file)
}

/// The first value of a column.
fn first_of(entry: &Entry, field: usize) -> Result<f64, CampaignError> {
    let mut first = 0.0;
    let Some(slice) = &entry.slice else {
        return Ok(first);
    };
    slice.walk(
        &entry.path,
        |batch| batch.columns[field].first().copied(),
        |_, value| {
            first = value.unwrap_or(0.0);
            Ok(ControlFlow::Break(()))
        },
    )?;
    Ok(first)
}

/// Gives the staged files their names and writes `campaign.toml`, its old text kept to the letter.
fn commit(
    dir: &Path,
    old: Option<&Manifest>,
    machine: Option<&str>,
    staged: Vec<Staged>,
) -> Result<Vec<Added>, CampaignError> {
    let path = dir.join("campaign.toml");
    let io = |e: std::io::Error| CampaignError::io(&path, "written", "a place for a file", &e);
    let mut document = match old {
        None => {
            let mut document = DocumentMut::new();
            let name = dir
                .canonicalize()
                .ok()
                .and_then(|d| Some(d.file_name()?.to_string_lossy().into_owned()));
            let mut head = Table::new();
            head["name"] = value(name.unwrap_or_else(|| "campaign".to_owned()));
            head["machine"] = value(machine.unwrap_or("unknown"));
            document["campaign"] = Item::Table(head);
            document
        }
        Some(_) => {
            let text = std::fs::read_to_string(&path).map_err(io)?;
            let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
            text.parse().map_err(|e: toml_edit::TomlError| {
                CampaignError::new(
                    Place::file(&path),
                    Problem::Toml {
                        reason: e.message().to_owned(),
                    },
                )
            })?
        }
    };
    let list = document
        .entry("run")
        .or_insert(Item::ArrayOfTables(ArrayOfTables::new()));
    let Some(list) = list.as_array_of_tables_mut() else {
        let reason =
            "`run` is an inline list, to which no table can be added; write [[run]] tables"
                .to_owned();
        return Err(CampaignError::new(
            Place::file(&path),
            Problem::Toml { reason },
        ));
    };
    let mut number = old.map_or(0, |m| m.runs.len());
    let mut done: Vec<Added> = Vec::new();
    let undo = |done: &[Added]| {
        done.iter()
            .for_each(|a| drop(std::fs::remove_file(dir.join(&a.file))))
    };
    for Staged {
        file,
        mut added,
        options,
        ..
    } in staged
    {
        let name = loop {
            let name = format!("run{number:03}.csv");
            number += 1;
            if !dir.join(&name).exists() {
                break name;
            }
        };
        let kept = file
            .persist(dir.join(&name))
            .map_err(|e| e.error)
            .and_then(|f| write::make_public(&f));
        if let Err(error) = kept {
            undo(&done);
            return Err(io(error));
        }
        added.file = name;
        list.push(entry_of(&added, &options));
        done.push(added);
    }
    if let Err(error) = write::replace(&path, &document.to_string()) {
        undo(&done);
        return Err(error);
    }
    Ok(done)
}

/// The `[[run]]` table of a run.
fn entry_of(added: &Added, options: &Options) -> Table {
    let mut table = Table::new();
    let si = |v: f64| value((v * 1e12).round() / 1e9);
    table["file"] = value(&added.file);
    table["radius_mm"] = si(options.radius_m);
    table["feed_mm_s"] = si(options.feed_m_s);
    table["direction"] = value(if added.direction == Direction::Ccw {
        "ccw"
    } else {
        "cw"
    });
    if let Some(start) = added.start_angle_rad {
        table["start_angle_deg"] = value((start.to_degrees() * 1e9).round() / 1e9);
    }
    if let Some(started) = options.started_s {
        table["started_s"] = value(started);
    }
    if let Some(temperature) = options.temperature_c {
        table["temperature_c"] = value(temperature);
    }
    if let Some(centre) = options.centre_m {
        table["centre_mm"] = value(
            centre
                .map(|c| (c * 1e12).round() / 1e9)
                .into_iter()
                .collect::<toml_edit::Array>(),
        );
    }
    if let Some(plane) = options.plane {
        table["plane"] = value(plane.name());
    }
    if let Some(setup) = &options.setup {
        table["setup"] = value(setup);
    }
    if let Some(arc) = added.arc_rad {
        table["arc_deg"] = value((arc.to_degrees() * 1e3).round() / 1e3);
    }
    table
}
