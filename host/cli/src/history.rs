//! `giotto history`: every campaign of a folder diagnosed once and kept; what drifts, what stepped.
use super::choice::whole;
use super::compare::summary;
use super::destination::{Destination, Kind};
use super::failure::cannot_write;
use super::grid::Grid;
use super::{Failure, Output};
use giotto::campaign;
use giotto::history::{self, CampaignRow, Date, FindingRow, History, StoreError};
use giotto::units;
use serde::Serialize;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Directory of the store inside the folder.
const STORE: &str = "history";

/// Arguments of `giotto history`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Folder whose directories are campaigns; a date in a name (2026-05-14) is the day of its measurement.
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
    /// Day on which the machine was serviced; may be given several times. A step at it is called so.
    #[arg(long, value_name = "DATE", value_parser = day)]
    service: Vec<Date>,
    /// Write the history as a page.
    #[arg(long, value_name = "FILE.html")]
    html: Option<PathBuf>,
    /// Seed of the diagnoses and of the shuffles.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u64>)]
    seed: u64,
}

fn day(text: &str) -> Result<Date, String> {
    Date::find(text).ok_or_else(|| "expected a day as 2026-05-14".to_owned())
}

#[derive(Serialize)]
struct Document<'a> {
    store: [PathBuf; 2],
    diagnosed: usize,
    machines: &'a [History],
    findings: &'a [FindingRow],
    seed: u64,
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let folder = &args.folder;
    let page = Destination::maybe(args.html.as_deref(), Kind::Html, &[])?;
    let found = campaigns(folder)?;
    let store = folder.join(STORE);
    let files = ["campaigns.parquet", "findings.parquet"].map(|name| store.join(name));
    let (mut rows, mut findings) = if files[0].exists() {
        (
            kept(&files[0], history::decode_campaigns)?,
            kept(&files[1], history::decode_findings)?,
        )
    } else {
        (Vec::new(), Vec::new())
    };
    if found.is_empty() && rows.is_empty() {
        return Err(Failure::input(format_args!(
            "{}: no directory in it holds a campaign.toml",
            folder.display()
        ))
        .help("give the folder that holds the campaigns, one directory each"));
    }
    let diagnosed = add(&found, &mut rows, &mut findings, args.seed, out)?;
    rows.sort_by(|a, b| (a.date, &a.folder).cmp(&(b.date, &b.folder)));
    findings.sort_by_key(|a| a.date);
    if diagnosed > 0 || !files[0].exists() {
        std::fs::create_dir_all(&store).map_err(|e| cannot_write(&store, &e))?;
        // The findings first: a campaign that is in the store has its findings there.
        let bytes = history::encode_findings(&findings).map_err(Failure::input)?;
        Destination::new(&files[1], Kind::Parquet, &[])?.write(bytes)?;
        let bytes = history::encode_campaigns(&rows).map_err(Failure::input)?;
        Destination::new(&files[0], Kind::Parquet, &[])?.write(bytes)?;
    }
    let machines = history::histories(&rows, &findings, &args.service, args.seed);
    if let Some(page) = &page {
        page.write(giotto_report::history_page(&machines).map_err(Failure::input)?)?;
        out.note(format_args!("wrote {}", page.path().display()));
    }
    if out.json {
        return out.document(&Document {
            store: files,
            diagnosed,
            machines: &machines,
            findings: &findings,
            seed: args.seed,
        });
    }
    machines.iter().for_each(|machine| show(machine, out));
    out.say(format_args!(
        "{} campaigns kept in {}, {diagnosed} of them diagnosed now",
        rows.len(),
        store.display()
    ));
    Ok(())
}

/// The campaigns of a folder, in order of their names.
fn campaigns(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let entries = std::fs::read_dir(folder).map_err(|error| {
        let reason = match error.kind() {
            std::io::ErrorKind::NotFound => "no such folder".to_owned(),
            _ => error.to_string(),
        };
        Failure::input(format_args!(
            "{}: {reason}; expected a folder whose directories are campaigns",
            folder.display()
        ))
        .help("check the path")
    })?;
    let mut found: Vec<PathBuf> = entries
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.join("campaign.toml").is_file())
        .collect();
    found.sort();
    Ok(found)
}

fn kept<T>(
    path: &Path,
    read: impl Fn(File) -> Result<Vec<T>, StoreError>,
) -> Result<Vec<T>, Failure> {
    let refused = |reason: &dyn std::fmt::Display| {
        Failure::input(format_args!("{}: {reason}", path.display()))
            .help("remove the store to diagnose all campaigns of the folder anew")
    };
    let file = File::open(path).map_err(|e| refused(&e))?;
    read(file).map_err(|e| refused(&e))
}

/// Diagnoses what the store does not hold yet. Returns how many those were.
fn add(
    found: &[PathBuf],
    rows: &mut Vec<CampaignRow>,
    findings: &mut Vec<FindingRow>,
    seed: u64,
    out: Output,
) -> Result<usize, Failure> {
    let bar = out.spinner("diagnosing");
    let mut diagnosed = 0;
    for path in found {
        let (campaign, notes) = campaign::read_with_notes(path)?;
        let hash = giotto_report::data_hash(&campaign);
        if rows.iter().any(|row| row.data_sha256 == hash) {
            continue;
        }
        notes.iter().for_each(|note| out.note(note));
        let folder = path.file_name().map(|n| n.to_string_lossy().into_owned());
        let folder = folder.unwrap_or_else(|| campaign.name.clone());
        let named = Date::find(&folder).or_else(|| Date::find(&campaign.name));
        let date = match named {
            Some(date) => date,
            None => {
                let date = written(path)?;
                out.note(format_args!(
                    "note: {folder}: no date in its name; taken is that of its campaign.toml, {date}"
                ));
                date
            }
        };
        let summary = summary(&campaign, path, seed)?;
        // Half a diagnosis of an earlier attempt is not counted twice.
        findings.retain(|f| f.data_sha256 != hash);
        let (row, found) = history::rows(&summary, date, &folder, &hash);
        rows.push(row);
        findings.extend(found);
        diagnosed += 1;
    }
    bar.finish_and_clear();
    Ok(diagnosed)
}

/// Day on which the manifest was written last.
fn written(path: &Path) -> Result<Date, Failure> {
    let failed = |error: std::io::Error| {
        Failure::input(format_args!("{}: {error}", path.display())).help("put a date into its name")
    };
    let time = std::fs::metadata(path.join("campaign.toml"))
        .and_then(|found| found.modified())
        .map_err(failed)?;
    let seconds = time
        .duration_since(std::time::UNIX_EPOCH)
        .map_or(0, |since| since.as_secs());
    let days = i32::try_from(seconds / 86_400).unwrap_or(i32::MAX);
    Ok(Date { days })
}

fn show(machine: &History, out: Output) {
    let (Some(first), Some(last)) = (machine.campaigns.first(), machine.campaigns.last()) else {
        return;
    };
    out.say(format_args!(
        "{}: {} campaigns, {} to {}",
        machine.machine,
        machine.campaigns.len(),
        first.date,
        last.date
    ));
    let words: Vec<&String> = machine.series.iter().flat_map(|s| &s.words).collect();
    if machine.campaigns.len() < history::trend::FEWEST {
        out.say(format_args!(
            "Too few to tell a drift or a step from scatter: {} campaigns are needed.",
            history::trend::FEWEST
        ));
    } else if words.is_empty() {
        out.say("Nothing drifts and nothing stepped beyond what unchanged machines show.");
    }
    words.iter().for_each(|words| out.tell(0, words));
    out.say("");
    let header = ["series", "first", "last", "low limit", "high limit", "unit"];
    let mut grid = Grid::new(&header, 1, 1);
    for s in &machine.series {
        let limits = s.trend.limits.last().copied().unwrap_or([0.0; 3]);
        let say = |v: f64| {
            if v.is_finite() {
                units::shown(v, [limits[0]; 2], &s.unit).value
            } else {
                "–".to_owned()
            }
        };
        let at = |v: Option<&f64>| v.map_or_else(|| "–".to_owned(), |v| say(*v));
        grid.row([
            s.title.clone(),
            at(s.values.first()),
            at(s.values.last()),
            say(limits[1]),
            say(limits[2]),
            units::shown(limits[0], [limits[0]; 2], &s.unit).unit,
        ]);
    }
    grid.show(out);
    out.say("");
}
