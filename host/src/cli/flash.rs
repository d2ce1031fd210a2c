//! `giotto flash`: write a table to a controller: inactive slot, read back, commit, confirm.
use super::{Failure, Output};

/// Arguments of `giotto flash`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: Args, _out: Output) -> Result<(), Failure> {
    Err(Failure::usage("giotto flash is not in this build"))
}
