//! Random bytes at the targets of `giotto_tests::fuzz`: seeded, counted by executions, on any compiler. What it finds, `--replay`
//! shows again.
use clap::Parser;
use giotto_tests::fuzz::{TARGETS, Target};
use giotto_tests::noise::Noise;
use std::num::NonZeroUsize;
use std::panic::catch_unwind;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::Instant;

/// Fuzzes without coverage.
#[derive(Parser, Debug)]
struct Args {
    /// `frame`, `server`, `motion`, `table` or `boot`; all of them if not given.
    #[arg(long)]
    target: Option<String>,
    /// Executions of each target.
    #[arg(long, default_value_t = 100_000)]
    executions: u64,
    /// Seed of the first execution; each has the next.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Threads; all cores if not given. What is found does not depend on it.
    #[arg(long)]
    threads: Option<NonZeroUsize>,
    /// Runs a target on the bytes of a file instead.
    #[arg(long, requires = "target")]
    replay: Option<PathBuf>,
}

/// Executions that a thread takes at once.
const BLOCK: u64 = 256;

/// The first execution in which a defect shows, if there is one, and what was counted.
fn first_defect(target: &Target, args: &Args, threads: usize) -> (Option<u64>, u64) {
    let noise = Noise::new(target);
    let (next, first) = (AtomicU64::new(0), AtomicU64::new(u64::MAX));
    let counted = AtomicU64::new(0);
    // Blocks are taken in order, and each is run until a defect before it is known.
    let work = || loop {
        let begin = next.fetch_add(BLOCK, Relaxed);
        for execution in begin..(begin + BLOCK).min(args.executions) {
            if execution >= first.load(Relaxed) {
                break;
            }
            let bytes = noise.bytes(args.seed.wrapping_add(execution));
            match catch_unwind(|| (target.run)(&bytes)) {
                Ok(count) => counted.fetch_add(count, Relaxed),
                Err(_) => first.fetch_min(execution, Relaxed),
            };
        }
        if begin >= args.executions.min(first.load(Relaxed)) {
            return;
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..threads {
            scope.spawn(work);
        }
        work();
    });
    let first = first.into_inner();
    ((first != u64::MAX).then_some(first), counted.into_inner())
}

fn main() -> ExitCode {
    let args = Args::parse();
    let chosen = |target: &&Target| args.target.as_ref().is_none_or(|name| target.name == name);
    let targets: Vec<&Target> = TARGETS.iter().filter(chosen).collect();
    if targets.is_empty() {
        eprintln!("error: no such target: there are frame, server, motion, table and boot");
        return ExitCode::from(2);
    }
    let cores = || std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let threads = args.threads.map_or_else(cores, NonZeroUsize::get);
    for target in targets {
        if let Some(path) = &args.replay {
            match std::fs::read(path) {
                Ok(bytes) => {
                    (target.run)(&bytes);
                }
                Err(error) => {
                    eprintln!("error: {}: {error}", path.display());
                    return ExitCode::from(3);
                }
            }
            continue;
        }
        let started = Instant::now();
        let (defect, counted) = first_defect(target, &args, threads);
        if let Some(execution) = defect {
            let seed = args.seed.wrapping_add(execution);
            eprintln!(
                "target {}, seed {seed}: bytes {:02x?}",
                target.name,
                Noise::new(target).bytes(seed)
            );
            return ExitCode::from(5);
        }
        let seconds = started.elapsed().as_secs_f64();
        let of = match counted {
            0 => String::new(),
            _ => format!(" of {counted} requests and ticks"),
        };
        println!(
            "{}: {} executions{of} from seed {}, no defect ({seconds:.1} s, {threads} threads)",
            target.name, args.executions, args.seed
        );
    }
    ExitCode::SUCCESS
}
