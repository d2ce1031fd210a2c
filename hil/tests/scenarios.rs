//! All scenarios on the virtual controller and on both boards under QEMU, and the stop switch. Needs the emulator:
//! `.ci/setup` brings it.
#![allow(
    clippy::unwrap_used,
    reason = "helpers of a test fail as the test does"
)]
use giotto_hil::scenarios::{self, Outcome};
use giotto_hil::streams;
use giotto_link::emulator::{Emulator, Pace};
use giotto_link::link::Link;
use giotto_link::{Board, Controller, OpenOptions, Port, circle, open};
use giotto_shared::Direction;
use giotto_shared::path::smoothstep;
use giotto_shared::wire::{MotionState, Refusal};
use std::io::Write;
use std::time::Duration;

fn outcomes(port: &Port) -> Vec<(&'static str, Outcome)> {
    let options = OpenOptions::default();
    let mut controller = open(port, &options, &mut |note| eprintln!("{note}")).unwrap();
    scenarios::ALL
        .iter()
        .chain(&streams::ALL)
        .map(|s| (s.0, scenarios::run(s, &mut controller)))
        .collect()
}

/// A computer that is busy elsewhere: it comes to a request or an answer a third of a second late now and then.
struct Busy<L> {
    inner: L,
    turns: u32,
}

impl<L> Busy<L> {
    fn turn(&mut self) {
        self.turns += 1;
        if self.turns.is_multiple_of(40) {
            std::thread::sleep(Duration::from_millis(300));
        }
    }
}

impl<L: Link> Link for Busy<L> {
    fn send(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        self.turn();
        self.inner.send(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], until: Duration) -> std::io::Result<usize> {
        self.turn();
        self.inner.receive(buffer, until)
    }

    fn now(&self) -> Duration {
        self.inner.now()
    }
}

/// What a controller does in the emulator does not depend on how soon this computer comes round to it.
#[test]
fn a_busy_computer_changes_nothing() {
    let run = |busy: bool| {
        let emulator =
            Emulator::start(None, Pace::Stepped, &mut |note| eprintln!("{note}")).unwrap();
        let link = emulator.into_link().unwrap();
        let link: Box<dyn Link> = if busy {
            Box::new(Busy {
                inner: link,
                turns: 0,
            })
        } else {
            Box::new(link)
        };
        let mut controller = Controller::connect(link, "qemu", 1).unwrap();
        // 50 mm along X and back to rest, in a second.
        let places: Vec<[i32; 3]> = (0..=1000)
            .map(|n| {
                let x = smoothstep(f64::from(n) * 1e-3).value * 5e7;
                [x.round() as i32, 0, 0]
            })
            .collect();
        controller.run_stream(&places, 0.5, 1).unwrap()
    };
    let (quiet, busy) = (run(false), run(true));
    assert_eq!((busy.missing, busy.late, busy.rejected), (0, 0, 0));
    assert_eq!(quiet.recording.points.len(), busy.recording.points.len());
    for (a, b) in quiet.recording.points.iter().zip(&busy.recording.points) {
        assert_eq!(a, b);
    }
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
    let emulator = Emulator::start(None, Pace::Stepped, &mut |note| eprintln!("{note}")).unwrap();
    let mut switch = emulator.stream().unwrap();
    let mut controller =
        Controller::connect(Box::new(emulator.into_link().unwrap()), "qemu", 1).unwrap();
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
