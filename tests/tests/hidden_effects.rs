//! The fast part of the study of hidden effects: fixed seeds, small campaigns, one of each kind.
//! `cargo run --release -p giotto-tests --bin power` runs the rest.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of a test fail as the test does"
)]
use giotto::diagnosis::{Options, diagnose};
use giotto_tests::effects::{Case, Keep, Kind, Null, Seat};
use giotto_tests::files;
use giotto_tests::machine::base::Variety;
use giotto_tests::study::{Outcome, Verdict, judge};
use rayon::prelude::*;

fn answer(case: &Case) -> Outcome {
    let dir = tempfile::tempdir().unwrap();
    files::write(&case.hidden(), dir.path()).unwrap();
    Outcome::of(dir.path()).unwrap()
}

fn ask(kind: &Kind, strength: f64, seed: u64) -> (Case, Verdict) {
    let case = Case::new(kind, strength, seed, Variety::Small).unwrap();
    let verdict = judge(&case.hidden(), &answer(&case));
    (case, verdict)
}

/// The slide that the first effect sits on; X if it is on both.
fn slide(case: &Case) -> usize {
    match case.truth[0].seat {
        Seat::Slide(slide) => slide,
        _ => 0,
    }
}

fn effects(names: &[&str]) -> Kind {
    Kind::Effects(names.iter().map(|s| (*s).to_owned()).collect())
}

fn all_exact(kinds: &[Kind]) {
    let wrong: Vec<String> = kinds
        .par_iter()
        .enumerate()
        .filter_map(|(row, kind)| {
            let seed = 100 + row as u64;
            let (_, v) = ask(kind, 3.0, seed);
            (!v.exact || !v.false_findings.is_empty())
                .then(|| format!("{kind}, seed {seed}: {}", v.said))
        })
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn single_effects_at_three_times_the_noise_are_named() {
    let kinds: Vec<Kind> = giotto_tests::effects::LISTED
        .iter()
        .map(|n| effects(&[n]))
        .collect();
    all_exact(&kinds);
}

#[test]
fn pairs_and_triples_are_taken_apart() {
    all_exact(&[
        effects(&["servo_mismatch", "backlash"]),
        effects(&["squareness", "scale_mismatch"]),
        effects(&["higher_order_dynamics", "scale_mismatch", "squareness"]),
        effects(&["vibration", "interpolation_chord"]),
    ]);
}

/// Teeth fill the slow runs; what lives in the others is found all the same, and the gain is that of whole circles.
#[test]
fn teeth_hide_nothing_else() {
    all_exact(&[
        effects(&["squareness", "stick_slip"]),
        effects(&["radius_offset", "stick_slip"]),
        effects(&["vibration", "stick_slip"]),
    ]);
    let (case, _) = ask(&effects(&["squareness", "stick_slip"]), 3.0, 11);
    let outcome = answer(&case);
    let noise_um = case.instrument.noise_m * 1e6;
    assert!(
        outcome.baseline_um < 8.0 * noise_um,
        "the centre is free: {} µm",
        outcome.baseline_um
    );
    assert!(
        outcome.extended_um < 0.8 * outcome.baseline_um,
        "{} µm",
        outcome.extended_um
    );
}

/// Amounts that bend a signature end where the machine has them, whatever grid they started from.
#[test]
fn shapes_are_climbed_to_the_truth() {
    let found = |name: &str, seed: u64| {
        let case = Case::new(&effects(&[name]), 10.0, seed, Variety::Small).unwrap();
        let diagnosis = diagnose(&case.campaign, &Options::default()).unwrap();
        let finding = diagnosis
            .findings
            .into_iter()
            .find(|f| f.cause.id() == name);
        (
            case,
            finding.unwrap_or_else(|| panic!("{name} was not found")),
        )
    };
    for seed in [1, 2, 3] {
        let (case, spike) = found("reversal_spike", seed);
        let friction = case.machine.axes[slide(&case)].friction.unwrap();
        let decay = spike.params["decay_s"] / friction.decay_s;
        assert!(
            (decay - 1.0).abs() < 0.05,
            "decay, seed {seed}: {decay} of the truth"
        );
        let (case, cyclic) = found("cyclic_error", seed);
        let truth = case.machine.geometry.cyclic[slide(&case)].unwrap();
        let pitch = 1e-3 * cyclic.params["pitch_mm"] / truth.pitch_m;
        assert!(
            (pitch - 1.0).abs() < 1e-3,
            "pitch, seed {seed}: {pitch} of the truth"
        );
    }
}

#[test]
fn nothing_is_found_where_nothing_is() {
    all_exact(&[Null::Noise, Null::Spread, Null::Lag, Null::Model].map(Kind::Null));
}

#[test]
fn what_has_no_name_is_left_unexplained() {
    all_exact(&[
        effects(&["unknown_third"]),
        effects(&["unknown_bump"]),
        effects(&["unknown_four_lobes"]),
    ]);
}

/// A step at a fixed place inside a slow stroke is one edge a stroke; teeth are many.
#[test]
fn a_step_at_a_place_is_no_stick_slip() {
    for seed in [389_000, 389_001] {
        let kind = effects(&["unknown_quadrant"]);
        let case = Case::new(&kind, 10.0, seed, Variety::Broad).unwrap();
        let verdict = judge(&case.hidden(), &answer(&case));
        assert!(
            verdict.exact && verdict.false_findings.is_empty(),
            "seed {seed}: {}",
            verdict.said
        );
    }
}

/// An inward pulse beside teeth is a piece of them.
#[test]
fn teeth_are_no_compensation_set_too_high() {
    let kind = effects(&["stick_slip"]);
    let case = Case::new(&kind, 1.0, 193_001, Variety::Broad).unwrap();
    let verdict = judge(&case.hidden(), &answer(&case));
    assert!(verdict.false_findings.is_empty(), "{}", verdict.said);
}

/// A loud tone is found where teeth make everything rough: its own leakage does not hide it.
#[test]
fn a_loud_vibration_beside_teeth_is_named() {
    for seed in [13_665_450_784_219_763_352, 13_665_450_784_219_763_345] {
        let case = Case::new(
            &effects(&["vibration", "stick_slip"]),
            3.0,
            seed,
            Variety::Broad,
        )
        .unwrap();
        let verdict = judge(&case.hidden(), &answer(&case));
        assert!(
            verdict.exact && verdict.false_findings.is_empty(),
            "seed {seed}: {}",
            verdict.said
        );
    }
}

/// What comes and goes in time takes many patterns, and a small bow of a guide would fit beside them.
#[test]
fn a_piece_of_what_has_no_name_gets_none() {
    for seed in [1_910_744_070_355_028_229, 1_910_744_070_355_028_237] {
        let case = Case::new(&effects(&["unknown_transient"]), 3.0, seed, Variety::Usual).unwrap();
        let verdict = judge(&case.hidden(), &answer(&case));
        assert!(
            verdict.exact && verdict.false_findings.is_empty(),
            "seed {seed}: {}",
            verdict.said
        );
    }
}

#[test]
fn the_papers_machine_shows_its_higher_order() {
    let (case, v) = ask(&effects(&["higher_order_dynamics"]), 30.0, 3);
    assert!(v.top_right && v.exact, "{}", v.said);
    assert!(
        case.truth[0].value < 0.0,
        "κ4/24 − κ2²/4 of a well damped second order is negative"
    );
}

#[test]
fn campaigns_too_poor_to_tell_get_no_guess() {
    for keep in [Keep::OneRun, Keep::OneFeed, Keep::OneRadius] {
        let mut case = Case::new(&Kind::Null(Null::Lag), 0.0, 7, Variety::Small).unwrap();
        keep.thin(&mut case.campaign);
        let outcome = answer(&case);
        assert!(
            outcome.findings.is_empty(),
            "{keep:?}: {:?}",
            outcome.findings
        );
    }
}

/// Open campaigns with their truth, where `GIOTTO_CAMPAIGNS` says they are.
#[test]
#[ignore = "needs GIOTTO_CAMPAIGNS, a folder of campaigns with truth.json"]
fn open_campaigns_come_out_as_their_truth_says() {
    let root = std::env::var_os("GIOTTO_CAMPAIGNS").expect("GIOTTO_CAMPAIGNS names a folder");
    let root = std::path::PathBuf::from(root);
    let mut seen = 0;
    for entry in std::fs::read_dir(&root).unwrap().filter_map(Result::ok) {
        let Ok(truth) = std::fs::read_to_string(entry.path().join("truth.json")) else {
            continue;
        };
        let truth: serde_json::Value = serde_json::from_str(&truth).unwrap();
        let outcome = Outcome::of(&entry.path()).unwrap();
        let said: Vec<&str> = outcome.findings.iter().map(|f| f.cause.as_str()).collect();
        let truths = truth["truth"].as_array().unwrap();
        let accepts = |t: &serde_json::Value| -> Vec<String> {
            t["accept"]
                .as_array()
                .unwrap()
                .iter()
                .filter_map(|a| a.as_str().map(str::to_owned))
                .collect()
        };
        let allowed: Vec<String> = truths.iter().flat_map(&accepts).collect();
        for cause in &said {
            let known = allowed.iter().any(|a| a.trim_start_matches('~') == *cause);
            assert!(known, "{}: {cause} is not there", entry.path().display());
        }
        for t in truths {
            let any = accepts(t);
            let found = any.iter().any(|a| said.contains(&a.as_str()))
                || (any.is_empty() && outcome.unexplained);
            assert!(
                found,
                "{}: {t} not found among {said:?}",
                entry.path().display()
            );
        }
        seen += 1;
    }
    assert!(seen > 0, "{}: no campaigns", root.display());
}
