//! `giotto verify`: compare the table on the controller with a file.
use super::port::PortArgs;
use super::{Failure, Output, table_file};
use giotto_link::flash::Verdict;
use serde_json::json;
use std::path::PathBuf;

/// Arguments of `giotto verify`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Table (TABLE.bin) or the model it was made of (MODEL.toml).
    file: PathBuf,
    #[command(flatten)]
    port: PortArgs,
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let file = table_file::read(&args.file, out)?;
    let mut controller = args.port.open(out)?;
    let verdict = controller.verify(&file.image)?;
    let port = controller.port();
    let (same, slot, offset) = match verdict {
        Verdict::Same { slot } => (true, Some(slot), None),
        Verdict::Differs { slot, offset } => (false, Some(slot), Some(offset)),
        Verdict::None => (false, None, None),
    };
    if out.json {
        let document =
            json!({ "port": port, "same": same, "slot": slot, "first_difference": offset });
        out.document(&document)?;
    }
    match verdict {
        Verdict::Same { slot } => {
            out.say(format_args!(
                "{port}: corrects with this table, in slot {slot}, byte for byte"
            ));
            Ok(())
        }
        Verdict::Differs { slot, offset } => Err(Failure::check(format_args!(
            "{port}: the table in use, in slot {slot}, differs from {} from byte {offset} on",
            args.file.display()
        ))
        .help("flash it; giotto status says what the slots hold")),
        Verdict::None => Err(Failure::check(format_args!("{port}: no table is in use"))
            .help("flash it; giotto status says what the slots hold")),
    }
}
