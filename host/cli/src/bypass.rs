//! `giotto bypass`: switch the correction off or on.
use super::port::PortArgs;
use super::{Failure, Output};
use giotto_shared::wire::Command;
use serde_json::json;

/// Arguments of `giotto bypass`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// `on`: set-points pass as programmed; `off`: they are corrected.
    state: State,
    #[command(flatten)]
    port: PortArgs,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    On,
    Off,
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let mut controller = args.port.open(out)?;
    let on = args.state == State::On;
    controller.command(Command::Bypass { on })?;
    if out.json {
        return out.document(&json!({ "port": controller.port(), "bypass": on }));
    }
    out.say(format_args!(
        "{}: correction {}",
        controller.port(),
        if on { "off" } else { "on" }
    ));
    Ok(())
}
