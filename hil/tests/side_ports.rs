//! The ports beside the link, on both boards under QEMU: set-points of every tick while the link stays free, and the log in words.
//! Needs the emulator: `.ci/setup` brings it.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of a test fail as the test does"
)]
use giotto_link::emulator::{Emulator, Pace, Setup};
use giotto_link::log::{Line, Words};
use giotto_link::{Board, Controller, circle, image};
use giotto_shared::Direction;
use giotto_shared::wire::{Accumulator, Command, FromController, MotionState, SetPoints};
use std::io::Read;
use std::os::unix::net::UnixStream;
use std::sync::mpsc::{Receiver, channel};

/// What comes to a socket, read as it comes, so that the emulator never waits.
fn read(mut socket: UnixStream) -> Receiver<Vec<u8>> {
    let (tell, hear) = channel();
    std::thread::spawn(move || {
        let mut bytes = [0; 4096];
        while let Ok(count @ 1..) = socket.read(&mut bytes) {
            if tell.send(bytes[..count].to_vec()).is_err() {
                return;
            }
        }
    });
    hear
}

fn batches(bytes: &[u8]) -> Vec<SetPoints> {
    let (mut accumulator, mut batches) = (Accumulator::new(), Vec::new());
    for &byte in bytes {
        let message = accumulator.push(byte).map(postcard::from_bytes);
        match message {
            Some(Ok(FromController::SetPoints(batch))) => batches.push(batch),
            None => {}
            Some(other) => panic!("{other:?} on the port for set-points"),
        }
    }
    assert_eq!(accumulator.counts().crc_errors, 0);
    batches
}

/// A circle, a run that is refused, a stop; and what came to the side ports meanwhile.
fn drive(board: Board) -> (u32, Vec<SetPoints>, Vec<Line>) {
    let mut note = |note: &str| eprintln!("{note}");
    let setup = Setup {
        held: true,
        ..Setup::default()
    };
    let emulator = Emulator::start_with(&setup, board, None, Pace::Stepped, &mut note).unwrap();
    let set_points = read(emulator.stream().unwrap());
    let log = read(emulator.log().unwrap());
    emulator.go().unwrap();
    let image = image::ensure_with(board, board.features(true), &mut note).unwrap();
    let link = emulator.into_link().unwrap();
    let mut controller = Controller::connect(Box::new(link), "qemu", 1).unwrap();
    controller
        .command(Command::Declare { place_nm: [0; 3] })
        .unwrap();
    let asked = controller.status().unwrap().tick;
    while controller.status().unwrap().tick < asked + 3 {}
    controller
        .start_circle(&circle(0.05, 0.3, Direction::Ccw, 1))
        .unwrap();
    assert!(
        controller
            .start_circle(&circle(0.05, 0.3, Direction::Ccw, 1))
            .is_err()
    );
    let mut asked = 0;
    // The link answers all the while.
    while controller.status().unwrap().motion != MotionState::Idle {
        asked += 1;
    }
    controller
        .start_circle(&circle(0.05, 0.1, Direction::Ccw, 1000))
        .unwrap();
    for _ in 0..100 {
        controller.status().unwrap();
    }
    controller.command(Command::Stop).unwrap();
    while controller.status().unwrap().motion != MotionState::Idle {}
    for _ in 0..20 {
        controller.status().unwrap();
    }
    drop(controller);
    let bytes = |port: Receiver<Vec<u8>>| port.iter().flatten().collect::<Vec<u8>>();
    let words = Words::of(&image).unwrap();
    let mut lines = Vec::new();
    let log = bytes(log);
    let disturbed = words.read(log.as_slice(), &mut |line| lines.push(line));
    assert_eq!(disturbed.unwrap(), 0);
    (asked, batches(&bytes(set_points)), lines)
}

fn looks_right(board: Board) {
    let (asked, batches, lines) = drive(board);
    // 0.05 m at 0.3 m/s takes a second and its ramps.
    assert!(asked > 20, "{asked} answers during a circle");
    let mut runs = vec![Vec::new()];
    for batch in &batches {
        let run = runs.last_mut().unwrap();
        if let Some((tick, _)) = run.last() {
            assert_eq!(batch.tick, tick + 1, "every tick, none twice");
        }
        assert_eq!(batch.every, 1);
        run.extend((batch.tick..).zip(&batch.points));
        if batch.last {
            runs.push(Vec::new());
        }
    }
    assert_eq!(
        runs.pop().map(|run| run.len()),
        Some(0),
        "each run has its last"
    );
    assert_eq!(runs.len(), 2);
    let on = |run: &[(u32, &giotto_shared::wire::SetPoint)]| {
        let radius = |p: [i32; 3]| f64::from(p[0]).hypot(f64::from(p[1]));
        let on =
            |(_, p): &&(u32, &giotto_shared::wire::SetPoint)| (radius(p.raw_nm) - 5e7).abs() < 3.0;
        run.iter().filter(on).count()
    };
    assert!(on(&runs[0]) > 1047, "{} points on the circle", on(&runs[0]));
    assert!(
        runs.iter()
            .flatten()
            .all(|(_, p)| p.raw_nm == p.corrected_nm)
    );
    // The log, in order and in time.
    let all: Vec<String> = lines
        .iter()
        .map(|line| format!("{} {}", line.level, line.words))
        .collect();
    let all = all.join("\n");
    let mut at = 0;
    for wanted in [
        "ticks a second",
        "Booted",
        "Declared",
        "Started",
        "warn Refused",
        "Rested",
        "Started",
        "Stopped",
        "Rested",
    ] {
        let found = all[at..].find(wanted);
        at += found.unwrap_or_else(|| panic!("no {wanted} in its place:\n{all}"));
    }
    let times: Vec<f64> = lines
        .iter()
        .map(|line| line.time.as_ref().unwrap().parse().unwrap())
        .collect();
    assert!(
        times.is_sorted() && *times.last().unwrap() > 1.0,
        "{times:?}"
    );
}

#[test]
fn mps2_an386() {
    looks_right(Board::Mps2An386);
}

#[test]
fn stm32f405() {
    looks_right(Board::Stm32f405);
}
