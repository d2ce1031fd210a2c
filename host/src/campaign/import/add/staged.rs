//! Runs on disk under temporary names, and the step in which all of them become runs of the campaign.
use super::{Added, Lap, Options, laps};
use crate::campaign::import::Quantity;
use crate::campaign::manifest::{Entry, Manifest};
use crate::campaign::run_file::RunFile;
use crate::campaign::table::Batch;
use crate::campaign::{CampaignError, Direction, Place, Problem, samples, write};
use std::io::Write;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;
use toml_edit::{ArrayOfTables, DocumentMut, Item, Table, value};

/// A run on disk under a temporary name.
pub(super) struct Staged {
    pub(super) file: NamedTempFile,
    pub(super) added: Added,
    pub(super) options: Options,
    /// Two measurements of it would differ.
    pub(super) noisy: bool,
}

pub(super) fn stage(
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

/// The text of a campaign that is there, or the head of a new one.
fn document(
    dir: &Path,
    path: &Path,
    there: bool,
    machine: Option<&str>,
) -> Result<DocumentMut, CampaignError> {
    Ok(match there {
        false => {
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
        true => {
            let text = std::fs::read_to_string(path)
                .map_err(|e| CampaignError::io(path, "written", "a place for a file", &e))?;
            let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
            text.parse().map_err(|e: toml_edit::TomlError| {
                CampaignError::new(
                    Place::file(path),
                    Problem::Toml {
                        reason: e.message().to_owned(),
                    },
                )
            })?
        }
    })
}

/// Gives the staged files their names and writes `campaign.toml`, its old text kept to the letter.
pub(super) fn commit(
    dir: &Path,
    old: Option<&Manifest>,
    machine: Option<&str>,
    staged: Vec<Staged>,
) -> Result<Vec<Added>, CampaignError> {
    let path = dir.join("campaign.toml");
    let io = |e: std::io::Error| CampaignError::io(&path, "written", "a place for a file", &e);
    let mut document = document(dir, &path, old.is_some(), machine)?;
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
