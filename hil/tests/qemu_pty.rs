//! The image in QEMU over a real pty, opened with the serialport crate. Needs the emulator: `.ci/setup` brings it.
#![allow(
    clippy::unwrap_used,
    reason = "helpers of a test fail as the test does"
)]
use giotto_hil::ticks::largest_table;
use giotto_link::emulator::{Emulator, Pace};
use giotto_link::flash::Verdict;
use giotto_link::port::BAUD;
use giotto_link::serial::SerialLink;
use giotto_link::{Controller, ControllerError, circle};
use giotto_shared::Direction;
use giotto_shared::table::{self, MAX_IMAGE_BYTES, TableError};
use giotto_shared::wire::{Command, Refusal};

fn connect(emulator: &Emulator) -> Result<Controller, ControllerError> {
    Controller::connect(emulator.open()?, emulator.pty(), 7)
}

/// The largest table with another name.
fn other_table() -> Vec<u8> {
    let mut table = table::decode(&largest_table()).unwrap();
    table.machine = "other".try_into().unwrap();
    let mut bytes = vec![0; MAX_IMAGE_BYTES];
    let length = table::encode(&table, &mut bytes).unwrap();
    bytes.truncate(length);
    bytes
}

#[test]
fn flash_status_verify_reset_verify_and_every_refusal_leaves_the_table() {
    let emulator = Emulator::start(None, Pace::Stepped, &mut |note| eprintln!("{note}")).unwrap();
    let mut controller = connect(&emulator).unwrap();
    let status = controller.status().unwrap();
    assert!(status.bypass && status.active.is_none());

    let table = largest_table();
    let flashed = controller.flash(&table, &mut |_| {}).unwrap();
    assert_eq!((flashed.slot, flashed.generation), (0, 1));
    let status = controller.status().unwrap();
    assert!(!status.bypass && status.active == Some(0));
    assert_eq!(
        controller.verify(&table).unwrap(),
        Verdict::Same { slot: 0 }
    );
    controller.reset().unwrap();
    assert_eq!(
        controller.verify(&table).unwrap(),
        Verdict::Same { slot: 0 }
    );

    // In use: a second program does not get the port.
    assert!(matches!(
        SerialLink::open(emulator.pty(), BAUD),
        Err(ControllerError::InUse { .. })
    ));

    // A broken table that a careless client sends: refused, the old one intact.
    let mut broken = other_table();
    broken[40] ^= 1;
    let refused = controller.write(&broken, &mut |_| {});
    let crc = matches!(
        refused,
        Err(ControllerError::Refused(Refusal::Table(
            TableError::BadCrc { .. }
        )))
    );
    assert!(crc, "{refused:?}");
    assert_eq!(
        controller.verify(&table).unwrap(),
        Verdict::Same { slot: 0 }
    );

    // Written and committed, never confirmed: gone after a reset.
    controller.write(&other_table(), &mut |_| {}).unwrap();
    controller.command(Command::Commit).unwrap();
    assert_eq!(
        controller.verify(&other_table()).unwrap(),
        Verdict::Same { slot: 1 }
    );
    controller.reset().unwrap();
    assert_eq!(
        controller.verify(&table).unwrap(),
        Verdict::Same { slot: 0 }
    );

    // And it moves.
    let recording = controller
        .run_circle(&circle(0.1, 0.5, Direction::Ccw, 1), 1)
        .unwrap();
    assert!(
        recording
            .points
            .iter()
            .any(|point| point.programmed_m != point.corrected_m)
    );
    assert_eq!(controller.status().unwrap().counters.tick_overruns, 0);
}

#[test]
fn ports_that_are_none_are_told_apart() {
    let open = |path| SerialLink::open(path, BAUD).map(drop);
    assert!(matches!(
        open("/dev/giotto-is-not-here"),
        Err(ControllerError::NoPort { .. })
    ));
    assert!(matches!(
        open("/dev/null"),
        Err(ControllerError::CannotOpen { .. })
    ));
}
