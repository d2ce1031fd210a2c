//! `giotto rollback`: return to the last good table.
use super::port::PortArgs;
use super::{Failure, Output};
use giotto_link::flash::active_table;
use giotto_shared::wire::Command;
use serde_json::json;

/// Arguments of `giotto rollback`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(flatten)]
    port: PortArgs,
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let mut controller = args.port.open(out)?;
    controller.command(Command::Rollback)?;
    let active = active_table(&controller.status()?);
    let (slot, generation) = (
        active.map(|(slot, _)| slot),
        active.and_then(|(_, info)| info.generation),
    );
    if out.json {
        return out.document(
            &json!({ "port": controller.port(), "slot": slot, "generation": generation }),
        );
    }
    match (slot, generation) {
        (Some(slot), Some(generation)) => {
            out.say(format_args!(
                "{}: back to the table in slot {slot}, generation {generation}",
                controller.port()
            ));
        }
        _ => out.say(format_args!(
            "{}: no confirmed table, bypass",
            controller.port()
        )),
    }
    Ok(())
}
