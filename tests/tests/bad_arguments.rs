//! Every command with what is not the file it wants, a port that is not there, a place that cannot be written:
//! the contract's exit code, the words, what to do next, and nothing half done.
#![allow(clippy::unwrap_used, reason = "a test may fail where it stands")]
use giotto_tests::command::{giotto, outcome};
use std::fs;
use std::path::Path;

const PLAN: &str = "[campaign]\nname = \"bench\"\nmachine = \"mill\"\n[machine]\nboth = { kv_per_s = 40.0 }\n\
                    [grid]\nradii_mm = [50.0, 100.0]\nfeeds_mm_s = [20.0, 100.0, 200.0]\n";
const MODEL: &str = "format = 1\ncampaign = \"bench\"\nmachine = \"mill\"\n[servo]\nkind = \"lag\"\nkv_per_s = 40.0\n\
                     [valid]\nradius_mm = [50.0, 100.0]\nfeed_mm_s = [20.0, 200.0]\n";

/// Commands that read a file, `{}` standing for it.
const READERS: [&str; 18] = [
    "import {} --radius 100 --feed 100 --direction ccw -o new",
    "analyze {}",
    "fit {}",
    "diagnose {}",
    "plan {}",
    "report {} -o new",
    "simulate {} -o new",
    "compensate {} --model model.toml -o new",
    "compensate part.nc --model {} -o new",
    "table {} -o new",
    "table show {}",
    "flash {} --port sim",
    "verify {} --port sim",
    "bridge rsi --table {} --listen 127.0.0.1:0 --wait 1",
    "run program {} --port sim",
    "run stream {} --port sim",
    "analyze campaign --ballbar {}",
    "diagnose campaign --model {}",
];

/// What is not the file wanted, and a word of the answer.
const FILES: [(&str, &[u8], &str); 5] = [
    ("empty", b"", ""),
    ("empty.toml", b"", "is empty"),
    ("bad.json", b"{\"runs\": [", ""),
    ("bad.toml", b"format = 1\nservo = {", ""),
    ("noise.bin", &[7, 200, 0, 13, 255, 254, 1, 10, 99, 0], ""),
];

/// Talks to a port.
const TALKERS: [&str; 9] = [
    "status",
    "rollback",
    "bypass on",
    "verify table.bin",
    "flash table.bin",
    "monitor",
    "run circle --radius 50 --feed 100 --direction ccw",
    "run program part.nc",
    "run stream path.csv",
];

fn run(folder: &Path, line: &str) -> (i32, String, String) {
    outcome(
        &giotto()
            .args(line.split(' '))
            .current_dir(folder)
            .output()
            .unwrap(),
    )
}

fn lay_out(folder: &Path) {
    fs::write(folder.join("plan.toml"), PLAN).unwrap();
    fs::write(folder.join("model.toml"), MODEL).unwrap();
    fs::write(folder.join("part.nc"), "G0 X20 Y0\nG3 I-20 F1500\n").unwrap();
    fs::write(
        folder.join("path.csv"),
        "time_s,x_mm,y_mm\n0,0,0\n0.001,0.01,0\n",
    )
    .unwrap();
    fs::create_dir(folder.join("folder")).unwrap();
    for (name, bytes, _) in FILES {
        fs::write(folder.join(name), bytes).unwrap();
    }
    for line in [
        "simulate plan.toml -o campaign",
        "table model.toml -o table.bin",
    ] {
        let (code, _, errors) = run(folder, line);
        assert_eq!(code, 0, "{line}: {errors}");
    }
}

/// Exit code, no panic, one error that names the file, and a help.
fn refused(folder: &Path, line: &str, code: i32, names: &str) -> String {
    let (found, stdout, errors) = run(folder, line);
    assert_eq!(found, code, "giotto {line}\n{stdout}{errors}");
    assert!(
        errors.contains("error: ") && errors.contains(names),
        "giotto {line}\n{errors}"
    );
    assert!(
        errors.contains("help: "),
        "giotto {line} says not what to do\n{errors}"
    );
    assert!(!errors.contains("panicked"), "giotto {line}\n{errors}");
    assert!(
        !folder.join("new").exists(),
        "giotto {line} leaves something behind"
    );
    errors
}

#[test]
fn every_command_refuses_what_is_not_its_file() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    lay_out(folder);
    for reader in READERS {
        let with = |name: &str| reader.replace("{}", name);
        let errors = refused(folder, &with("missing"), 3, "missing");
        assert!(errors.contains("no such file"), "{errors}");
        refused(folder, &with("folder"), 3, "folder");
        for (name, _, word) in FILES {
            let errors = refused(folder, &with(name), 3, name);
            assert!(errors.contains(word), "giotto {}\n{errors}", with(name));
        }
    }
    // A line and a column where there is one to name.
    let errors = refused(folder, "diagnose campaign --model bad.toml", 3, "bad.toml");
    assert!(errors.contains("bad.toml:2:10:"), "{errors}");
    // So with a block that no controller can run.
    fs::write(folder.join("stop.nc"), "G1 X1 F100\n M0\n").unwrap();
    refused(
        folder,
        "run program stop.nc --port sim",
        3,
        "stop.nc:2:2: M0 waits",
    );
    fs::write(folder.join("far.nc"), "G1 X1 F100\nX1e9\n").unwrap();
    refused(
        folder,
        "run program far.nc --port sim",
        3,
        "far.nc:2:3: a word E",
    );
    fs::write(folder.join("far.nc"), "G1 X1 F100\nX2500\n").unwrap();
    refused(
        folder,
        "run program far.nc --port sim",
        3,
        "far.nc:2:1: position",
    );
    // A measurement whose circle is not given is wrong usage, no bad input.
    fs::write(folder.join("ball.csv"), "time_s,deviation_um\n0,1\n1,2\n").unwrap();
    for command in ["analyze", "fit", "diagnose", "plan"] {
        refused(
            folder,
            &format!("{command} ball.csv"),
            2,
            "ball.csv is no campaign",
        );
    }
}

#[test]
fn a_port_that_is_not_there_is_no_answer() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    lay_out(folder);
    for talker in TALKERS {
        for port in ["/dev/nowhere", "folder", "empty"] {
            refused(folder, &format!("{talker} --port {port}"), 4, port);
        }
        let (code, _, errors) = outcome(
            &giotto()
                .args(talker.split(' '))
                .args(["--port", ""])
                .current_dir(folder)
                .output()
                .unwrap(),
        );
        assert_eq!(code, 2, "giotto {talker} --port ''\n{errors}");
    }
    refused(folder, "status --port qemu --image nowhere", 4, "nowhere");
    refused(
        folder,
        "run circle --radius -5 --feed 100 --direction ccw --port sim",
        4,
        "radius",
    );
    refused(
        folder,
        "run circle --radius 5000 --feed 100 --direction ccw --port sim",
        4,
        "radius",
    );
    // What the controller refuses is named with its block; the part is too fast for it.
    fs::write(folder.join("fast.nc"), "F600 G1 X1\nG1 X2 F90000\n").unwrap();
    refused(
        folder,
        "run program fast.nc --port sim",
        4,
        "fast.nc:2:1: refused",
    );
}

/// Rows that are no set-points, each with its place; and what only the controller can refuse.
#[test]
fn a_stream_that_is_none_is_refused_with_the_place_of_its_fault() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    lay_out(folder);
    for (text, code, words) in [
        ("time_s,x_mm\n0,0\n", 3, "rows.csv: lacks a column"),
        (
            "time_s,x_mm,y_mm,w_mm\n0,0,0,0\n",
            3,
            "rows.csv: has a column \"w_mm\"",
        ),
        (
            "time_s,x_mm,x_mm\n0,0,0\n",
            3,
            "rows.csv: has two columns x_mm",
        ),
        (
            "time_s,x_mm,y_mm\n0,0,0\n",
            3,
            "rows.csv: has fewer than two rows",
        ),
        (
            "time_s,x_mm,y_mm\n0,0,0\n0.001,0\n",
            3,
            "rows.csv:3:1: 2 fields, expected 3",
        ),
        (
            "time_s,x_mm,y_mm\n0,0,0\n0.001,0,one\n",
            3,
            "rows.csv:3:9: \"one\", expected a number",
        ),
        (
            "time_s,x_mm,y_mm\n0,0,0\n0.001,0,nan\n",
            3,
            "rows.csv:3:9: \"nan\"",
        ),
        (
            "time_s,x_mm,y_mm\n0,0,0\n0.001,3000,0\n",
            3,
            "rows.csv:3:7: 3000 mm",
        ),
        (
            "x_mm,y_mm,time_s\n0,0,0\n\n0,0,0.003\n",
            3,
            "rows.csv:4:5: 0.003000 s after the first row",
        ),
        (
            "time_s,x_mm,y_mm\n0,0,0\n0.001,30,0\n0.002,0,0\n",
            4,
            "rows.csv:3:1: to this row: refused",
        ),
        (
            "time_s,x_mm,y_mm\n0,0,0\n0.001,1.5,0\n",
            4,
            "rows.csv:3:1: to this row: refused",
        ),
    ] {
        fs::write(folder.join("rows.csv"), text).unwrap();
        refused(folder, "run stream rows.csv --port sim", code, words);
    }
}

#[test]
fn what_cannot_be_written_is_said_with_its_path() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    lay_out(folder);
    for line in [
        "fit campaign -o folder",
        "simulate plan.toml -o campaign",
        "simulate plan.toml -o empty",
        "table model.toml -o folder",
        "compensate part.nc --model model.toml -o folder",
        "man -o empty",
        // Before anything moves: no controller was asked.
        "run circle --radius 50 --feed 100 --direction ccw --port /dev/nowhere -o folder",
        "run program part.nc --port /dev/nowhere -o folder",
        "run stream path.csv --port /dev/nowhere -o folder",
    ] {
        refused(folder, line, 3, line.rsplit(' ').next().unwrap());
    }
}

#[test]
fn wrong_usage_is_two_and_json_keeps_stdout_clean() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    lay_out(folder);
    for line in [
        "frobnicate",
        "analyze",
        "import",
        "run square --port sim",
        "run program part.nc --port sim --tolerance-mm -1",
        "run program part.nc --port sim --rapid 0",
        "run stream path.csv --port sim --every 0",
        "completions csh",
        "fit campaign --train-radius 77",
        "fit campaign --alpha 2",
        "monitor --port sim --interval 0",
        "plan campaign --runs 0",
        "compensate part.nc --model model.toml -o new --max-offset 0",
    ] {
        assert_eq!(run(folder, line).0, 2, "giotto {line}");
    }
    for line in [
        "--json analyze missing",
        "--json status --port /dev/nowhere",
        "--json table show noise.bin",
    ] {
        let (code, stdout, _) = run(folder, line);
        assert!(
            code > 2 && stdout.is_empty(),
            "giotto {line}: {code} {stdout}"
        );
    }
    for line in [
        "--json completions zsh",
        "--json man -o pages",
        "--json",
        "--json monitor --port sim --count 1",
    ] {
        let (code, stdout, errors) = run(folder, line);
        assert_eq!(code, 0, "giotto {line}\n{errors}");
        assert!(
            serde_json::from_str::<serde_json::Value>(&stdout).is_ok(),
            "giotto {line}\n{stdout}"
        );
    }
    let (code, stdout, errors) = run(folder, "--quiet fit campaign -o quiet.toml");
    assert!(
        code == 0 && errors.is_empty() && !stdout.contains('\x1b'),
        "{stdout}{errors}"
    );
    let (_, stdout, _) = run(folder, "monitor --port sim --count 2 --interval 0.01");
    assert!(
        !stdout.contains('\x1b') && stdout.matches("motion").count() == 2,
        "plain text off a terminal:\n{stdout}"
    );
}
