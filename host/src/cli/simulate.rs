//! `giotto simulate`: a simulated machine runs the circles of a plan and writes a campaign.
use super::{Failure, Output};

/// Arguments of `giotto simulate`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: Args, _out: Output) -> Result<(), Failure> {
    Err(Failure::usage("giotto simulate is not in this build"))
}
