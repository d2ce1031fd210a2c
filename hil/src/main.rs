//! Hardware in the loop: what a controller is made to stand, and what its tick costs.
#![forbid(unsafe_code)]

use clap::{Parser, Subcommand};
use giotto_hil::faults;
use giotto_hil::linuxcnc::{self, LinuxCncError};
use giotto_hil::scenarios::{self, Outcome};
use giotto_hil::ticks::{self, Counts, TERMS};
use giotto_hil::{link, rate, size, streams};
use giotto_link::ControllerError;
use giotto_link::{Board, OpenOptions, Port, open};
use serde_json::{Value, json};
use std::path::PathBuf;
use std::process::ExitCode;

/// Scenarios on the giotto controller.
#[derive(Parser, Debug)]
#[command(version, about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Instructions of every kind of tick, and of the whole timer interrupt, on the M4F image under QEMU; and what the image takes.
    Ticks {
        /// One JSON document.
        #[arg(long)]
        json: bool,
        /// Exit code 5 unless every bar is met.
        #[arg(long)]
        check: bool,
    },
    /// Runs every scenario on a controller. The machine on a real port moves: circles of up to 100 mm about the origin.
    Run {
        /// Serial device, `sim`, `qemu` or `qemu:stm32f405`.
        #[arg(long)]
        port: String,
        /// Baud rate of a serial device.
        #[arg(long, default_value_t = giotto_link::port::BAUD)]
        baud: u32,
        /// Firmware image for QEMU, instead of the one of this workspace.
        #[arg(long)]
        image: Option<PathBuf>,
        /// The flash is known not to keep what it is given: tables must be refused.
        #[arg(long)]
        worn_flash: bool,
        /// One JSON document.
        #[arg(long)]
        json: bool,
    },
    /// Ticks a second that the 25 MHz image reaches with time to spare, and the time to flash a table.
    Rate {
        /// One JSON document.
        #[arg(long)]
        json: bool,
        /// Exit code 5 unless every bar is met.
        #[arg(long)]
        check: bool,
    },
    /// Bytes a second of the largest table on the emulated line, beside a raw echo of as many bytes.
    Link {
        /// One JSON document.
        #[arg(long)]
        json: bool,
        /// Exit code 5 unless the bar is met.
        #[arg(long)]
        check: bool,
    },
    /// The loop closed in LinuxCNC: measured, diagnosed, flashed into the running component, measured again.
    Linuxcnc {
        /// The component; without it the one that was built beside this program.
        #[arg(long)]
        component: Option<PathBuf>,
        /// The play of the machine lies behind its servo instead of ahead of it.
        #[arg(long)]
        play_behind: bool,
        /// What LinuxCNC may ask of an axis, mm/s²; its drive can do 30000.
        #[arg(long, value_name = "MM_S2", default_value_t = linuxcnc::ACCELERATION)]
        max_acceleration: f64,
        /// Fewer circles, in one plane, and no rewritten programs: three minutes instead of twelve.
        #[arg(long)]
        short: bool,
        /// Programs, samples and campaigns stay in this folder.
        #[arg(long, value_name = "FOLDER")]
        keep: Option<PathBuf>,
        /// One JSON document.
        #[arg(long)]
        json: bool,
        /// Exit code 5 unless every bar is met, and where there is no LinuxCNC.
        #[arg(long)]
        check: bool,
        /// With --check: no failure where there is no LinuxCNC, which is said with its reason.
        #[arg(long)]
        may_skip: bool,
    },
    /// What an image takes in flash and RAM, its deepest stack, and whether its tick can panic.
    Size {
        /// The board: `mps2_an386` or `stm32f405`; only the first one's stack can be measured.
        #[arg(long, default_value = "mps2_an386")]
        board: String,
        /// The image that checks signatures of tables.
        #[arg(long)]
        signed: bool,
        /// One JSON document.
        #[arg(long)]
        json: bool,
        /// Exit code 5 unless every bar is met.
        #[arg(long)]
        check: bool,
    },
    /// Flashes tables and runs programs over a link that breaks a tenth of what passes; fails if a wrong table is ever in use
    /// or a program ends elsewhere.
    Faults {
        /// Frames to send.
        #[arg(long, default_value_t = 100_000)]
        frames: u64,
        /// Share of pieces broken.
        #[arg(long, default_value_t = 0.1)]
        share: f64,
        /// Seed of the faults.
        #[arg(long, default_value_t = 1)]
        seed: u64,
    },
}

fn main() -> ExitCode {
    let done = match Cli::parse().command {
        Command::Ticks { json, check } => run_ticks(json, check),
        Command::Run {
            port,
            baud,
            image,
            worn_flash,
            json,
        } => run_scenarios(&port, &OpenOptions { image, baud }, worn_flash, json),
        Command::Link { json, check } => run_link(json, check),
        Command::Linuxcnc {
            component,
            play_behind,
            max_acceleration,
            short,
            keep,
            json,
            check,
            may_skip,
        } => {
            let setup = linuxcnc::Setup {
                component: component.unwrap_or_else(|| beside("libgiotto_linuxcnc.so")),
                giotto: beside("giotto"),
                play: if play_behind {
                    linuxcnc::Play::Behind
                } else {
                    linuxcnc::Play::Ahead
                },
                acceleration: max_acceleration,
                short,
                keep,
            };
            return run_linuxcnc(&setup, json, check, may_skip);
        }
        Command::Rate { json, check } => run_rate(json, check),
        Command::Size {
            board,
            signed,
            json,
            check,
        } => run_size(&board, signed, json, check),
        Command::Faults {
            frames,
            share,
            seed,
        } => run_faults(frames, share, seed),
    };
    match done {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error}");
            if let Some(help) = error.help() {
                eprintln!(" help: {help}");
            }
            ExitCode::from(4)
        }
    }
}

fn range(counts: &Counts, name: &str) -> Value {
    match counts.get(name) {
        Some((min, max)) => json!({ "min": min, "max": max }),
        None => Value::Null,
    }
}

fn run_ticks(as_json: bool, check: bool) -> Result<ExitCode, ControllerError> {
    let mut note = |text: &str| eprintln!("{text}");
    let counts = ticks::count(&mut note)?;
    let image = ticks::image_size(&mut note)?;
    let over = ticks::over(&counts);
    let verdict = if check && !over.is_empty() {
        ExitCode::from(5)
    } else {
        ExitCode::SUCCESS
    };
    if as_json {
        let mut extended = range(&counts, "arc_extended");
        extended["terms"] = json!(TERMS);
        let document = json!({
            "arc_beta": range(&counts, "arc_beta"),
            "arc_beta_steady": range(&counts, "arc_beta_steady"),
            "arc_extended": extended,
            "arc_extended_steady": range(&counts, "arc_extended_steady"),
            "stream": range(&counts, "stream"),
            "naive_libm": range(&counts, "naive_libm"),
            "interrupt": range(&counts, "interrupt"),
            "interrupt_stop": range(&counts, "interrupt_stop"),
            "interrupt_stopping": range(&counts, "interrupt_stopping"),
            "naive_nalgebra": range(&counts, "naive_nalgebra"),
            "naive_idsp": range(&counts, "naive_idsp"),
            "image": { "text_bytes": image.text, "ram_bytes": image.ram, "stack_bytes": image.stack },
        });
        println!("{document:#}");
        return Ok(verdict);
    }
    println!("instructions of one tick, compute only (emulated Cortex-M4F)");
    for (name, (min, max)) in &counts {
        let bar = match ticks::bar(name) {
            Some(bar) if *max > bar => format!("   over the bar of {bar}"),
            Some(bar) => format!("   bar {bar}"),
            None => String::new(),
        };
        println!("  {name:20} {min:5} to {max:5}{bar}");
    }
    println!(
        "image: {} bytes text, {} RAM with a stack of {}",
        image.text, image.ram, image.stack
    );
    Ok(verdict)
}

fn run_scenarios(
    port: &str,
    options: &OpenOptions,
    worn_flash: bool,
    as_json: bool,
) -> Result<ExitCode, ControllerError> {
    let Ok(port) = port.parse::<Port>();
    let mut note = |text: &str| eprintln!("{text}");
    let mut controller = open(&port, options, &mut note)?;
    let (mut failed, mut done) = (0, Vec::new());
    for scenario in scenarios::ALL.iter().chain(&streams::ALL) {
        let outcome = scenarios::run(scenario, &mut controller);
        let good = match outcome {
            Outcome::Passed => true,
            Outcome::RefusedByFlash => worn_flash,
            Outcome::Failed(_) => false,
        };
        failed += usize::from(!good);
        let words = match &outcome {
            Outcome::Passed => "passed".to_owned(),
            Outcome::RefusedByFlash => "refused: the flash does not read back".to_owned(),
            Outcome::Failed(how) => format!("failed: {how}"),
        };
        if !as_json {
            println!(
                "{} {}: {words}",
                if good { "ok    " } else { "FAILED" },
                scenario.0
            );
        }
        done.push(json!({ "scenario": scenario.0, "ok": good, "outcome": words }));
    }
    if as_json {
        let identity = controller.identity();
        let document =
            json!({ "board": identity.board, "build": identity.build, "scenarios": done });
        println!("{document:#}");
    }
    Ok(if failed == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(5)
    })
}

fn run_link(as_json: bool, check: bool) -> Result<ExitCode, ControllerError> {
    let report = link::measure(&mut |text: &str| eprintln!("{text}"))?;
    if as_json {
        println!("{:#}", report.document());
    } else {
        let [table, echo, percent] = report.rates();
        let bytes = report.table_bytes;
        println!(
            "table of {bytes} bytes: {table:.0} bytes/s, raw echo {echo:.0} bytes/s: {percent:.1} % (bar {} %)",
            link::BAR_PERCENT
        );
    }
    Ok(if check && !report.meets_bar() {
        ExitCode::from(5)
    } else {
        ExitCode::SUCCESS
    })
}

/// What cargo has built beside this program.
fn beside(name: &str) -> PathBuf {
    let mut path = std::env::current_exe().unwrap_or_default();
    path.pop();
    path.join(name)
}

fn run_linuxcnc(setup: &linuxcnc::Setup, as_json: bool, check: bool, may_skip: bool) -> ExitCode {
    let report = match linuxcnc::run(setup, &mut |text: &str| eprintln!("{text}")) {
        Ok(report) => report,
        Err(error) => {
            eprintln!("{error}");
            let skipped = matches!(error, LinuxCncError::Skipped(_));
            return ExitCode::from(if skipped && (may_skip || !check) {
                0
            } else {
                5
            });
        }
    };
    if as_json {
        println!("{:#}", report.document());
    } else {
        println!(
            "                     radius error, rms    out-of-roundness, mean    contour of the part, largest"
        );
        let compensated = report.compensated.as_ref();
        for (name, left) in [
            ("without", Some(&report.before)),
            ("component", Some(&report.component)),
            ("compensate", compensated),
        ] {
            let Some(left) = left else { continue };
            let ([radius, round, contour], [less, rounder, nearer]) =
                (left.figures_um(), left.gains_percent(&report.before));
            println!(
                "{name:12} {radius:12.2} um {less:7.2} % {round:12.2} um {rounder:7.1} % {contour:14.2} um {nearer:7.1} %"
            );
        }
        let [median, longest] = report.update_us;
        println!(
            "update: {median:.2} us median, {longest:.2} us at most; {} runs diagnosed",
            report.runs
        );
        let [before, after] = report.touched;
        println!(
            "output not the input to the bit: {before} ticks before the first enable, {after} after the last; contour under bypass {:.2} um",
            report.bypassed_um
        );
        let [bare, corrected] = report.hardest_mm_s2.map(|pull| pull * 1e-3);
        println!(
            "a drive is pulled with {bare:.2} m/s2 on the part without correction, with {corrected:.2} with it"
        );
        for command in &report.commands {
            println!("did: {command}");
        }
        for finding in &report.findings {
            println!("found: {finding}");
        }
    }
    ExitCode::from(if check && !report.meets_bars() { 5 } else { 0 })
}

fn run_rate(as_json: bool, check: bool) -> Result<ExitCode, ControllerError> {
    let report = rate::measure(&mut |text: &str| eprintln!("{text}"))?;
    if as_json {
        println!("{:#}", report.document());
    } else {
        println!(
            "{} ticks/s with {:.1} % idle, {} late (bar: {} with {} %)",
            report.tick_hz,
            report.idle_percent,
            report.overruns,
            rate::RATE_BAR_HZ,
            rate::IDLE_BAR_PERCENT
        );
        println!(
            "flash, read back, commit, confirm and verify of {} bytes: {:.3} s by the clock, {:.3} s by its ticks \
             (bar: {} s)",
            report.table_bytes,
            report.flash_s,
            report.flash_controller_s,
            rate::FLASH_BAR_S
        );
    }
    Ok(if check && !report.meets_bars() {
        ExitCode::from(5)
    } else {
        ExitCode::SUCCESS
    })
}

fn run_size(
    board: &str,
    signed: bool,
    as_json: bool,
    check: bool,
) -> Result<ExitCode, ControllerError> {
    let Some(board) = Board::named(board) else {
        eprintln!("error: no board {board}: there are mps2_an386 and stm32f405");
        return Ok(ExitCode::from(2));
    };
    let report = size::measure(
        board,
        if signed { &["signed"] } else { &[] },
        &mut |text: &str| eprintln!("{text}"),
    )?;
    if as_json {
        println!("{:#}", report.document());
    } else {
        println!("image {}", report.board.name());
        println!("  text      {:6} bytes of {}", report.text, size::TEXT_BAR);
        println!(
            "  RAM       {:6} bytes of {}: {} of variables, {} of stack at the deepest",
            report.ram(),
            size::RAM_BAR,
            report.variables,
            report.stack
        );
        println!("  panics in the image: {}", names(report.panics.iter()));
        println!(
            "  panics that the tick can reach: {}",
            names(report.panics_in_tick().iter())
        );
        println!(
            "  calls of the tick through pointers: {}",
            names(report.tick.indirect.iter())
        );
    }
    Ok(if check && !report.meets_bars() {
        ExitCode::from(5)
    } else {
        ExitCode::SUCCESS
    })
}

fn names(names: impl Iterator<Item = impl std::fmt::Display>) -> String {
    let names: Vec<String> = names.map(|name| name.to_string()).collect();
    if names.is_empty() {
        "none".to_owned()
    } else {
        names.join(", ")
    }
}

fn run_faults(frames: u64, share: f64, seed: u64) -> Result<ExitCode, ControllerError> {
    let broken = |tally: &faults::Tally| {
        let kinds = tally
            .broken()
            .map(|(fault, count)| format!("{fault:?} {count}").to_lowercase());
        println!("broken: {}", kinds.join(", "));
    };
    let report = faults::flash_over_faults(frames, share, seed)?;
    println!(
        "seed {seed}: {} frames sent, {:.0} % of {} pieces broken, {} tables flashed, {} flashes begun anew, \
         {} requests repeated, {} wrong tables in use",
        report.tally.frames_sent(),
        share * 100.0,
        report.tally.pieces(),
        report.flashes,
        report.retries,
        report.repeats,
        report.wrong
    );
    broken(&report.tally);
    let paths = faults::programs_over_faults(frames / 4, share, seed)?;
    println!(
        "seed {seed}: {} frames sent, {} programs run, {} given up, {} requests repeated, {} programs astray",
        paths.tally.frames_sent(),
        paths.programs,
        paths.given_up,
        paths.repeats,
        paths.astray
    );
    broken(&paths.tally);
    let good = report.wrong + paths.astray == 0 && report.flashes > 0 && paths.programs > 0;
    Ok(if good {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(5)
    })
}
