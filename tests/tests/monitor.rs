//! `giotto monitor` over a real pty: the controller goes, another comes back under the same name, the watch goes on.
#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test may fail where it stands"
)]
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

/// A terminal of 40 × 120 in which a script runs, and what it shows.
#[cfg(target_os = "linux")]
struct Terminal {
    child: Running,
    keys: std::process::ChildStdin,
    screen: std::sync::Arc<std::sync::Mutex<vt100::Parser>>,
    reader: Option<std::thread::JoinHandle<()>>,
}

#[cfg(target_os = "linux")]
impl Terminal {
    /// `script` gives the pty; its window is as large as `stty` says.
    fn run(script: &Path) -> Self {
        use std::io::Read;
        use std::sync::{Arc, Mutex};
        let mut command = std::process::Command::new("script");
        command.args([
            "--quiet",
            "--return",
            "--command",
            &format!("sh {}", script.display()),
            "/dev/null",
        ]);
        command
            .env("TERM", "xterm-256color")
            .env("SHELL", "/bin/sh");
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (keys, mut out) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        let [rows, columns] = [40, 120].map(|n| std::num::NonZero::new(n).unwrap());
        let screen = Arc::new(Mutex::new(vt100::Parser::new(rows, columns, 0)));
        let drawn = Arc::clone(&screen);
        let reader = std::thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(count @ 1..) = out.read(&mut bytes) {
                drawn.lock().unwrap().process(&bytes[..count]);
            }
        });
        Self {
            child: Running(child),
            keys,
            screen,
            reader: Some(reader),
        }
    }

    fn shown(&self) -> String {
        self.screen.lock().unwrap().screen().contents()
    }

    /// Waits for words on the screen; a minute is a hang.
    fn wait(&self, wanted: impl Fn(&str) -> bool, words: &str) {
        for _ in 0..1200 {
            if wanted(&self.shown()) {
                return;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        panic!("{words} is not on the screen:\n{}", self.shown());
    }
}

/// The picture on a terminal: the state as it changes, the loss and the return of the controller, and the terminal as it was.
#[cfg(target_os = "linux")]
#[test]
fn the_picture_lives_and_leaves_the_terminal_clean() {
    use std::io::Write;
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
    let mut terminal = Terminal::run(&script);
    terminal.wait(
        |s| s.contains("motion       running") && s.contains("q quit"),
        "a running state",
    );
    assert!(terminal.screen.lock().unwrap().screen().alternate_screen());
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
    drop(first);
    terminal.wait(|s| s.contains("LOST"), "the loss");
    let _second = controller(&name);
    terminal.wait(
        |s| !s.contains("LOST") && s.contains("motion       idle") && s.contains("line lost"),
        "its return",
    );
    terminal.keys.write_all(b"q").unwrap();
    terminal.wait(
        |s| s.contains("the terminal is as it was"),
        "the shell's last word",
    );
    assert!(terminal.child.0.wait().unwrap().success());
    terminal.reader.take().unwrap().join().unwrap();
    let parser = terminal.screen.lock().unwrap();
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
