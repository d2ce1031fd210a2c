//! Recordings as runs of a campaign: every file is read and checked before anything of the campaign changes.
use super::detect::Format;
use super::recording::Recording;
use super::trim::{self, Turns};
use crate::campaign::manifest::{Entry, Manifest};
use crate::campaign::{CampaignError, Direction, Frame, Note, Place, Problem, check, samples, write};
use std::io::{BufWriter, Write};
use std::ops::Range;
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
    /// Machine, for a campaign that is new.
    pub machine: Option<String>,
    /// Which laps become runs.
    pub laps: Laps,
}

/// Which laps of a recording become runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Laps {
    /// The first whole one: laps of one recording share its set-up and are no repetitions of it.
    First,
    /// Each one, as a run of its own.
    Each,
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
    /// Rows before and after the circle.
    pub left_out: (usize, usize),
    /// Direction of travel.
    pub direction: Direction,
    /// Angle covered, rad, where it is no whole turn.
    pub arc_rad: Option<f64>,
    /// Where the circle lies, for positions.
    pub frame: Option<Frame>,
    /// Measured duration of the turn, s.
    pub turn_s: Option<f64>,
    /// Radius of the circle that the controller wanted, m, where the file has it.
    pub target_radius_m: Option<f64>,
    /// What the reader should know.
    pub notes: Vec<Note>,
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
    let manifest_path = dir.join("campaign.toml");
    let old = if manifest_path.exists() { Some(Manifest::open(dir)?) } else { None };
    let io = |e: std::io::Error| CampaignError::io(dir, "made", "a place for a directory", &e);
    let fresh = !dir.exists();
    std::fs::create_dir_all(dir).map_err(io)?;
    let staged =
        stage(files, dir, options, progress).and_then(|staged| commit(dir, old.as_ref(), options, staged));
    if staged.is_err() && fresh {
        let _ = std::fs::remove_dir(dir); // only if still empty
    }
    staged
}

/// A run on disk under a temporary name.
struct Staged {
    file: NamedTempFile,
    added: Added,
}

fn stage(
    files: &[PathBuf],
    dir: &Path,
    options: &Options,
    progress: &dyn Fn(&Path, u64),
) -> Result<Vec<Staged>, CampaignError> {
    let mut staged = Vec::new();
    for path in files {
        let tell = |bytes| progress(path, bytes);
        let recording = Recording::read(path, options.format, options.columns.as_deref(), &tell)?;
        let refuse = |problem| CampaignError::new(Place::at(path, recording.first_line, 1), problem);
        if recording.rows < samples::FEWEST {
            return Err(refuse(Problem::TooFew { found: recording.rows, expected: samples::FEWEST }));
        }
        let turns = turns(&recording, path, options).map_err(refuse)?;
        let direction = match (options.direction, turns.sign) {
            (Some(direction), _) => direction,
            (None, sign) if sign > 0.0 => Direction::Ccw,
            (None, sign) if sign < 0.0 => Direction::Cw,
            _ => return Err(refuse(Problem::DirectionUnknown)),
        };
        let laps = if options.laps == Laps::First { 1 } else { turns.laps.len() };
        for (index, rows) in turns.laps.iter().take(laps).enumerate() {
            let file = write_rows(&recording, rows.clone(), dir)?;
            let entry = Entry {
                file: file.path().display().to_string(),
                path: file.path().to_path_buf(),
                line: 0,
                radius_m: options.radius_m,
                feed_m_s: options.feed_m_s,
                direction,
                start_angle_rad: options.start_angle_rad,
                started_s: options.started_s,
                temperature_c: options.temperature_c,
                centre_m: options.centre_m,
                arc_rad: turns.arc_rad,
            };
            let first = recording.first_line + rows.start;
            let loaded = samples::load(&entry, false).map_err(|e| at_source(e, path, first))?;
            staged.push(Staged {
                file,
                added: Added {
                    file: String::new(),
                    source: path.clone(),
                    format: recording.format,
                    rows: recording.rows,
                    lines: (first, recording.first_line + rows.end - 1),
                    lap: (index + 1, turns.laps.len()),
                    left_out: (turns.feed_in, turns.feed_out),
                    direction,
                    arc_rad: turns.arc_rad,
                    frame: loaded.frame,
                    turn_s: loaded.turn_s,
                    target_radius_m: target_radius(&recording, rows),
                    notes: loaded
                        .notes
                        .into_iter()
                        .map(|n| Note { at: moved(&n.at, path, first), ..n })
                        .collect(),
                },
            });
        }
    }
    Ok(staged)
}

/// A place in a staged file, said of the line that it came from.
fn moved(at: &Place, source: &Path, first: usize) -> Place {
    let line = at.line.map(|l| l.saturating_sub(2) + first);
    Place { file: source.to_path_buf(), line, column: line.map(|_| 1) }
}

fn at_source(error: CampaignError, source: &Path, first: usize) -> CampaignError {
    CampaignError::new(moved(&error.at, source, first), *error.problem)
}

fn turns(recording: &Recording, path: &Path, options: &Options) -> Result<Turns, Problem> {
    if !recording.position_m[0].is_empty() {
        return trim::of_points(&recording.position_m, &recording.time_s, options.radius_m);
    }
    if !recording.angle_rad.is_empty() {
        let mut angle = recording.angle_rad.clone();
        trim::unwrap(&mut angle);
        return trim::of_angles(&angle, &recording.time_s);
    }
    // Deviations over time: readings beyond the range at either end are feed-in and feed-out.
    let deviation = |k: usize| match recording.deviation_m.get(k) {
        Some(v) => *v,
        None => recording.radius_m[k] - options.radius_m,
    };
    let inside = |k: usize| deviation(k).abs() < check::INSTRUMENT_LIMIT_M;
    let rows = recording.rows;
    let (mut from, mut to) = (0, rows);
    if (0..rows).filter(|&k| inside(k)).count() * 2 > rows {
        from = (0..rows).find(|&k| inside(k)).unwrap_or(0);
        to = (0..rows).rfind(|&k| inside(k)).map_or(rows, |k| k + 1);
    }
    let time = &recording.time_s[from..to];
    let n = time.len();
    let last = time[n - 1] - time[0];
    let turn_s = last * n as f64 / (n as f64 - 1.0);
    let values: Vec<f64> = (from..to).map(deviation).collect();
    let entry = Entry {
        file: String::new(),
        path: path.to_path_buf(),
        line: 0,
        radius_m: options.radius_m,
        feed_m_s: options.feed_m_s,
        direction: Direction::Ccw,
        start_angle_rad: None,
        started_s: None,
        temperature_c: None,
        centre_m: None,
        arc_rad: None,
    };
    let found = check::duration(&entry, turn_s, &values, &mut Vec::new()).map_err(|e| *e.problem)?;
    let count = found.unwrap_or(1) as usize;
    let edge = |k: usize| from + n * k / count;
    let laps: Vec<Range<usize>> = (0..count).map(|k| edge(k)..edge(k + 1)).collect();
    Ok(Turns { laps, arc_rad: None, feed_in: from, feed_out: rows - to, sign: 0.0 })
}

/// Radius of the circle through the controller's own positions.
fn target_radius(recording: &Recording, rows: &Range<usize>) -> Option<f64> {
    if recording.target_m[0].is_empty() || recording.target_m[1].is_empty() {
        return None;
    }
    let all: Vec<usize> = rows.clone().collect();
    let (x, y) = trim::flatten(&recording.target_m, &all)?;
    let points = giotto_shared::circle::Xy::new(&x[rows.clone()], &y[rows.clone()]).ok()?;
    giotto_shared::circle::fit(&points).ok().map(|fit| fit.circle.radius)
}

/// Rows as a CSV of the contract under a temporary name in the campaign.
fn write_rows(recording: &Recording, rows: Range<usize>, dir: &Path) -> Result<NamedTempFile, CampaignError> {
    let io = |e: std::io::Error| CampaignError::io(dir, "written", "a place for a file", &e);
    let mut columns: Vec<(&str, &[f64], f64, usize)> = Vec::new();
    let degrees = 180.0 / std::f64::consts::PI;
    let positions = ["x_mm", "y_mm", "z_mm"].into_iter().zip(&recording.position_m);
    let time = &recording.time_s;
    let distinct = 1 + rows.clone().skip(1).filter(|&k| !time.is_empty() && time[k] != time[k - 1]).count();
    // Stamps in whole seconds under many samples tell neither order nor feed.
    if !time.is_empty() && distinct * 4 >= rows.len() {
        columns.push(("time_s", time, 1.0, 9));
    }
    columns.extend(positions.filter(|(_, v)| !v.is_empty()).map(|(name, v)| (name, v.as_slice(), 1e3, 9)));
    if !recording.angle_rad.is_empty() {
        columns.push(("angle_deg", &recording.angle_rad, degrees, 9));
    }
    if recording.position_m[0].is_empty() {
        if recording.deviation_m.is_empty() {
            columns.push(("radius_mm", &recording.radius_m, 1e3, 9));
        } else {
            columns.push(("deviation_um", &recording.deviation_m, 1e6, 6));
        }
    }
    let origin = if time.is_empty() { 0.0 } else { time[rows.start] };
    let mut file = tempfile::Builder::new().prefix(".import-").suffix(".csv").tempfile_in(dir).map_err(io)?;
    let mut out = BufWriter::with_capacity(1 << 18, file.as_file_mut());
    let names: Vec<&str> = columns.iter().map(|c| c.0).collect();
    writeln!(out, "{}", names.join(",")).map_err(io)?;
    let mut line = String::new();
    for k in rows {
        line.clear();
        for (index, (name, values, factor, places)) in columns.iter().enumerate() {
            let shift = if *name == "time_s" { origin } else { 0.0 };
            let end = if index + 1 == columns.len() { b'\n' } else { b',' };
            write::number(&mut line, (values[k] - shift) * factor, *places, end);
        }
        out.write_all(line.as_bytes()).map_err(io)?;
    }
    out.flush().map_err(io)?;
    drop(out);
    Ok(file)
}

/// Gives the staged files their names and writes `campaign.toml`, its old text kept to the letter.
fn commit(
    dir: &Path,
    old: Option<&Manifest>,
    options: &Options,
    staged: Vec<Staged>,
) -> Result<Vec<Added>, CampaignError> {
    let path = dir.join("campaign.toml");
    let io = |e: std::io::Error| CampaignError::io(&path, "written", "a place for a file", &e);
    let mut document = match old {
        None => {
            let mut document = DocumentMut::new();
            let name =
                dir.canonicalize().ok().and_then(|d| Some(d.file_name()?.to_string_lossy().into_owned()));
            let mut head = Table::new();
            head["name"] = value(name.unwrap_or_else(|| "campaign".to_owned()));
            head["machine"] = value(options.machine.as_deref().unwrap_or("unknown"));
            document["campaign"] = Item::Table(head);
            document
        }
        Some(_) => {
            let text = std::fs::read_to_string(&path).map_err(io)?;
            let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
            text.parse().map_err(|e: toml_edit::TomlError| {
                CampaignError::new(Place::file(&path), Problem::Toml { reason: e.message().to_owned() })
            })?
        }
    };
    let list = document.entry("run").or_insert(Item::ArrayOfTables(ArrayOfTables::new()));
    let Some(list) = list.as_array_of_tables_mut() else {
        let reason =
            "`run` is an inline list, to which no table can be added; write [[run]] tables".to_owned();
        return Err(CampaignError::new(Place::file(&path), Problem::Toml { reason }));
    };
    let mut number = old.map_or(0, |m| m.runs.len());
    let mut done: Vec<Added> = Vec::new();
    let undo = |done: &[Added]| done.iter().for_each(|a| drop(std::fs::remove_file(dir.join(&a.file))));
    for Staged { file, mut added } in staged {
        let name = loop {
            let name = format!("run{number:03}.csv");
            number += 1;
            if !dir.join(&name).exists() {
                break name;
            }
        };
        let kept = file.persist(dir.join(&name)).map_err(|e| e.error).and_then(|f| write::make_public(&f));
        if let Err(error) = kept {
            undo(&done);
            return Err(io(error));
        }
        added.file = name;
        let mut table = Table::new();
        let si = |v: f64| value((v * 1e12).round() / 1e9);
        table["file"] = value(&added.file);
        table["radius_mm"] = si(options.radius_m);
        table["feed_mm_s"] = si(options.feed_m_s);
        table["direction"] = value(if added.direction == Direction::Ccw { "ccw" } else { "cw" });
        if let Some(start) = options.start_angle_rad {
            table["start_angle_deg"] = value((start.to_degrees() * 1e9).round() / 1e9);
        }
        if let Some(started) = options.started_s {
            table["started_s"] = value(started);
        }
        if let Some(temperature) = options.temperature_c {
            table["temperature_c"] = value(temperature);
        }
        if let Some(centre) = options.centre_m {
            table["centre_mm"] =
                value(centre.map(|c| (c * 1e12).round() / 1e9).into_iter().collect::<toml_edit::Array>());
        }
        if let Some(arc) = added.arc_rad {
            table["arc_deg"] = value((arc.to_degrees() * 1e3).round() / 1e3);
        }
        list.push(table);
        done.push(added);
    }
    if let Err(error) = write::replace(&path, &document.to_string()) {
        undo(&done);
        return Err(error);
    }
    Ok(done)
}
