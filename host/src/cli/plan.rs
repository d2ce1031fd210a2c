//! `giotto plan`: the next runs that would best separate what cannot be told apart yet.
use super::{Failure, Output};

/// Arguments of `giotto plan`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: Args, _out: Output) -> Result<(), Failure> {
    Err(Failure::usage("giotto plan is not in this build"))
}
