//! What is loaded on the controller, into files.
use crate::destination::{Destination, Kind};
use crate::{Failure, Output};
use giotto_bridge::Setup;
use giotto_bridge::program::Program;
use serde_json::json;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

/// Stands for this computer's address where nobody has said it.
const UNKNOWN_HOST: &str = "192.168.1.10";

/// Writes the program to `file`, and what belongs to it beside it.
pub(super) fn write(
    file: &Path,
    setup: &Setup,
    listen: SocketAddr,
    out: Output,
) -> Result<(), Failure> {
    let name = file
        .file_stem()
        .and_then(|stem| stem.to_str())
        .unwrap_or("");
    if !Program::is_name(name) {
        return Err(Failure::usage(format_args!(
            "--program {}: the module takes its name from the file: a letter, then up to 23 letters, digits or underscores",
            file.display()
        )));
    }
    let known = !listen.ip().is_unspecified();
    let host = if known {
        listen.ip().to_string()
    } else {
        UNKNOWN_HOST.to_owned()
    };
    let port = if listen.port() == 0 {
        setup.kind.usual_port()
    } else {
        listen.port()
    };
    let program = Program {
        setup,
        name,
        host: (&host, port),
    };
    let files: Vec<(PathBuf, String)> = program
        .files()
        .into_iter()
        .enumerate()
        .map(|(index, (ending, text))| match index {
            0 => (file.to_path_buf(), text),
            _ => (file.with_extension(ending), text),
        })
        .collect();
    let places: Vec<Option<&Path>> = files.iter().map(|(path, _)| Some(path.as_path())).collect();
    Destination::apart(&places)?;
    let mut written = Vec::new();
    for (path, text) in &files {
        // Checked all before the first is written.
        written.push((Destination::new(path, Kind::Text, &[])?, text));
    }
    for (place, text) in &written {
        place.write(text)?;
    }
    let names: Vec<String> = files
        .iter()
        .map(|(path, _)| path.display().to_string())
        .collect();
    if out.json {
        return out.document(&json!({ "files": names, "host": host, "port": port }));
    }
    out.say(names.join("\n"));
    if !known {
        out.note(format_args!(
            "note: {host} stands for this computer; --listen ADDRESS:PORT puts another in its place"
        ));
    }
    out.note("never run on a real robot by the authors: read the guide's page on robots first");
    Ok(())
}
