//! `giotto monitor` over a real pty: the controller goes, another comes back under the same name, the watch goes on.
#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test may fail where it stands"
)]
use giotto_tests::command::{Running, giotto};
#[cfg(target_os = "linux")]
use giotto_tests::terminal::Terminal;
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{ChildStdout, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

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
    let mut child = giotto()
        .args(["controller", "sim"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let first = next(&lines(child.stdout.take().unwrap()));
    let port = first
        .strip_prefix("port: ")
        .unwrap_or_else(|| panic!("{first}"))
        .to_owned();
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
    let mut watch = Running(
        watch
            .arg(&name)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap(),
    );
    let told = lines(watch.0.stdout.take().unwrap());
    let look = || serde_json::from_str::<Value>(&next(&told)).unwrap();
    let moving = std::iter::repeat_with(look)
        .take(200)
        .find(|l| l["motion"] == "running");
    let before = moving.unwrap()["ticks"].as_u64().unwrap();
    drop(first);
    let _second = controller(&name);
    // The second began to count anew and runs nothing: a run is not begun twice by itself.
    let after = std::iter::repeat_with(look)
        .take(2000)
        .find(|l| l["motion"] == "idle")
        .unwrap();
    assert!(
        after["ticks"].as_u64().unwrap() < before + 60_000,
        "{before} {after}"
    );
    assert!(watch.0.try_wait().unwrap().is_none(), "it watches still");
}

/// The picture on a terminal: the state as it changes, the loss and the return of the controller, and the terminal as it was.
#[cfg(target_os = "linux")]
#[test]
fn the_picture_lives_and_leaves_the_terminal_clean() {
    let folder = tempfile::tempdir().unwrap();
    let name = folder.path().join("tty");
    let first = controller(&name);
    let script = folder.path().join("session.sh");
    let binary = giotto().get_program().to_owned();
    let text = format!(
        "stty rows 40 cols 120\nbefore=$(stty -g)\n'{}' monitor --interval 0.05 --radius 20 --feed 50 --laps 1000 --port '{}'\n\
         echo \"it ended with $?\"\n[ \"$before\" = \"$(stty -g)\" ] && echo 'the terminal is as it was'\n",
        binary.to_string_lossy(),
        name.display()
    );
    std::fs::write(&script, text).unwrap();
    let mut terminal = Terminal::run(&script, [40, 120]);
    terminal.wait(
        |s| s.contains("motion       running") && s.contains("q quit"),
        "a running state",
    );
    assert!(terminal.screen().screen().alternate_screen());
    // Live: ticks go on, and the trace is drawn.
    let ticks = |s: &str| -> u64 {
        let number = s
            .split("ticks        ")
            .nth(1)
            .and_then(|rest| rest.split_whitespace().next());
        number.and_then(|n| n.parse().ok()).unwrap_or(0)
    };
    let then = ticks(&terminal.shown());
    terminal.wait(
        |s| ticks(s) > then && s.contains("corrected, ×"),
        "a later tick and a trace",
    );
    // A machine that moves is not left without a question; any other key stays.
    terminal.press("q");
    terminal.wait(
        |s| s.contains("The machine moves: s stops it first"),
        "the question",
    );
    terminal.press("x");
    terminal.wait(|s| s.contains("q quit"), "the keys again");
    drop(first);
    terminal.wait(|s| s.contains("LOST"), "the loss");
    let _second = controller(&name);
    terminal.wait(
        |s| !s.contains("LOST") && s.contains("motion       idle") && s.contains("line lost"),
        "its return",
    );
    terminal.press("q");
    terminal.wait(
        |s| s.contains("the terminal is as it was"),
        "the shell's last word",
    );
    assert!(terminal.end());
    let parser = terminal.screen();
    let screen = parser.screen();
    assert!(
        screen.contents().contains("it ended with 0"),
        "{}",
        screen.contents()
    );
    assert!(
        !screen.alternate_screen() && !screen.hide_cursor(),
        "{}",
        screen.contents()
    );
}
