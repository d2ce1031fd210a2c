//! `giotto run`: execute a path on the controller and record its set-points.
mod circle;
mod correction;
mod program;
mod set_points;
mod stream;
mod stream_file;

use super::port::PortArgs;
use super::{Failure, Output, interrupt};
use giotto_link::Controller;

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

/// Opens the controller; from now on Ctrl-C stops what it runs and keeps what was recorded, a second one ends this program.
fn open(port: &PortArgs, out: Output) -> Result<Controller, Failure> {
    let mut controller = port.open(out)?;
    controller.stop_on(interrupt::listen());
    Ok(controller)
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    match args.path {
        Path::Circle(args) => circle::run(args, out),
        Path::Program(args) => program::run(args, out),
        Path::Stream(args) => stream::run(args, out),
    }
}
