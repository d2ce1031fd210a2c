//! All scenarios on the virtual controller and on both boards under QEMU, and the stop switch. Needs the emulator:
//! `.ci/setup` brings it.
#![allow(
    clippy::unwrap_used,
    reason = "helpers of a test fail as the test does"
)]
use giotto_hil::scenarios::{self, Outcome, Scenario};
use giotto_hil::streams;
use giotto_link::emulator::{Emulator, Pace};
use giotto_link::{Board, Controller, OpenOptions, Port, circle, open};
use giotto_shared::Direction;
use giotto_shared::wire::{MotionState, Refusal};
use std::io::Write;

fn outcomes(port: &Port) -> Vec<(&'static str, Outcome)> {
    let run = |pace, scenarios: &[Scenario]| {
        let options = OpenOptions {
            pace,
            ..OpenOptions::default()
        };
        let mut controller = open(port, &options, &mut |note| eprintln!("{note}")).unwrap();
        scenarios
            .iter()
            .map(|s| (s.0, scenarios::run(s, &mut controller)))
            .collect::<Vec<_>>()
    };
    let all = run(Pace::Fast, &scenarios::ALL);
    // In the emulator time would run away from whoever sends or records every set-point.
    [all, run(Pace::Slow, &streams::ALL)].concat()
}

#[test]
fn virtual_controller() {
    for (name, outcome) in outcomes(&Port::Sim) {
        assert_eq!(outcome, Outcome::Passed, "{name}");
    }
}

#[test]
fn mps2_an386() {
    for (name, outcome) in outcomes(&Port::Qemu) {
        assert_eq!(outcome, Outcome::Passed, "{name}");
    }
}

/// QEMU has neither its clock nor its flash: the image falls back to the internal oscillator, answers, runs circles,
/// and refuses every table, since none reads back.
#[test]
fn stm32f405_runs_and_refuses_tables_that_do_not_read_back() {
    let outcomes = outcomes(&Port::QemuBoard(Board::Stm32f405));
    for (name, outcome) in &outcomes {
        let needs_flash = name.starts_with("flash") || name.starts_with("a table");
        let wanted = if needs_flash {
            Outcome::RefusedByFlash
        } else {
            Outcome::Passed
        };
        assert_eq!(*outcome, wanted, "{name}");
    }
    assert!(
        outcomes
            .iter()
            .any(|(_, outcome)| *outcome == Outcome::RefusedByFlash)
    );
}

/// The switch on UART1: pressed it ends the run and keeps the next one from starting, released it lets it start.
#[test]
fn stop_switch() {
    let emulator = Emulator::start(None, Pace::Fast, &mut |note| eprintln!("{note}")).unwrap();
    let mut switch = emulator.stream().unwrap();
    let mut controller =
        Controller::connect(Box::new(emulator.into_link().unwrap()), "qemu", 1).unwrap();
    controller.supervise(None).unwrap();
    let until = |controller: &mut Controller, wanted: &dyn Fn(MotionState, bool) -> bool| {
        (0..10_000).any(|_| {
            let status = controller.status().unwrap();
            wanted(status.motion, status.stop_input)
        })
    };
    controller
        .start_circle(&circle(0.1, 0.1, Direction::Ccw, 10_000))
        .unwrap();
    assert!(until(&mut controller, &|motion, _| motion == MotionState::Running));
    switch.write_all(b"!").unwrap();
    assert!(until(&mut controller, &|motion, pressed| motion
        == MotionState::Idle
        && pressed));
    let refused = controller.start_circle(&circle(0.1, 0.1, Direction::Ccw, 1));
    let refused = matches!(
        refused,
        Err(giotto_link::ControllerError::Refused(Refusal::Motion(_)))
    );
    assert!(refused && controller.status().unwrap().counters.stops == 1);
    switch.write_all(b".").unwrap();
    assert!(until(&mut controller, &|_, pressed| !pressed));
    controller
        .run_circle(&circle(0.1, 0.5, Direction::Ccw, 1), 8)
        .unwrap();
}
