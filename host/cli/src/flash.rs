//! `giotto flash`: write a table to a controller: inactive slot, read back, commit, confirm.
use super::port::PortArgs;
use super::{Failure, Output, key, table_file};
use giotto_link::flash::Progress;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use std::path::PathBuf;

/// Arguments of `giotto flash`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Model (MODEL.toml) or table (TABLE.bin).
    file: PathBuf,
    /// Secret key to sign the table with, for this controller and above all serials it has confirmed (`giotto key`).
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    #[command(flatten)]
    port: PortArgs,
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let mut file = table_file::read(&args.file, out)?;
    let key = args.key.as_deref().map(key::load).transpose()?;
    let mut controller = args.port.open(out)?;
    if let Some(key) = &key {
        file.image = key
            .sign(&file.image, &key::next(&mut controller)?)
            .map_err(|error| Failure::input(format_args!("{}: {error}", args.file.display())))?;
    }
    let bar = if out.draws() {
        ProgressBar::new(file.image.len() as u64)
    } else {
        ProgressBar::hidden()
    };
    if let Ok(style) = ProgressStyle::with_template("{msg:12} {bar:32} {bytes}/{total_bytes}") {
        bar.set_style(style);
    }
    let flashed = controller.flash(&file.image, &mut |progress| match progress {
        Progress::Sent(sent, _) => {
            bar.set_message("writing");
            bar.set_position(sent as u64);
        }
        Progress::Programmed => bar.set_message("reading back"),
        Progress::ReadBack => bar.set_message("committing"),
        Progress::Committed => bar.set_message("confirming"),
        Progress::Confirmed => {}
    });
    bar.finish_and_clear();
    let flashed = flashed?;
    if out.json {
        return out.document(&json!({
            "port": controller.port(),
            "slot": flashed.slot,
            "generation": flashed.generation,
            "crc": format!("{:08x}", flashed.crc),
            "bytes": flashed.bytes,
            "repeats": controller.repeats(),
        }));
    }
    out.say(format_args!(
        "{}: {} bytes in slot {}, read back, committed and confirmed as generation {}",
        controller.port(),
        flashed.bytes,
        flashed.slot,
        flashed.generation
    ));
    Ok(())
}
