//! What the image takes, against the bars. Needs the emulator: `.ci/setup` brings it.
#![allow(
    clippy::unwrap_used,
    reason = "helpers of a test fail as the test does"
)]
use giotto_hil::size::{RAM_BAR, TEXT_BAR, measure};
use giotto_link::image::Board;

#[test]
fn the_image_meets_its_bars_and_cannot_panic() {
    let report = measure(Board::Mps2An386, &[], &mut |note| eprintln!("{note}")).unwrap();
    println!("{:#}", report.document());
    assert!(report.text <= TEXT_BAR, "{} bytes of text", report.text);
    assert!(report.ram() <= RAM_BAR, "{} bytes of RAM", report.ram());
    assert!(
        report.stack > 1000,
        "the stack was not measured: {}",
        report.stack
    );
    assert_eq!(report.panics, [""; 0]);
    // Where a call through a pointer leads is not known: there must be none.
    assert!(
        report.tick.indirect.is_empty(),
        "{:?}",
        report.tick.indirect
    );
    assert!(report.tick.functions.len() > 1);
}
