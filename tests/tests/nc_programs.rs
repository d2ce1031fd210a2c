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

/// Highest memory of this process so far, MB; `None` where the system does not say.
fn peak_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kb: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kb / 1024.0)
}

/// 1e6 lines with 2.5e5 arcs of 200 sizes; alone, and optimised: `cargo test --release -p giotto-tests --test nc_programs --
/// --ignored --nocapture a_million_lines`.
#[test]
#[ignore = "measures time and memory, which must not be shared"]
fn a_million_lines() {
    let mut program = String::from("G21 G17 G90 G94 F3000\nG0 X0 Y0\n");
    for k in 0..250_000 {
        let r = 3.0 + 0.1 * f64::from(k % 200);
        let (x, y) = (20.0 + r, r);
        program += &format!(
            "G0 X0 Y0\nG1 X20\nG3 X{x:.3} Y{y:.3} J{r:.3}\nG1 Y{:.3}\n",
            y + 20.0
        );
    }
    let begin = std::time::Instant::now();
    let options = giotto_nc::Options::default();
    let mut out = std::io::sink();
    let arcs = giotto_nc::compensate_to(program.as_bytes(), &model(), &options, None, &mut out);
    let (seconds, peak) = (begin.elapsed().as_secs_f64(), peak_mb());
    let arcs = arcs.expect("a sink takes everything");
    let corrected = |a: &&giotto_nc::Report| matches!(a.fate, giotto_nc::Fate::Corrected { .. });
    let count = arcs.iter().filter(corrected).count();
    println!(
        "{count} of {} arcs in {seconds:.2} s, {peak:?} MB at most",
        arcs.len()
    );
    assert_eq!(arcs.len(), 250_000);
    assert!(
        count > 200_000 && seconds <= 5.0,
        "{count} arcs, {seconds} s"
    );
    assert!(peak.is_none_or(|mb| mb <= 100.0), "{peak:?} MB");
}
