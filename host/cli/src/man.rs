//! `giotto man`: manual pages, one a command.
use super::destination::{Destination, Kind};
use super::failure::cannot_write;
use super::{Failure, Output};
use clap::Command;
use clap_mangen::Man;
use serde_json::json;
use std::path::PathBuf;

/// Arguments of `giotto man`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Directory for the pages, made if missing.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

/// Writes `giotto.1` and a page for each command, subcommands of commands included.
pub fn run(args: Args, command: Command, out: Output) -> Result<(), Failure> {
    let folder = args.output;
    std::fs::create_dir_all(&folder).map_err(|e| cannot_write(&folder, &e))?;
    let mut command = command.disable_help_subcommand(true);
    command.build();
    let mut pages = Vec::new();
    write(&command, &folder, &mut pages)?;
    if out.json {
        return out.document(&json!({ "directory": folder, "pages": pages }));
    }
    out.say(format_args!(
        "{}: {} pages; read one with man -l {}",
        folder.display(),
        pages.len(),
        folder.join("giotto.1").display()
    ));
    Ok(())
}

fn write(
    command: &Command,
    folder: &std::path::Path,
    pages: &mut Vec<String>,
) -> Result<(), Failure> {
    let name = command
        .get_display_name()
        .unwrap_or_else(|| command.get_name());
    let page = format!("{name}.1");
    let path = folder.join(&page);
    let mut text = Vec::new();
    let rendered = Man::new(command.clone())
        .title(name.to_uppercase())
        .render(&mut text);
    rendered.map_err(|e| cannot_write(&path, &e))?;
    Destination::new(&path, Kind::Text, &[])?.write(&text)?;
    pages.push(page);
    command
        .get_subcommands()
        .try_for_each(|sub| write(sub, folder, pages))
}
