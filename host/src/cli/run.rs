//! `giotto run`: execute a path on the controller and record its set-points.
use super::{Failure, Output};

/// Arguments of `giotto run`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: Args, _out: Output) -> Result<(), Failure> {
    Err(Failure::usage("giotto run is not in this build"))
}
