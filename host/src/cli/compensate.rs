//! `giotto compensate`: rewrite the arcs of an NC program with the inverse correction.
use super::{Failure, Output};

/// Arguments of `giotto compensate`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: Args, _out: Output) -> Result<(), Failure> {
    Err(Failure::usage("giotto compensate is not in this build"))
}
