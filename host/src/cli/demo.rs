//! `giotto demo`: the whole loop on a bundled campaign and a simulated machine.
use super::{Failure, Output};

/// Arguments of `giotto demo`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: Args, _out: Output) -> Result<(), Failure> {
    Err(Failure::usage("giotto demo is not in this build"))
}
