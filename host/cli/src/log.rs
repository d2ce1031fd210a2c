//! `giotto log`: what has happened on a controller, in words.
use super::port::PortArgs;
use super::{Failure, Output};
use giotto_link::Board;
use giotto_link::image;
use giotto_link::log::{Line, Words};
use giotto_link::port::BAUD;
use giotto_shared::wire::{Event, What};
use serde_json::{Value, json};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Between two questions for more.
const ASK_AFTER: Duration = Duration::from_millis(200);

/// Arguments of `giotto log`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// What the controller remembers, and no more; otherwise what comes is shown until interrupted.
    #[arg(long)]
    once: bool,
    /// The board's own log port instead (or a socket, or a file): what comes there in defmt's encoding, in the image's words.
    #[arg(long, value_name = "PATH", conflicts_with = "port")]
    encoded: Option<PathBuf>,
    /// The image whose words they are, an ELF file; without it the one of this workspace for QEMU.
    #[arg(long, value_name = "IMAGE", requires = "encoded")]
    elf: Option<PathBuf>,
    #[command(flatten)]
    port: Option<PortArgs>,
}

/// Requests by their numbers in the protocol.
const REQUESTS: [&str; 32] = [
    "Hello",
    "Status",
    "WriteBegin",
    "WriteChunk",
    "WriteEnd",
    "ReadBack",
    "Commit",
    "Confirm",
    "Rollback",
    "Bypass",
    "RunCircle",
    "Stop",
    "Subscribe",
    "Reset",
    "Provision",
    "Supervise",
    "Begin",
    "Append",
    "End",
    "BeginStream",
    "Points",
    "ClearFault",
    "Declare",
    "Pause",
    "Resume",
    "Override",
    "Config",
    "Configure",
    "SaveConfig",
    "Events",
    "Key",
    "ReplaceKey",
];

fn words(what: &What) -> String {
    let table = |slot: Option<u8>| match slot {
        Some(slot) => format!("table in slot {slot}"),
        None => "no confirmed table, bypass".to_owned(),
    };
    match what {
        What::Booted { cause, slot } => {
            format!(
                "started ({}): {}",
                format!("{cause:?}").to_lowercase(),
                table(*slot)
            )
        }
        What::Started => "a run began".to_owned(),
        What::Rested => "at rest".to_owned(),
        What::Faulted(cause) => format!("fault: {}", format!("{cause:?}").to_lowercase()),
        What::Cleared => "fault cleared".to_owned(),
        What::Stopped => "stop asked for".to_owned(),
        What::StopInput { active } => {
            format!("stop input {}", if *active { "active" } else { "released" })
        }
        What::LinkLost => "nothing heard from the host during a run".to_owned(),
        What::Overdue => "what outlived its host was stopped".to_owned(),
        What::Written { slot } => format!("slot {slot} programmed"),
        What::Committed { slot } => format!("table in slot {slot} in use, on probation"),
        What::Confirmed { slot } => format!("table in slot {slot} confirmed"),
        What::RolledBack { slot } => format!("rolled back: {}", table(*slot)),
        What::Bypassed { on } => format!("correction {}", if *on { "off" } else { "on" }),
        What::Declared => "position declared".to_owned(),
        What::Configured { saved } => {
            format!(
                "limits {}",
                if *saved {
                    "stored"
                } else {
                    "changed, not stored"
                }
            )
        }
        What::Refused { request, why } => {
            let name = REQUESTS
                .get(usize::from(*request))
                .copied()
                .unwrap_or("a request");
            format!("{name} refused: {why}")
        }
    }
}

fn document(number: u32, event: &Event, tick_hz: u32) -> Value {
    let time_s = f64::from(event.tick) / f64::from(tick_hz);
    json!({ "number": number, "time_s": time_s, "event": words(&event.what) })
}

/// Where a board's log comes from: a socket of the emulator, a serial device, or what was kept of either in a file.
fn source(path: &Path) -> std::io::Result<Box<dyn Read>> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        let kind = path.metadata()?.file_type();
        if kind.is_socket() {
            return Ok(Box::new(std::os::unix::net::UnixStream::connect(path)?));
        }
        if kind.is_char_device() {
            let path = path.to_string_lossy();
            return Ok(Box::new(giotto_link::serial::listen(&path, BAUD)?));
        }
    }
    Ok(Box::new(std::fs::File::open(path)?))
}

/// Shows a board's log to its end.
fn encoded(path: &Path, elf: Option<PathBuf>, out: Output) -> Result<(), Failure> {
    let image = elf.unwrap_or_else(|| image::path(Board::Mps2An386));
    let words = Words::of(&image)?;
    let fail = |error: std::io::Error| Failure::input(format_args!("{}: {error}", path.display()));
    let from = source(path).map_err(fail)?;
    let mut all = Vec::new();
    let disturbed = words
        .read(from, &mut |Line { time, level, words }| {
            if out.json {
                all.push(json!({ "time_s": time, "level": level, "event": words }));
            } else {
                let time = time.unwrap_or_default();
                out.say(format_args!("{time:>12} s  {level:<5} {words}"));
            }
        })
        .map_err(fail)?;
    if out.json {
        return out.document(&json!({ "events": all, "disturbed": disturbed }));
    }
    if disturbed > 0 {
        out.note(format_args!(
            "{disturbed} pieces were disturbed, or are another image's"
        ));
    }
    Ok(())
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let (mut controller, once) = match (args.port, args.encoded) {
        (_, Some(path)) => return encoded(&path, args.elf, out),
        (Some(port), None) => (port.open(out)?, args.once),
        (None, None) => {
            return Err(Failure::usage("whose log?").help("--port PORT, or --encoded PATH"));
        }
    };
    let tick_hz = controller.identity().tick_hz;
    if out.json {
        let events = controller.events(0)?;
        let all: Vec<Value> = events
            .iter()
            .map(|(number, event)| document(*number, event, tick_hz))
            .collect();
        return out.document(&json!({ "port": controller.port(), "events": all }));
    }
    let mut next = 0;
    loop {
        for (number, event) in controller.events(next)? {
            let time_s = f64::from(event.tick) / f64::from(tick_hz);
            out.say(format_args!("{time_s:>12.3} s  {}", words(&event.what)));
            next = number.wrapping_add(1);
        }
        if once {
            return Ok(());
        }
        controller.listen(ASK_AFTER)?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use giotto_shared::wire::{Command, Refusal};

    /// The names stand where the protocol has them.
    #[test]
    fn requests_have_their_names() {
        let number = |command: Command| {
            let mut bytes = [0; 64];
            giotto_shared::wire::put(&command, &mut bytes);
            usize::from(bytes[0])
        };
        assert_eq!(REQUESTS[number(Command::Commit)], "Commit");
        assert_eq!(REQUESTS[number(Command::ClearFault)], "ClearFault");
        assert_eq!(REQUESTS[number(Command::Events { from: 0 })], "Events");
        let why = Refusal::NothingToCommit;
        let said = words(&What::Refused { request: 6, why });
        assert!(said.starts_with("Commit refused: nothing"), "{said}");
    }
}
