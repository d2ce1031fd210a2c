//! `giotto plan`: the next runs that would best separate what cannot be told apart yet.
use super::choice::{up_to_60, whole};
use super::destination::{Destination, Kind as FileKind};
use super::source::{Source, length};
use super::{Failure, Output};
use comfy_table::{CellAlignment, Table, presets};
use giotto::campaign::Direction;
use giotto::causes::Cause;
use giotto::diagnosis::{Options, diagnose};
use giotto::model_file::ModelFile;
use giotto::planning::{self, Limits, Plan, Purpose};
use std::path::PathBuf;

/// Arguments of `giotto plan`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(flatten)]
    source: Source,
    /// Write the runs as a plan that `giotto simulate` reads.
    #[arg(short, long, value_name = "PLAN.toml")]
    output: Option<PathBuf>,
    /// Write the measuring program in RS-274 here: warm-up, runs in order, stops for the instrument.
    #[arg(long, value_name = "FILE.nc")]
    gcode: Option<PathBuf>,
    /// Write the measuring program in RAPID here.
    #[arg(long, value_name = "FILE.mod")]
    rapid: Option<PathBuf>,
    /// Simulation to start from; without it one servo lag with fitted kv.
    #[arg(long, value_name = "MODEL.toml")]
    model: Option<PathBuf>,
    /// Radii that the instrument has, separated by commas; without it those measured and the lengths of usual bars (50,
    /// 100, 150 mm, …) up to the largest measured.
    #[arg(long, value_name = "MM,MM", value_delimiter = ',', value_parser = length)]
    radii: Vec<f64>,
    /// Largest radius; without it the largest of the campaign.
    #[arg(long, value_name = "MM", value_parser = length)]
    max_radius: Option<f64>,
    /// Highest feed; without it the highest of the campaign.
    #[arg(long, value_name = "MM_S", value_parser = length)]
    max_feed: Option<f64>,
    /// Highest centripetal acceleration; without it the highest of the campaign.
    #[arg(long, value_name = "MM_S2", value_parser = length)]
    max_acceleration: Option<f64>,
    /// Most runs beside the three reference runs.
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = up_to_60)]
    runs: u8,
    /// Seed of the order of the runs and of the diagnosis.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u64>)]
    seed: u64,
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let inputs = args.source.inputs(args.model.as_deref());
    Destination::apart(&[
        args.output.as_deref(),
        args.gcode.as_deref(),
        args.rapid.as_deref(),
    ])?;
    let place = |path: &Option<PathBuf>, kind| Destination::maybe(path.as_deref(), kind, &inputs);
    let file = place(&args.output, FileKind::Plan)?;
    let programs = [
        place(&args.gcode, FileKind::Text)?,
        place(&args.rapid, FileKind::Text)?,
    ];
    let campaign = args.source.read(out)?;
    let model = args.model.as_deref().map(ModelFile::load).transpose()?;
    let bar = out.spinner("diagnosing");
    let diagnosis = diagnose(
        &campaign,
        &Options {
            model,
            seed: args.seed,
            ..Options::default()
        },
    );
    bar.finish_and_clear();
    let diagnosis = diagnosis.map_err(|e| args.source.refused(&e))?;
    let options = planning::Options {
        limits: Limits {
            radii_m: args.radii.iter().map(|mm| mm * 1e-3).collect(),
            largest_radius_m: args.max_radius.map(|mm| mm * 1e-3),
            highest_feed_m_s: args.max_feed.map(|mm| mm * 1e-3),
            highest_acceleration_m_s2: args.max_acceleration.map(|mm| mm * 1e-3),
        },
        most_runs: usize::from(args.runs),
        seed: args.seed,
    };
    let plan = planning::propose(&campaign, &diagnosis, &options);
    let asked = args.output.is_some() || args.gcode.is_some() || args.rapid.is_some();
    if asked && plan.runs.is_empty() {
        return Err(Failure::check(nothing(&plan))
            .help("leave out -o, --gcode and --rapid to see what the campaign tells"));
    }
    if let Some(file) = &file {
        let text = toml::to_string(&plan.file(&campaign))
            .map_err(|e| Failure::input(format_args!("{}: {e}", file.path().display())))?;
        let text = format!(
            "# The next measurement, in this order. Warm up before it: {} turns of the first circle.\n# To simulate it, name the machine here: model = \"MODEL.toml\"\n{text}",
            plan.warm_up_turns
        );
        write(file, &text, out)?;
    }
    let [gcode, rapid] = &programs;
    if let Some(file) = gcode {
        write(file, &plan.gcode(&campaign.name), out)?;
    }
    if let Some(file) = rapid {
        write(file, &plan.rapid(&campaign.name), out)?;
    }
    if out.json {
        return out.document(&plan);
    }
    show(&plan, &diagnosis.cannot_tell, asked, out);
    Ok(())
}

fn write(file: &Destination, text: &str, out: Output) -> Result<(), Failure> {
    file.write(text)?;
    out.note(format_args!("wrote {}", file.path().display()));
    Ok(())
}

/// Why no run is planned: nothing is open, or what is open needs circles that were not allowed.
fn nothing(plan: &Plan) -> &'static str {
    if plan.open.is_empty() {
        "No runs to plan: circles have nothing more to tell apart here."
    } else {
        "No runs to plan within these limits, though something is open: allow other circles with --radii, --max-radius, \
         --max-feed or --max-acceleration."
    }
}

/// A cause for a person; what is none of the list keeps its name.
pub(super) fn name(id: &str) -> String {
    Cause::from_id(id).map_or_else(
        || id.replace('_', " "),
        |cause| cause.model().words().name.to_string(),
    )
}

/// More causes than this are named as what they are: nearly all.
const MANY: usize = 6;

fn runs(plan: &Plan) -> Table {
    let mut table = Table::new();
    table
        .load_style(presets::NOTHING)
        .set_header(["run", "R mm", "f mm/s", "direction", "for"]);
    for (i, step) in plan.runs.iter().enumerate() {
        table.add_row([
            (i + 1).to_string(),
            step.radius_mm.to_string(),
            step.feed_mm_s.to_string(),
            match step.direction {
                Direction::Ccw => "ccw",
                Direction::Cw => "cw",
            }
            .to_string(),
            match step.purpose {
                Purpose::Test => "",
                Purpose::Reference => "reference",
            }
            .to_string(),
        ]);
    }
    table
        .column_iter_mut()
        .take(3)
        .for_each(|column| column.set_cell_alignment(CellAlignment::Right));
    table
}

fn show(plan: &Plan, cannot_tell: &[String], asked: bool, out: Output) {
    for class in &plan.open {
        if class.members.len() > MANY && !cannot_tell.is_empty() {
            out.tell(0, "Open: nearly every cause, for these runs cannot tell:");
            for missing in cannot_tell {
                let first = missing.split(';').next().unwrap_or(missing);
                out.tell(2, first.split(", so ").next().unwrap_or(first));
            }
            continue;
        }
        let members: Vec<String> = class.members.iter().map(|cause| name(cause.id())).collect();
        out.tell(
            0,
            format_args!("Open: any of {}: {}.", members.join(", "), class.why),
        );
    }
    for line in &plan.line_tests {
        let [a, b] = &line.pair;
        out.tell(
            0,
            format_args!(
                "No circle can tell {} from {} ({}); do a line test: {}.",
                name(a),
                name(b),
                line.why,
                line.test
            ),
        );
    }
    if plan.runs.is_empty() {
        out.tell(0, nothing(plan));
        return;
    }
    out.say(runs(plan));
    for s in &plan.separations {
        let [a, b] = &s.pair;
        out.tell(
            0,
            format_args!(
                "{} or {}: χ² {:.0} now, {:.0} with these runs{}.",
                name(a),
                name(b),
                s.expected_chi2_before,
                s.expected_chi2_after,
                if s.told() { "" } else { ", not enough" }
            ),
        );
    }
    out.tell(0, format_args!(
        "Warm up with {} turns of the first circle, then measure in this order: {:.0} min in all; seed {}.",
        plan.warm_up_turns,
        (plan.duration_s / 60.0).ceil(),
        plan.seed
    ));
    if !asked {
        out.tell(
            0,
            "The program for it: --gcode FILE.nc for a machine tool, --rapid FILE.mod for a robot; -o PLAN.toml for giotto simulate.",
        );
    }
}
