//! `giotto report`: self-contained HTML report with plots.
use super::{Failure, Output};

/// Arguments of `giotto report`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: Args, _out: Output) -> Result<(), Failure> {
    Err(Failure::usage("giotto report is not in this build"))
}
