//! The step after a correction: of a machine that a table corrects no model of the remainder alone is made.
#![allow(clippy::unwrap_used, reason = "a test may fail where it stands")]
use serde_json::Value;
use std::path::Path;
use std::process::Command;

const GIOTTO: &str = env!("CARGO_BIN_EXE_giotto");

/// Exit code, document, and what was said on stderr.
fn giotto(folder: &Path, line: &str) -> (i32, Value, String) {
    let output = Command::new(GIOTTO)
        .args(line.split(' '))
        .arg("--json")
        .current_dir(folder)
        .output()
        .unwrap();
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    let document = serde_json::from_slice(&output.stdout).unwrap_or(Value::Null);
    (output.status.code().unwrap_or(-1), document, words)
}

fn measured(folder: &Path, name: &str, machine: &str, seed: u64) {
    let plan = format!(
        "[campaign]\nname = \"mill\"\nmachine = \"mill\"\n[machine]\n{machine}[instrument]\nnoise_um = 0.5\nspread_um = 0.3\n\
         setup_um = [30.0, -20.0]\n[grid]\nradii_mm = [50.0, 100.0, 150.0]\nfeeds_mm_s = [20.0, 100.0, 200.0, 300.0]\n"
    );
    std::fs::write(folder.join("plan.toml"), plan).unwrap();
    let line = format!("simulate plan.toml --seed {seed} -o {name}");
    let (code, _, words) = giotto(folder, &line);
    assert_eq!(code, 0, "{words}");
}

/// The campaign says that a table was at work.
fn with_table(folder: &Path, name: &str) {
    let path = folder.join(name).join("campaign.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let key = format!("[campaign]\ntable = \"{}\"", "ab".repeat(32));
    std::fs::write(path, text.replacen("[campaign]", &key, 1)).unwrap();
}

#[test]
fn what_is_left_is_added_to_the_model_at_work() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let machine =
        "both = { kv_per_s = 40.0 }\nx = { backlash_um = 12.0 }\nsquareness_um_per_m = 80.0\n";
    measured(folder, "before", machine, 1);
    let (code, _, words) = giotto(folder, "diagnose before -o old.toml");
    assert_eq!(code, 0, "{words}");
    // Corrected, it draws circles but for the backlash, which has grown by 8 µm.
    measured(folder, "after", "x = { backlash_um = 8.0 }\n", 2);
    with_table(folder, "after");
    let (code, found, words) = giotto(folder, "diagnose after -o new.toml");
    assert_eq!(code, 5, "{words}");
    assert!(words.contains("a table was at work"), "{words}");
    assert!(!folder.join("new.toml").exists());
    assert_eq!(found["recommendation"]["action"], "look", "{found}");
    let command = found["recommendation"]["command"].as_str().unwrap();
    assert_eq!(command, "giotto diagnose after --corrected-by MODEL.toml");
    // A report does not advise to flash it either.
    let (code, _, words) = giotto(folder, "report after -o after.html");
    assert_eq!(code, 0, "{words}");
    let page = std::fs::read_to_string(folder.join("after.html")).unwrap();
    assert!(!page.contains("Write the extended model"));
    assert!(page.contains("Look for the model whose table was at work"));
    // With the model at work what is left is added to it.
    let (code, found, words) = giotto(folder, "diagnose after --corrected-by old.toml -o new.toml");
    assert_eq!(code, 0, "{words}");
    assert_eq!(found["recommendation"]["action"], "flash", "{found}");
    let size = |cause: &str| {
        let findings = found["findings"].as_array().unwrap();
        let finding = findings.iter().find(|f| f["cause"] == cause);
        finding.unwrap_or_else(|| unreachable!("{cause} in {found}"))["estimate"]["value"]
            .as_f64()
            .unwrap()
    };
    let backlash = size("backlash");
    assert!((backlash - 0.020).abs() < 0.001, "{backlash} mm");
    let squareness = size("squareness");
    assert!((squareness - 80.0).abs() < 4.0, "{squareness} µm/m");
    let model = std::fs::read_to_string(folder.join("new.toml")).unwrap();
    let kv = model.lines().find_map(|l| l.strip_prefix("kv_per_s = "));
    let kv: f64 = kv.unwrap().parse().unwrap();
    assert!((kv - 40.0).abs() < 1.0, "{kv} /s");
}

#[test]
fn where_the_table_leaves_nothing_there_is_nothing_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    measured(
        folder,
        "before",
        "both = { kv_per_s = 40.0 }\nx = { backlash_um = 12.0 }\n",
        1,
    );
    let (code, _, words) = giotto(folder, "diagnose before -o old.toml");
    assert_eq!(code, 0, "{words}");
    measured(folder, "after", "", 2);
    with_table(folder, "after");
    let (code, found, words) = giotto(folder, "diagnose after --corrected-by old.toml");
    assert_eq!(code, 0, "{words}");
    assert_eq!(found["recommendation"]["action"], "nothing", "{found}");
    assert!(
        found["recommendation"]["words"]
            .as_str()
            .unwrap()
            .contains("the table at work")
    );
}

#[test]
fn a_given_model_that_explains_all_is_said_to_be_enough() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let machine = "both = { kv_per_s = 40.0 }\nx = { backlash_um = 12.0 }\n";
    measured(folder, "first", machine, 1);
    let (code, _, words) = giotto(folder, "diagnose first -o model.toml");
    assert_eq!(code, 0, "{words}");
    measured(folder, "second", machine, 2);
    let (code, found, words) = giotto(folder, "diagnose second --model model.toml");
    assert_eq!(code, 0, "{words}");
    assert_eq!(found["findings"], serde_json::json!([]), "{found}");
    let words = found["recommendation"]["words"].as_str().unwrap();
    assert!(
        words.contains("given model") && !words.contains("fit"),
        "{words}"
    );
}
