//! Writing campaigns in the contract's files.
use super::error::{CampaignError, Place, Problem};
use super::{Campaign, Direction, Frame, Plane, Run};
use crate::kinematics::{Kinematics, WrittenKinematics};
use crate::whole_file;
pub(crate) use crate::whole_file::make_public;
use std::collections::HashSet;
use std::fmt::Write as _;
use std::io::Write;
use std::path::{Component, Path};
use toml_edit::{ArrayOfTables, DocumentMut, Item, Table, value};

/// Writes a campaign into a directory (made if missing): the CSVs first, `campaign.toml` last, so that a
/// directory with a `campaign.toml` is whole.
///
/// Runs with inferred angles become `time_s,deviation_um`; with measured angles `angle_deg,deviation_um`, or
/// `time_s,x_mm,y_mm` where the time is known as well.
///
/// # Errors
/// A file name that is used twice or leaves the directory, and what the operating system says.
///
/// ```
/// use giotto::campaign;
/// use giotto::simulation::{self, Plan};
/// # use std::path::Path;
///
/// let plan = Plan::parse("[grid]\nradii_mm = [100.0]\nfeeds_mm_s = [50.0]", Path::new("plan.toml"))?;
/// let simulated = simulation::campaign(&plan, 1);
/// let folder = tempfile::tempdir()?;
/// campaign::write(&simulated, folder.path())?;
/// let read = campaign::read(folder.path())?;
/// assert_eq!(read.runs.len(), simulated.runs.len());
/// assert_eq!(read.runs[0].radius_m, simulated.runs[0].radius_m);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write(campaign: &Campaign, dir: &Path) -> Result<(), CampaignError> {
    let mut names = HashSet::new();
    for (index, run) in campaign.runs.iter().enumerate() {
        let plain = |c: Component<'_>| matches!(c, Component::Normal(_) | Component::CurDir);
        if run.file.is_empty() || !Path::new(&run.file).components().all(plain) {
            return Err(CampaignError::new(
                Place::file(dir),
                Problem::OutsideDirectory {
                    file: run.file.clone(),
                },
            ));
        }
        if !names.insert(run.file.as_str()) {
            let problem = Problem::DuplicateName {
                index,
                file: run.file.clone(),
            };
            return Err(CampaignError::new(Place::file(dir), problem));
        }
    }
    make_dir(dir)?;
    for run in &campaign.runs {
        let path = dir.join(&run.file);
        if let Some(parent) = path.parent() {
            make_dir(parent)?;
        }
        write_samples(run, &path)?;
    }
    let mut document = DocumentMut::new();
    let mut head = Table::new();
    head["name"] = value(&campaign.name);
    head["machine"] = value(&campaign.machine);
    if let Some(repeatability_m) = campaign.repeatability_m {
        head["repeatability_um"] = value(plain(repeatability_m * 1e6));
    }
    if let Some(table) = &campaign.table {
        head["table"] = value(table);
    }
    document["campaign"] = Item::Table(head);
    if let Some(kinematics) = &campaign.kinematics {
        document["kinematics"] = Item::Table(block(kinematics));
    }
    let mut list = ArrayOfTables::new();
    for run in &campaign.runs {
        list.push(entry(run));
    }
    document["run"] = Item::ArrayOfTables(list);
    replace(&dir.join("campaign.toml"), &document.to_string())
}

fn make_dir(dir: &Path) -> Result<(), CampaignError> {
    std::fs::create_dir_all(dir)
        .map_err(|e| CampaignError::io(dir, "made", "a place for a directory", &e))
}

/// Writes a file whole or not at all.
pub fn replace(path: &Path, text: &str) -> Result<(), CampaignError> {
    whole_file::write(path, text.as_bytes())
        .map_err(|e| CampaignError::io(path, "written", "a place for a file", &e))
}

/// The `[kinematics]` table of an arm.
fn block(kinematics: &Kinematics) -> Table {
    let written = WrittenKinematics::from(kinematics);
    let mut table = Table::new();
    let list = |numbers: &[f64]| value(numbers.iter().copied().collect::<toml_edit::Array>());
    let mut put = |key: &str, item: Option<Item>| {
        if let Some(item) = item {
            table[key] = item;
        }
    };
    put("model", written.model.map(value));
    put("robot", written.robot.map(value));
    let lengths = [
        ("a1_mm", written.a1_mm),
        ("a2_mm", written.a2_mm),
        ("b_mm", written.b_mm),
        ("c1_mm", written.c1_mm),
        ("c2_mm", written.c2_mm),
        ("c3_mm", written.c3_mm),
        ("c4_mm", written.c4_mm),
        ("l1_mm", written.l1_mm),
        ("l2_mm", written.l2_mm),
    ];
    for (key, length) in lengths {
        put(key, length.map(value));
    }
    put("tool_mm", written.tool_mm.map(|v| list(&v)));
    put("orientation", written.orientation.map(|v| list(&v)));
    put("branch", written.branch.map(value));
    put("elbow", written.elbow.map(value));
    table
}

/// The `[[run]]` table of a run.
fn entry(run: &Run) -> Table {
    let mut table = Table::new();
    table["file"] = value(&run.file);
    table["radius_mm"] = value(plain(run.radius_m * 1e3));
    table["feed_mm_s"] = value(plain(run.feed_m_s * 1e3));
    table["direction"] = value(match run.direction {
        Direction::Ccw => "ccw",
        Direction::Cw => "cw",
    });
    table["start_angle_deg"] = value(plain(run.start_angle_rad.to_degrees()));
    if let Some(started) = run.started_s {
        table["started_s"] = value(plain(started));
    }
    if let Some(temperature) = run.temperature_c {
        table["temperature_c"] = value(plain(temperature));
    }
    if let Some(centre) = run.centre_m {
        table["centre_mm"] = value(
            centre
                .map(|c| plain(c * 1e3))
                .into_iter()
                .collect::<toml_edit::Array>(),
        );
    }
    if let Some(plane) = run.frame.plane().filter(|plane| *plane != Plane::Xy) {
        table["plane"] = value(plane.name());
    }
    if let Some(setup) = &run.setup {
        table["setup"] = value(setup);
    }
    if let Some(arc) = run.samples.covered_rad() {
        table["arc_deg"] = value((arc.to_degrees() * 1e3).round() / 1e3);
    }
    table
}

/// A decimal of at most nine places: what the conversion of units left behind goes.
fn plain(v: f64) -> f64 {
    (v * 1e9).round() / 1e9
}

fn write_samples(run: &Run, path: &Path) -> Result<(), CampaignError> {
    whole_file::with(path, |out| fill(run, out))
        .map_err(|e| CampaignError::io(path, "written", "a place for a file", &e))
}

fn fill(run: &Run, out: &mut dyn Write) -> std::io::Result<()> {
    let samples = &run.samples;
    let rows = samples.deviation_m.len();
    let mut line = String::with_capacity(64);
    // A file of lengths says nothing of a tilt: points in space do.
    let tilted = run.frame.plane().is_none();
    let positions = tilted || (samples.time_s.is_some() && !samples.angle_inferred);
    let flat = run.frame == Frame::of(Plane::Xy);
    let mut header: Vec<&str> = Vec::new();
    if samples.time_s.is_some() {
        header.push("time_s");
    }
    header.extend(match (positions, flat, samples.time_s.is_some()) {
        (true, true, _) => &["x_mm", "y_mm"][..],
        (true, false, _) => &["x_mm", "y_mm", "z_mm"],
        (false, _, true) => &["deviation_um"],
        (false, _, false) => &["angle_deg", "deviation_um"],
    });
    out.write_all((header.join(",") + "\n").as_bytes())?;
    for k in 0..rows {
        line.clear();
        let (angle, deviation) = (samples.angle_rad[k], samples.deviation_m[k]);
        if let Some(time) = &samples.time_s {
            number(&mut line, time[k], 9, b',');
        } else if !positions {
            number(&mut line, angle.to_degrees(), 9, b',');
        }
        if positions {
            let (sin, cos) = angle.sin_cos();
            let radius_mm = (run.radius_m + deviation) * 1e3;
            let (first, second) = (run.frame.first(), run.frame.second());
            let last = if flat { 1 } else { 2 };
            for axis in 0..=last {
                let coordinate_mm = radius_mm * (cos * first[axis] + sin * second[axis]);
                let end = if axis == last { b'\n' } else { b',' };
                number(&mut line, coordinate_mm, 9, end);
            }
        } else {
            number(&mut line, deviation * 1e6, 6, b'\n');
        }
        out.write_all(line.as_bytes())?;
    }
    Ok(())
}

/// A decimal without trailing zeros (one is kept), and what follows it.
pub(crate) fn number(line: &mut String, v: f64, places: usize, end: u8) {
    let start = line.len();
    let _ = write!(line, "{v:.places$}"); // writing to a String cannot fail
    while line.ends_with('0') && !line.ends_with(".0") {
        line.pop();
    }
    if &line[start..] == "-0.0" {
        line.replace_range(start.., "0.0");
    }
    line.push(char::from(end));
}
