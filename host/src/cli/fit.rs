//! `giotto fit`: the radius model of the paper: stepwise partial F, intervals, prediction of other radii.
use super::{Failure, Output};

/// Arguments of `giotto fit`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: Args, _out: Output) -> Result<(), Failure> {
    Err(Failure::usage("giotto fit is not in this build"))
}
