//! The protocol as someone reads it who has nothing but the guide: `tests/protocol/reader.py` against the emulated board.
//! Needs the emulator (`.ci/setup` brings it) and python3.
#![allow(
    clippy::unwrap_used,
    reason = "helpers of a test fail as the test does"
)]
use giotto_link::emulator::{Emulator, Pace};
use giotto_link::serve::serve;
use giotto_link::virtual_controller::VirtualLink;
use std::process::Command;
use std::sync::mpsc::channel;

fn reads(link: impl giotto_link::link::Link + 'static) {
    let (tell, hear) = channel();
    // Serves until this process ends.
    std::thread::spawn(move || {
        serve(link, &mut |path| tell.send(path.to_owned()).unwrap()).map(drop)
    });
    let port = hear.recv().unwrap();
    let reader = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/protocol/reader.py");
    let output = Command::new("python3")
        .arg(reader)
        .arg(&port)
        .output()
        .unwrap();
    let (out, error) = (
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr),
    );
    assert!(
        output.status.success() && out.starts_with("ok: "),
        "{out}{error}"
    );
}

#[test]
fn a_second_reader_understands_the_virtual_controller() {
    reads(VirtualLink::new());
}

#[test]
fn a_second_reader_understands_the_emulated_board() {
    let emulator = Emulator::start(None, Pace::Stepped, &mut |note| eprintln!("{note}")).unwrap();
    reads(emulator.into_link().unwrap());
}
