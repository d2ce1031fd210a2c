//! `giotto bypass`: switch the correction off or on.
use super::{Failure, Output};

/// Arguments of `giotto bypass`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: Args, _out: Output) -> Result<(), Failure> {
    Err(Failure::usage("giotto bypass is not in this build"))
}
