//! `giotto import`: foreign measurements into a campaign.
use super::{Failure, Output};

/// Arguments of `giotto import`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: Args, _out: Output) -> Result<(), Failure> {
    Err(Failure::usage("giotto import is not in this build"))
}
