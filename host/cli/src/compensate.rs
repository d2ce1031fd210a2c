//! `giotto compensate`: rewrite the arcs of an NC program with the inverse correction.
mod output_file;
mod page;
mod summary;

use super::destination::{Destination, Kind as FileKind};
use super::{Failure, Output};
use giotto::model_file::ModelFile;
use giotto_nc::check::Controller;
use giotto_nc::{self, Code, Fate, FreeSide, Keep, Leads, Led, Mark, Options, Report};
use output_file::OutputFile;
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::io::Write;
use std::path::{Path, PathBuf};
use summary::Summary;

/// Arguments of `giotto compensate`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// NC program, RS-274 as LinuxCNC, Grbl, Fanuc, Haas and Siemens speak it; Klartext of Heidenhain; or a plain RAPID module.
    #[arg(value_name = "IN.nc")]
    program: PathBuf,
    /// Model of the machine, from `giotto fit` or `giotto diagnose`.
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// Corrected program; a file that is no program is not written over.
    #[arg(short, long, value_name = "OUT.nc")]
    output: PathBuf,
    /// What stays when a radius changes: the feed, or the angular rate (the feed then grows with the radius).
    #[arg(long, value_enum, default_value_t = KeepArg::Feed)]
    keep: KeepArg,
    /// Acceleration that the transitions may ask for, mm/s²; 2000 unless `--for` says otherwise.
    #[arg(long, value_name = "MM_S2")]
    acceleration: Option<f64>,
    /// Largest change of a radius, mm; 0.5 unless `--for` says otherwise.
    #[arg(long, value_name = "MM")]
    max_offset: Option<f64>,
    /// Correct arcs in G18 and G19 as well, though the model was measured in one plane.
    #[arg(long)]
    all_planes: bool,
    /// What the program is for: acceleration, largest change and codes that go with it.
    #[arg(long = "for", value_enum)]
    purpose: Option<Purpose>,
    /// What I, J and K count from where the program says neither G90.1 nor G91.1: a setting of the controller.
    #[arg(long, value_enum, default_value_t = Centres::Relative)]
    centres: Centres,
    /// A code of the machine's own that moves nothing, as M150 or G77; may be given again.
    #[arg(long, value_name = "CODE", value_parser = |text: &str| text.parse::<Code>())]
    harmless: Vec<Code>,
    /// Keep F to the last where an arc ends at a stop; up to a quarter of a lag's correction then remains there. So it is
    /// for `--for laser` and `--for printer`, whose beam or melt goes by the feed.
    #[arg(long)]
    full_feed_to_stops: bool,
    /// Full circles that begin or end at a stop get leads of their own on the free side, which is that of `--inside` or
    /// `--outside`, or what the comment before them names (hole, bore, pocket; boss, stud, island). Not in RAPID.
    #[arg(long, value_enum)]
    lead: Option<LeadArg>,
    /// The circles with leads are walls of holes: the inside is free.
    #[arg(long, requires = "lead", conflicts_with = "outside")]
    inside: bool,
    /// The circles with leads are walls of bosses: the outside is free, by the circle's own diameter.
    #[arg(long, requires = "lead")]
    outside: bool,
    /// Write a page: the part drawn, arcs by their correction, what was left and why, contour error before and after.
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Hold the output against the rules of the controller it is for; exit 5 where it would be refused.
    #[arg(long, value_enum)]
    check: Option<Target>,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum KeepArg {
    Feed,
    Omega,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum Centres {
    Relative,
    Absolute,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum LeadArg {
    /// A circle that touches the wall where it is entered and left.
    Tangent,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum Purpose {
    /// Light axes: 5000 mm/s², changes up to 0.3 mm; F is kept to the last.
    Laser,
    /// 2000 mm/s², changes up to 0.2 mm.
    Mill,
    /// 3000 mm/s², M-codes of Marlin and Klipper; F is kept to the last.
    Printer,
    /// 2000 mm/s², changes up to 2 mm.
    Robot,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum Target {
    Linuxcnc,
    Grbl,
    Abb,
}

impl Args {
    fn options(&self) -> Result<Options, Failure> {
        let (acceleration, offset) = match self.purpose {
            Some(Purpose::Laser) => (5000.0, 0.3),
            Some(Purpose::Mill) => (2000.0, 0.2),
            Some(Purpose::Printer) => (3000.0, 0.5),
            Some(Purpose::Robot) => (2000.0, 2.0),
            None => {
                let usual = Options::default();
                (usual.acceleration_mm_s2, usual.max_offset_mm)
            }
        };
        let options = Options {
            keep: match self.keep {
                KeepArg::Feed => Keep::Feed,
                KeepArg::Omega => Keep::Omega,
            },
            acceleration_mm_s2: self.acceleration.unwrap_or(acceleration),
            max_offset_mm: self.max_offset.unwrap_or(offset),
            all_planes: self.all_planes,
            absolute_centres: self.centres == Centres::Absolute,
            printer: matches!(self.purpose, Some(Purpose::Printer)),
            harmless: self.harmless.clone(),
            // Power and melt are set for the feed: half of it burns, or leaves a blob.
            slow_to_stops: !self.full_feed_to_stops
                && !matches!(self.purpose, Some(Purpose::Laser | Purpose::Printer)),
            leads: match (self.lead, self.inside, self.outside) {
                (None, ..) => Leads::No,
                (Some(LeadArg::Tangent), true, _) => Leads::On(FreeSide::Inside),
                (Some(LeadArg::Tangent), _, true) => Leads::On(FreeSide::Outside),
                (Some(LeadArg::Tangent), false, false) => Leads::ByName,
            },
        };
        for (name, value) in [
            ("--acceleration", options.acceleration_mm_s2),
            ("--max-offset", options.max_offset_mm),
        ] {
            if value.is_nan() || value <= 0.0 || value.is_infinite() {
                return Err(Failure::usage(format_args!(
                    "{name} {value}: expected a positive number"
                )));
            }
        }
        Ok(options)
    }

    fn mark(&self, options: &Options) -> Result<Mark, Failure> {
        let text = std::fs::read(&self.model).map_err(|e| {
            Failure::input(format_args!(
                "{}: cannot be read: {e}",
                self.model.display()
            ))
        })?;
        let digest = Sha256::digest(&text);
        let keep = match options.keep {
            Keep::Feed => "feed",
            Keep::Omega => "omega",
        };
        let planes = if options.all_planes {
            ", all planes"
        } else {
            ""
        };
        let centres = if options.absolute_centres {
            ", absolute centres"
        } else {
            ""
        };
        let leads = match options.leads {
            Leads::No => "",
            Leads::ByName => ", leads by name",
            Leads::On(FreeSide::Inside) => ", leads inside",
            Leads::On(FreeSide::Outside) => ", leads outside",
        };
        let feed = if options.slow_to_stops {
            ""
        } else {
            ", full feed to stops"
        };
        Ok(Mark {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            model: digest[..6].iter().map(|b| format!("{b:02x}")).collect(),
            options: format!(
                "keep {keep}, acceleration {}, max offset {}{planes}{centres}{leads}{feed}",
                options.acceleration_mm_s2, options.max_offset_mm
            ),
        })
    }
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
    slower_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    lead: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    left: Option<String>,
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let options = args.options()?;
    let program = read(&args.program, Kind::Any)?;
    if let Some((line, words)) = giotto_nc::marked(&program) {
        return Err(Failure::input(format_args!(
            "{}:{line}:1: corrected before ({words}); expected a program as the post wrote it",
            args.program.display()
        ))
        .help("correct the original; twice corrected is wrong by as much as not at all"));
    }
    let model = ModelFile::load(&args.model)?;
    let mark = args.mark(&options)?;
    let inputs = [args.program.as_path(), args.model.as_path()];
    let place = OutputFile::at(&args.output, &inputs)?;
    let report = Destination::maybe(
        args.report.as_deref(),
        FileKind::Html,
        &[inputs[0], inputs[1], args.output.as_path()],
    )?;
    let mut arcs = Vec::new();
    // The page is made of the output, which a pipe does not give back.
    let mut kept = Vec::new();
    place.write(|file| {
        let correct = |to: &mut dyn Write| {
            if giotto_nc::rapid::is_rapid(&program) {
                giotto_nc::rapid::compensate_to(&program, &model, &options, Some(&mark), to)
            } else {
                giotto_nc::compensate_to(&program, &model, &options, Some(&mark), to)
            }
        };
        if report.is_some() {
            arcs = correct(&mut kept)?;
            file.write_all(&kept)
        } else {
            arcs = correct(file)?;
            Ok(())
        }
    })?;
    if let Some(report) = &report {
        let page = page::Page {
            args: &args,
            options: &options,
            model: &model,
            program: &program,
            output: &kept,
            arcs: &arcs,
        };
        report.write(page.html()?)?;
        out.note(format_args!("wrote {}", report.path().display()));
    }
    if out.json {
        out.document(&document(&arcs, &model))?;
    } else {
        Summary {
            args: &args,
            model: &model,
            arcs: &arcs,
        }
        .say(out);
    }
    match args.check {
        Some(target) => check(&args.output, target, out),
        None => Ok(()),
    }
}

/// Holds the output against the rules of its controller.
fn check(path: &Path, target: Target, out: Output) -> Result<(), Failure> {
    let text = std::fs::read(path).map_err(|e| {
        Failure::input(format_args!(
            "{}: cannot be read again: {e}",
            path.display()
        ))
    })?;
    let (rules, name) = match target {
        Target::Linuxcnc => (Controller::LinuxCnc, "LinuxCNC"),
        Target::Grbl => (Controller::Grbl, "Grbl"),
        Target::Abb => (Controller::Abb, "ABB"),
    };
    let found = giotto_nc::check::check(&text, rules);
    let Some(first) = found.first() else {
        out.note(format_args!("{name}: nothing that it would refuse"));
        return Ok(());
    };
    for trouble in &found {
        out.note(format_args!(
            "  {}:{}: {}",
            path.display(),
            trouble.line,
            trouble.what
        ));
    }
    Err(Failure::check(format_args!(
        "{}:{}:1: {name} would refuse {} line{}, this one first: {}",
        path.display(),
        first.line,
        found.len(),
        if found.len() == 1 { "" } else { "s" },
        first.what
    ))
    .help("what stands in the original as well is the post's; see the lines above"))
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

fn document(arcs: &[Report], model: &ModelFile) -> Document {
    let arcs: Vec<Arc> = arcs
        .iter()
        .map(|report| {
            let none = Arc {
                line: report.line,
                radius_mm: None,
                feed_mm_s: None,
                change_um: None,
                blocks: None,
                joint_remaining_um: None,
                slower_s: None,
                lead: None,
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
                    slower_s,
                    led,
                } => Arc {
                    radius_mm: Some(radius_mm),
                    feed_mm_s: Some(feed_mm_s),
                    change_um: Some(delta_mm * 1e3),
                    blocks: Some(blocks),
                    joint_remaining_um: Some(joint_share * delta_mm.abs() * 1e3),
                    slower_s: (slower_s > 0.0).then_some(slower_s),
                    lead: match led {
                        Led::Not => None,
                        Led::Tangent => Some("tangent"),
                        Led::SideUnknown => Some("free side unknown"),
                        Led::NoRoom => Some("no room"),
                    },
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
        not_applied: not_applied(model),
        arcs,
    }
}

fn not_applied(model: &ModelFile) -> Vec<String> {
    let names = model.effects.iter().map(|e| e.cause().id().to_owned());
    names.collect()
}
