//! A place for foreign files and the campaign that is made of them.
use giotto_tests::command::{giotto, outcome};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

pub struct Bench {
    pub dir: tempfile::TempDir,
}

impl Bench {
    pub fn new() -> Self {
        Self {
            dir: tempfile::tempdir().unwrap(),
        }
    }

    pub fn put(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.dir.path().join(name);
        fs::write(&path, bytes).unwrap();
        path
    }

    pub fn campaign(&self) -> PathBuf {
        self.dir.path().join("campaign")
    }

    /// `giotto import FILE --radius 100 --feed 60 … -o campaign --json`
    pub fn import(&self, file: &Path, more: &[&str]) -> (i32, String, String) {
        let mut command = giotto();
        command
            .arg("import")
            .arg(file)
            .args(["--radius", "100", "--feed", "60", "--json", "-o"])
            .arg(self.campaign());
        outcome(&command.args(more).output().unwrap())
    }

    pub fn analyze(&self) -> Value {
        let (code, out, err) = outcome(
            &giotto()
                .args(["analyze", "--json"])
                .arg(self.campaign())
                .output()
                .unwrap(),
        );
        assert_eq!(code, 0, "{err}");
        serde_json::from_str(&out).unwrap()
    }
}

pub fn near(value: &Value, expected: f64, tolerance: f64) {
    let found = value.as_f64().unwrap_or(f64::NAN);
    assert!(
        (found - expected).abs() <= tolerance,
        "{found} against {expected}"
    );
}
