//! Flashing over a link that breaks a tenth of what passes, in every way there is.
#![allow(
    clippy::unwrap_used,
    reason = "helpers of a test fail as the test does"
)]
use giotto_hil::faults::{flash_over_faults, programs_over_faults};

/// Few frames here; `giotto-hil faults` runs 1e5.
#[test]
fn no_wrong_table_is_ever_in_use_and_flashing_succeeds() {
    for seed in 1..=3 {
        let report = flash_over_faults(4000, 0.1, seed).unwrap();
        assert_eq!(report.wrong, 0, "seed {seed}: {report:?}");
        assert!(
            report.flashes > 50 && report.repeats > 100,
            "seed {seed}: {report:?}"
        );
        for (fault, count) in report.tally.broken() {
            assert!(count > 20, "seed {seed}: {fault:?} {count} times");
        }
    }
}

/// Without faults nothing is repeated: the repeats above are the faults'.
#[test]
fn a_good_link_repeats_nothing() {
    let report = flash_over_faults(500, 0.0, 1).unwrap();
    assert_eq!((report.wrong, report.retries, report.repeats), (0, 0, 0));
    assert!(report.tally.broken().iter().all(|(_, count)| *count == 0));
}

#[test]
fn programs_end_where_they_should_whatever_the_link_does() {
    for seed in 1..=3 {
        let report = programs_over_faults(1000, 0.1, seed).unwrap();
        assert_eq!(report.astray, 0, "seed {seed}: {report:?}");
        assert!(
            report.programs > 10 && report.repeats > 30,
            "seed {seed}: {report:?}"
        );
    }
}
