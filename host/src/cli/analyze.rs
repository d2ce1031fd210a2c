//! `giotto analyze`: least-squares circle, radius size error, out-of-roundness, harmonics, ISO 230-4 of each run.
use super::{Failure, Output};

/// Arguments of `giotto analyze`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: Args, _out: Output) -> Result<(), Failure> {
    Err(Failure::usage("giotto analyze is not in this build"))
}
