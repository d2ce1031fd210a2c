//! `giotto run`: execute a path on the controller and record its set-points.
mod circle;
mod program;
mod set_points;
mod stream;
mod stream_file;

use super::{Failure, Output};

/// Arguments of `giotto run`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(subcommand)]
    path: Path,
}

#[derive(clap::Subcommand, Debug)]
enum Path {
    /// Whole circles, with entry and exit along the circle.
    Circle(circle::Args),
    /// An NC program: lines, arcs, helices, dwells, sent ahead of the machine.
    Program(program::Args),
    /// Set-points from a file, one a tick, as another controller makes them.
    Stream(stream::Args),
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    match args.path {
        Path::Circle(args) => circle::run(args, out),
        Path::Program(args) => program::run(args, out),
        Path::Stream(args) => stream::run(args, out),
    }
}
