//! Made-up programs before LinuxCNC's interpreter, where it is installed; the whole study is `--bin nc`.
use giotto_tests::nc::canon::Rs274;
use giotto_tests::nc::{generate, grbl, judge, model, options};
use rayon::prelude::*;

const COUNT: u64 = 300;
/// Not those of the study.
const FIRST_SEED: u64 = 1_000_000;

#[test]
fn linuxcnc_runs_the_output_as_the_original() {
    let Some(rs274) = Rs274::find() else {
        println!("skipped: no rs274 (Debian: linuxcnc-uspace)");
        return;
    };
    let outcomes: Vec<_> = (FIRST_SEED..FIRST_SEED + COUNT)
        .into_par_iter()
        .map(|seed| judge(&rs274, seed))
        .collect();
    let wrong: Vec<&String> = outcomes.iter().filter_map(|o| o.as_ref().err()).collect();
    assert!(
        wrong.is_empty(),
        "{} differ, the first:\n{}",
        wrong.len(),
        wrong[0]
    );
    let corrected: usize = outcomes.iter().flatten().map(|o| o.corrected).sum();
    let run = outcomes.iter().flatten().filter(|o| o.runs).count();
    assert!(
        corrected > 1000 && run > 150,
        "{corrected} arcs, {run} programs"
    );
}

/// Without LinuxCNC as well: what a 32-bit reader makes of the output.
#[test]
fn a_small_controller_takes_what_it_took_before() {
    let mut compared = 0;
    for seed in FIRST_SEED..FIRST_SEED + COUNT {
        let program = generate::program(seed);
        let result = giotto_nc::compensate(program.as_bytes(), &model(), &options(seed));
        let output = String::from_utf8_lossy(&result.program).into_owned();
        compared += usize::from(grbl::read(&program).1.is_none());
        if let Err(words) = grbl::compare(&program, &output) {
            panic!("seed {seed}: {words}\n{program}\n---\n{output}");
        }
        // What is left needs no second look: the output of the output is refused by its mark, and a zero model changes nothing.
        assert!(!output.is_empty());
    }
    assert!(compared > 10, "{compared}");
}
