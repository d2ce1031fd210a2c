//! What a person at the machine does from a terminal, against a controller that another process serves: stop, Ctrl-C, feed hold,
//! override, reset, limits, log. On a pty, by the clock.
#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of a test fail as the test does"
)]
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

fn giotto() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_giotto"));
    command.env("NO_COLOR", "1").stdin(Stdio::null());
    command
}

/// `giotto controller sim`, ended with the test.
struct Served {
    process: Child,
    port: String,
}

impl Served {
    fn start() -> Self {
        let mut process = giotto()
            .args(["controller", "sim"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(process.stdout.as_mut().unwrap())
            .read_line(&mut line)
            .unwrap();
        let port = line.trim().strip_prefix("port: ").unwrap().to_owned();
        Self { process, port }
    }

    fn command(&self, words: &[&str]) -> Command {
        let mut command = giotto();
        command.args(words).args(["--port", &self.port]);
        command
    }

    fn run(&self, words: &[&str]) -> Output {
        self.command(words).output().unwrap()
    }

    /// Its exit code, and what it said on both streams.
    fn said(&self, words: &[&str]) -> (i32, String) {
        said(&self.run(words))
    }

    fn json(&self, words: &[&str]) -> serde_json::Value {
        let output = self.run(&[words, &["--json"]].concat());
        serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{output:?}"))
    }

    /// A long circle, in a process of its own, once it moves: its first set-points have come.
    fn circle(&self, folder: &std::path::Path) -> Child {
        let output = folder.join("points.csv");
        let mut command = self.command(&["run", "circle", "--radius", "50", "--feed", "100"]);
        command.args(["--direction", "ccw", "--laps", "100", "--every", "10", "-o"]);
        let child = command
            .arg(output)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(1500));
        child
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn said(output: &Output) -> (i32, String) {
    let text = [&output.stdout[..], &output.stderr[..]].concat();
    (
        output.status.code().unwrap_or(-1),
        String::from_utf8_lossy(&text).into_owned(),
    )
}

/// The rows of what was recorded: not all of the run, and the last ones where the machine came to rest.
fn recorded(folder: &std::path::Path) {
    let text = std::fs::read_to_string(folder.join("points.csv")).unwrap();
    let rows: Vec<&str> = text.lines().skip(1).collect();
    assert!(rows.len() > 50, "{} rows", rows.len());
    let place = |row: &str| row.split_once(',').unwrap().1.to_owned();
    let x = |row: &str| row.split(',').nth(1).unwrap().parse::<f64>().unwrap();
    // At rest the last set-points are as good as the same.
    let (last, before) = (rows[rows.len() - 1], rows[rows.len() - 2]);
    assert!(
        (x(last) - x(before)).abs() < 0.02,
        "{} and {}",
        place(before),
        place(last)
    );
}

#[test]
fn another_program_s_run_can_be_stopped() {
    let (served, folder) = (Served::start(), tempfile::tempdir().unwrap());
    let run = served.circle(folder.path());
    let asked = Instant::now();
    let (code, words) = served.said(&["stop"]);
    assert!(
        code == 0 && words.contains("asked to stop"),
        "{code}: {words}"
    );
    let (code, words) = said(&run.wait_with_output().unwrap());
    assert!(asked.elapsed() < Duration::from_secs(10));
    assert!(
        code != 0 && words.contains("stopped before its end"),
        "{code}: {words}"
    );
    recorded(folder.path());
    // And when nobody has the port.
    let (code, words) = served.said(&["stop"]);
    assert!(
        code == 0 && words.contains("nothing ran"),
        "{code}: {words}"
    );
    let stopped = served.json(&["stop"]);
    assert_eq!(stopped["ran"], false);
    let (_, log) = served.said(&["log", "--once"]);
    let order = ["a run began", "stop asked for", "at rest"].map(|words| log.find(words).unwrap());
    assert!(order.is_sorted(), "{log}");
}

/// While another program has the port: a feed hold stands still, a resume goes on to the end.
#[test]
fn another_program_s_run_can_be_held_and_resumed() {
    let (served, folder) = (Served::start(), tempfile::tempdir().unwrap());
    let output = folder.path().join("points.csv");
    let mut command = served.command(&["run", "circle", "--radius", "30", "--feed", "100"]);
    let run = command
        .args(["--direction", "ccw", "--laps", "2", "--every", "10", "-o"])
        .arg(&output)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(1500));
    for wish in ["hold", "resume"] {
        let (code, words) = served.said(&["feed", wish]);
        assert!(code == 0 && words.contains("asked for"), "{code}: {words}");
        std::thread::sleep(Duration::from_millis(2500));
    }
    let (code, words) = said(&run.wait_with_output().unwrap());
    assert_eq!(code, 0, "{words}");
    let text = std::fs::read_to_string(&output).unwrap();
    let places: Vec<&str> = text
        .lines()
        .map(|row| row.split_once(',').unwrap().1)
        .collect();
    // Rows of the hold are the same: longer than any standstill of a run without one.
    let longest = places
        .chunk_by(|a, b| a == b)
        .map(<[&str]>::len)
        .max()
        .unwrap();
    assert!(longest > 100, "{longest} rows of 10 ms at rest");
}

#[test]
fn ctrl_c_stops_the_machine_and_keeps_what_was_recorded() {
    let (served, folder) = (Served::start(), tempfile::tempdir().unwrap());
    let run = served.circle(folder.path());
    let interrupt = Command::new("kill")
        .args(["-INT", &run.id().to_string()])
        .status();
    assert!(interrupt.unwrap().success());
    let (code, words) = said(&run.wait_with_output().unwrap());
    assert!(
        code == 130 && words.contains("what was recorded is kept"),
        "{code}: {words}"
    );
    recorded(folder.path());
    assert_eq!(served.json(&["status"])["motion"], "idle");
}

#[test]
fn the_feed_is_overridden_and_a_hold_needs_something_that_runs() {
    let served = Served::start();
    let seconds = || {
        let circle = [
            "run",
            "circle",
            "--radius",
            "20",
            "--feed",
            "100",
            "--direction",
            "cw",
        ];
        served.json(&circle)["duration_s"].as_f64().unwrap()
    };
    let full = seconds();
    assert_eq!(served.said(&["feed", "50"]).0, 0);
    let half = seconds();
    // One turn of the circle takes twice as long; the ramps, which are shorter, are added.
    assert!((1.5..2.1).contains(&(half / full)), "{full} and {half} s");
    for wrong in ["19", "121", "fast", ""] {
        assert_eq!(served.said(&["feed", wrong]).0, 2, "{wrong}");
    }
    let (code, words) = served.said(&["feed", "hold"]);
    assert!(code == 4 && words.contains("refused"), "{code}: {words}");
}

#[test]
fn limits_are_shown_changed_kept_and_refused() {
    let served = Served::start();
    let before = served.json(&["config", "get"]);
    assert_eq!(before["stored"], false);
    assert_eq!(before["config"]["feed_mm_s"], 1000.0);
    let set = ["config", "set", "feed_mm_s=500", "soft_x_mm=-100,100"];
    assert_eq!(served.said(&set).0, 0);
    assert_eq!(served.said(&["config", "save"]).0, 0);
    let after = served.json(&["config", "get"]);
    assert_eq!(after["stored"], true);
    assert_eq!(after["config"]["feed_mm_s"], 500.0);
    // Beyond a soft limit, and beyond the feed: refused before it moves, with the reason.
    let circle = |radius: &str, feed: &str| {
        served.said(&[
            "run",
            "circle",
            "--radius",
            radius,
            "--feed",
            feed,
            "--direction",
            "cw",
        ])
    };
    let (code, words) = circle("101", "100");
    assert!(code == 4 && words.contains("soft limit"), "{code}: {words}");
    let (code, words) = circle("50", "600");
    assert!(
        code == 4 && words.to_lowercase().contains("feed"),
        "{code}: {words}"
    );
    assert_eq!(served.json(&["status"])["counters"]["segments"], 0);
    for (wrong, code) in [
        ("nothing=1", 2),
        ("feed_mm_s=fast", 2),
        ("soft_x_mm=1", 2),
        ("feed_mm_s=-5", 4),
        ("soft_x_mm=5,-5", 4),
        ("feed_mm_s=99999", 4),
    ] {
        assert_eq!(served.said(&["config", "set", wrong]).0, code, "{wrong}");
    }
    // What would be taken is said in the unit of the name, and it is taken.
    let (_, words) = served.said(&["config", "set", "acceleration_mm_s2=1e9"]);
    assert!(words.contains("up to 1000000"), "{words}");
    assert_eq!(
        served
            .said(&["config", "set", "acceleration_mm_s2=1000000"])
            .0,
        0
    );
    assert_eq!(
        served
            .said(&["config", "set", "acceleration_mm_s2=1000001"])
            .0,
        4
    );
}

#[test]
fn a_reset_says_where_the_machine_stands() {
    let served = Served::start();
    let reset = served.json(&["reset", "--at", "10,-5.5,1"]);
    assert_eq!(reset["place_mm"], serde_json::json!([10.0, -5.5, 1.0]));
    assert_eq!(reset["position"], "known");
    let again = served.json(&["reset"]);
    assert_eq!(again["place_mm"], reset["place_mm"]);
    for wrong in ["1,2", "1,2,3,4", "1,2,nan", "2101,0,0", "a,b,c"] {
        assert_eq!(served.said(&["reset", "--at", wrong]).0, 2, "{wrong}");
    }
}

/// Exit code 5 if part of the path was not corrected: without a table none of it is.
#[test]
fn a_correction_that_is_required_is_missed() {
    let served = Served::start();
    let run = [
        "run",
        "circle",
        "--radius",
        "20",
        "--feed",
        "100",
        "--direction",
        "cw",
    ];
    assert_eq!(served.said(&run).0, 0);
    let (code, words) = served.said(&[&run[..], &["--require-correction"]].concat());
    assert!(code == 5 && words.contains("no table"), "{code}: {words}");
}

/// From an open controller to one that knows its owner, and on to the next owner; what is refused says what to do.
#[test]
fn a_controller_takes_its_owner_s_tables_in_order() {
    let served = Served::start();
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let model = "format = 2\ncampaign = \"lab\"\nmachine = \"mill\"\n[servo]\nkind = \"lag\"\nkv_per_s = 50.0\n\
                 [valid]\nradius_mm = [50.0, 150.0]\nfeed_mm_s = [20.0, 300.0]\n";
    std::fs::write(at("model.toml"), model).unwrap();
    let alone = |words: &[&str]| said(&giotto().args(words).output().unwrap());
    for key in ["owner", "heir"] {
        assert_eq!(alone(&["key", "new", &at(key)]).0, 0);
    }
    let refused = |words: &[&str], why: &str, help: &str| {
        let (code, text) = served.said(words);
        assert_eq!(code, 4, "{text}");
        assert!(text.contains(why) && text.contains(help), "{text}");
    };
    let (model, owner, heir) = (at("model.toml"), at("owner"), at("heir"));
    assert_eq!(served.json(&["key", "show"])["key"], "none");
    refused(
        &["key", "replace", &owner, &heir],
        "no key that",
        "giotto key provision",
    );
    assert_eq!(served.said(&["key", "provision", &owner]).0, 0);
    refused(&["flash", &model], "not signed", "--key FILE");
    refused(
        &["key", "provision", &heir],
        "already",
        "giotto key replace",
    );
    assert_eq!(served.said(&["flash", &model, "--key", &owner]).0, 0);
    let shown = served.json(&["key", "show"]);
    assert_eq!(
        (&shown["key"], &shown["serial"], &shown["number"]),
        (&"kept".into(), &1.into(), &1.into())
    );
    // Signed elsewhere, for this machine, and for another one.
    let machine = shown["machine"].as_str().unwrap();
    let signed = |machine: &str, serial: &str, file: &str| {
        let words = ["key", "sign", &model, "--key", &owner, "--machine", machine];
        let output = giotto()
            .args(words)
            .args(["--serial", serial, "-o", file])
            .output();
        assert_eq!(said(&output.unwrap()).0, 0);
    };
    let (second, third, theirs) = (at("second.bin"), at("third.bin"), at("theirs.bin"));
    signed(machine, "2", &second);
    signed(machine, "3", &third);
    signed("0102030405060708090a0b0c", "9", &theirs);
    refused(&["flash", &theirs], "another machine", "giotto key show");
    assert_eq!(served.said(&["flash", &third]).0, 0);
    refused(&["flash", &second], "serial 2", "sign it again");
    refused(&["flash", &third], "already confirmed serial 3", "rollback");
    assert!(alone(&["table", "show", &third]).1.contains("serial 3"));
    // Handed on.
    refused(
        &["key", "replace", &heir, &heir],
        "not by the owner",
        "giotto key show",
    );
    assert_eq!(
        served.json(&["key", "replace", &owner, &heir])["corrects"],
        false
    );
    refused(
        &["flash", &model, "--key", &owner],
        "does not fit",
        "--key FILE",
    );
    assert_eq!(served.said(&["flash", &model, "--key", &heir]).0, 0);
    let shown = served.json(&["key", "show"]);
    assert_eq!((&shown["serial"], &shown["number"]), (&4.into(), &2.into()));
}

/// Limits of each axis and the rate outlive a restart; what the controller does not take says its range.
#[test]
fn limits_by_axis_and_the_rate_are_stored() {
    let served = Served::start();
    let set = [
        "config",
        "set",
        "offset_rate_mm_s=150",
        "offset_rate_z_mm_s=20",
    ];
    let steps = ["tick_hz=500", "step_x_mm=5,3200", "step_z_mm=0.01,1"];
    assert_eq!(served.said(&[&set[..], &steps].concat()).0, 0);
    assert!(
        served
            .said(&["config", "save"])
            .1
            .contains("giotto reset --restart")
    );
    assert_eq!(served.json(&["status"])["tick_hz"], 1000);
    assert_eq!(served.said(&["reset", "--restart"]).0, 0);
    assert_eq!(served.json(&["status"])["tick_hz"], 500);
    let shown = served.json(&["config", "get"]);
    let config = &shown["config"];
    assert_eq!(shown["stored"], true);
    assert_eq!(config["offset_rate_x_mm_s"], 150.0);
    assert_eq!(config["offset_rate_z_mm_s"], 20.0);
    assert_eq!(config["step_x_mm"], serde_json::json!([0.003125, 2]));
    for (value, range) in [
        ("tick_hz=100", "250"),
        ("tick_hz=30000", "20000"),
        ("offset_rate_y_mm_s=1100", "up to 1000"),
        ("step_y_mm=2,1", "1048576"),
    ] {
        let (code, text) = served.said(&["config", "set", value]);
        assert!(code == 4 && text.contains(range), "{text}");
    }
    for value in [
        "step_y_mm=5",
        "step_y_mm=0.0000001,1",
        "tick_hz=1.5",
        "step_y_mm=1,0",
    ] {
        assert_eq!(served.said(&["config", "set", value]).0, 2, "{value}");
    }
}
