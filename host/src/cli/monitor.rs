//! `giotto monitor`: live view of the controller in the terminal.
use super::port::PortArgs;
use super::status::words;
use super::{Failure, Output};
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
    #[arg(long, value_name = "N")]
    count: Option<u64>,
}

/// Clears the terminal and goes to its first column.
const CLEAR: &str = "\x1b[2J\x1b[H";

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    if !(args.interval > 0.0 && args.interval <= 3600.0) {
        return Err(Failure::usage(format_args!("--interval is {}, expected up to 3600 s", args.interval)));
    }
    let mut controller = args.port.open(out)?;
    let mut looks = 0;
    while args.count.is_none_or(|count| looks < count) {
        if looks > 0 {
            std::thread::sleep(Duration::from_secs_f64(args.interval));
        }
        let status = controller.status()?;
        if out.json {
            // One document a line, as long as someone listens.
            let line = serde_json::json!({
                "motion": format!("{:?}", status.motion).to_lowercase(),
                "bypass": status.bypass,
                "ticks": status.tick,
                "programmed_nm": status.raw_nm,
                "corrected_nm": status.corrected_nm,
                "counters": status.counters,
            });
            println!("{line}");
        } else {
            let clear = if out.draws() { CLEAR } else { "" };
            out.say(format_args!("{clear}{}", words(&controller, &status)));
        }
        looks += 1;
    }
    Ok(())
}
