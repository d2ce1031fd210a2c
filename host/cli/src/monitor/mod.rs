//! `giotto monitor`: live view of the controller in the terminal.
//!
//! | file | holds |
//! |---|---|
//! | `watch` | the line: asks, collects set-points, notices a loss, opens it again |
//! | `view` | what is known, without a terminal |
//! | `draw` | the view as a picture of characters |
//! | `live` | the terminal: keys in, pictures out |
mod controller_state;
mod draw;
mod live;
mod watch;

use super::port::PortArgs;
use super::source::{direction, length};
use super::status::words;
use super::{Failure, Output};
use giotto::campaign::Direction;
use giotto_link::{Controller, ControllerError};
use giotto_shared::path::CircleRun;
use giotto_shared::wire::Status;
use std::io::IsTerminal;
use std::time::Duration;

/// Arguments of `giotto monitor`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(flatten)]
    port: PortArgs,
    /// Seconds from one look to the next.
    #[arg(long, default_value_t = 0.5, value_name = "S")]
    interval: f64,
    /// Stop after so many looks instead of when interrupted.
    #[arg(long, value_name = "N", value_parser = crate::choice::whole::<u64>)]
    count: Option<u64>,
    /// Circle to run while watching, about the origin.
    #[arg(long, value_name = "MM", value_parser = length, requires = "feed", help_heading = "A circle to watch")]
    radius: Option<f64>,
    /// Its feed.
    #[arg(long, value_name = "MM_S", value_parser = length, requires = "radius", help_heading = "A circle to watch")]
    feed: Option<f64>,
    /// Its direction.
    #[arg(long, value_name = "ccw|cw", value_parser = direction, default_value = "ccw", help_heading = "A circle to watch")]
    direction: Direction,
    /// Its turns.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 10,
        help_heading = "A circle to watch"
    )]
    laps: u32,
}

impl Args {
    fn circle(&self) -> Option<CircleRun> {
        let (radius, feed) = (self.radius? * 1e-3, self.feed? * 1e-3);
        Some(CircleRun {
            centre_m: [0.0; 3],
            radius_m: radius,
            feed_m_s: feed,
            plane: giotto_shared::Plane::Xy,
            direction: self.direction,
            laps: self.laps,
            start_rad: 0.0,
        })
    }
}

/// Runs the command: a picture on a terminal, lines elsewhere.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    if !(args.interval > 0.0 && args.interval <= 3600.0) {
        return Err(Failure::usage(format_args!(
            "--interval is {}, expected up to 3600 s",
            args.interval
        )));
    }
    // Who is not there at the beginning was not unplugged.
    let controller = args.port.open(out)?;
    let terminal = std::io::stdout().is_terminal() && std::io::stdin().is_terminal();
    if terminal && !out.json && !out.quiet && !out.non_interactive {
        return live::run(args, controller);
    }
    lines(&args, controller, out)
}

/// Status after status, as text or as one document a line.
fn lines(args: &Args, mut controller: Controller, out: Output) -> Result<(), Failure> {
    if let Some(circle) = args.circle() {
        controller.start_circle(&circle)?;
    }
    let interval = Duration::from_secs_f64(args.interval);
    let (mut looks, mut since) = (0, interval);
    while args.count.is_none_or(|count| looks < count) {
        if looks > 0 {
            let pause = interval.saturating_sub(since).min(watch::SILENCE);
            std::thread::sleep(pause);
            since += pause;
        }
        let status = match controller.status() {
            Ok(status) => status,
            // Who counts wants an end; who does not wants to go on when the plug is back.
            Err(error) if args.count.is_none() && gone(&error) => {
                out.note(format_args!("{error}; waiting for it to come back"));
                controller = back(args);
                out.note(format_args!("{}: is back", controller.port()));
                continue;
            }
            Err(error) => return Err(error.into()),
        };
        // Between looks it is asked all the same: silence would end a run.
        if since >= interval {
            show(&controller, &status, out);
            looks += 1;
            since = Duration::ZERO;
        }
    }
    Ok(())
}

/// Whether the line is lost rather than the request refused.
fn gone(error: &ControllerError) -> bool {
    matches!(
        error,
        ControllerError::Lost { .. } | ControllerError::NoAnswer { .. }
    )
}

fn back(args: &Args) -> Controller {
    let silent = Output {
        json: false,
        quiet: true,
        non_interactive: true,
    };
    loop {
        std::thread::sleep(watch::RETRY);
        if let Ok(controller) = args.port.connect(silent) {
            return controller;
        }
    }
}

fn show(controller: &Controller, status: &Status, out: Output) {
    if out.json {
        let line = serde_json::json!({
            "motion": controller_state::motion(status.motion),
            "bypass": status.bypass,
            "ticks": status.tick,
            "programmed_nm": status.raw_nm,
            "corrected_nm": status.corrected_nm,
            "counters": status.counters,
        });
        // A closed pipe (`giotto … | head`) is no error of ours.
        let _ = std::io::Write::write_fmt(&mut std::io::stdout(), format_args!("{line}\n"));
    } else {
        out.say(format_args!("{}\n", words(controller, status)));
    }
}
