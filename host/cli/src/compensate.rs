//! `giotto compensate`: rewrite the arcs of an NC program with the inverse correction.
use super::destination::{Destination, Kind as FileKind};
use super::{Failure, Output};
use giotto::model_file::ModelFile;
use giotto_nc::{self, Compensated, Fate, Keep, Left, Options};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What remains at a joint is said from this share of the correction on.
const JOINT_BAR: f64 = 0.05;

/// Arguments of `giotto compensate`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// NC program, RS-274 as LinuxCNC and Grbl speak it; or a plain RAPID module.
    #[arg(value_name = "IN.nc")]
    program: PathBuf,
    /// Model of the machine, from `giotto fit` or `giotto diagnose`.
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// Corrected program.
    #[arg(short, long, value_name = "OUT.nc")]
    output: PathBuf,
    /// What stays when a radius changes: the feed, or the angular rate (the feed then grows with the radius).
    #[arg(long, value_enum, default_value_t = KeepArg::Feed)]
    keep: KeepArg,
    /// Acceleration that the transitions may ask for, mm/s².
    #[arg(long, value_name = "MM_S2", default_value_t = Options::default().acceleration_mm_s2)]
    acceleration: f64,
    /// Largest change of a radius, mm.
    #[arg(long, value_name = "MM", default_value_t = Options::default().max_offset_mm)]
    max_offset: f64,
    /// Correct arcs in G18 and G19 as well, though the model was measured in one plane.
    #[arg(long)]
    all_planes: bool,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum KeepArg {
    Feed,
    Omega,
}

#[derive(Serialize)]
struct Document {
    corrected: usize,
    left: usize,
    largest_change_um: f64,
    arcs: Vec<Arc>,
    not_applied: Vec<String>,
}

#[derive(Serialize)]
struct Arc {
    line: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    radius_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    feed_mm_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    change_um: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    blocks: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    joint_remaining_um: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    left: Option<String>,
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    for (name, value) in [
        ("--acceleration", args.acceleration),
        ("--max-offset", args.max_offset),
    ] {
        if value.is_nan() || value <= 0.0 || value.is_infinite() {
            return Err(Failure::usage(format_args!(
                "{name} {value}: expected a positive number"
            )));
        }
    }
    let place = Destination::new(&args.output, FileKind::Text, &[&args.program, &args.model])?;
    let program = read(&args.program, Kind::Any)?;
    let model = ModelFile::load(&args.model)?;
    let options = Options {
        keep: match args.keep {
            KeepArg::Feed => Keep::Feed,
            KeepArg::Omega => Keep::Omega,
        },
        acceleration_mm_s2: args.acceleration,
        max_offset_mm: args.max_offset,
        all_planes: args.all_planes,
    };
    let compensate = if giotto_nc::rapid::is_rapid(&program) {
        giotto_nc::rapid::compensate
    } else {
        giotto_nc::compensate
    };
    let result = compensate(&program, &model, &options);
    place.write(&result.program)?;
    let document = document(&result, &model);
    if out.json {
        out.document(&document)
    } else {
        say(&args, &result, &document, out)
    }
}

/// What a program may be written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    GCode,
    Any,
}

/// The bytes of a program.
pub(super) fn read(path: &Path, kind: Kind) -> Result<Vec<u8>, Failure> {
    let fail = |what: &str| {
        Failure::input(format_args!(
            "{}: {what}; expected an NC program",
            path.display()
        ))
    };
    match std::fs::read(path) {
        Ok(bytes) if bytes.is_empty() => Err(fail("is empty").help("check which file this is")),
        Ok(bytes) if bytes.contains(&0) => {
            Err(fail("holds zero bytes").help("check which file this is"))
        }
        Ok(bytes) if kind == Kind::GCode && giotto_nc::rapid::is_rapid(&bytes) => {
            Err(fail("is RAPID, which only a robot's own controller runs")
                .help("write it as G-code"))
        }
        Ok(bytes) if !giotto_nc::rapid::is_rapid(&bytes) && !giotto_nc::is_program(&bytes) => {
            Err(fail("no line of it is a block")
                .help("check which file this is; RAPID begins with MODULE"))
        }
        Ok(bytes) => Ok(bytes),
        Err(_) if path.is_dir() => Err(fail("is a directory").help("check the path")),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            Err(fail("no such file").help("check the path"))
        }
        Err(e) => Err(fail(&format!("cannot be read: {e}")).help("check the path")),
    }
}

fn document(result: &Compensated, model: &ModelFile) -> Document {
    let arcs: Vec<Arc> = result
        .arcs
        .iter()
        .map(|report| {
            let none = Arc {
                line: report.line,
                radius_mm: None,
                feed_mm_s: None,
                change_um: None,
                blocks: None,
                joint_remaining_um: None,
                left: None,
            };
            match report.fate {
                Fate::Left(left) => Arc {
                    left: Some(left.to_string()),
                    ..none
                },
                Fate::Corrected {
                    radius_mm,
                    feed_mm_s,
                    delta_mm,
                    blocks,
                    joint_share,
                } => Arc {
                    radius_mm: Some(radius_mm),
                    feed_mm_s: Some(feed_mm_s),
                    change_um: Some(delta_mm * 1e3),
                    blocks: Some(blocks),
                    joint_remaining_um: Some(joint_share * delta_mm.abs() * 1e3),
                    ..none
                },
            }
        })
        .collect();
    Document {
        corrected: arcs.iter().filter(|a| a.left.is_none()).count(),
        left: arcs.iter().filter(|a| a.left.is_some()).count(),
        largest_change_um: arcs
            .iter()
            .filter_map(|a| a.change_um)
            .fold(0.0, |m, c| f64::max(m, c.abs())),
        not_applied: model
            .effects
            .iter()
            .map(|e| e.cause().id().to_owned())
            .collect(),
        arcs,
    }
}

fn say(args: &Args, result: &Compensated, document: &Document, out: Output) -> Result<(), Failure> {
    out.say(format_args!(
        "{}: {} of {} arcs corrected, radius changed by up to {:.1} µm",
        args.output.display(),
        document.corrected,
        document.arcs.len(),
        document.largest_change_um
    ));
    let name = args.program.display();
    let mut negligible = 0;
    let mut reasons: BTreeMap<usize, Left> = BTreeMap::new();
    for report in &result.arcs {
        match report.fate {
            Fate::Left(Left::Negligible) => negligible += 1,
            Fate::Left(left) => _ = reasons.insert(report.line, left),
            Fate::Corrected {
                radius_mm,
                feed_mm_s,
                delta_mm,
                blocks,
                joint_share,
            } => {
                let joints = if joint_share > JOINT_BAR {
                    let left_um = joint_share * delta_mm.abs() * 1e3;
                    format!(
                        "; up to {:.0} % of that ({left_um:.1} µm) remains at a joint",
                        100.0 * joint_share
                    )
                } else {
                    String::new()
                };
                out.say(format_args!(
                    "  {name}:{}: R {radius_mm:.3} mm at {feed_mm_s:.1} mm/s: {:+.1} µm, {blocks} block{}{joints}",
                    report.line,
                    delta_mm * 1e3,
                    if blocks == 1 { "" } else { "s" }
                ));
            }
        }
    }
    for (line, left) in reasons {
        out.say(format_args!("  {name}:{line}: left as it was: {left}"));
    }
    if negligible > 0 {
        out.say(format_args!(
            "  {negligible} arcs need less than 0.5 µm and were left as they were"
        ));
    }
    if !document.not_applied.is_empty() {
        out.say(format_args!(
            "only the radius law is applied; {} act on lines too and belong to the controller's table",
            document.not_applied.join(", ")
        ));
    }
    Ok(())
}
