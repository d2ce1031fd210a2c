//! `giotto key`: keys that tables are signed with, and whose tables a controller takes.
use super::destination::{Destination, Kind};
use super::port::PortArgs;
use super::{Failure, Output, table_file};
use giotto_link::Controller;
use giotto_link::signing::{SigningKey, hex, machine_id};
use giotto_shared::table::image::{Binding, MachineId};
use giotto_shared::wire::{Command, KeyInfo, KeyState};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// Arguments of `giotto key`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(subcommand)]
    command: KeyCommand,
}

#[derive(clap::Subcommand, Debug)]
enum KeyCommand {
    /// Make a new secret key. Who has the file can sign tables; without it none can be signed any more.
    New {
        /// Where to write it; never over another file.
        file: PathBuf,
    },
    /// Give a controller the public half of its first key: from then on it takes only tables signed with it. Or the one it has lost.
    Provision {
        /// The secret key.
        file: PathBuf,
        #[command(flatten)]
        port: PortArgs,
    },
    /// Whose tables a controller takes, which machine they have to be bound to, and the highest serial so far.
    Show {
        #[command(flatten)]
        port: PortArgs,
    },
    /// Bind a table to a machine and sign it, without a controller: for `giotto flash` by somebody who has no key.
    Sign {
        /// Model (MODEL.toml) or table (TABLE.bin).
        table: PathBuf,
        /// The secret key.
        #[arg(long, value_name = "FILE")]
        key: PathBuf,
        /// The machine, as `giotto key show` says it: 24 hex digits.
        #[arg(long, value_name = "ID")]
        machine: String,
        /// Above all serials that the controller has confirmed; without it the time, in seconds since 1970.
        #[arg(long, value_name = "N")]
        serial: Option<u32>,
        /// Where to write it.
        #[arg(short, long, value_name = "TABLE.bin")]
        output: PathBuf,
    },
    /// Hand a controller on to another key, which only the owner of the present one can. Tables signed with that correct no more.
    Replace {
        /// The secret key that the controller has now.
        old: PathBuf,
        /// The secret key that it is to have.
        new: PathBuf,
        #[command(flatten)]
        port: PortArgs,
    },
}

/// Reads a key file.
pub(super) fn load(path: &Path) -> Result<SigningKey, Failure> {
    SigningKey::load(path).map_err(|error| {
        Failure::input(format_args!("{}: {error}", path.display()))
            .help("make a key: giotto key new FILE")
    })
}

/// What the next table of a controller is bound to.
pub(super) fn next(controller: &mut Controller) -> Result<Binding, Failure> {
    let info = controller.key_info()?;
    let serial = info.serial.checked_add(1).ok_or_else(|| {
        Failure::controller("every serial there is has been confirmed on this controller").help(
            "it keeps the tables it has; another one needs a controller whose flash was erased",
        )
    })?;
    Ok(Binding {
        machine: controller.identity().machine,
        serial,
    })
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    match args.command {
        KeyCommand::New { file } => make(&file, out),
        KeyCommand::Provision { file, port } => provision(&file, &port, out),
        KeyCommand::Show { port } => show(&mut port.open(out)?, out),
        KeyCommand::Sign {
            table,
            key,
            machine,
            serial,
            output,
        } => sign(&table, &key, (&machine, serial), &output, out),
        KeyCommand::Replace { old, new, port } => replace(&old, &new, &port, out),
    }
}

fn make(file: &Path, out: Output) -> Result<(), Failure> {
    let key = SigningKey::generate();
    key.save(file).map_err(|error| {
        Failure::input(format_args!(
            "{}: cannot be written: {error}",
            file.display()
        ))
        .help("a key is never written over another file")
    })?;
    if out.json {
        return out.document(&json!({ "key": file, "public": key.public_hex() }));
    }
    out.say(format_args!(
        "{}: secret key; public half {}",
        file.display(),
        key.public_hex()
    ));
    Ok(())
}

fn provision(file: &Path, port: &PortArgs, out: Output) -> Result<(), Failure> {
    let key = load(file)?;
    let mut controller = port.open(out)?;
    controller.command(Command::Provision { key: key.public() })?;
    if out.json {
        return out.document(&json!({ "port": controller.port(), "public": key.public_hex() }));
    }
    out.say(format_args!(
        "{}: from now on only tables signed with this key for machine {}, public half {}",
        controller.port(),
        hex(&controller.identity().machine),
        key.public_hex()
    ));
    Ok(())
}

fn show(controller: &mut Controller, out: Output) -> Result<(), Failure> {
    let KeyInfo {
        state,
        key,
        epoch,
        serial,
    } = controller.key_info()?;
    let machine = hex(&controller.identity().machine);
    let kept = state == KeyState::Kept;
    if out.json {
        return out.document(&json!({
            "port": controller.port(),
            "machine": machine,
            "key": format!("{state:?}").to_lowercase(),
            "public": kept.then(|| hex(&key)),
            "number": kept.then_some(epoch),
            "serial": kept.then_some(serial),
        }));
    }
    out.say(format_args!("machine {machine}"));
    out.say(match state {
        KeyState::None => "no key: tables need no signature".to_owned(),
        KeyState::Lost => {
            "its key is lost: no table is taken before `giotto key provision` with the same one"
                .to_owned()
        }
        KeyState::Kept => format!(
            "key number {epoch}, public half {}; the next table needs a serial above {serial}",
            hex(&key)
        ),
    });
    Ok(())
}

/// The time as a serial: above those of all tables signed before.
fn now() -> u32 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(1, |since| since.as_secs() as u32)
}

fn sign(
    table: &Path,
    key: &Path,
    (machine, serial): (&str, Option<u32>),
    output: &Path,
    out: Output,
) -> Result<(), Failure> {
    let machine: MachineId = machine_id(machine).ok_or_else(|| {
        Failure::usage(format_args!(
            "\"{machine}\" is no machine: expected 24 hex digits"
        ))
        .help("`giotto key show --port PORT` says it")
    })?;
    let serial = serial.unwrap_or_else(now);
    let (key, place) = (
        load(key)?,
        Destination::new(output, Kind::Table, &[table, key])?,
    );
    let file = table_file::read(table, out)?;
    let signed = key
        .sign(&file.image, &Binding { machine, serial })
        .map_err(|error| Failure::input(format_args!("{}: {error}", table.display())))?;
    place.write(&signed)?;
    let machine = hex(&machine);
    if out.json {
        return out.document(&json!({
            "table": output,
            "bytes": signed.len(),
            "machine": machine,
            "serial": serial,
            "public": key.public_hex(),
        }));
    }
    out.say(format_args!(
        "{}: {} bytes, signed for machine {machine}, serial {serial}",
        output.display(),
        signed.len()
    ));
    Ok(())
}

fn replace(old: &Path, new: &Path, port: &PortArgs, out: Output) -> Result<(), Failure> {
    let (old, new) = (load(old)?, load(new)?);
    let mut controller = port.open(out)?;
    let epoch = controller.key_info()?.epoch;
    let machine = controller.identity().machine;
    controller.command(old.hand_over(&machine, epoch, &new.public()))?;
    let left = controller.status()?.active.is_none();
    if out.json {
        return out.document(&json!({
            "port": controller.port(),
            "public": new.public_hex(),
            "number": epoch + 1,
            "corrects": !left,
        }));
    }
    out.say(format_args!(
        "{}: key number {} from now on, public half {}",
        controller.port(),
        epoch + 1,
        new.public_hex()
    ));
    if left {
        out.say(
            "nothing corrects until a table signed with it is there: giotto flash TABLE --key NEW",
        );
    }
    Ok(())
}
