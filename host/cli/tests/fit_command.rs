//! `giotto fit` as its user runs it: JSON by the contract, model file, figures, exit codes.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of a test fail as the test does"
)]
use giotto::campaign::{Campaign, Direction, Run, Samples, write};
use giotto::model_file::{ModelFile, Servo};
use giotto_shared::model::RadiusModel;
use serde_json::Value;
use std::f64::consts::TAU;
use std::path::Path;
use std::process::{Command, Output};

const PAPER: RadiusModel<f64> = RadiusModel {
    beta1_s2: -23.29e-6,
    beta2_s4: -0.23e-6,
};

/// Circles of the paper's robot, with a spread between runs of ±0.5 µm.
/// Three lobes of each circle, µm, that flip with the direction: a form, and no part of the size.
fn lobes_um(sign: f64, angle_rad: f64) -> f64 {
    5.0 * sign * (3.0 * angle_rad).cos()
}

fn campaign() -> Campaign {
    let mut runs = Vec::new();
    for (radius_m, offset_m) in [(0.1, 2e-6), (0.15, -14e-6), (0.3, 38e-6)] {
        for feed in 0..8 {
            for direction in [Direction::Ccw, Direction::Cw] {
                let feed_m_s = 0.02 + 0.68 * f64::from(feed) / 7.0;
                let spread_m = 1e-6 * ((runs.len() as f64 * 0.754877666).fract() - 0.5);
                let deviation = offset_m + spread_m + PAPER.radius_error_m(radius_m, feed_m_s);
                let samples = 400;
                let turn_s = TAU * radius_m / feed_m_s;
                let sign = f64::from(direction.sign());
                let at = |i: usize| i as f64 / samples as f64;
                runs.push(Run {
                    file: format!("run{:03}.csv", runs.len()),
                    radius_m,
                    feed_m_s,
                    direction,
                    start_angle_rad: 0.0,
                    started_s: None,
                    temperature_c: None,
                    centre_m: None,
                    frame: giotto::campaign::Frame::default(),
                    setup: None,
                    samples: Samples {
                        angle_rad: (0..samples).map(|i| sign * TAU * at(i)).collect(),
                        deviation_m: (0..samples)
                            .map(|i| deviation + 1e-6 * lobes_um(sign, sign * TAU * at(i)))
                            .collect(),
                        time_s: Some((0..samples).map(|i| turn_s * at(i)).collect()),
                        angle_inferred: true,
                    },
                });
            }
        }
    }
    Campaign {
        name: "paper".into(),
        machine: "ABB IRB 1600-6/1.45, simulated".into(),
        repeatability_m: None,
        table: None,
        kinematics: None,
        runs,
    }
}

fn giotto(directory: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_giotto"))
        .current_dir(directory)
        .args(arguments)
        .output()
        .unwrap()
}

fn written() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    write(&campaign(), &directory.path().join("campaign")).unwrap();
    directory
}

#[test]
fn json_is_the_contracts() {
    let directory = written();
    let output = giotto(
        directory.path(),
        &[
            "fit",
            "campaign",
            "--train-radius",
            "100",
            "--json",
            "-o",
            "m.toml",
        ],
    );
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let number = |path: &str| {
        json.pointer(path)
            .and_then(Value::as_f64)
            .unwrap_or_else(|| panic!("{path} in {json}"))
    };
    assert!((number("/model/beta1_s2") / PAPER.beta1_s2 - 1.0).abs() < 0.03);
    assert!((number("/model/beta2_s4") / PAPER.beta2_s4 - 1.0).abs() < 0.08);
    for (term, truth) in [("beta1_s2", PAPER.beta1_s2), ("beta2_s4", PAPER.beta2_s4)] {
        assert!(
            number(&format!("/ci95/{term}/0")) < truth
                && truth < number(&format!("/ci95/{term}/1"))
        );
    }
    assert_eq!(json["stepwise"][0]["enter"], "f2_r");
    assert_eq!(json["stepwise"][1]["enter"], "f4_r3");
    assert_eq!(json["stepwise"][1]["dof"], serde_json::json!([1, 13]));
    assert!(number("/stepwise/1/partial_f") > number("/stepwise/1/critical_f"));
    assert_eq!(
        (number("/train/runs"), number("/heldout/runs")),
        (16.0, 32.0)
    );
    assert!(
        number("/train/rms_um") < 0.5
            && number("/heldout/rms_um") < 0.6
            && number("/heldout/max_um") < 2.0
    );
    assert!(number("/heldout/explained_percent") > 99.9);
    assert!(
        (number("/offset_um/300") - 38.0).abs() < 0.5
            && (number("/offset_um/100") - 2.0).abs() < 0.5
    );
    assert!((number("/cumulants/kappa2_s2") + 2.0 * number("/model/beta1_s2")).abs() < 1e-12);
    assert!(number("/cumulants/kappa4_s4") < 0.0);
    assert_eq!(json["cumulants"]["class"], "second_order");

    let model = ModelFile::load(&directory.path().join("m.toml")).unwrap();
    let Servo::Beta {
        beta1_s2,
        half_width95,
        ..
    } = model.servo
    else {
        panic!("{model:?}")
    };
    assert_eq!(beta1_s2, number("/model/beta1_s2"));
    assert!(half_width95[0] > 0.0 && half_width95[1] > 0.0);
    assert_eq!(model.valid.radius_mm, [100.0, 300.0]);
    assert_eq!(model.valid.feed_mm_s, [20.0, 700.0]);
}

#[test]
fn offsets_and_partial_f_are_named_in_words() {
    let directory = written();
    let joint = giotto(directory.path(), &["fit", "campaign"]);
    let text = String::from_utf8(joint.stdout).unwrap();
    assert!(
        text.contains("fitted together with β") && text.contains("F(α; 1; n − p)"),
        "{text}"
    );
    let paper = [
        "fit",
        "campaign",
        "--offset",
        "lowest-speed",
        "--partial-f",
        "paper",
        "--figures",
        "figures",
    ];
    let text = String::from_utf8(giotto(directory.path(), &paper).stdout).unwrap();
    assert!(
        text.contains("as the paper does") && text.contains("divided by p"),
        "{text}"
    );
    for number in 2..=11 {
        for ending in ["svg", "csv"] {
            let file = format!("figures/figure{number:02}.{ending}");
            assert!(directory.path().join(&file).is_file(), "{file}");
        }
    }
}

/// What the figures draw is what the campaign holds: every run of 8 to 11 by its ΔR and roundness, the forms of 2 to 7 by
/// their samples.
#[test]
fn the_figures_draw_the_campaign() {
    let directory = written();
    let folder = directory.path();
    giotto(
        folder,
        &[
            "fit",
            "campaign",
            "--train-radius",
            "100",
            "--figures",
            "figures",
        ],
    );
    let rows = |number: usize| -> Vec<Vec<String>> {
        let text = std::fs::read_to_string(folder.join(format!("figures/figure{number:02}.csv")));
        let text = text.unwrap();
        let row = |line: &str| {
            line.split(',')
                .map(|c| c.trim_matches('"').to_owned())
                .collect()
        };
        text.lines().skip(1).map(row).collect()
    };
    let report: Value =
        serde_json::from_slice(&giotto(folder, &["analyze", "campaign", "--json"]).stdout).unwrap();
    let runs = report["runs"].as_array().unwrap();
    let near = |a: f64, b: f64, within: f64| (a - b).abs() <= within;
    let number = |text: &str| text.parse::<f64>().unwrap();
    for (figure, field) in [(8, "radius_error_um"), (9, "out_of_roundness_um")] {
        let rows = rows(figure);
        assert_eq!(rows.len(), runs.len());
        for run in runs {
            let of = |key: &str| run[key].as_f64().unwrap();
            let found = rows.iter().any(|row| {
                near(number(&row[0]), of("radius_mm"), 1e-6)
                    && near(number(&row[1]), of("feed_mm_s"), 1e-6)
                    && row[2] == run["direction"].as_str().unwrap()
                    && (row[3] == "fitted") == near(of("radius_mm"), 100.0, 1e-6)
                    && near(
                        number(&row[4]),
                        1e-3 * of("feed_mm_s").powi(2) / of("radius_mm"),
                        1e-5,
                    )
                    && near(number(&row[5]), of(field), 1e-4)
            });
            assert!(found, "figure {figure}: {run}");
        }
    }
    // Figure 10 is the measured size less the offset of its radius; 11 what the model leaves of that.
    let fit = giotto(
        folder,
        &["fit", "campaign", "--train-radius", "100", "--json"],
    )
    .stdout;
    let fit: Value = serde_json::from_slice(&fit).unwrap();
    let model = |r_mm: f64, f_mm_s: f64| {
        let of = |key: &str| fit["model"][key].as_f64().unwrap();
        let (r, f) = (r_mm * 1e-3, f_mm_s * 1e-3);
        1e6 * (of("beta1_s2") * f.powi(2) / r + of("beta2_s4") * f.powi(4) / r.powi(3))
    };
    let (sizes, less, left) = (rows(8), rows(10), rows(11));
    assert_eq!([less.len(), left.len()], [runs.len(); 2]);
    for ((size, less), left) in sizes.iter().zip(&less).zip(&left) {
        assert_eq!([&size[..5], &size[..5]], [&less[..5], &left[..5]]);
        let offset = fit["offset_um"][&size[0]].as_f64().unwrap();
        let [size_um, less_um, left_um] = [size, less, left].map(|row| number(&row[5]));
        assert!(
            near(less_um, size_um - offset, 1e-3),
            "{size:?} {less:?} {offset}"
        );
        let foretold = model(number(&size[0]), number(&size[1]));
        assert!(
            near(left_um, less_um - foretold, 1e-3),
            "{less:?} {left:?} {foretold}"
        );
    }
    let campaign = campaign();
    for figure in 2..=7 {
        let rows = rows(figure);
        assert!(rows.len() >= 300, "figure {figure}: {}", rows.len());
        for row in &rows {
            let run = campaign.runs.iter().find(|run| run.file == row[0]).unwrap();
            assert!(near(run.radius_m * 1e3, number(&row[1]), 1e-6));
            assert!(near(run.feed_m_s * 1e3, number(&row[2]), 1e-6));
            let mean = run.samples.deviation_m.iter().sum::<f64>() * 1e6
                / run.samples.deviation_m.len() as f64;
            let form = lobes_um(run.sign(), number(&row[4]).to_radians());
            assert!(
                near(number(&row[5]), mean + form, 0.3),
                "figure {figure}: {row:?} {mean} {form}"
            );
        }
        let ways: std::collections::BTreeSet<&str> = rows.iter().map(|r| r[3].as_str()).collect();
        let both = figure <= 4;
        assert_eq!(
            ways.len(),
            if both { 2 } else { 1 },
            "figure {figure}: {ways:?}"
        );
    }
}

#[test]
fn what_is_wrong_is_said_with_the_right_code() {
    let directory = written();
    for (arguments, code, words) in [
        (
            vec!["fit", "campaign", "--train-radius", "120"],
            2,
            "has 100, 150, 300 mm",
        ),
        (
            vec!["fit", "campaign", "--alpha", "1.5"],
            2,
            "significance 1.5",
        ),
        (vec!["fit", "nowhere"], 3, "nowhere"),
        (
            vec!["fit", "campaign", "-o", "no/such/place.toml"],
            3,
            "place.toml",
        ),
    ] {
        let output = giotto(directory.path(), &arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{said}");
        assert!(said.contains(words) && said.contains("help: "), "{said}");
        assert!(output.stdout.is_empty());
    }
}
