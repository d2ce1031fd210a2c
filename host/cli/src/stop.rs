//! `giotto stop`: what runs comes to rest within the limits, on its path.
use super::port::PortArgs;
use super::{Failure, Output};
use giotto_link::ControllerError;
use giotto_link::outside;
use giotto_shared::wire::Command;
use serde_json::json;
use std::time::Duration;

/// Between two looks at whether it stands.
const LOOK_AFTER: Duration = Duration::from_millis(20);

/// Arguments of `giotto stop`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(flatten)]
    port: PortArgs,
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let mut controller = match args.port.connect(out) {
        Ok(controller) => controller,
        Err(ControllerError::InUse { port }) => {
            // Whoever has the port says where the machine stands.
            outside::say(&port, args.port.baud(), &Command::Stop)?;
            if out.json {
                return out.document(&json!({ "port": port, "ran": null, "place_mm": null }));
            }
            out.say(format_args!(
                "{port}: asked to stop; the program that has the port says where it stands"
            ));
            return Ok(());
        }
        Err(error) => return Err(error.into()),
    };
    let ran = controller.status()?.motion.is_run();
    controller.command(Command::Stop)?;
    let mut status = controller.status()?;
    while status.motion.is_run() {
        controller.listen(LOOK_AFTER)?;
        status = controller.status()?;
    }
    let place_mm = status.raw_nm.map(|nm| f64::from(nm) * 1e-6);
    let [x, y, z] = place_mm;
    let port = controller.port();
    if out.json {
        return out.document(&json!({ "port": port, "ran": ran, "place_mm": place_mm }));
    }
    let what = if ran { "stopped" } else { "nothing ran" };
    out.say(format_args!(
        "{port}: {what}, stands at {x:.6} {y:.6} {z:.6} mm"
    ));
    Ok(())
}
