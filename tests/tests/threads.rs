//! Results are the same bit for bit whatever the number of threads.
#![allow(clippy::unwrap_used, reason = "a test may fail where it stands")]
use giotto_tests::command::{giotto, outcome};
use std::fmt::Write as _;
use std::path::Path;

/// Two radii, three feeds, both directions, on a machine with geometry and a reversal error.
const PLAN: &str = r#"
[campaign]
name = "threads"
machine = "simulated"
[machine]
squareness_um_per_m = 80.0
both = { omega_n_rad_s = 38.0, zeta = 0.72 }
x = { backlash_um = 8.0 }
[instrument]
noise_um = 1.0
spread_um = 0.2
resolution_um = 0.1
setup_spread_um = 5.0
[grid]
radii_mm = [100.0, 200.0]
feeds_mm_s = [50.0, 300.0, 600.0]
directions = ["ccw", "cw"]
order = "random"
"#;

/// What a command prints with so many threads.
fn printed(threads: u32, folder: &Path, arguments: &[&str]) -> String {
    let mut command = giotto();
    command
        .args(arguments)
        .current_dir(folder)
        .env("RAYON_NUM_THREADS", threads.to_string());
    let (code, out, err) = outcome(&command.output().unwrap());
    assert_eq!(code, 0, "{arguments:?} with {threads} threads: {err}");
    out
}

#[test]
fn any_number_of_threads_prints_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("plan.toml"), PLAN).unwrap();
    // One long foreign run: many blocks of rows, many chunks of points.
    let rows = 150_000;
    let mut text = "time,pos0,pos1,pos2\n".to_owned();
    for k in 0..rows {
        let turn = std::f64::consts::TAU * f64::from(k) / f64::from(rows);
        let radius = 100.03 + 0.002 * (f64::from(k) * 0.618).sin() + 0.01 * (2.0 * turn).cos();
        let (sin, cos) = turn.sin_cos();
        let (x, t) = (radius * cos, turn * 5.0);
        writeln!(
            text,
            "{t:.6},{:.6},{:.6},{:.6}",
            40.0 + x,
            radius * sin,
            7.0 + 0.02 * x
        )
        .unwrap();
    }
    std::fs::write(at.join("long.csv"), text).unwrap();
    let once = |threads: u32| -> Vec<String> {
        let name = format!("campaign{threads}");
        printed(
            threads,
            at,
            &["simulate", "plan.toml", "--seed", "3", "-o", &name],
        );
        let mut files: Vec<_> = std::fs::read_dir(at.join(&name))
            .unwrap()
            .map(|e| e.unwrap().path())
            .collect();
        files.sort();
        let mut all: Vec<String> = files
            .iter()
            .map(|f| std::fs::read_to_string(f).unwrap())
            .collect();
        for command in [&["analyze"][..], &["fit"], &["diagnose", "--seed", "5"]] {
            all.push(printed(
                threads,
                at,
                &[command, &[&name, "--json"]].concat(),
            ));
        }
        all.push(printed(
            threads,
            at,
            &[
                "analyze", "long.csv", "--radius", "100", "--feed", "20", "--json",
            ],
        ));
        all
    };
    let one = once(1);
    assert!(one.len() > 12 && one.iter().all(|text| text.len() > 100));
    for threads in [2, 5] {
        for (a, b) in one.iter().zip(once(threads)) {
            assert!(*a == b, "{threads} threads differ:\n{a}\n{b}");
        }
    }
}
