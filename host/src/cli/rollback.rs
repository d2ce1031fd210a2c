//! `giotto rollback`: return to the last good table.
use super::{Failure, Output};

/// Arguments of `giotto rollback`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: Args, _out: Output) -> Result<(), Failure> {
    Err(Failure::usage("giotto rollback is not in this build"))
}
