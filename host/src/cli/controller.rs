//! `giotto controller`: start a virtual controller.
use super::{Failure, Output};

/// Arguments of `giotto controller`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: Args, _out: Output) -> Result<(), Failure> {
    Err(Failure::usage("giotto controller is not in this build"))
}
