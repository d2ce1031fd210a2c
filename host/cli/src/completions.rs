//! `giotto completions`: what a shell needs to complete commands and options.
use super::{Failure, Output};
use clap::Command;
use clap_complete::{Shell, generate};
use serde_json::json;

/// Arguments of `giotto completions`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The shell.
    shell: Shell,
}

/// Writes the script to stdout.
pub fn run(args: Args, mut command: Command, out: Output) -> Result<(), Failure> {
    let mut script = Vec::new();
    generate(args.shell, &mut command, "giotto", &mut script);
    let script = String::from_utf8_lossy(&script);
    if out.json {
        return out.document(&json!({ "shell": args.shell.to_string(), "script": script }));
    }
    out.say(script.trim_end());
    Ok(())
}
