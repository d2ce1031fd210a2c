//! The instructions of a tick, against their bars. Needs the emulator: `.ci/setup` brings it.
#![allow(
    clippy::unwrap_used,
    reason = "helpers of a test fail as the test does"
)]
use giotto_hil::ticks::{count, over};

/// As `giotto-hil ticks --check` has it; what was not counted is over its bar.
#[test]
fn no_tick_is_over_its_bar() {
    let counts = count(&mut |note| eprintln!("{note}")).unwrap();
    println!("{counts:#?}");
    assert_eq!(over(&counts), [""; 0], "{counts:?}");
}
