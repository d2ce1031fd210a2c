//! `giotto diagnose`: what the simulation gets wrong, why, the extended model, the gain.
use super::{Failure, Output};

/// Arguments of `giotto diagnose`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: Args, _out: Output) -> Result<(), Failure> {
    Err(Failure::usage("giotto diagnose is not in this build"))
}
