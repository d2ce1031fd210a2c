//! `giotto simulate`: a simulated machine runs the circles of a plan and writes a campaign.
use super::choice::whole;
use super::{Failure, Output};
use giotto::simulation::{self, Plan};
use serde::Serialize;
use std::path::PathBuf;

/// Arguments of `giotto simulate`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The plan: machine (or model), instrument and runs; also what `giotto plan` writes.
    #[arg(
        value_name = "PLAN.toml",
        required_unless_present = "preset",
        conflicts_with = "preset"
    )]
    plan: Option<PathBuf>,
    /// A plan that comes with giotto: `paper`, the plan of Slamani, Nubiola and Bonev (2012) on a simulated IRB 1600.
    #[arg(long, value_name = "NAME", value_parser = clap::builder::PossibleValuesParser::new(simulation::PRESETS))]
    preset: Option<String>,
    /// Directory of the campaign to be written.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Seed of every random draw: noise, spread, order of the runs.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole::<u64>)]
    seed: u64,
}

#[derive(Serialize)]
struct Document<'a> {
    simulated: bool,
    seed: u64,
    campaign: &'a std::path::Path,
    runs: usize,
    noise_um: f64,
    spread_um: f64,
}

/// The plan of the file, or the preset.
fn plan(args: &Args) -> Result<Plan, Failure> {
    if let Some(file) = &args.plan {
        return Ok(Plan::load(file)?);
    }
    let name = args.preset.as_deref().unwrap_or_default();
    Plan::preset(name)?.ok_or_else(|| Failure::input(format!("no preset \"{name}\"")))
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let plan = plan(&args)?;
    if args.output.join("campaign.toml").exists() {
        let message = format!("{}: holds a campaign already", args.output.display());
        return Err(
            Failure::input(message).help("choose another directory with -o, or remove this one")
        );
    }
    let campaign = simulation::campaign(&plan, args.seed);
    giotto::campaign::write(&campaign, &args.output)?;
    if out.json {
        return out.document(&Document {
            simulated: true,
            seed: args.seed,
            campaign: &args.output,
            runs: campaign.runs.len(),
            noise_um: plan.instrument.noise_m * 1e6,
            spread_um: plan.instrument.spread_m * 1e6,
        });
    }
    out.say(format_args!(
        "{}: {} runs of a simulated machine, seed {}",
        args.output.display(),
        campaign.runs.len(),
        args.seed
    ));
    Ok(())
}
