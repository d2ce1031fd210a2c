//! `giotto log`: what has happened on a controller, in words.
use super::port::PortArgs;
use super::{Failure, Output};
use giotto_shared::wire::{Event, What};
use serde_json::{Value, json};
use std::time::Duration;

/// Between two questions for more.
const ASK_AFTER: Duration = Duration::from_millis(200);

/// Arguments of `giotto log`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// What the controller remembers, and no more; otherwise what comes is shown until interrupted.
    #[arg(long)]
    once: bool,
    #[command(flatten)]
    port: PortArgs,
}

/// Requests by their numbers in the protocol.
const REQUESTS: [&str; 30] = [
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

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let mut controller = args.port.open(out)?;
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
        if args.once {
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
