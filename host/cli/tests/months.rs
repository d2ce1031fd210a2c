//! Two years of a simulated machine: one slow drift, one step at a service, everything else unchanged.
#![allow(clippy::unwrap_used, reason = "a test may fail where it stands")]
use serde_json::Value;
use std::path::Path;
use std::process::Command;

const GIOTTO: &str = env!("CARGO_BIN_EXE_giotto");

fn giotto(folder: &Path, line: &str) -> (i32, Value, String) {
    let output = Command::new(GIOTTO)
        .args(line.split(' '))
        .current_dir(folder)
        .output()
        .unwrap();
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    let document = serde_json::from_slice(&output.stdout).unwrap_or(Value::Null);
    (output.status.code().unwrap_or(-1), document, words)
}

/// Backlash of X grows by 0.4 µm a month from 4 µm; the squareness steps from 80 to 40 µm/m in February of the second year.
fn measure(folder: &Path) {
    for month in 0..24 {
        let backlash = 4.0 + 0.4 * f64::from(month);
        let squareness = if month < 13 { 80.0 } else { 40.0 };
        let plan = format!(
            "[campaign]\nname = \"mill\"\nmachine = \"simulated mill\"\n[machine]\nboth = {{ kv_per_s = 40.0 }}\n\
             x = {{ backlash_um = {backlash} }}\nsquareness_um_per_m = {squareness}\n[instrument]\nnoise_um = 1.0\n\
             spread_um = 0.7\nsetup_spread_um = 8.0\n[grid]\nradii_mm = [100.0, 150.0]\n\
             feeds_mm_s = [50.0, 100.0, 200.0]\n"
        );
        std::fs::write(folder.join("plan.toml"), plan).unwrap();
        let (year, of_year) = (2024 + month / 12, month % 12 + 1);
        let (code, _, words) = giotto(
            folder,
            &format!("simulate plan.toml --seed {month} -o months/{year}-{of_year:02}-14 --json"),
        );
        assert_eq!(code, 0, "{words}");
    }
}

#[test]
fn the_drift_and_the_step_are_found_and_kept() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    measure(folder);
    let (code, document, words) = giotto(
        folder,
        "history months --service 2025-02-01 --html history.html --json",
    );
    assert_eq!(code, 0, "{words}");
    assert_eq!(document["diagnosed"], 24);
    let series = document["machines"][0]["series"].as_array().unwrap();
    let of = |id: &str| series.iter().find(|s| s["id"] == id).unwrap();
    let drift = &of("cause:backlash:x")["trend"]["change"];
    assert_eq!(drift["kind"], "drift", "{drift}");
    let per_month = drift["per_month"].as_f64().unwrap();
    assert!(
        (per_month - 0.4e-3).abs() < 0.08e-3,
        "{per_month} mm a month"
    );
    let step = of("cause:squareness:x y");
    assert_eq!(step["trend"]["change"]["kind"], "step");
    assert_eq!(step["trend"]["change"]["at"], 13);
    let said = step["words"][0].as_str().unwrap();
    assert!(said.contains("with the service of 2025-02-01"), "{said}");
    // Whatever else has a name or a figure of its own: nothing happened to it. Figures of form follow the two causes.
    for s in series {
        let id = s["id"].as_str().unwrap();
        if ![
            "cause:backlash:x",
            "cause:squareness:x y",
            "figure:g",
            "figure:g_b",
        ]
        .contains(&id)
        {
            assert_eq!(s["trend"]["change"], Value::Null, "{id}: {}", s["words"]);
        }
    }
    // A second look diagnoses nothing; the store is Parquet at both ends.
    for name in ["campaigns", "findings"] {
        let bytes = std::fs::read(folder.join(format!("months/history/{name}.parquet"))).unwrap();
        assert!(bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1"));
    }
    let (_, again, _) = giotto(folder, "history months --json");
    assert_eq!(again["diagnosed"], 0);
    assert_eq!(
        again["machines"][0]["series"][0]["values"],
        series[0]["values"]
    );
    // Before and after the service.
    let (code, document, words) = giotto(
        folder,
        "compare months/2025-01-14 months/2025-02-14 --html compare.html --json",
    );
    assert_eq!(code, 0, "{words}");
    let causes = document["comparisons"][0]["causes"].as_array().unwrap();
    let fate = |cause: &str| causes.iter().find(|c| c["cause"] == cause).unwrap()["fate"].clone();
    assert_eq!(fate("squareness"), "changed", "{causes:?}");
    assert_eq!(fate("backlash"), "same", "{causes:?}");
    for page in ["history.html", "compare.html"] {
        let html = std::fs::read_to_string(folder.join(page)).unwrap();
        assert!(html.starts_with("<!doctype html>") && html.contains("</html>"));
    }
}
