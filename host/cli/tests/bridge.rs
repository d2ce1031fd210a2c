//! `giotto bridge` on sockets of this computer: a robot of our own in this process, and robots by others where they are installed.
#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of a test fail as the test does"
)]
use serde_json::Value;
use std::io::{BufRead, BufReader, Read};
use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

const MODEL: &str = "format = 1\ncampaign = \"bench\"\nmachine = \"robot\"\n[servo]\nkind = \"lag\"\nkv_per_s = 40.0\n\
                     [valid]\nradius_mm = [20.0, 200.0]\nfeed_mm_s = [20.0, 400.0]\n";

fn giotto(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_giotto"));
    command
        .env("NO_COLOR", "1")
        .current_dir(folder)
        .stdin(Stdio::null());
    command
}

/// A folder with a model.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("model.toml"), MODEL).unwrap();
    folder
}

/// A bridge that runs, and where it listens.
struct Bridge {
    process: Child,
    stderr: BufReader<std::process::ChildStderr>,
    at: SocketAddr,
}

impl Bridge {
    fn start(folder: &Path, words: &str) -> Self {
        let mut process = giotto(folder)
            .args(["bridge", "--json", "--table", "model.toml"])
            .args(words.split(' '))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut stderr = BufReader::new(process.stderr.take().unwrap());
        let mut line = String::new();
        stderr.read_line(&mut line).unwrap();
        let at = line
            .trim()
            .strip_prefix("listening on ")
            .unwrap_or_else(|| panic!("{line}"))
            .replace("0.0.0.0", "127.0.0.1")
            .parse()
            .unwrap();
        Self {
            process,
            stderr,
            at,
        }
    }

    fn interrupt(&self) {
        let done = Command::new("kill")
            .args(["-INT", &self.process.id().to_string()])
            .status();
        assert!(done.unwrap().success());
    }

    /// Waits for its end: how it ended, its document, its words.
    fn end(mut self) -> (ExitStatus, Value, String) {
        let (mut out, mut words) = (String::new(), String::new());
        let mut stdout = self.process.stdout.take().unwrap();
        stdout.read_to_string(&mut out).unwrap();
        self.stderr.read_to_string(&mut words).unwrap();
        let document = serde_json::from_str(&out).unwrap_or(Value::Null);
        (self.process.wait().unwrap(), document, words)
    }
}

impl Drop for Bridge {
    fn drop(&mut self) {
        let _ = self.process.kill();
    }
}

/// A place on a circle of 50 mm, from rest to 200 mm/s.
fn circle(t: f64) -> [f64; 2] {
    let angle = if t < 1.0 { 2.0 * t * t } else { 4.0 * t - 2.0 };
    [50.0 * angle.cos(), 50.0 * angle.sin()]
}

#[test]
fn rsi_over_a_socket_until_ctrl_c() {
    let folder = folder();
    let bridge = Bridge::start(folder.path(), "rsi --listen 127.0.0.1:0 --record rec.csv");
    let robot = UdpSocket::bind("127.0.0.1:0").unwrap();
    robot
        .set_read_timeout(Some(Duration::from_millis(500)))
        .unwrap();
    let began = Instant::now();
    let (mut answered, mut in_time, mut largest, mut last, mut ended) =
        (0u32, 0u32, 0.0f64, [9.0; 2], false);
    let mut bytes = [0; 2000];
    for cycle in 0..1000u32 {
        let t = f64::from(cycle) * 4e-3;
        if cycle == 700 {
            bridge.interrupt();
        }
        let [x, y] = circle(t);
        let ipoc = 900_000 + 4 * cycle;
        let said = format!(
            "<Rob Type=\"KUKA\"><RIst X=\"{x:.4}\" Y=\"{y:.4}\" Z=\"0\"/><RSol X=\"{x:.4}\" Y=\"{y:.4}\" Z=\"0\"/><IPOC>{ipoc}</IPOC></Rob>"
        );
        let sent = Instant::now();
        robot.send_to(said.as_bytes(), bridge.at).unwrap();
        let Ok(length) = robot.recv(&mut bytes) else {
            ended = cycle > 700;
            break;
        };
        in_time += u32::from(sent.elapsed() < Duration::from_millis(4));
        answered += 1;
        let reply = std::str::from_utf8(&bytes[..length]).unwrap();
        assert!(reply.contains(&format!("<IPOC>{ipoc}</IPOC>")), "{reply}");
        let value = |name: &str| -> f64 {
            let rest = reply.split_once(name).unwrap().1;
            rest.split('"').nth(1).unwrap().parse().unwrap()
        };
        last = [value(" X="), value(" Y=")];
        largest = largest.max(last[0].hypot(last[1]));
        let due = Duration::from_secs_f64(t + 4e-3);
        std::thread::sleep(due.saturating_sub(began.elapsed()));
    }
    let (status, document, words) = bridge.end();
    assert!(ended && status.success(), "{status} {words}");
    // Lag of 25 ms: half of τ² f²/R is 0.25 mm.
    assert!((0.2..0.3).contains(&largest), "{largest}");
    assert_eq!(last, [0.0, 0.0], "the correction was taken out first");
    assert!(
        f64::from(in_time) >= 0.9 * f64::from(answered),
        "{in_time} of {answered}"
    );
    println!("{in_time} of {answered} within 4 ms");
    assert_eq!(document["answered"], answered);
    assert_eq!(document["door"], "rsi");
    assert!(document["refused"].is_null() && document["malformed"] == 0);
    // What was measured is read by the importer as it is.
    assert_eq!(document["record"]["rows"], answered);
    let imported = giotto(folder.path())
        .args("import rec.csv --radius 50 --feed 200 --direction ccw -o new --json".split(' '))
        .output()
        .unwrap();
    assert!(imported.status.success(), "{imported:?}");
}

#[test]
fn nobody_a_stranger_and_a_missing_address() {
    let folder = folder();
    let bridge = Bridge::start(folder.path(), "egm --listen 127.0.0.1:0 --wait 0.3");
    let (status, document, words) = bridge.end();
    assert_eq!(status.code(), Some(4));
    assert!(
        words.contains("no robot was heard on 127.0.0.1:"),
        "{words}"
    );
    assert_eq!(document["received"], 0);
    let bridge = Bridge::start(folder.path(), "rsi --listen 127.0.0.1:0");
    let stranger = UdpSocket::bind("127.0.0.1:0").unwrap();
    stranger.send_to(b"hello", bridge.at).unwrap();
    let (status, document, words) = bridge.end();
    assert_eq!(status.code(), Some(4));
    assert!(words.contains("no RSI telegram"), "{words}");
    assert!(
        document["refused"]
            .as_str()
            .unwrap()
            .contains("no RSI telegram")
    );
    for (line, code, expected) in [
        ("j519 --table model.toml", 2, "--robot ADDR"),
        ("rsi", 2, "--table"),
        ("rsi --table missing.bin", 3, "missing.bin"),
        ("egm --table model.toml --cycle 200", 2, "0.25 to 50 ms"),
        (
            "egm --table model.toml --listen nowhere:x",
            2,
            "is no address",
        ),
        ("rsi --program 1x.src", 2, "a letter"),
        ("egm --table model.toml --path path.csv", 3, "path.csv:3:1"),
        (
            "j519 --table model.toml --robot 127.0.0.1 --path steep.csv",
            3,
            "allowed are 80000",
        ),
    ] {
        std::fs::write(
            folder.path().join("path.csv"),
            "time_s,x_mm,y_mm\n0,0,0\n0,1,1\n",
        )
        .unwrap();
        std::fs::write(
            folder.path().join("steep.csv"),
            "time_s,x_mm,y_mm\n0,0,0\n0.1,900,1\n",
        )
        .unwrap();
        let output = giotto(folder.path())
            .arg("bridge")
            .args(line.split(' '))
            .output()
            .unwrap();
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{line}: {words}");
        assert!(words.contains(expected), "{line}: {words}");
    }
}

#[test]
fn stream_motion_is_called_and_told_goodbye() {
    let folder = folder();
    let robot = UdpSocket::bind("127.0.0.1:0").unwrap();
    robot
        .set_read_timeout(Some(Duration::from_secs(10)))
        .unwrap();
    let mut path = String::from("time_s,x_mm,y_mm\n");
    for row in 0..600 {
        let s = f64::from(row.min(500)) / 500.0;
        let share = s * s * s * (10.0 + s * (6.0 * s - 15.0));
        path += &format!(
            "{:.3},{:.6},5\n",
            f64::from(row) * 2e-3,
            10.0 + 40.0 * share
        );
    }
    std::fs::write(folder.path().join("path.csv"), path).unwrap();
    let words = format!(
        "j519 --robot {} --path path.csv",
        robot.local_addr().unwrap()
    );
    let bridge = Bridge::start(folder.path(), &words);
    let mut bytes = [0; 200];
    let (length, host) = robot.recv_from(&mut bytes).unwrap();
    assert_eq!(bytes[..length], [0, 0, 0, 0, 0, 0, 0, 1], "start");
    let (mut last, mut x) = (false, 10.0f32);
    for seq in 7..1000u32 {
        let mut status = vec![0, 0, 0, 0, 0, 0, 0, 1];
        status.extend(seq.to_be_bytes());
        status.extend([0b101, 0, 0, 0, 0, 0, 0, 0]);
        status.extend((seq * 8).to_be_bytes());
        status.extend([x, 5.0].iter().flat_map(|v| v.to_be_bytes()));
        status.resize(132, 0);
        robot.send_to(&status, host).unwrap();
        let (length, _) = robot.recv_from(&mut bytes).unwrap();
        assert_eq!((length, &bytes[..4]), (64, &[0, 0, 0, 1][..]));
        assert_eq!(bytes[8..12], seq.to_be_bytes());
        x = f32::from_be_bytes(bytes[28..32].try_into().unwrap());
        last = bytes[12] == 1;
        if last {
            break;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(last && (x - 50.0).abs() < 1e-3, "{x}");
    let (length, _) = robot.recv_from(&mut bytes).unwrap();
    assert_eq!(bytes[..length], [0, 0, 0, 2, 0, 0, 0, 1], "stop");
    let (status, document, words) = bridge.end();
    assert!(status.success(), "{words}");
    assert_eq!(document["limited"], 0);
}

/// Python with these modules, if this computer has one: the one of `GIOTTO_PYTHON`, or `python3`.
fn python(modules: &str) -> Option<String> {
    let python = std::env::var("GIOTTO_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let found = Command::new(&python)
        .args(["-c", &format!("import {modules}")])
        .current_dir(std::env::temp_dir())
        .output();
    if found.is_ok_and(|output| output.status.success()) {
        return Some(python);
    }
    println!(
        "skipped: {python} cannot import {modules} (pip install rsipi abbrobotegm abb-robot-client; GIOTTO_PYTHON=…)"
    );
    None
}

fn peer(python: &str, folder: &Path, script: &str, words: &[&str]) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/peers")
        .join(script);
    let output = Command::new(python)
        .arg(script)
        .args(words)
        .current_dir(folder)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    let last = text.lines().last().unwrap_or_default();
    serde_json::from_str(last).unwrap_or_else(|_| panic!("{output:?}"))
}

#[test]
fn rsipi_s_echo_server_accepts_every_answer() {
    let Some(python) = python("RSIPI.rsi_echo_server") else {
        return;
    };
    let folder = folder();
    let bridge = Bridge::start(folder.path(), "rsi --listen 127.0.0.1:0");
    // Its configuration is the one that is loaded on the robot.
    let written = giotto(folder.path())
        .args([
            "bridge",
            "rsi",
            "--program",
            "Ring.src",
            "--listen",
            &bridge.at.to_string(),
        ])
        .status()
        .unwrap();
    assert!(written.success());
    let shown = peer(&python, folder.path(), "rsi.py", &["Ring.xml", "1500"]);
    println!("{shown}");
    // It refuses none for what is in it. How many come in their 4 ms is the computer's other work to say.
    assert_eq!(shown["rejected"], 0, "{shown}");
    let (cycles, answered) = (
        shown["cycles"].as_f64().unwrap(),
        shown["answered"].as_f64().unwrap(),
    );
    assert!(answered >= 0.9 * cycles, "{shown}");
    // τ²/2 · f²/R at 200 mm/s on 100 mm, and the 10 µm that its numbers are rounded to.
    let largest = shown["largest_mm"].as_f64().unwrap();
    assert!((0.1..0.35).contains(&largest), "{largest}");
    let (status, document, words) = bridge.end();
    assert!(status.success() && document["malformed"] == 0, "{words}");
}

#[test]
fn abb_s_messages_by_others_are_read_and_written() {
    for package in ["ABBRobotEGM", "abb_robot_client"] {
        let Some(python) = python(package) else {
            continue;
        };
        let folder = folder();
        for (door, cycles, kind) in [("egm", "1000", 3), ("egm-path", "120", 4)] {
            let bridge = Bridge::start(folder.path(), &format!("{door} --listen 127.0.0.1:0"));
            let port = bridge.at.port().to_string();
            let words = [port.as_str(), door, cycles, package];
            let shown = peer(&python, folder.path(), "egm.py", &words);
            println!("{package} {door} {shown}");
            assert_eq!(shown["kinds"], serde_json::json!([kind]));
            assert_eq!(shown["in_order"], true, "{shown}");
            let (cycles, answered) = (
                shown["cycles"].as_f64().unwrap(),
                shown["answered"].as_f64().unwrap(),
            );
            assert!(answered >= 0.9 * cycles, "{shown}");
            let largest = shown["largest_mm"].as_f64().unwrap();
            // Position guidance is late by 32 ms at 200 mm/s; path correction adds τ²/2 · f²/R = 0.125 mm across.
            let expected = if door == "egm" { 5.5..7.5 } else { 0.1..0.15 };
            assert!(expected.contains(&largest), "{door}: {largest}");
            let (status, document, words) = bridge.end();
            assert!(status.success() && document["malformed"] == 0, "{words}");
        }
    }
}
