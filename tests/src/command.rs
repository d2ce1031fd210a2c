//! The real `giotto`, as its user runs it.
use std::path::PathBuf;
use std::process::{Child, Command, Output};
use std::sync::OnceLock;

/// The binary of this build, brought up to date once a test process; or the one that `GIOTTO_BINARY` names, which
/// `.ci/check` has just built.
pub fn giotto() -> Command {
    static BINARY: OnceLock<PathBuf> = OnceLock::new();
    let path = BINARY.get_or_init(|| {
        if let Some(given) = std::env::var_os("GIOTTO_BINARY") {
            return PathBuf::from(given);
        }
        // target/PROFILE/deps/test-hash → target/PROFILE/giotto
        let test = std::env::current_exe().expect("a test knows where it is");
        let profile = test
            .ancestors()
            .nth(2)
            .expect("tests run from target/PROFILE/deps")
            .to_path_buf();
        let mut build = Command::new(env!("CARGO"));
        build.args([
            "build",
            "--quiet",
            "--package",
            "giotto-cli",
            "--bin",
            "giotto",
        ]);
        if profile.ends_with("release") {
            build.arg("--release");
        }
        let target = profile
            .parent()
            .expect("a profile lies in a target directory");
        let built = build
            .arg("--target-dir")
            .arg(target)
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .status();
        assert!(
            built.expect("cargo runs").success(),
            "giotto does not build"
        );
        profile.join(format!("giotto{}", std::env::consts::EXE_SUFFIX))
    });
    let mut command = Command::new(path);
    command
        .env("NO_COLOR", "1")
        .stdin(std::process::Stdio::null());
    command
}

/// Exit code (−1 for a signal), stdout and stderr.
pub fn outcome(output: &Output) -> (i32, String, String) {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (
        output.status.code().unwrap_or(-1),
        text(&output.stdout),
        text(&output.stderr),
    )
}

/// A child that goes when the test does.
pub struct Running(pub Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
