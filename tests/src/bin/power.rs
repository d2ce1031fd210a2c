//! The power study of `diagnose`: `power` writes `tests/POWER.md`.
//!
//! Published seeds and seeds for tuning are ranges of their own (`giotto_tests::study::seeds`); `--tune` takes the
//! latter and then prints instead of writing, as `--only` and `--group` do. The whole study takes hours; `--most 8`
//! draws at most eight campaigns a group and says so on the page.
use clap::Parser;
use giotto_tests::files;
use giotto_tests::study::schedule::FULL;
use giotto_tests::study::seeds::{PUBLISHED, TUNING};
use giotto_tests::study::sheet::{Heading, Row, page};
use giotto_tests::study::{Group, Job, Order, Outcome, judge, schedule};
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
    /// Takes the seeds that thresholds may be set on, and prints the page.
    #[arg(long)]
    tune: bool,
    /// Other rows from the same range of seeds.
    #[arg(long, default_value_t = 0)]
    round: u64,
    /// Keeps the rows whose name contains this, and prints the page.
    #[arg(long)]
    only: Option<String>,
    /// Keeps these groups (`single`, `scatter`, `arm-sound`, …), and prints the page.
    #[arg(long, value_parser = group)]
    group: Vec<Group>,
    /// Campaigns a cause and strength.
    #[arg(long = "per-case", visible_alias = "each", default_value_t = FULL)]
    each: usize,
    /// At most so many campaigns a group.
    #[arg(long)]
    most: Option<usize>,
    /// Where the page goes.
    #[arg(short, long, default_value = "tests/POWER.md")]
    output: PathBuf,
    /// Also writes a line a campaign, as each is answered, to this file (tab-separated).
    #[arg(long)]
    rows: Option<PathBuf>,
}

/// A group by its name, with or without hyphens.
fn group(name: &str) -> Result<Group, String> {
    let plain = |s: &str| s.replace(['-', '_'], "").to_lowercase();
    Group::ALL
        .into_iter()
        .find(|g| plain(&format!("{g:?}")) == plain(name))
        .ok_or_else(|| {
            let names: Vec<String> = Group::ALL.iter().map(|g| format!("{g:?}")).collect();
            format!("one of {}", names.join(", "))
        })
}

/// The heading of `--rows`.
const HEADING: &str = "group\thidden\tstrength\tseed\tseconds\tright\tgain_share\tcovered\tsaid";

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
        "{:?}\t{}\t{}\t{}\t{seconds:.2}\t{}\t{:.3}\t{}\t{}",
        job.group,
        job.kind,
        job.strength,
        job.seed,
        u8::from(giotto_tests::study::groups::right(row)),
        verdict.gain_share.unwrap_or(f64::NAN),
        covered.join(" "),
        verdict.said
    )
}

/// Draws the campaign of `job`, has it diagnosed as a user would from its files, judges the answer.
fn ask(job: &Job) -> Result<Row, String> {
    let case = job
        .kind
        .hidden(job.strength, job.seed)
        .ok_or("no such effect")?;
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

/// Answers of all jobs in their order, the failed ones by their group and words.
fn answers(jobs: &[Job], keep: impl Fn(&str) + Sync) -> Vec<Result<Row, (Group, String)>> {
    let done = AtomicUsize::new(0);
    jobs.par_iter()
        .map(|job| {
            let row = ask(job).map_err(|e| {
                let words = format!("{} at {}×, seed {}: {e}", job.kind, job.strength, job.seed);
                (job.group, words)
            });
            if let Ok(row) = &row {
                keep(&line(row));
            }
            let n = done.fetch_add(1, Ordering::Relaxed) + 1;
            if n.is_multiple_of(50) {
                eprintln!("{n} of {}", jobs.len());
            }
            row
        })
        .collect()
}

/// What the page says of itself.
fn heading(args: &Args, all: usize, drawn: usize) -> Heading {
    let mut command = format!(
        "cargo run --release -p giotto-tests --bin power -- --per-case {}",
        args.each
    );
    if args.round != 0 {
        command += &format!(" --round {}", args.round);
    }
    if let Some(most) = args.most {
        command += &format!(" --most {most}");
    }
    if args.tune {
        command += " --tune";
    }
    Heading {
        command,
        seeds: if args.tune {
            format!("Seeds {TUNING:?}: thresholds may have been set on these, so these are no results to publish.")
        } else {
            format!("Seeds {PUBLISHED:?}, round {}; tests and thresholds use {TUNING:?} alone.", args.round)
        },
        short: (drawn < all).then(|| {
            format!("A short version: {drawn} of {all} campaigns. Rates of so few say little; read the intervals.")
        }),
    }
}

fn main() -> ExitCode {
    let args = Args::parse();
    let order = Order {
        range: if args.tune { TUNING } else { PUBLISHED },
        round: args.round,
        each: args.each,
        groups: args.group.clone(),
        only: args.only.clone(),
        most: args.most,
    };
    let jobs = schedule(&order);
    let all = schedule(&Order {
        most: None,
        each: FULL,
        ..order
    })
    .len();
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
    let (mut rows, mut refused) = (Vec::new(), Vec::new());
    for answer in answers(&jobs, keep) {
        match answer {
            Ok(row) => rows.push(row),
            Err((group, words)) => {
                refused.push(group);
                eprintln!("{words}");
            }
        }
    }
    let page = page(&rows, &refused, &heading(&args, all, jobs.len()));
    if args.tune || args.only.is_some() || !args.group.is_empty() {
        println!("{page}");
    } else if let Err(e) = std::fs::write(&args.output, &page) {
        eprintln!("{}: {e}", args.output.display());
        return ExitCode::from(2);
    } else {
        println!(
            "{} campaigns, {} without an answer: {}",
            rows.len(),
            refused.len(),
            args.output.display()
        );
    }
    if refused.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(5)
    }
}
