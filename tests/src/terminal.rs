//! A terminal in which a script runs, and what it shows.
use crate::command::Running;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{ChildStdin, Command, Stdio};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::Duration;

/// A pty, its keyboard and its screen.
pub struct Terminal {
    child: Running,
    keys: ChildStdin,
    screen: Arc<Mutex<vt100::Parser>>,
    reader: Option<JoinHandle<()>>,
}

impl Terminal {
    /// `script` (the program) gives the pty, in which the shell script `session` runs; its window is as large as `stty` in it
    /// says, `size` is that of the screen here: rows and columns.
    ///
    /// # Panics
    /// No `script` on this machine.
    pub fn run(session: &Path, size: [u16; 2]) -> Self {
        let mut command = Command::new("script");
        command.args([
            "--quiet",
            "--return",
            "--command",
            &format!("sh {}", session.display()),
            "/dev/null",
        ]);
        command
            .env("TERM", "xterm-256color")
            .env("SHELL", "/bin/sh");
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("script is there");
        let keys = child.stdin.take().expect("it was asked for");
        let mut out = child.stdout.take().expect("it was asked for");
        let [rows, columns] = size.map(|n| std::num::NonZero::new(n).expect("a screen has a size"));
        let screen = Arc::new(Mutex::new(vt100::Parser::new(rows, columns, 0)));
        let drawn = Arc::clone(&screen);
        let reader = std::thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(count @ 1..) = out.read(&mut bytes) {
                drawn
                    .lock()
                    .expect("nobody panics")
                    .process(&bytes[..count]);
            }
        });
        Self {
            child: Running(child),
            keys,
            screen,
            reader: Some(reader),
        }
    }

    /// The screen.
    ///
    /// # Panics
    /// The reader has panicked.
    pub fn screen(&self) -> MutexGuard<'_, vt100::Parser> {
        self.screen.lock().expect("nobody panics")
    }

    /// What stands on the screen.
    pub fn shown(&self) -> String {
        self.screen().screen().contents()
    }

    /// Waits for words on the screen.
    ///
    /// # Panics
    /// They do not come within a minute.
    pub fn wait(&self, wanted: impl Fn(&str) -> bool, words: &str) {
        for _ in 0..1200 {
            if wanted(&self.shown()) {
                return;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        unreachable!("{words} is not on the screen:\n{}", self.shown());
    }

    /// Types.
    ///
    /// # Panics
    /// The terminal is gone.
    pub fn press(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).expect("it takes keys");
    }

    /// Waits for the end of the session, with all that it showed; whether it went well.
    ///
    /// # Panics
    /// The session cannot be waited for.
    pub fn end(&mut self) -> bool {
        let well = self.child.0.wait().expect("a child ends").success();
        if let Some(reader) = self.reader.take() {
            reader.join().expect("nobody panics");
        }
        well
    }
}
