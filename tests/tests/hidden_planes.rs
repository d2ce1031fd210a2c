//! Effects of X, Y and Z hidden in circles of several planes, read from files as a user has them.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of a test fail as the test does"
)]
use giotto_tests::effects::{Case, Kind, Slides};
use giotto_tests::files;
use giotto_tests::machine::Plane;
use giotto_tests::study::{Outcome, Verdict, judge};
use rayon::prelude::*;

/// Z with X, Z itself.
const Z: Slides = Slides {
    pair: [2, 0],
    axis: Some(2),
};

fn answer(case: &Case) -> Outcome {
    let dir = tempfile::tempdir().unwrap();
    files::write(&case.hidden(), dir.path()).unwrap();
    Outcome::of(dir.path()).unwrap()
}

fn ask(names: &[&str], seed: u64, planes: &[Plane], slides: &[Slides]) -> (Outcome, Verdict) {
    let kind = Kind::Effects(names.iter().map(|s| (*s).to_owned()).collect());
    let case = Case::in_space(&kind, 3.0, seed, planes, slides).unwrap();
    let outcome = answer(&case);
    let verdict = judge(&case.hidden(), &outcome);
    (outcome, verdict)
}

/// Right set, each on its slides, nothing else.
fn wrong(names: &[&str], seed: u64, planes: &[Plane], slides: &[Slides]) -> Option<String> {
    let (_, v) = ask(names, seed, planes, slides);
    let right = v.exact && v.false_findings.is_empty() && v.axis.iter().all(|a| *a);
    (!right).then(|| format!("{names:?}, seed {seed}: {}", v.said))
}

fn none_wrong(wrong: Vec<String>) {
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn effects_of_z_are_named_on_z_from_zx_and_yz_circles() {
    let names = ["backlash", "reversal_spike", "cyclic_error", "straightness"];
    let planes = [vec![Plane::ZX], vec![Plane::YZ], vec![Plane::YZ, Plane::ZX]];
    let jobs: Vec<_> = planes
        .iter()
        .flat_map(|p| names.iter().map(move |n| (p, *n)))
        .collect();
    none_wrong(
        jobs.par_iter()
            .enumerate()
            .filter_map(|(row, (planes, name))| {
                let seed = 500 + row as u64;
                // In YZ the other slide of the pair is Y.
                let slides = if planes[0] == Plane::YZ && planes.len() == 1 {
                    Slides {
                        pair: [1, 2],
                        axis: Some(2),
                    }
                } else {
                    Z
                };
                wrong(&[name], seed, planes, &[slides])
            })
            .collect(),
    );
}

#[test]
fn circles_in_xy_say_nothing_of_z() {
    let names = ["backlash", "reversal_spike", "cyclic_error"];
    none_wrong(
        names
            .par_iter()
            .enumerate()
            .filter_map(|(row, name)| {
                let seed = 520 + row as u64;
                let (outcome, v) = ask(&[name], seed, &[Plane::XY], &[Z]);
                (!outcome.findings.is_empty() || outcome.unexplained)
                    .then(|| format!("{name}, seed {seed}: {}", v.said))
            })
            .collect(),
    );
}

#[test]
fn one_campaign_of_three_planes_holds_three_right_angles_and_three_scales() {
    let names = [
        "squareness",
        "squareness",
        "squareness",
        "scale_mismatch",
        "scale_mismatch",
        "scale_error",
    ];
    let on = |pair| Slides { pair, axis: None };
    let slides = [0, 1, 2, 0, 1, 2].map(|k| on(Plane::PAIRS[k]));
    none_wrong(
        (540_u64..544)
            .into_par_iter()
            .filter_map(|seed| wrong(&names, seed, &Plane::ALL, &slides))
            .collect(),
    );
}

#[test]
fn a_slide_seen_in_two_planes_is_one_finding() {
    none_wrong(
        ["backlash", "servo_mismatch"]
            .par_iter()
            .enumerate()
            .filter_map(|(row, name)| {
                let seed = 560 + row as u64;
                let (outcome, v) = ask(&[name], seed, &Plane::ALL, &[Z]);
                let times = outcome.findings.iter().filter(|f| f.cause == *name).count();
                // A pair that differs by a slide is seen in two planes, as two differences.
                let most = if *name == "backlash" { 1 } else { 3 };
                let right = v.exact && times <= most && v.axis.iter().all(|a| *a);
                (!right).then(|| format!("{name}, seed {seed}: {}", v.said))
            })
            .collect(),
    );
}

#[test]
#[ignore = "not met: two pairs that share a slide each tell half of a split, not the difference (yz −15.5 for −11.6e-6 s²)"]
fn a_slide_with_a_filter_of_its_own_differs_from_both_others() {
    none_wrong(
        wrong(&["bandwidth_mismatch"], 562, &Plane::ALL, &[Z])
            .into_iter()
            .collect(),
    );
}

#[test]
fn a_tilted_circle_shows_backlash_of_the_slide_that_has_it() {
    let planes = [
        Plane::XY,
        Plane::tilted([0.4, -0.3, 0.85]),
        Plane::tilted([-0.5, 0.6, 0.62]),
    ];
    none_wrong(
        (580_u64..583)
            .into_par_iter()
            .filter_map(|seed| wrong(&["backlash"], seed, &planes, &[Z]))
            .collect(),
    );
}

#[test]
fn nothing_is_found_in_three_planes_of_a_healthy_machine() {
    none_wrong(
        (600_u64..604)
            .into_par_iter()
            .filter_map(|seed| {
                let kind = Kind::Null(giotto_tests::effects::Null::Lag);
                let case = Case::in_space(&kind, 0.0, seed, &Plane::ALL, &[Slides::XY]).unwrap();
                let v = judge(&case.hidden(), &answer(&case));
                (!v.stated.is_empty() || v.said.ends_with("unexplained"))
                    .then(|| format!("seed {seed}: {}", v.said))
            })
            .collect(),
    );
}
