//! The bytes in the pages on protocol and table.
use super::holds;
use giotto_shared::model::Cumulants;
use giotto_shared::path::{CircleRun, Segment};
use giotto_shared::table::{self, Limits, Table, Travel, Zone};
use giotto_shared::term::Term;
use giotto_shared::wire::{
    self, Command, ExactSegment, FromController, MAX_FRAME, Reply, Request, SetPoint, SetPoints,
    Steps,
};
use giotto_shared::{Actuator, Direction};
use serde::Serialize;

fn dump(bytes: &[u8]) -> String {
    let line = |(k, row): (usize, &[u8])| {
        let hex: Vec<String> = row.iter().map(|b| format!("{b:02x}")).collect();
        let plain: String = row
            .iter()
            .map(|b| {
                if b.is_ascii_graphic() {
                    char::from(*b)
                } else {
                    '.'
                }
            })
            .collect();
        format!("{:04x}  {:<47}  {plain}", 16 * k, hex.join(" "))
    };
    let lines: Vec<String> = bytes.chunks(16).enumerate().map(line).collect();
    lines.join("\n")
}

/// Payload and frame of a message; the frame is taken apart again by the receiver's own code.
fn frame(message: &impl Serialize) -> String {
    let payload = postcard::to_allocvec_like(message);
    let mut buffer = [0; MAX_FRAME];
    let frame = wire::encode(message, &mut buffer).unwrap();
    let mut accumulator = wire::Accumulator::new();
    let back = frame
        .iter()
        .find_map(|b| accumulator.push(*b).map(<[u8]>::to_vec));
    assert_eq!(back.as_deref(), Some(payload.as_slice()));
    format!(
        "```text\npayload\n{}\nframe\n{}\n```",
        dump(&payload),
        dump(frame)
    )
}

/// Postcard without its own allocator.
mod postcard {
    pub(super) fn to_allocvec_like(message: &impl serde::Serialize) -> Vec<u8> {
        let mut buffer = [0; giotto_shared::wire::MAX_PAYLOAD];
        ::postcard::to_slice(message, &mut buffer).unwrap().to_vec()
    }
}

#[test]
fn frames_are_those_of_the_page() {
    let page = "protocol.md";
    let request = |seq, command| Request {
        session: 4660,
        seq,
        command,
    };
    holds(page, "bytes hello", &frame(&request(1, Command::Hello)));
    holds(page, "bytes status", &frame(&request(2, Command::Status)));
    let done = FromController::Reply {
        session: 4660,
        seq: 2,
        reply: Reply::Done,
    };
    holds(page, "bytes done", &frame(&done));
    let circle = CircleRun {
        centre_m: [0.0; 3],
        radius_m: 0.05,
        feed_m_s: 0.1,
        plane: giotto_shared::Plane::Xy,
        direction: Direction::Ccw,
        laps: 2,
        start_rad: 0.0,
    };
    holds(
        page,
        "bytes circle",
        &frame(&request(3, Command::RunCircle(circle.exact().unwrap()))),
    );
    holds(page, "bytes begin", &frame(&request(4, Command::Begin)));
    let line = Segment::Line {
        to_m: [0.05, 0.0, 0.0],
        feed_m_s: 0.1,
    }
    .exact([0; 3])
    .unwrap();
    holds(
        page,
        "bytes line",
        &frame(&request(
            5,
            Command::Append {
                segment: line,
                tolerance_nm: 10_000,
            },
        )),
    );
    let (centre_m, normal) = ([0.05, 0.02, 0.0], [0.0, 0.0, 1.0]);
    let (sweep_rad, rise_m) = (std::f64::consts::FRAC_PI_2, 0.0);
    let arc = Segment::Arc {
        centre_m,
        normal,
        sweep_rad,
        rise_m,
        feed_m_s: 0.1,
    }
    .exact([50_000_000, 0, 0])
    .unwrap();
    holds(
        page,
        "bytes arc",
        &frame(&request(
            6,
            Command::Append {
                segment: arc,
                tolerance_nm: 0,
            },
        )),
    );
    let stream = Command::BeginStream {
        feed_m_s: 0.5,
        ahead: 60,
    };
    holds(page, "bytes begin-stream", &frame(&request(7, stream)));
    let (mut writer, mut steps) = (Steps::from([0; 3]), wire::Chunk::new());
    for x_nm in [1000, 3000, 5000] {
        assert!(writer.write([x_nm, 0, 0], &mut steps));
    }
    holds(
        page,
        "bytes points",
        &frame(&request(8, Command::Points { steps })),
    );
    let point = SetPoint {
        raw_nm: [50_000_000, 0, 0],
        corrected_nm: [50_012_000, 0, 0],
    };
    let points = std::iter::once(point).collect();
    let batch = FromController::SetPoints(SetPoints {
        tick: 1000,
        every: 10,
        last: false,
        points,
    });
    holds(page, "bytes set-points", &frame(&batch));
}

#[test]
fn the_numbers_of_requests_are_those_of_the_page() {
    let text = std::fs::read_to_string(super::guide().join("protocol.md")).unwrap();
    let first = |command: &Command| {
        let mut buffer = [0; wire::MAX_PAYLOAD];
        ::postcard::to_slice(command, &mut buffer).unwrap()[0]
    };
    let circle = CircleRun {
        centre_m: [0.0; 3],
        radius_m: 0.05,
        feed_m_s: 0.1,
        plane: giotto_shared::Plane::Xy,
        direction: Direction::Cw,
        laps: 1,
        start_rad: 0.0,
    };
    let all = [
        ("Hello", Command::Hello),
        ("Status", Command::Status),
        ("WriteBegin", Command::WriteBegin { length: 0, crc: 0 }),
        (
            "WriteChunk",
            Command::WriteChunk {
                offset: 0,
                data: wire::Chunk::default(),
            },
        ),
        ("WriteEnd", Command::WriteEnd),
        (
            "ReadBack",
            Command::ReadBack {
                slot: 0,
                offset: 0,
                length: 0,
            },
        ),
        ("Commit", Command::Commit),
        ("Confirm", Command::Confirm),
        ("Rollback", Command::Rollback),
        ("Bypass", Command::Bypass { on: true }),
        ("RunCircle", Command::RunCircle(circle.exact().unwrap())),
        ("Stop", Command::Stop),
        (
            "Subscribe",
            Command::Subscribe {
                every: 1,
                on_link: true,
            },
        ),
        ("Reset", Command::Reset),
        ("Provision", Command::Provision { key: [0; 32] }),
        ("Supervise", Command::Supervise { after_ms: 0 }),
        ("Begin", Command::Begin),
        (
            "Append",
            Command::Append {
                segment: ExactSegment::Dwell { time_s: 1.0 },
                tolerance_nm: 0,
            },
        ),
        ("End", Command::End),
        (
            "BeginStream",
            Command::BeginStream {
                feed_m_s: 1.0,
                ahead: 1,
            },
        ),
        (
            "Points",
            Command::Points {
                steps: wire::Chunk::new(),
            },
        ),
        ("ClearFault", Command::ClearFault),
        ("Declare", Command::Declare { place_nm: [0; 3] }),
        ("Pause", Command::Pause),
        ("Resume", Command::Resume),
        ("Override", Command::Override { percent: 100 }),
        ("Config", Command::Config),
        ("SaveConfig", Command::SaveConfig),
        ("Events", Command::Events { from: 0 }),
    ];
    let versions = [
        format!("protocol version {}.", wire::PROTOCOL_VERSION),
        format!("`Hello` sets {} ms", wire::SUPERVISE_MS),
        format!("The longest payload is {} bytes.", wire::MAX_PAYLOAD),
        format!("in batches of at most {}.", wire::POINTS),
    ];
    for words in &versions {
        assert!(text.contains(words), "{words}");
    }
    for (name, command) in &all {
        let row = format!("| {} | `{name}` |", first(command));
        assert!(text.contains(&row), "{row}");
    }
}

#[test]
fn the_table_is_that_of_the_page() {
    let mut zone = Zone {
        place_m: None,
        radius_m: [0.05, 0.3],
        feed_m_s: [0.02, 0.7],
        travel: Travel::Both,
        cumulants: Cumulants {
            kappa2_s2: 533e-6,
            kappa4_s4: 939e-9,
        },
        terms: heapless::Vec::new(),
    };
    zone.terms
        .push(Term::Backlash {
            actuator: Actuator::X,
            step_m: 8e-6,
        })
        .unwrap();
    let mut table = Table {
        limits: Limits {
            offset_m: 0.5e-3,
            slew_m_s: 0.01,
        },
        ..Table::empty()
    };
    table.machine.push_str("mill").unwrap();
    table.zones.push(zone).unwrap();
    let mut bytes = [0; table::MAX_IMAGE_BYTES];
    let length = table::encode(&table, &mut bytes).unwrap();
    assert_eq!(table::decode(&bytes[..length]).unwrap(), table);
    holds(
        "table.md",
        "bytes table",
        &format!("```text\n{}\n```", dump(&bytes[..length])),
    );
    let schema = std::fs::read_to_string(
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/src/table/schema.txt"),
    );
    holds(
        "table.md",
        "schema",
        &format!("```text\n{}\n```", schema.unwrap().trim_end()),
    );
}
