//! The engine's rate on the 25 MHz image. Needs the emulator: `.ci/setup` brings it.
#![allow(
    clippy::unwrap_used,
    reason = "helpers of a test fail as the test does"
)]
use giotto_hil::rate::{IDLE_BAR_PERCENT, RATE_BAR_HZ, measure};

/// Both are counts of the emulated core, not of the clock on the wall.
#[test]
fn eight_thousand_ticks_a_second_leave_half_the_time() {
    let report = measure(&mut |note| eprintln!("{note}")).unwrap();
    println!("{:#}", report.document());
    assert!(report.tick_hz >= RATE_BAR_HZ, "{report:?}");
    assert!(
        (IDLE_BAR_PERCENT..100.0).contains(&report.idle_percent),
        "{report:?}"
    );
    assert_eq!(report.overruns, 0);
}
