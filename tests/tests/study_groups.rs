//! A few campaigns of each group of the power study, on seeds for tuning: the bars of the issues in small. A group that
//! the diagnosis does not master yet is ignored with what it needs; `power --tune --group NAME` runs it at length.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of a test fail as the test does"
)]
use giotto_tests::files;
use giotto_tests::study::groups::right;
use giotto_tests::study::seeds::TUNING;
use giotto_tests::study::sheet::Row;
use giotto_tests::study::{Group, Order, Outcome, judge, schedule};
use rayon::prelude::*;

/// Asks for `most` campaigns of a group; all must be right, promise nothing false, gain nothing negative.
fn hold(group: Group, most: usize) {
    let jobs = schedule(&Order {
        range: TUNING,
        round: 7,
        each: 2,
        groups: vec![group],
        only: None,
        most: Some(most),
    });
    assert_eq!(jobs.len(), most);
    let wrong: Vec<String> = jobs
        .par_iter()
        .filter_map(|job| {
            let case = job.kind.hidden(job.strength, job.seed).unwrap();
            let dir = tempfile::tempdir().unwrap();
            files::write(&case, dir.path()).unwrap();
            let place = format!("{} at {}×, seed {}", job.kind, job.strength, job.seed);
            let outcome = match Outcome::of(dir.path()) {
                Ok(outcome) => outcome,
                Err(words) => return Some(format!("{place}: {words}")),
            };
            let row = Row {
                job: job.clone(),
                verdict: judge(&case, &outcome),
                seconds: 0.0,
            };
            let v = &row.verdict;
            let sure_and_wrong = v.stated.iter().any(|s| s.0 > 0.99 && !s.1);
            let named = v.spoilt_named != Some(false);
            let held = right(&row) && named && !sure_and_wrong && !v.negative_gain && !v.bad_flash;
            let mut why = Vec::new();
            if !right(&row) {
                why.push("not right");
            }
            if v.negative_gain || v.bad_flash {
                why.push("no gain");
            }
            if !named {
                why.push("spoilt run not named");
            }
            (!held).then(|| format!("{place}: {} ({})", v.said, why.join(", ")))
        })
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

macro_rules! groups {
    ($($(#[$attribute:meta])* $name:ident: $group:ident, $most:expr;)*) => {
        $($(#[$attribute])* #[test] fn $name() { hold(Group::$group, $most); })*
    };
}

groups! {
    single_effects_in_broad_laboratories: Single, 4;
    pairs: Pair, 3;
    nulls: Null, 4;
    unlisted: Unlisted, 3;
    permuted: Permuted, 2;
    other_laws: Laws, 6;
    nulls_with_scatter_of_every_kind: Scatter, 12;
    robots: Robot, 4;
    arms_taken_for_slides: ArmAsSlides, 2;
    small_sessions_of_nothing: SmallNull, 5;
    delay_unknown: Delay, 4;
    waves_of_any_order_and_law: Wave, 6;
    arcs: Arc, 5;
    one_spoilt_run: Spoilt, 6;
    a_common_override: Override, 4;
    from_rest_to_rest: Ramps, 4;
    planes: Planes, 6;
    sound_arms: ArmSound, 4;
    arms_with_one_fault: ArmSingle, 7;
    arms_at_four_places: ArmPlaces, 2;
    arms_with_two_faults: ArmPair, 2;
    small_sessions: Small, 5;
}
