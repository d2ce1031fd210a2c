//! Writes campaigns with hidden effects and their truth.
//!
//! `hide --effect servo_mismatch --strength 3 --seed 5 -o DIR` (effects joined by `+`, or `null_lag`, …);
//! `hide --all DIR` writes every effect at 1 and 3 times the noise, nulls, unlisted effects, pairs, triples.
use clap::Parser;
use giotto_tests::effects::{Case, Keep, Kind, LISTED, Null, UNLISTED};
use giotto_tests::files;
use giotto_tests::machine::base::Variety;
use rayon::prelude::*;
use std::path::PathBuf;

/// Writes campaigns with hidden effects.
#[derive(Parser)]
struct Args {
    /// Effect by name, several joined by `+`; `null_noise`, `null_spread`, `null_lag`, `null_model`; `permuted_NAME`.
    #[arg(long, default_value = "null_lag")]
    effect: String,
    /// Misfit of each effect in units of the sample noise.
    #[arg(long, default_value_t = 3.0)]
    strength: f64,
    /// Seed of every draw.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Other grids, instruments, spreads than the paper's.
    #[arg(long)]
    broad: bool,
    /// Leaves out most runs: `one-radius`, `one-feed`, `one-direction`, `one-run`.
    #[arg(long, value_parser = keep)]
    keep: Option<Keep>,
    /// Directory to write to.
    #[arg(short, long, default_value = "hidden")]
    output: PathBuf,
    /// Writes one of everything into this directory instead.
    #[arg(long)]
    all: Option<PathBuf>,
}

/// Which runs stay.
fn keep(name: &str) -> Result<Keep, String> {
    match name {
        "one-radius" => Ok(Keep::OneRadius),
        "one-feed" => Ok(Keep::OneFeed),
        "one-direction" => Ok(Keep::OneDirection),
        "one-run" => Ok(Keep::OneRun),
        _ => Err("one of one-radius, one-feed, one-direction, one-run".into()),
    }
}

/// What a name on the command line asks for.
fn kind(name: &str) -> Kind {
    match name {
        "null_noise" => Kind::Null(Null::Noise),
        "null_spread" => Kind::Null(Null::Spread),
        "null_lag" => Kind::Null(Null::Lag),
        "null_model" => Kind::Null(Null::Model),
        other => match other.strip_prefix("permuted_") {
            Some(inner) => Kind::Permuted(inner.to_owned()),
            None => Kind::Effects(other.split('+').map(str::to_owned).collect()),
        },
    }
}

fn main() -> std::process::ExitCode {
    let args = Args::parse();
    let variety = if args.broad {
        Variety::Broad
    } else {
        Variety::Usual
    };
    let mut jobs: Vec<(String, f64, PathBuf)> = Vec::new();
    if let Some(dir) = &args.all {
        let mut add = |name: &str, strength: f64| {
            jobs.push((
                name.to_owned(),
                strength,
                dir.join(format!("{name}_{strength}")),
            ));
        };
        for null in [
            "null_noise",
            "null_spread",
            "null_lag",
            "null_model",
            "permuted_servo_mismatch",
        ] {
            add(null, 3.0);
        }
        for name in LISTED {
            add(name, 1.0);
            add(name, 3.0);
        }
        for name in UNLISTED {
            add(name, 3.0);
        }
        for set in [
            "servo_mismatch+backlash",
            "squareness+scale_mismatch",
            "higher_order_dynamics+scale_mismatch",
            "reversal_spike+servo_mismatch",
            "thermal_drift+scale_error",
            "cyclic_error+straightness",
            "feed_clamp+radius_offset",
            "higher_order_dynamics+scale_mismatch+squareness",
            "servo_mismatch+backlash+squareness",
            "lateral_play+thermal_drift+vibration",
        ] {
            add(set, 3.0);
        }
    } else {
        jobs.push((args.effect.clone(), args.strength, args.output.clone()));
    }
    let failed: Vec<String> = jobs
        .par_iter()
        .filter_map(|(name, strength, dir)| {
            let Some(mut case) = Case::new(&kind(name), *strength, args.seed, variety) else {
                return Some(format!("{name}: no such effect"));
            };
            if let Some(keep) = args.keep {
                keep.thin(&mut case.campaign);
            }
            files::write(&case.hidden(), dir)
                .err()
                .map(|e| format!("{}: {e}", dir.display()))
        })
        .collect();
    for line in &failed {
        eprintln!("{line}");
    }
    println!(
        "seed {}: {} campaigns",
        args.seed,
        jobs.len() - failed.len()
    );
    if failed.is_empty() {
        std::process::ExitCode::SUCCESS
    } else {
        std::process::ExitCode::from(2)
    }
}
