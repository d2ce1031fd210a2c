//! `giotto report`: self-contained HTML report with plots.
use super::choice::whole;
use super::destination::{Destination, Kind};
use super::failure::Failure;
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
    /// Print the report into this file as well, by the browser of this machine (Chromium or Chrome).
    #[arg(long, value_name = "FILE.pdf")]
    pdf: Option<PathBuf>,
    /// Simulation to start from; without it one servo lag with fitted kv.
    #[arg(long, value_name = "MODEL.toml")]
    model: Option<PathBuf>,
    /// Seed of the bootstrap.
    #[arg(long, default_value_t = 1, value_parser = whole::<u64>)]
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
    let inputs = args.source.inputs(args.model.as_deref());
    Destination::apart(&[Some(&args.output), args.pdf.as_deref()])?;
    let page = Destination::new(&args.output, Kind::Html, &inputs)?;
    let pdf = Destination::maybe(args.pdf.as_deref(), Kind::Pdf, &inputs)?;
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
    page.write(&html)?;
    if let Some(pdf) = &pdf {
        pdf.write(printed(&html)?)?;
        out.note(format_args!("wrote {}", pdf.path().display()));
    }
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

/// Browsers that print without a window.
const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

/// The page as a PDF, by the first browser there is.
fn printed(html: &str) -> Result<Vec<u8>, Failure> {
    let failed = |error: std::io::Error| {
        Failure::input(format_args!("the report cannot be printed: {error}"))
            .help("open the HTML in a browser and print it there")
    };
    let folder = tempfile::tempdir().map_err(failed)?;
    let [page, pdf, profile] =
        ["report.html", "report.pdf", "profile"].map(|n| folder.path().join(n));
    std::fs::write(&page, html).map_err(failed)?;
    for browser in BROWSERS {
        let mut command = std::process::Command::new(browser);
        command
            .args([
                "--headless",
                "--disable-gpu",
                "--no-first-run",
                "--no-pdf-header-footer",
            ])
            // Only this page is opened, which fetches nothing; as root the sandbox is not to be had.
            .arg("--no-sandbox")
            .arg(format!("--user-data-dir={}", profile.display()))
            .arg(format!("--print-to-pdf={}", pdf.display()))
            .arg(format!("file://{}", page.display()));
        match command.output() {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => continue,
            Err(error) => return Err(failed(error)),
            Ok(_) => return std::fs::read(&pdf).map_err(failed),
        }
    }
    Err(
        Failure::input("no browser was found that could print the report")
            .help("install chromium, or open the HTML in a browser and print it there"),
    )
}
