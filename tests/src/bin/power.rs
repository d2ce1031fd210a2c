//! The power study of `diagnose`: `power` writes `tests/POWER.md`.
//!
//! `--only NAME` keeps the rows whose name contains NAME (or one group: `single`, `pair`, `triple`, `null`,
//! `unlisted`, `permuted`) and then prints instead of writing.
use clap::Parser;
use giotto_tests::effects::Case;
use giotto_tests::files;
use giotto_tests::machine::base::Variety;
use giotto_tests::study::schedule::FULL;
use giotto_tests::study::sheet::{Row, page};
use giotto_tests::study::{Job, Outcome, judge, schedule};
use rayon::prelude::*;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Hides effects under seeds and asks `diagnose` for them.
#[derive(Parser)]
struct Args {
    /// Seed of the whole study.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Keeps the rows whose name contains this, and prints the page.
    #[arg(long)]
    only: Option<String>,
    /// Keeps the rows of this strength.
    #[arg(long)]
    strength: Option<f64>,
    /// Campaigns a cause and strength.
    #[arg(long = "per-case", visible_alias = "each", default_value_t = FULL)]
    each: usize,
    /// Four campaigns a cause and strength.
    #[arg(long)]
    quick: bool,
    /// Other grids, instruments and spreads than the paper's.
    #[arg(long)]
    broad: bool,
    /// Where the page goes.
    #[arg(short, long, default_value = "tests/POWER.md")]
    output: PathBuf,
    /// Also writes a line a campaign, as each is answered, to this file (tab-separated).
    #[arg(long)]
    rows: Option<PathBuf>,
}

/// The heading of `--rows`.
const HEADING: &str = "hidden\tstrength\tseed\tseconds\texact\tgain_share\tcovered\tsaid";

/// One line of `--rows`.
fn line(row: &Row) -> String {
    let Row {
        job,
        verdict,
        seconds,
    } = row;
    let covered: Vec<String> = verdict
        .covered
        .iter()
        .map(|(name, inside)| format!("{name}={}", u8::from(*inside)))
        .collect();
    format!(
        "{}\t{}\t{}\t{seconds:.2}\t{}\t{:.3}\t{}\t{}",
        job.kind,
        job.strength,
        job.seed,
        u8::from(verdict.exact),
        verdict.gain_share.unwrap_or(f64::NAN),
        covered.join(" "),
        verdict.said
    )
}

/// Draws the campaign of `job`, has it diagnosed as a user would from its files, judges the answer.
fn ask(job: &Job, variety: Variety) -> Result<Row, String> {
    let case = Case::new(&job.kind, job.strength, job.seed, variety).ok_or("no such effect")?;
    let case = case.hidden();
    let dir = tempfile::tempdir().map_err(|e| e.to_string())?;
    files::write(&case, dir.path()).map_err(|e| e.to_string())?;
    let start = Instant::now();
    let outcome = Outcome::of(dir.path())?;
    Ok(Row {
        job: job.clone(),
        verdict: judge(&case, &outcome),
        seconds: start.elapsed().as_secs_f64(),
    })
}

fn main() -> ExitCode {
    let args = Args::parse();
    let variety = if args.broad {
        Variety::Broad
    } else {
        Variety::Usual
    };
    let each = if args.quick { 4 } else { args.each };
    let mut jobs = schedule(args.seed, each, args.only.as_deref());
    jobs.retain(|j| args.strength.is_none_or(|s| s == j.strength));
    let done = AtomicUsize::new(0);
    let rows_file = match args.rows.as_ref().map(std::fs::File::create).transpose() {
        Ok(file) => Mutex::new(file),
        Err(e) => {
            eprintln!("--rows: {e}");
            return ExitCode::from(2);
        }
    };
    let keep = |line: &str| {
        if let Ok(mut file) = rows_file.lock()
            && let Some(file) = file.as_mut()
            && let Err(e) = writeln!(file, "{line}")
        {
            eprintln!("--rows: {e}");
        }
    };
    keep(HEADING);
    let answers: Vec<Result<Row, String>> = jobs
        .par_iter()
        .map(|job| {
            let row = ask(job, variety)
                .map_err(|e| format!("{} at {}×, seed {}: {e}", job.kind, job.strength, job.seed));
            if let Ok(row) = &row {
                keep(&line(row));
            }
            let n = done.fetch_add(1, Ordering::Relaxed) + 1;
            if n.is_multiple_of(50) {
                eprintln!("{n} of {}", jobs.len());
            }
            row
        })
        .collect();
    let mut rows = Vec::new();
    let mut broken = 0;
    for answer in answers {
        match answer {
            Ok(row) => rows.push(row),
            Err(words) => {
                broken += 1;
                eprintln!("{words}");
            }
        }
    }
    let command = format!(
        "cargo run --release -p giotto-tests --bin power -- --seed {} --per-case {each}{}",
        args.seed,
        if args.broad { " --broad" } else { "" }
    );
    let page = page(&rows, args.seed, &command);
    if args.only.is_some() || args.strength.is_some() {
        println!("{page}");
    } else if let Err(e) = std::fs::write(&args.output, &page) {
        eprintln!("{}: {e}", args.output.display());
        return ExitCode::from(2);
    } else {
        println!(
            "{} campaigns, {broken} without an answer: {}",
            rows.len(),
            args.output.display()
        );
    }
    if broken == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(5)
    }
}
