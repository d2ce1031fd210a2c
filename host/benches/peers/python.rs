//! The Python peers: their environment, their process, one request at a time.
use crate::Error;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

const HERE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peers");

/// A running `peers.py`.
pub(crate) struct Peers {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    versions: Value,
}

/// The environment beside the build, made when missing.
fn environment() -> Result<PathBuf, Error> {
    let exe = std::env::current_exe()?;
    let target = exe.ancestors().nth(3).ok_or("no target directory")?;
    let home = target.join("bench-venv");
    let python = home.join("bin/python");
    let wanted = std::fs::read_to_string(Path::new(HERE).join("requirements.txt"))?;
    let mark = home.join("installed.txt");
    if std::fs::read_to_string(&mark).ok().as_ref() != Some(&wanted) {
        eprintln!("making {} for the peers", home.display());
        let done = |command: &mut Command| -> Result<(), Error> {
            if command.status()?.success() {
                Ok(())
            } else {
                Err(format!("{command:?} failed").into())
            }
        };
        done(Command::new("python3").args(["-m", "venv"]).arg(&home))?;
        done(
            Command::new(&python)
                .args(["-m", "pip", "install", "-q", "-r"])
                .arg(Path::new(HERE).join("requirements.txt")),
        )?;
        std::fs::write(mark, wanted)?;
    }
    Ok(python)
}

/// Writes numbers as Python reads them.
pub(crate) fn store(path: &Path, values: &[f64]) -> Result<(), Error> {
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    Ok(std::fs::write(path, bytes)?)
}

impl Peers {
    /// Starts the peers.
    pub(crate) fn start() -> Result<Self, Error> {
        let mut child = Command::new(environment()?)
            .arg(Path::new(HERE).join("peers.py"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let input = child.stdin.take().ok_or("no stdin")?;
        let output = BufReader::new(child.stdout.take().ok_or("no stdout")?);
        let mut peers = Self {
            child,
            input,
            output,
            versions: Value::Null,
        };
        peers.versions = peers.answer()?["versions"].take();
        Ok(peers)
    }

    /// Versions of Python and its packages.
    pub(crate) fn versions(&self) -> &Value {
        &self.versions
    }

    fn answer(&mut self) -> Result<Value, Error> {
        let mut line = String::new();
        self.output.read_line(&mut line)?;
        if line.is_empty() {
            return Err("the Python peers stopped".into());
        }
        Ok(serde_json::from_str(&line)?)
    }

    /// Runs one peer once: seconds that it took, and what it found.
    pub(crate) fn run(&mut self, peer: &str, data: &Value) -> Result<(f64, Vec<f64>), Error> {
        self.repeat(peer, 1, data)
    }

    /// Runs one peer several times in a row: seconds that it took on average, and what it found last.
    pub(crate) fn repeat(
        &mut self,
        peer: &str,
        times: usize,
        data: &Value,
    ) -> Result<(f64, Vec<f64>), Error> {
        writeln!(
            self.input,
            "{}",
            json!({ "peer": peer, "times": times, "data": data })
        )?;
        let answer = self.answer()?;
        let seconds = answer["seconds"].as_f64().ok_or("no time in the answer")?;
        let value = answer["value"].as_array().ok_or("no value in the answer")?;
        Ok((seconds, value.iter().filter_map(Value::as_f64).collect()))
    }
}

impl Drop for Peers {
    fn drop(&mut self) {
        // It ends by itself at the end of its input; this is for the case that it hangs.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
