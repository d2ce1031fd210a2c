//! `giotto calibrate`: plan, run, record the machine's own feedback, diagnose, flash, prove, and take the table back if it
//! does not help.
//!
//! | file | holds |
//! |---|---|
//! | `limits` | how far and how fast, and which circles |
//! | `machine` | what is moved, and what measures it |
//! | `linuxcnc` | the machine behind a LinuxCNC |
//! | `before` | what the controller kept before, and its return |
//! | `shown` | words, table and JSON |
mod before;
mod limits;
mod linuxcnc;
mod machine;
mod shown;

use super::choice::whole;
use super::port::PortArgs;
use super::source::length;
use super::{Failure, Output, interrupt};
use crate::ring::Size;
use before::Before;
use giotto::diagnosis::{self, diagnose};
use giotto::table_from_model::table_from_model;
use giotto_link::Controller;
use limits::Limits;
use machine::Behind;
use std::io::{BufRead, IsTerminal, Write};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// Arguments of `giotto calibrate`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(flatten)]
    port: PortArgs,
    /// The machine behind `sim` or `qemu`: a plan of `giotto simulate`, of which machine and instrument count; without it the
    /// demo's.
    #[arg(long, value_name = "PLAN.toml")]
    machine: Option<PathBuf>,
    /// What measures: the encoders of the slides, or a ballbar at the tool.
    #[arg(long, value_enum, default_value = "encoders")]
    measure: Eyes,
    /// Largest radius; without it 150 mm, less where the controller's soft limits are nearer.
    #[arg(long, value_name = "MM", value_parser = length)]
    max_radius: Option<f64>,
    /// Highest feed; without it the controller's.
    #[arg(long, value_name = "MM_S", value_parser = length)]
    max_feed: Option<f64>,
    /// Highest centripetal acceleration; without it the controller's.
    #[arg(long, value_name = "MM_S2", value_parser = length)]
    max_acceleration: Option<f64>,
    /// Where the campaigns of LinuxCNC are kept, a folder that is not there yet; without it they are forgotten.
    #[arg(long, short, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Seed of every random draw.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u64>)]
    seed: u64,
    /// Move and flash without asking.
    #[arg(long, short)]
    yes: bool,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum Eyes {
    Encoders,
    Ballbar,
}

/// Least share of the size error that has to go, or the table is taken back.
const LEAST_GAIN: f64 = 0.5;
/// What is below this is left as it is, m rms.
const SMALL_M: f64 = 0.5e-6;
/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let machine = machine::behind(&args)?;
    let mut controller = args.port.open(out)?;
    let limits = Limits::of(&args, &machine, &mut controller)?;
    shown::propose(&limits, &controller, machine.is_simulated(), out);
    agreed(args.yes, "Move the machine", "nothing was done", out)?;
    let before = Before::of(&mut controller)?;
    let wish = interrupt::listen();
    controller.stop_on(wish.clone());
    let kept = ring(&args, &machine, &mut controller, &limits, &wish, out);
    if matches!(kept, Ok(true)) {
        return Ok(());
    }
    // Whatever went wrong, the controller corrects as it did before.
    before.restore(&mut controller)?;
    match kept {
        _ if wish.load(Relaxed) => Err(Failure::interrupted(
            "stopped: the controller corrects as it did before",
        )),
        Err(failure) => Err(failure),
        Ok(_) => Err(Failure::check(format_args!(
            "the size error should fall by {:.0} % and the out-of-roundness should not grow: the table was taken back",
            LEAST_GAIN * 100.0
        ))),
    }
}

/// Measures, diagnoses, flashes, proves; whether the table is to be kept.
fn ring(
    args: &Args,
    machine: &Behind,
    controller: &mut Controller,
    limits: &Limits,
    wish: &AtomicBool,
    out: Output,
) -> Result<bool, Failure> {
    let bar = out.spinner("measuring");
    let campaign = machine.measure(controller, &limits.circles(), args.seed, wish);
    bar.finish_and_clear();
    let campaign = campaign?;
    let bar = out.spinner("diagnosing");
    let options = diagnosis::Options {
        seed: args.seed,
        ..diagnosis::Options::default()
    };
    let found = diagnose(&campaign, &options);
    bar.finish_and_clear();
    let found = found.map_err(|error| Failure::input(format_args!("the runs: {error}")))?;
    shown::found(&found, out);
    if !found.worth_writing {
        let words = format!("nothing to flash: {}", found.recommendation.words);
        return Err(Failure::check(words));
    }
    agreed(
        args.yes,
        "Flash it, and run circles that were not measured",
        "nothing was flashed",
        out,
    )?;
    let table = table_from_model(&found.model)
        .map_err(|error| Failure::input(format_args!("the model has no table: {error}")))?;

    let bar = out.spinner("proving");
    let proof = machine.prove(controller, &table.table, &limits.proof(), args.seed, wish);
    bar.finish_and_clear();
    let proof = proof?;
    let kept = helps(proof.before(), proof.after());
    if out.json {
        let simulated = machine.is_simulated();
        out.document(&shown::document(
            args, controller, limits, &found, &proof, kept, simulated,
        ))?;
    } else {
        shown::proof(&proof, args, out);
    }
    Ok(kept)
}

/// Asks at a terminal; elsewhere `--yes` has to have been said. `otherwise` is how things stand without it.
fn agreed(yes: bool, question: &str, otherwise: &str, out: Output) -> Result<(), Failure> {
    if yes {
        return Ok(());
    }
    if out.json || out.non_interactive || !std::io::stdin().is_terminal() {
        return Err(Failure::usage(format_args!("{question}: nobody to ask"))
            .help("--yes agrees beforehand"));
    }
    let mut stderr = std::io::stderr();
    // A terminal that takes no words takes no answer either.
    let _ = write!(stderr, "{question} (y/N)? ");
    let _ = stderr.flush();
    let mut line = String::new();
    let read = std::io::stdin().lock().read_line(&mut line).unwrap_or(0);
    if read > 0 && matches!(line.trim(), "y" | "Y" | "yes") {
        return Ok(());
    }
    Err(Failure::interrupted(format_args!(
        "not agreed: {otherwise}"
    )))
}

/// Whether a table has earned its place.
fn helps(before: Size, after: Size) -> bool {
    let left = after.radius_error_rms_m;
    let smaller = left <= (1.0 - LEAST_GAIN) * before.radius_error_rms_m || left <= SMALL_M;
    smaller && after.out_of_roundness_m <= before.out_of_roundness_m + SMALL_M
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_without_gain_goes_back() {
        let um = |radius: f64, round: f64| Size {
            radius_error_rms_m: radius * 1e-6,
            out_of_roundness_m: round * 1e-6,
        };
        assert!(helps(um(90.0, 40.0), um(0.3, 7.0)));
        assert!(helps(um(0.6, 7.0), um(0.4, 7.2)));
        assert!(!helps(um(90.0, 40.0), um(60.0, 7.0)));
        assert!(!helps(um(90.0, 7.0), um(0.3, 9.0)));
        assert!(!helps(um(90.0, 7.0), um(f64::NAN, 7.0)));
    }
}
