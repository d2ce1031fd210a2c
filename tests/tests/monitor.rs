//! `giotto monitor` over a real pty: the controller goes, another comes back under the same name, the watch goes on.
#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail where it stands")]
use giotto_tests::command::giotto;
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ChildStdout, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// A child that goes when the test does.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Lines as they come; a reader that hears nothing for a minute gives up instead of hanging.
fn lines(out: ChildStdout) -> Receiver<String> {
    let (tell, hear) = channel();
    std::thread::spawn(move || {
        for line in BufReader::new(out).lines().map_while(Result::ok) {
            if tell.send(line).is_err() {
                break;
            }
        }
    });
    hear
}

fn next(lines: &Receiver<String>) -> String {
    lines.recv_timeout(Duration::from_secs(60)).unwrap()
}

/// Starts a virtual controller and lets `name` lead to its port.
fn controller(name: &Path) -> Running {
    let mut child = giotto().args(["controller", "sim"]).stdout(Stdio::piped()).spawn().unwrap();
    let first = next(&lines(child.stdout.take().unwrap()));
    let port = first.strip_prefix("port: ").unwrap_or_else(|| panic!("{first}")).to_owned();
    let _ = std::fs::remove_file(name);
    std::os::unix::fs::symlink(port, name).unwrap();
    Running(child)
}

#[test]
fn the_watch_outlives_its_controller() {
    let folder = tempfile::tempdir().unwrap();
    let name = folder.path().join("tty");
    let first = controller(&name);
    let mut watch = giotto();
    watch.args([
        "monitor",
        "--json",
        "--interval",
        "0.05",
        "--radius",
        "20",
        "--feed",
        "50",
        "--laps",
        "1000",
        "--port",
    ]);
    let mut watch = Running(watch.arg(&name).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap());
    let told = lines(watch.0.stdout.take().unwrap());
    let look = || serde_json::from_str::<Value>(&next(&told)).unwrap();
    let moving = std::iter::repeat_with(look).take(200).find(|l| l["motion"] == "running");
    let before = moving.unwrap()["ticks"].as_u64().unwrap();
    drop(first);
    let _second = controller(&name);
    // The second began to count anew and runs nothing: a run is not begun twice by itself.
    let after = std::iter::repeat_with(look).take(2000).find(|l| l["motion"] == "idle").unwrap();
    assert!(after["ticks"].as_u64().unwrap() < before + 60_000, "{before} {after}");
    assert!(watch.0.try_wait().unwrap().is_none(), "it watches still");
}
