//! `giotto status`: the controller's state and slots.
use super::port::PortArgs;
use super::{Failure, Output};
use comfy_table::{Table, presets};
use giotto_link::Controller;
use giotto_link::signing::hex;
use giotto_shared::wire::{ClockSource, Identity, PositionState, Probation, SlotState, Status};
use serde_json::{Value, json};

/// Arguments of `giotto status`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(flatten)]
    port: PortArgs,
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let mut controller = args.port.open(out)?;
    let status = controller.status()?;
    if out.json {
        return out.document(&document(&controller, &status));
    }
    out.say(words(&controller, &status));
    Ok(())
}

fn slot_document(state: &SlotState) -> Value {
    match state {
        SlotState::Empty => json!({ "state": "empty" }),
        SlotState::Invalid => json!({ "state": "invalid" }),
        SlotState::OtherFormat { version } => json!({ "state": "other_format", "format": version }),
        SlotState::Table(info) => json!({
            "state": if info.generation.is_some() { "confirmed" } else { "unconfirmed" },
            "generation": info.generation,
            "crc": format!("{:08x}", info.crc),
            "bytes": info.length,
        }),
    }
}

fn document(controller: &Controller, status: &Status) -> Value {
    let Identity {
        board,
        build,
        protocol,
        table_format,
        schema_hash,
        max_image_bytes,
        tick_hz,
        signed_only,
        machine,
    } = controller.identity();
    let probation = match status.probation {
        Probation::None => "none",
        Probation::Fresh => "fresh",
        Probation::FirstRun => "first_run",
    };
    json!({
        "port": controller.port(),
        "board": board,
        "build": build,
        "protocol": protocol,
        "table_format": table_format,
        "schema": format!("{schema_hash:08x}"),
        "max_table_bytes": max_image_bytes,
        "tick_hz": tick_hz,
        "signed_only": signed_only,
        "machine": hex(machine),
        "motion": format!("{:?}", status.motion).to_lowercase(),
        "fault": status.fault.map(|cause| format!("{cause:?}").to_lowercase()),
        "stop_input": status.stop_input,
        "bypass": status.bypass,
        "active_slot": status.active,
        "probation": probation,
        "position": format!("{:?}", status.position).to_lowercase(),
        "override_percent": status.override_percent,
        "reset_cause": format!("{:?}", status.reset).to_lowercase(),
        "clock": format!("{:?}", status.clock).to_lowercase(),
        "worst_tick_percent": status.worst_tick_permille.map(|permille| f64::from(permille) / 10.0),
        "stack_left_bytes": status.stack_left_bytes,
        "queued_segments": status.queued,
        "slots": status.slots.iter().map(slot_document).collect::<Vec<_>>(),
        "ticks": status.tick,
        "stack_bytes": status.stack_bytes,
        "idle_percent": status.idle_permille.map(|permille| f64::from(permille) / 10.0),
        "programmed_mm": status.raw_nm.map(millimetres),
        "corrected_mm": status.corrected_nm.map(millimetres),
        "counters": status.counters,
    })
}

fn millimetres(nm: i32) -> f64 {
    f64::from(nm) * 1e-6
}

fn slot_words(state: &SlotState) -> String {
    match state {
        SlotState::Empty => "empty".to_owned(),
        SlotState::Invalid => "not a whole table".to_owned(),
        SlotState::OtherFormat { version } => {
            format!("table of format {version}, which this image cannot read")
        }
        SlotState::Table(info) => {
            let confirmed = match info.generation {
                Some(generation) => format!("generation {generation}"),
                None => "never confirmed".to_owned(),
            };
            format!("{} bytes, CRC {:08x}, {confirmed}", info.length, info.crc)
        }
    }
}

/// State and slots for a person.
pub(super) fn words(controller: &Controller, status: &Status) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    let mut rows = identity_rows(controller);
    rows.extend(motion_rows(status));
    rows.extend(position_rows(status));
    rows.extend(counter_rows(status));
    rows.extend(load_rows(status));
    for (name, value) in rows {
        table.add_row(vec![name, value]);
    }
    table
}

/// Name and value of a line.
type Row = (String, String);

fn row(name: &str, value: String) -> Row {
    (name.to_owned(), value)
}

/// Who it is and what it speaks.
fn identity_rows(controller: &Controller) -> Vec<Row> {
    let identity = controller.identity();
    let named = row(
        "controller",
        format!(
            "{} {} at {}",
            identity.board,
            identity.build,
            controller.port()
        ),
    );
    let protocol = row(
        "protocol",
        format!(
            "{}, table format {}, schema {:08x}, {} ticks/s{}",
            identity.protocol,
            identity.table_format,
            identity.schema_hash,
            identity.tick_hz,
            if identity.signed_only {
                ", signed tables only"
            } else {
                ""
            }
        ),
    );
    let machine = row("machine", hex(&identity.machine));
    vec![named, machine, protocol]
}

/// What it does, with which correction.
fn motion_rows(status: &Status) -> Vec<Row> {
    let motion = format!("{:?}", status.motion).to_lowercase();
    let cause = status
        .fault
        .map(|cause| format!(" ({cause:?})").to_lowercase())
        .unwrap_or_default();
    let stop = if status.stop_input {
        ", stop input active"
    } else {
        ""
    };
    let correction = match (status.active, status.bypass) {
        (None, _) => "bypass: no confirmed table".to_owned(),
        (Some(slot), true) => format!("bypass; table in slot {slot}"),
        (Some(slot), false) => format!("on, table in slot {slot}"),
    };
    let mut rows = vec![
        row("motion", format!("{motion}{cause}{stop}")),
        row("correction", correction),
    ];
    let probation = match status.probation {
        Probation::None => None,
        Probation::Fresh => Some("table not confirmed, has not run"),
        Probation::FirstRun => Some("table not confirmed, first run begun or done"),
    };
    rows.extend(probation.map(|words| row("probation", words.to_owned())));
    let slots = status.slots.iter().enumerate();
    rows.extend(slots.map(|(number, slot)| row(&format!("slot {number}"), slot_words(slot))));
    rows
}

/// Where it stands.
fn position_rows(status: &Status) -> Vec<Row> {
    let place = |nm: [i32; 3]| {
        let [x, y, z] = nm.map(millimetres);
        format!("{x:.6} {y:.6} {z:.6} mm")
    };
    let known = match status.position {
        PositionState::Unknown => "not known: giotto reset --at X,Y,Z declares it",
        PositionState::Known => "known",
        PositionState::Kept => "kept over the last reset",
    };
    vec![
        row("position", known.to_owned()),
        row("programmed", place(status.raw_nm)),
        row("corrected", place(status.corrected_nm)),
    ]
}

/// What it has counted since it booted.
fn counter_rows(status: &Status) -> Vec<Row> {
    let counts = &status.counters;
    let ticks = format!(
        "{} since boot ({}), {} overrun{}{}",
        status.tick,
        format!("{:?}", status.reset).to_lowercase(),
        counts.tick_overruns,
        status
            .worst_tick_permille
            .map_or(String::new(), |p| format!(
                ", longest {:.1} % of a period",
                f64::from(p) / 10.0
            )),
        match status.clock {
            ClockSource::Crystal => "",
            ClockSource::Internal => ", NO CRYSTAL: counted by the internal oscillator",
        }
    );
    let clamps = format!(
        "offset {}, rate {}",
        counts.offset_clamps, counts.slew_clamps
    );
    let segments = format!(
        "{} done, {} waiting, {} dropped, {} uncorrected; {} stops, {} runs without a host",
        counts.segments,
        status.queued,
        counts.dropped_segments,
        counts.uncorrected_segments,
        counts.stops,
        counts.link_losses
    );
    let link = format!(
        "{} CRC errors, {} malformed, {} overlong, {} repeated, {} bytes and {} set-points lost",
        counts.crc_errors,
        counts.malformed_frames,
        counts.overlong_frames,
        counts.repeated_requests,
        counts.lost_bytes,
        counts.dropped_set_points
    );
    let streams = format!(
        "{} set-points missing, {} late, {} beyond the feed",
        counts.missing_set_points, counts.late_set_points, counts.rejected_set_points
    );
    vec![
        row("ticks", ticks),
        row("clamps", clamps),
        row("segments", segments),
        row("link", link),
        row("streams", streams),
    ]
}

/// How much of its time and memory it uses, where it measures that.
fn load_rows(status: &Status) -> Vec<Row> {
    let idle = status.idle_permille.map(|permille| {
        row(
            "idle",
            format!("{:.1} % of the time", f64::from(permille) / 10.0),
        )
    });
    let stack = (status.stack_bytes > 0).then(|| {
        row(
            "stack",
            format!(
                "{} bytes at the deepest, {} never used",
                status.stack_bytes, status.stack_left_bytes
            ),
        )
    });
    idle.into_iter().chain(stack).collect()
}
