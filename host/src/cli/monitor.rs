//! `giotto monitor`: live view of the controller in the terminal.
use super::{Failure, Output};

/// Arguments of `giotto monitor`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: Args, _out: Output) -> Result<(), Failure> {
    Err(Failure::usage("giotto monitor is not in this build"))
}
