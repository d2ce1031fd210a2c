//! `giotto key`: keys that tables are signed with.
use super::port::PortArgs;
use super::{Failure, Output};
use giotto_link::signing::SigningKey;
use giotto_shared::wire::Command;
use serde_json::json;
use std::path::{Path, PathBuf};

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
    /// Give a controller the public half of a key, once and for all: from then on it takes only tables signed with it.
    Provision {
        /// The secret key.
        file: PathBuf,
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

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    match args.command {
        KeyCommand::New { file } => {
            let key = SigningKey::generate();
            key.save(&file).map_err(|error| {
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
        KeyCommand::Provision { file, port } => {
            let key = load(&file)?;
            let mut controller = port.open(out)?;
            controller.command(Command::Provision { key: key.public() })?;
            if out.json {
                return out
                    .document(&json!({ "port": controller.port(), "public": key.public_hex() }));
            }
            out.say(format_args!(
                "{}: from now on only tables signed with this key, public half {}",
                controller.port(),
                key.public_hex()
            ));
            Ok(())
        }
    }
}
