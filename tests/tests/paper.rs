//! The paper's claims on simulated campaigns with its coefficients.
//! The full study, sample by sample with 1000 samples a turn: `cargo run --release -p giotto-tests --bin paper`.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of a test fail as the test does"
)]
use giotto::fit::{Offset, critical_f};
use giotto_tests::paper::Measurement;
use giotto_tests::paper::printed::{F1, F2, F21, HALF_BETA1, HALF_BETA2, follows};
use giotto_tests::paper::study::study;

/// Fewer samples than an instrument takes, so that 1000 seeds are quick: their noise weighs four times as much in the radius.
const QUICK: Measurement = Measurement {
    samples: 60,
    noise_m: 1e-6,
    spread_m: 0.5e-6,
    resolution_m: 0.1e-6,
};

#[test]
fn radii_not_fitted_are_predicted_and_intervals_hold_what_they_promise() {
    let s = study(1, 1000, QUICK, Offset::Joint).unwrap();
    for k in 0..2 {
        assert!(s.least_explained_percent[k] >= 99.5, "{s:?}");
        assert!(s.rms_um[k].0 <= 1.0, "{s:?}");
        assert!((93.0..=97.0).contains(&s.coverage_percent[k]), "{s:?}");
    }
    assert!(s.max_um <= 4.0, "{s:?}");
    assert_eq!(s.both_entered_percent, 100.0);
}

#[test]
fn subtracting_one_noisy_run_makes_the_intervals_too_narrow() {
    // The reason why `joint` is the default: the docs of `Offset::LowestSpeed` say so.
    let s = study(1, 1000, QUICK, Offset::LowestSpeed).unwrap();
    assert!(s.coverage_percent[0] < 93.0, "{s:?}");
}

#[test]
fn printed_numbers_that_follow_from_the_printed_model_do_and_the_others_do_not() {
    assert!((critical_f(0.05, 1, 24).unwrap() - 4.26).abs() < 0.005);
    let f = follows().unwrap();
    // A scatter between runs that gives the printed F1 is as large as the bound of 4 µm on every residual …
    assert!((4.0..5.0).contains(&f.scatter_um.unwrap()), "{F1}: {f:?}");
    // … and F2 is then three times the printed one, F2/1 half as much again: the paper's feeds were others.
    assert!(f.f2 > 3.0 * F2 && f.f21 > 1.4 * F21, "{f:?}");
    // Table 1's intervals cannot be those of f²/R and f⁴/R³ over these feeds, whatever the scatter: a ratio has no scatter in it.
    assert!((HALF_BETA1 / HALF_BETA2 - 16.0).abs() < 0.1);
    assert!((f.half_width_ratio - 46.0).abs() < 3.0, "{f:?}");
}
