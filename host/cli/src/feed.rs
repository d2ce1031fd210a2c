//! `giotto feed`: feed hold, and the override of what is accepted from now on.
use super::port::PortArgs;
use super::{Failure, Output};
use giotto_link::{ControllerError, outside};
use giotto_shared::wire::{Command, OVERRIDE_PERCENT};
use serde_json::json;

/// Arguments of `giotto feed`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// `hold`, `resume`, or percent of the programmed feed (20 to 120) for what the controller accepts from now on.
    #[arg(value_parser = wish)]
    wish: Wish,
    #[command(flatten)]
    port: PortArgs,
}

#[derive(Clone, Copy, Debug)]
enum Wish {
    Hold,
    Resume,
    Percent(u8),
}

fn wish(text: &str) -> Result<Wish, String> {
    let [least, most] = OVERRIDE_PERCENT;
    match text {
        "hold" => Ok(Wish::Hold),
        "resume" => Ok(Wish::Resume),
        number => match number.trim_end_matches('%').parse() {
            Ok(percent) if (least..=most).contains(&percent) => Ok(Wish::Percent(percent)),
            _ => Err(format!("expected hold, resume, or {least} to {most}")),
        },
    }
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let (command, words) = match args.wish {
        Wish::Hold => (Command::Pause, "feed hold".to_owned()),
        Wish::Resume => (Command::Resume, "goes on".to_owned()),
        Wish::Percent(percent) => (
            Command::Override { percent },
            format!("{percent} % of the programmed feed from the next segment on"),
        ),
    };
    let (port, asked) = match args.port.connect(out) {
        Ok(mut controller) => {
            controller.command(command)?;
            (controller.port().to_owned(), "")
        }
        // The answer is for the program that has the port.
        Err(ControllerError::InUse { port }) => {
            outside::say(&port, args.port.baud(), &command)?;
            (port, "asked for: ")
        }
        Err(error) => return Err(error.into()),
    };
    if out.json {
        return out.document(&json!({ "port": port, "feed": words }));
    }
    out.say(format_args!("{port}: {asked}{words}"));
    Ok(())
}
