//! What the image takes, against the bars. Needs the emulator: `.ci/setup` brings it.
#![allow(
    clippy::unwrap_used,
    reason = "helpers of a test fail as the test does"
)]
use giotto_hil::size::{RAM_BAR, Report, TEXT_BAR, measure};
use giotto_link::image::Board;

#[test]
fn the_image_meets_its_bars_and_cannot_panic() {
    let report = meets_its_bars(&[]);
    assert_eq!(report.panics, [""; 0]);
}

/// The crate that checks signatures has slices whose bounds the compiler does not see: what it links for them is in the image that has
/// it, and nothing else of that kind; the tick does not reach it.
#[test]
fn the_tick_of_the_image_that_checks_signatures_cannot_panic() {
    let report = meets_its_bars(&["signed"]);
    assert_eq!(report.panics_in_tick(), [""; 0]);
    // The first two are one function, folded by the linker, under either name.
    let slices = ["slice_index_fail", "panic_bounds_check", "panic_fmt"];
    let known = |name: &String| slices.iter().any(|slice| name.contains(slice));
    assert!(report.panics.iter().all(known), "{:?}", report.panics);
}

fn meets_its_bars(features: &[&str]) -> Report {
    let board = Board::Mps2An386;
    let report = measure(board, features, &mut |note| eprintln!("{note}")).unwrap();
    println!("{:#}", report.document());
    assert!(report.text <= TEXT_BAR, "{} bytes of text", report.text);
    assert!(report.ram() <= RAM_BAR, "{} bytes of RAM", report.ram());
    assert!(
        report.stack > 1000,
        "the stack was not measured: {}",
        report.stack
    );
    // Where a call through a pointer leads is not known: there must be none.
    assert!(
        report.tick.indirect.is_empty(),
        "{:?}",
        report.tick.indirect
    );
    assert!(report.tick.functions.len() > 1);
    report
}
