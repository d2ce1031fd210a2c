//! Made-up programs before LinuxCNC's interpreter: `nc` writes `tests/NC.md`.
//!
//! Each program is corrected; original and output are run by `rs274`, and their canonical calls compared. Needs Debian's
//! `linuxcnc-uspace`, or `GIOTTO_RS274`. About 0.1 s of a core each.
use clap::Parser;
use giotto_tests::nc::canon::Rs274;
use giotto_tests::nc::judge;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Corrects made-up programs and compares what LinuxCNC makes of them.
#[derive(Parser)]
struct Args {
    /// Programs.
    #[arg(long, default_value_t = 10_000)]
    count: u64,
    /// Seed of the first.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Begin no program behind so many minutes; the page says how many there were.
    #[arg(long)]
    minutes: Option<u64>,
    /// Print instead of writing the page.
    #[arg(long)]
    print: bool,
}

/// Programs that are worked on together.
const CHUNK: usize = 200;

fn main() -> ExitCode {
    let args = Args::parse();
    let Some(rs274) = Rs274::find() else {
        eprintln!(
            "error: no rs274; apt-get install --no-install-recommends linuxcnc-uspace, or name it by GIOTTO_RS274"
        );
        return ExitCode::from(2);
    };
    let begin = Instant::now();
    let limit = args.minutes.map(|m| Duration::from_secs(60 * m));
    let seeds: Vec<u64> = (args.seed..args.seed + args.count).collect();
    let mut outcomes = Vec::new();
    for seeds in seeds.chunks(CHUNK) {
        if limit.is_some_and(|limit| begin.elapsed() > limit) {
            break;
        }
        let some: Vec<_> = seeds.par_iter().map(|seed| judge(&rs274, *seed)).collect();
        for words in some.iter().filter_map(|o| o.as_ref().err()) {
            eprintln!("{words}\n");
        }
        outcomes.extend(some);
        eprintln!(
            "{} programs in {:.0} s",
            outcomes.len(),
            begin.elapsed().as_secs_f64()
        );
    }
    let count = outcomes.len();
    let (mut corrected, mut left, mut run, mut wrong, mut whole) = (0, 0, 0, 0, 0);
    let mut reasons: BTreeMap<String, usize> = BTreeMap::new();
    for outcome in &outcomes {
        match outcome {
            Ok(o) => {
                corrected += o.corrected;
                left += o.left;
                run += usize::from(o.runs);
                whole += usize::from(o.corrected == 0);
                for reason in &o.reasons {
                    // Without the line, and without the code that a letter stands before.
                    let kind = reason.split(" in line").next().unwrap_or_default();
                    *reasons.entry(kind.to_owned()).or_default() += 1;
                }
            }
            Err(_) => wrong += 1,
        }
    }
    let mut page = format!(
        "# Made-up programs before LinuxCNC's interpreter\n\n`cargo run --release -p giotto-tests --bin nc -- --count {} --seed {}`: {count} programs. In {whole} of them nothing was corrected, and the \
         output is the original to the byte; of the others {run} run to their end as they are. {corrected} arcs corrected, {left} left. Programs whose output differs in anything but arcs and their entries, \
         stops where the original does not, or is refused by a 32-bit reader with the rules of Grbl where the original is not: **{wrong}**.\n\n\
         | left because | arcs |\n|---|---|\n",
        count, args.seed
    );
    let mut sorted: Vec<_> = reasons.into_iter().collect();
    sorted.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    for (reason, count) in sorted.iter().take(40) {
        page += &format!("| {reason} | {count} |\n");
    }
    if args.print {
        println!("{page}");
    } else if let Err(error) = std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/NC.md"), &page)
    {
        eprintln!("error: NC.md: {error}");
        return ExitCode::from(3);
    } else {
        println!("NC.md: {wrong} of {count} programs differ");
    }
    ExitCode::from(if wrong > 0 { 5 } else { 0 })
}
