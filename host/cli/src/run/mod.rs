//! `giotto run`: execute a path on the controller and record its set-points.
mod circle;
mod correction;
mod program;
mod set_points;
mod stream;
mod stream_file;

use super::port::PortArgs;
use super::{Failure, Output};
use giotto_link::Controller;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

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
    let wish = Arc::new(AtomicBool::new(false));
    let heard = Arc::clone(&wish);
    // Where there are no signals to listen to, Ctrl-C does what it always did.
    let listening = ctrlc::set_handler(move || {
        if heard.swap(true, Relaxed) {
            std::process::exit(130);
        }
    });
    if listening.is_ok() {
        controller.stop_on(wish);
    }
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
