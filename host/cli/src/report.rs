//! `giotto report`: self-contained HTML report with plots.
use super::failure::{Failure, cannot_write};
use super::output::Output;
use super::source::Source;
use giotto::diagnosis::{Options, diagnose};
use giotto::model_file::ModelFile;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Arguments of `giotto report`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(flatten)]
    source: Source,
    /// The report.
    #[arg(short, long, value_name = "FILE.html")]
    output: PathBuf,
    /// Simulation to start from; without it one servo lag with fitted kv.
    #[arg(long, value_name = "MODEL.toml")]
    model: Option<PathBuf>,
    /// Seed of the bootstrap.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

#[derive(Serialize)]
struct Document<'a> {
    report: &'a Path,
    bytes: usize,
    seed: u64,
    data_sha256: String,
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
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
    let html = giotto_report::html(&campaign, &diagnosis).map_err(Failure::input)?;
    std::fs::write(&args.output, &html).map_err(|e| cannot_write(&args.output, &e))?;
    if out.json {
        return out.document(&Document {
            report: &args.output,
            bytes: html.len(),
            seed: args.seed,
            data_sha256: giotto_report::data_hash(&campaign),
        });
    }
    out.say(format_args!(
        "{}: {} runs, {:.1} MB, seed {}; open it in any browser",
        args.output.display(),
        campaign.runs.len(),
        html.len() as f64 * 1e-6,
        args.seed
    ));
    Ok(())
}
