//! The command line: one file a command; arguments in, tables or one JSON document out.
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

mod analyze;
mod bounds_in_words;
mod bridge;
mod bypass;
mod calibrate;
mod campaign_edit;
mod choice;
mod compare;
mod compensate;
mod completions;
mod config;
mod controller;
mod demo;
pub mod destination;
mod diagnose;
mod feed;
mod fit;
mod flash;
mod grid;
mod history;
mod import;
mod interrupt;
mod key;
mod kinematics;
mod log;
mod man;
mod monitor;
mod paragraph;
mod plan;
mod port;
mod proof_shown;
mod report;
mod reset;
mod rollback;
mod run;
mod simulate;
mod start;
mod status;
mod stop;
mod table;
mod table_file;
mod verify;
mod welcome;

pub mod failure;
pub mod output;
pub mod ring;
pub mod source;

pub use failure::Failure;
pub use output::Output;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use std::process::ExitCode;

/// True circles from robots and machine tools: measure, explain, compensate, prove.
#[derive(Parser, Debug)]
#[command(name = "giotto", version, about, propagate_version = true)]
struct Cli {
    /// Print one JSON document on stdout and nothing else; what goes on (monitor, log) prints one a line.
    #[arg(long, global = true)]
    json: bool,
    /// Print results and errors only.
    #[arg(long, short, global = true)]
    quiet: bool,
    /// Never ask and never draw progress, whatever the terminal.
    #[arg(long, global = true)]
    non_interactive: bool,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// The first time, by questions: two files to a provisional verdict.
    Start(start::Args),
    /// Foreign measurements into a campaign.
    Import(import::Args),
    /// List, change and remove the runs of a campaign.
    Campaign(campaign_edit::Args),
    /// Least-squares circle, radius size error, out-of-roundness, harmonics, ISO 230-4 of each run.
    Analyze(analyze::Args),
    /// The radius model of the paper: stepwise partial F, intervals, prediction of other radii.
    Fit(fit::Args),
    /// A simulated machine runs the circles of a plan and writes a campaign.
    Simulate(simulate::Args),
    /// What the simulation gets wrong, why, the extended model, the gain.
    Diagnose(diagnose::Args),
    /// The next runs that would best separate what cannot be told apart yet.
    Plan(plan::Args),
    /// What changed between campaigns, figure by figure, cause by cause, with intervals.
    Compare(compare::Args),
    /// Every campaign of a folder diagnosed and kept; what drifts, what stepped.
    History(history::Args),
    /// Self-contained HTML report with plots.
    Report(report::Args),
    /// Rewrite the arcs of an NC program with the inverse correction.
    Compensate(compensate::Args),
    /// The lengths of an arm, as a campaign wants them, from its URDF.
    Kinematics(kinematics::Args),
    /// Model to controller table, and back to words.
    Table(table::Args),
    /// Write a table to a controller: inactive slot, read back, commit, confirm.
    Flash(flash::Args),
    /// Keys that tables are signed with.
    Key(key::Args),
    /// The controller's state and slots.
    Status(status::Args),
    /// Return to the last good table.
    Rollback(rollback::Args),
    /// Compare the table on the controller with a file.
    Verify(verify::Args),
    /// Switch the correction off or on.
    Bypass(bypass::Args),
    /// Stop what runs, within the limits.
    Stop(stop::Args),
    /// Clear a fault without losing the position, or say where the machine stands.
    Reset(reset::Args),
    /// Feed hold, resume, override of the feed.
    Feed(feed::Args),
    /// What has happened on the controller, in words.
    Log(log::Args),
    /// The limits that a controller keeps.
    Config(config::Args),
    /// Execute a path on the controller and record its set-points.
    Run(run::Args),
    /// Live view of the controller in the terminal.
    Monitor(monitor::Args),
    /// Corrected set-points to a robot controller over its own protocol.
    Bridge(bridge::Args),
    /// Start a virtual controller.
    Controller(controller::Args),
    /// Plan, run, record, diagnose, flash and prove in one go; take the table back without gain.
    Calibrate(calibrate::Args),
    /// The whole loop on a bundled campaign and a simulated machine.
    Demo(demo::Args),
    /// Script that completes commands and options in a shell.
    Completions(completions::Args),
    /// Manual pages, one a command.
    Man(man::Args),
}

fn dispatch(command: Command, out: Output) -> Result<(), Failure> {
    match command {
        Command::Start(args) => start::run(args, out),
        Command::Import(args) => import::run(args, out),
        Command::Campaign(args) => campaign_edit::run(args, out),
        Command::Analyze(args) => analyze::run(args, out),
        Command::Fit(args) => fit::run(args, out),
        Command::Simulate(args) => simulate::run(args, out),
        Command::Diagnose(args) => diagnose::run(args, out),
        Command::Plan(args) => plan::run(args, out),
        Command::Compare(args) => compare::run(args, out),
        Command::History(args) => history::run(args, out),
        Command::Report(args) => report::run(args, out),
        Command::Compensate(args) => compensate::run(args, out),
        Command::Kinematics(args) => kinematics::run(args, out),
        Command::Table(args) => table::run(args, out),
        Command::Flash(args) => flash::run(args, out),
        Command::Key(args) => key::run(args, out),
        Command::Status(args) => status::run(args, out),
        Command::Rollback(args) => rollback::run(args, out),
        Command::Verify(args) => verify::run(args, out),
        Command::Bypass(args) => bypass::run(args, out),
        Command::Stop(args) => stop::run(args, out),
        Command::Reset(args) => reset::run(args, out),
        Command::Feed(args) => feed::run(args, out),
        Command::Log(args) => log::run(args, out),
        Command::Config(args) => config::run(args, out),
        Command::Run(args) => run::run(args, out),
        Command::Monitor(args) => monitor::run(args, out),
        Command::Bridge(args) => bridge::run(args, out),
        Command::Controller(args) => controller::run(args, out),
        Command::Calibrate(args) => calibrate::run(args, out),
        Command::Demo(args) => demo::run(args, out),
        Command::Completions(args) => completions::run(args, Cli::command(), out),
        Command::Man(args) => man::run(args, Cli::command(), out),
    }
}

/// Options take numbers below zero, so that one that may not be is refused by its range and not as an unknown option.
fn below_zero(command: clap::Command) -> clap::Command {
    command
        .mut_args(|arg| {
            let takes = arg.get_action().takes_values() && !arg.is_positional();
            if takes {
                arg.allow_negative_numbers(true)
            } else {
                arg
            }
        })
        .mut_subcommands(below_zero)
}

/// Runs the command line of this process.
pub fn main() -> ExitCode {
    let given = below_zero(Cli::command()).try_get_matches();
    let cli = match given.and_then(|given| Cli::from_arg_matches(&given)) {
        Ok(cli) => cli,
        Err(words) => return told(&words),
    };
    let out = Output {
        json: cli.json,
        quiet: cli.quiet,
        non_interactive: cli.non_interactive,
    };
    let Some(command) = cli.command else {
        let words = welcome::words(std::path::Path::new("."));
        if out.json {
            return shown(out.document(&serde_json::json!({ "words": words })));
        }
        out.say(words);
        return shown(Ok(()));
    };
    shown(dispatch(command, out))
}

/// Help, version or wrong usage: to stdout or stderr, with the exit code that belongs to it.
fn told(words: &clap::Error) -> ExitCode {
    match words.print() {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Failure::input(format_args!("stdout: {error}")).report()
        }
        _ if words.use_stderr() => ExitCode::from(2),
        _ => shown(Ok(())),
    }
}

fn shown(result: Result<(), Failure>) -> ExitCode {
    match result.and_then(|()| output::finish()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
