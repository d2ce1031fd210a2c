//! `giotto table`: model to controller table, and back to words.
use super::{Failure, Output};

/// Arguments of `giotto table`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: Args, _out: Output) -> Result<(), Failure> {
    Err(Failure::usage("giotto table is not in this build"))
}
