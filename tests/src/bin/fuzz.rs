//! Random bytes at the targets of `giotto_tests::fuzz`: seeded, counted by executions, on any compiler. What it finds, `--replay`
//! shows again.
use clap::Parser;
use giotto_tests::fuzz::{TARGETS, Target};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Fuzzes without coverage.
#[derive(Parser, Debug)]
struct Args {
    /// `frame`, `server`, `table` or `boot`; all of them if not given.
    #[arg(long)]
    target: Option<String>,
    /// Executions of each target.
    #[arg(long, default_value_t = 100_000)]
    executions: u64,
    /// Seed of the first execution; each has the next.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Runs a target on the bytes of a file instead.
    #[arg(long, requires = "target")]
    replay: Option<PathBuf>,
}

/// Most bytes made up.
const LONGEST: usize = 1500;

/// The bytes of one execution: a seed of the target with some of it changed, cut, repeated, or nothing but noise.
fn bytes(target: &Target, seeds: &[Vec<u8>], random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = match random.random_range(0..8_u8) {
        0 => vec![0; random.random_range(0..200)],
        _ => seeds[random.random_range(0..seeds.len())].clone(),
    };
    if bytes.iter().all(|byte| *byte == 0) {
        random.fill_bytes(&mut bytes);
    }
    for _ in 0..random.random_range(0..6_u8) {
        let at = random.random_range(0..=bytes.len());
        match random.random_range(0..6_u8) {
            0 => bytes.truncate(at),
            1 => bytes.insert(at, random.random()),
            2 => bytes.extend_from_within(..at),
            3 => bytes.extend_from_slice(&seeds[random.random_range(0..seeds.len())]),
            _ => {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte = if random.random() {
                        random.random()
                    } else {
                        *byte ^ 1 << random.random_range(0..8_u8)
                    };
                }
            }
        }
    }
    if target.name == "server" {
        // Steps of a conversation are short: more of them.
        let more = random.random_range(0..24_usize);
        bytes.extend((0..more).map(|_| random.random::<u8>()));
        bytes.truncate(80);
    }
    bytes.truncate(LONGEST);
    bytes
}

fn main() -> ExitCode {
    let args = Args::parse();
    let chosen = |target: &&Target| args.target.as_ref().is_none_or(|name| target.name == name);
    let targets: Vec<&Target> = TARGETS.iter().filter(chosen).collect();
    if targets.is_empty() {
        eprintln!("error: no such target: there are frame, server, table and boot");
        return ExitCode::from(2);
    }
    for target in targets {
        if let Some(path) = &args.replay {
            match std::fs::read(path) {
                Ok(bytes) => (target.run)(&bytes),
                Err(error) => {
                    eprintln!("error: {}: {error}", path.display());
                    return ExitCode::from(3);
                }
            }
            continue;
        }
        let seeds = (target.seeds)();
        let started = Instant::now();
        for execution in 0..args.executions {
            let seed = args.seed.wrapping_add(execution);
            let bytes = bytes(target, &seeds, &mut ChaCha8Rng::seed_from_u64(seed));
            let outcome = std::panic::catch_unwind(|| (target.run)(&bytes));
            if outcome.is_err() {
                eprintln!("target {}, seed {seed}: bytes {bytes:02x?}", target.name);
                return ExitCode::from(5);
            }
        }
        let seconds = started.elapsed().as_secs_f64();
        println!(
            "{}: {} executions from seed {}, no defect ({seconds:.1} s)",
            target.name, args.executions, args.seed
        );
    }
    ExitCode::SUCCESS
}
