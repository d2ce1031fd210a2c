//! `giotto status`: the controller's state and slots.
use super::{Failure, Output};

/// Arguments of `giotto status`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: Args, _out: Output) -> Result<(), Failure> {
    Err(Failure::usage("giotto status is not in this build"))
}
