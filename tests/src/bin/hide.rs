//! Writes campaigns with hidden effects and their truth.
//!
//! `hide --effect servo_mismatch --strength 3 --seed 5 -o DIR` (effects joined by `+`, or `null_lag`, …);
//! `hide --row NAME --strength K --seed SEED -o DIR` writes a campaign of the power study by the name of its row
//! (`arm6_joint_zero_4places`, `backlash@arc(220)`, …), as its list of failures gives it; `hide --rows` lists the names;
//! `hide --all DIR` writes every effect at 1 and 3 times the noise, nulls, unlisted effects, pairs, triples.
use clap::Parser;
use giotto_tests::effects::{Case, Keep, Kind, LISTED, Null, UNLISTED};
use giotto_tests::files;
use giotto_tests::machine::base::Variety;
use giotto_tests::study::seeds::TUNING;
use giotto_tests::study::{Order, Recipe, schedule};
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
    /// A row of the power study by name.
    #[arg(long)]
    row: Option<String>,
    /// Lists the rows of the power study.
    #[arg(long)]
    rows: bool,
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

/// Rows of the power study, each once.
fn rows() -> Vec<Recipe> {
    let order = Order {
        range: TUNING,
        round: 0,
        each: 1,
        groups: Vec::new(),
        only: None,
        most: None,
    };
    let mut all: Vec<Recipe> = schedule(&order).into_iter().map(|job| job.kind).collect();
    all.dedup();
    all
}

/// Writes one campaign of a row.
fn write_row(name: &str, args: &Args) -> Result<(), String> {
    let row = rows()
        .into_iter()
        .find(|r| r.to_string() == name)
        .ok_or_else(|| format!("{name}: no such row; --rows lists them"))?;
    let hidden = row
        .hidden(args.strength, args.seed)
        .ok_or_else(|| format!("{name}: no such effect"))?;
    files::write(&hidden, &args.output).map_err(|e| format!("{}: {e}", args.output.display()))
}

fn main() -> std::process::ExitCode {
    let args = Args::parse();
    if args.rows {
        for row in rows() {
            println!("{row}");
        }
        return std::process::ExitCode::SUCCESS;
    }
    if let Some(name) = &args.row {
        return match write_row(name, &args) {
            Ok(()) => {
                println!("seed {}: {}", args.seed, args.output.display());
                std::process::ExitCode::SUCCESS
            }
            Err(words) => {
                eprintln!("{words}");
                std::process::ExitCode::from(2)
            }
        };
    }
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
