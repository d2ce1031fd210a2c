//! `giotto verify`: compare the table on the controller with a file.
use super::{Failure, Output};

/// Arguments of `giotto verify`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: Args, _out: Output) -> Result<(), Failure> {
    Err(Failure::usage("giotto verify is not in this build"))
}
