//! Foreign files in their real layouts, good and broken, through the real binary.
#![allow(clippy::unwrap_used, reason = "a test may fail where it stands")]
mod bench;
mod layouts;

use bench::{Bench, near};
use giotto_tests::command::{giotto, outcome};
use layouts::{LAYOUTS, Path3, SIZE_MM, bare, german, kflop, leica, rtde, spatial_analyzer};
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

#[test]
fn each_layout_gives_the_same_circle() {
    for (name, make, format, more) in LAYOUTS {
        let bench = Bench::new();
        let tilt = if *name == "bare.txt" { 0.0 } else { 0.02 };
        let file = bench.put(
            name,
            &make(&Path3 {
                tilt,
                ..Path3::default()
            }),
        );
        let (code, out, err) = bench.import(&file, more);
        assert_eq!(code, 0, "{name}: {out}{err}");
        assert!(err.contains(format), "{name}: {err}");
        let run = &serde_json::from_str::<Value>(&out).unwrap()["runs"][0];
        assert_eq!(run["direction"], "ccw", "{name}");
        let found = &bench.analyze()["runs"][0];
        near(&found["radius_error_um"], SIZE_MM * 1e3, 1.0);
        near(&found["harmonics_um"]["2"]["cos"], 15.0, 1.0);
        near(&found["centre_mm"][0], 1832.4, 2e-3);
        near(&found["centre_mm"][1], -977.1, 2e-3);
        if *name != "bare.txt" {
            near(&found["plane"]["tilt_deg"], 0.02f64.to_degrees(), 1e-3);
            near(&found["plane"]["centre_mm"][2], 611.8, 2e-3);
        }
        if *name == "sa.txt" {
            assert!(found["measured_feed_mm_s"].is_null()); // stamps in whole seconds
        } else {
            near(&found["measured_feed_mm_s"], 60.0, 0.1);
        }
        if matches!(*name, "rtde.csv" | "kflop.csv") {
            near(&run["target_radius_mm"], 100.0, 1e-4);
        }
    }
}

#[test]
fn feed_in_feed_out_dwell_and_laps_are_told_apart() {
    let path = Path3 {
        turns: 2.4,
        lead_mm: 40.0,
        dwell: 150,
        sign: -1.0,
        ..Path3::default()
    };
    let bench = Bench::new();
    let file = bench.put("rtde.csv", &rtde(&path));
    let (code, out, err) = bench.import(&file, &["--laps", "each"]);
    assert_eq!(code, 0, "{err}");
    let imported: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(imported["runs"].as_array().unwrap().len(), 2, "{out}");
    assert_eq!(imported["runs"][1]["direction"], "cw");
    let lead = 40.0 / 0.6 + 150.0;
    near(&imported["runs"][0]["rows_left_out"][0], lead, 20.0);
    let report = bench.analyze();
    for run in report["runs"].as_array().unwrap() {
        near(&run["radius_error_um"], SIZE_MM * 1e3, 1.0);
        near(&run["measured_feed_mm_s"], 60.0, 0.1);
    }
    // One lap unless asked: the laps of a recording are no repetitions.
    let one = Bench::new();
    let (code, out, _) = one.import(&one.put("rtde.csv", &rtde(&path)), &["--direction", "cw"]);
    assert_eq!(
        (
            code,
            serde_json::from_str::<Value>(&out).unwrap()["runs"]
                .as_array()
                .unwrap()
                .len()
        ),
        (0, 1)
    );
    // What the points say is not overruled.
    let (code, _, err) = one.import(&one.put("rtde.csv", &rtde(&path)), &["--direction", "ccw"]);
    assert!(
        code == 3 && err.contains("clockwise (falling)") && err.contains("rtde.csv:"),
        "{code} {err}"
    );
}

#[test]
fn an_arc_is_kept_as_one_and_a_short_one_refused() {
    let bench = Bench::new();
    let arc = bench.put(
        "arc.csv",
        &leica(&Path3 {
            turns: 243.0 / 360.0,
            ..Path3::default()
        }),
    );
    let (code, out, err) = bench.import(&arc, &[]);
    assert_eq!(code, 0, "{err}");
    near(
        &serde_json::from_str::<Value>(&out).unwrap()["runs"][0]["arc_deg"],
        243.0,
        1.0,
    );
    assert!(
        fs::read_to_string(bench.campaign().join("campaign.toml"))
            .unwrap()
            .contains("arc_deg = 24")
    );
    let whole = bench.put("whole.csv", &leica(&Path3::default()));
    assert_eq!(bench.import(&whole, &[]).0, 0);
    let report = bench.analyze();
    let (arc, whole) = (&report["runs"][0], &report["runs"][1]);
    near(&arc["arc_deg"], 243.0, 1.0);
    assert!(arc["harmonics_um"].as_object().unwrap().is_empty());
    let se = |run: &Value| run["radius_error_se_um"].as_f64().unwrap();
    assert!(se(arc) > 2.0 * se(whole), "{} {}", se(arc), se(whole));
    near(&arc["radius_error_um"], SIZE_MM * 1e3, 6.0 * se(arc)); // the oval bends an arc; its interval knows
    let before = fs::read(bench.campaign().join("campaign.toml")).unwrap();
    let short = bench.put(
        "short.csv",
        &leica(&Path3 {
            turns: 0.4,
            ..Path3::default()
        }),
    );
    let (code, out, err) = bench.import(&short, &[]);
    assert!(
        code == 3
            && out.is_empty()
            && err.contains("short.csv:2:1")
            && err.contains("at least 180°"),
        "{err}"
    );
    assert_eq!(
        fs::read(bench.campaign().join("campaign.toml")).unwrap(),
        before
    );
}

#[test]
fn a_campaign_keeps_its_own_words_and_nothing_is_half_done() {
    let bench = Bench::new();
    let good = bench.put("a.csv", &kflop(&Path3::default()));
    let more = [
        "--machine",
        "mill 7",
        "--temperature",
        "-2.5",
        "--started",
        "12",
        "--centre",
        "1,-2,3",
    ];
    assert_eq!(bench.import(&good, &more).0, 0);
    let toml = bench.campaign().join("campaign.toml");
    let mut text = fs::read_to_string(&toml).unwrap();
    for part in [
        "machine = \"mill 7\"",
        "temperature_c = -2.5",
        "started_s = 12.0",
        "centre_mm = [1.0, -2.0, 3.0]",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    text = text.replace("[[run]]", "# measured by hand   \n[[run]]");
    fs::write(&toml, &text).unwrap();
    let other = bench.put(
        "b.csv",
        &kflop(&Path3 {
            sign: -1.0,
            ..Path3::default()
        }),
    );
    assert_eq!(bench.import(&other, &[]).0, 0);
    let now = fs::read_to_string(&toml).unwrap();
    assert!(now.starts_with(&text), "{now}");
    assert!(now.contains("run001.csv") && now.contains("\"cw\""));
    // A good and a broken file together: neither is added.
    let listing = || fs::read_dir(bench.campaign()).unwrap().count();
    let files = listing();
    let broken = bench.put("c.csv", b"time,pos0,pos1,pos2\n0,1,2,x\n");
    let mut command = giotto();
    command
        .arg("import")
        .arg(&good)
        .arg(&broken)
        .args(["--radius", "100", "--feed", "60", "-o"])
        .arg(bench.campaign());
    let (code, out, err) = outcome(&command.output().unwrap());
    assert!(
        code == 3 && out.is_empty() && err.contains("c.csv:2:7"),
        "{err}"
    );
    assert_eq!(
        (listing(), fs::read_to_string(&toml).unwrap()),
        (files, now)
    );
    // A campaign that would be new is not begun.
    let fresh = Bench::new();
    assert_eq!(fresh.import(&broken, &[]).0, 3);
    assert!(!fresh.campaign().exists());
}

#[test]
fn broken_files_are_refused_by_line() {
    let path = Path3::default();
    let line = |bytes: Vec<u8>, number: usize, from: &str, to: &str| {
        let text: String = bytes.iter().map(|&b| char::from(b)).collect();
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        assert!(lines[number - 1].contains(from), "{}", lines[number - 1]);
        lines[number - 1] = lines[number - 1].replacen(from, to, 1);
        lines
            .join("\n")
            .chars()
            .map(|c| u32::from(c) as u8)
            .collect::<Vec<u8>>()
    };
    #[allow(clippy::type_complexity, reason = "a table of cases, read once")]
    let cases: Vec<(&str, Vec<u8>, &[&str], &[&str])> =
        vec![
            (
                "text in a number",
                line(leica(&path), 7, ",0.0152", "x,0.0152"),
                &[],
                &["in.csv:7:", "not a number"],
            ),
            (
                "stamp is no date",
                line(leica(&path), 9, "'08.11", "'08.13"),
                &[],
                &["in.csv:9:", "date and time"],
            ),
            (
                "row cut short",
                line(spatial_analyzer(&path), 12, "Circle,  ", ""),
                &[],
                &["in.csv:12:", "6 fields"],
            ),
            (
                "NaN",
                line(rtde(&path), 5, "0.01 -3.14", "nan -3.14"),
                &[],
                &[],
            ), // a field that is not used may be anything
            (
                "NaN in a position",
                line(rtde(&path), 5, " ", " nan "),
                &[],
                &["in.csv:5:", "not finite"],
            ),
            (
                "empty field",
                line(german(&path), 4, ";", ";;"),
                &[],
                &["in.csv:4:", "empty field"],
            ),
            (
                "unknown header",
                b"a,b,c\n1,2,3\n".to_vec(),
                &[],
                &["in.csv:1:1", "no known layout", "--columns"],
            ),
            (
                "layout asked for is another",
                leica(&path),
                &["--format", "rtde"],
                &["in.csv:1:1", "UR RTDE"],
            ),
            (
                "unknown column",
                bare(&path),
                &["--columns", "time_ms,x_furlong"],
                &["x_furlong", "expected"],
            ),
            (
                "columns that are not there",
                bare(&path),
                &["--columns", "x_m,-,-,-,-,y_m"],
                &["none of the first"],
            ),
            (
                "metres called millimetres",
                bare(&path),
                &["--columns", "time_ms,-,x_mm,y_mm"],
                &["in.csv:3:1", "as if in metres"],
            ),
            (
                "another radius",
                kflop(&Path3 {
                    radius_mm: 70.0,
                    ..Path3::default()
                }),
                &[],
                &["in.csv:2:1", "70.0", "100 mm"],
            ),
            (
                "time in the wrong unit",
                bare(&path),
                &["--columns", "time_s,-,x_m,y_m"],
                &["in.csv:", "1000 times as long"],
            ),
            ("empty", Vec::new(), &[], &["in.csv", "is empty"]),
            (
                "no direction",
                b"time_s;deviation_um\n"
                    .iter()
                    .copied()
                    .chain((0..300).flat_map(|k| {
                        format!("{};{}\n", f64::from(k) * 0.0349, k % 7).into_bytes()
                    }))
                    .collect(),
                &[],
                &["--direction"],
            ),
            (
                "ballbar results",
                b"<?xml version=\"1.0\"?><BALLBAR/>".to_vec(),
                &[],
                &["in.csv:1:1", "results", "--ballbar"],
            ),
        ];
    let mut wrong = String::new();
    for (name, bytes, more, says) in cases {
        let bench = Bench::new();
        let file = bench.put("in.csv", &bytes);
        let (code, out, err) = bench.import(&file, more);
        let right = if says.is_empty() {
            code == 0
        } else {
            code == 3 && out.is_empty() && !bench.campaign().exists()
        };
        if !right || err.contains("panicked") || !says.iter().all(|s| err.contains(s)) {
            writeln!(
                wrong,
                "--- {name}: exit {code}, wanted {says:?}\n{out}{err}"
            )
            .unwrap();
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
    let bench = Bench::new();
    let (code, _, err) = bench.import(&bench.dir.path().join("nowhere.csv"), &[]);
    assert!(
        code == 3 && err.contains("nowhere.csv: no such file"),
        "{err}"
    );
}

#[test]
fn a_ballbar_beyond_its_range_is_trimmed_at_the_ends_and_refused_inside() {
    let turn = TAU * 100.0 / 60.0;
    let row = |k: i32| {
        format!(
            "{:.4};{:.1}\n",
            turn * f64::from(k) / 500.0,
            30.0 * (TAU * f64::from(k) / 500.0).cos() - 12.0
        )
    };
    let limit = |k: i32| format!("{:.4};-1000.0\n", turn * f64::from(k) / 500.0);
    let mut text = "Zeit [s];Abweichung [µm]\n".to_owned();
    (0..40).for_each(|k| text += &limit(k));
    (40..540).for_each(|k| text += &row(k));
    (540..590).for_each(|k| text += &limit(k));
    let bench = Bench::new();
    let (code, out, err) = bench.import(
        &bench.put("bar.csv", text.replace('.', ",").as_bytes()),
        &["--direction", "cw"],
    );
    assert_eq!(code, 0, "{err}");
    let run = &serde_json::from_str::<Value>(&out).unwrap()["runs"][0];
    assert_eq!(run["rows_left_out"], serde_json::json!([40, 50]));
    assert_eq!(run["lines"], serde_json::json!([42, 541]));
    near(&bench.analyze()["runs"][0]["radius_error_um"], -12.0, 0.1);
    let mut text = "Zeit [s];Abweichung [µm]\n".to_owned();
    (0..500).for_each(|k| {
        text += &if (100..120).contains(&k) {
            limit(k)
        } else {
            row(k)
        }
    });
    let (code, _, err) = bench.import(
        &bench.put("bad.csv", text.replace('.', ",").as_bytes()),
        &["--direction", "cw"],
    );
    assert!(
        code == 3 && err.contains("bad.csv:102:1") && err.contains("-1000"),
        "{err}"
    );
}

#[test]
fn a_foreign_file_stands_for_a_campaign() {
    let bench = Bench::new();
    let file = bench.put("tracker.csv", &leica(&Path3::default()));
    let (code, _, err) = outcome(&giotto().arg("analyze").arg(&file).output().unwrap());
    assert!(code == 2 && err.contains("--radius"), "{code} {err}");
    let rest = ["--radius", "100", "--feed", "60", "--json"];
    let (code, out, err) = outcome(
        &giotto()
            .arg("analyze")
            .arg(&file)
            .args(rest)
            .output()
            .unwrap(),
    );
    assert_eq!(code, 0, "{err}");
    assert!(err.contains("Leica tracker CSV"), "{err}");
    near(
        &serde_json::from_str::<Value>(&out).unwrap()["runs"][0]["radius_error_um"],
        SIZE_MM * 1e3,
        1.0,
    );
}

/// 2e5 rows are read in blocks, where the lap begins and ends within one: what `analyze` finds in the file itself it finds in the
/// campaign that `import` makes of it, and both find the circle that the points lie on. `--example streaming -- --foreign
/// leica` does the same to 1e7 rows and prints time and memory.
#[test]
fn a_large_file_gives_the_circle_of_all_its_points() {
    let path = Path3 {
        feed_mm_s: 0.3,
        lead_mm: 2.0,
        dwell: 3000,
        tilt: 0.02,
        ..Path3::default()
    };
    let bench = Bench::new();
    for (name, make) in [
        ("kflop.csv", kflop as fn(&Path3) -> Vec<u8>),
        ("leica.csv", leica),
        ("german.csv", german),
    ] {
        let file = bench.put(name, &make(&path));
        let given = ["--radius", "100", "--feed", "0.3", "--json"];
        let analyze = |what: &Path, more: &[&str]| {
            let (code, out, err) = outcome(
                &giotto()
                    .arg("analyze")
                    .arg(what)
                    .args(more)
                    .output()
                    .unwrap(),
            );
            assert_eq!(code, 0, "{name}: {err}");
            serde_json::from_str::<Value>(&out).unwrap()["runs"][0].clone()
        };
        let direct = analyze(&file, &given);
        let folder = bench.dir.path().join(name).with_extension("campaign");
        let (code, out, err) = outcome(
            &giotto()
                .arg("import")
                .arg(&file)
                .args(given)
                .arg("-o")
                .arg(&folder)
                .output()
                .unwrap(),
        );
        assert_eq!(code, 0, "{name}: {err}");
        let imported = &serde_json::from_str::<Value>(&out).unwrap()["runs"][0];
        assert!(imported["rows"].as_u64().unwrap() > 200_000, "{imported}");
        // Nine places of a millimetre are written, and the plane is summed in other blocks.
        let again = analyze(&folder, &["--json"]);
        for key in [
            "radius_error_um",
            "radius_error_se_um",
            "out_of_roundness_um",
            "noise_um",
            "measured_feed_mm_s",
        ] {
            near(&direct[key], again[key].as_f64().unwrap(), 2e-6);
        }
        // The points without noise and tilt: 80 µm too large, oval by 15 µm.
        near(&direct["radius_error_um"], SIZE_MM * 1e3, 0.2);
        let second = &direct["harmonics_um"]["2"];
        near(
            &Value::from(
                second["cos"]
                    .as_f64()
                    .unwrap()
                    .hypot(second["sin"].as_f64().unwrap()),
            ),
            15.0,
            0.2,
        );
        near(&imported["tilt_deg"], 0.02_f64.to_degrees(), 1e-3);
    }
}

/// A fault far behind the first block is named by its line, and nothing is left behind.
#[test]
fn a_fault_in_a_large_file_is_found_by_its_line() {
    let path = Path3 {
        feed_mm_s: 0.6,
        ..Path3::default()
    };
    let text = String::from_utf8(kflop(&path)).unwrap();
    let (line, column) = (90_000, 3);
    let mut rows: Vec<String> = text.lines().map(str::to_owned).collect();
    let mut fields: Vec<&str> = rows[line - 1].split(',').collect();
    fields[column - 1] = "1x5";
    rows[line - 1] = fields.join(",");
    let bench = Bench::new();
    let (code, out, err) = bench.import(&bench.put("kflop.csv", rows.join("\n").as_bytes()), &[]);
    assert!(out.is_empty() && !bench.campaign().exists(), "{out}");
    assert!(
        code == 3 && err.contains(&format!("kflop.csv:{line}:")) && err.contains("1x5"),
        "{code} {err}"
    );
}

/// The other commands take the file as well; what one run cannot tell, they say.
#[test]
fn every_command_takes_a_foreign_file() {
    let bench = Bench::new();
    let file = bench.put("tracker.csv", &leica(&Path3::default()));
    let rest = ["--radius", "100", "--feed", "60"];
    let run = |command: &str, more: &[&str]| {
        let mut line = giotto();
        line.arg(command)
            .arg(&file)
            .args(rest)
            .args(more)
            .current_dir(bench.dir.path());
        outcome(&line.output().unwrap())
    };
    let (code, out, err) = run("diagnose", &["--json"]);
    assert_eq!(code, 0, "{err}");
    let diagnosis: Value = serde_json::from_str(&out).unwrap();
    assert!(
        diagnosis["cannot_tell"][0]
            .as_str()
            .unwrap()
            .starts_with("1 run: "),
        "{out}"
    );
    let (code, _, err) = run("report", &["-o", "report.html"]);
    assert_eq!(code, 0, "{err}");
    assert!(
        fs::read_to_string(bench.dir.path().join("report.html"))
            .unwrap()
            .contains("tracker.csv")
    );
    let (code, out, err) = run("plan", &["--gcode", "next.nc", "--rapid", "next.mod"]);
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("Warm up with"), "{out}");
    let program = fs::read_to_string(bench.dir.path().join("next.nc")).unwrap();
    assert!(
        program.contains("run 1 of ") && program.contains("tracker.csv, seed 1"),
        "{program}"
    );
    assert!(
        fs::read_to_string(bench.dir.path().join("next.mod"))
            .unwrap()
            .starts_with("MODULE")
    );
    let (code, _, err) = run("fit", &[]);
    assert!(
        code == 3 && err.contains("help: measure more"),
        "{code} {err}"
    );
}

#[test]
fn results_of_ballbar_20_are_set_beside() {
    let b5r = r#"<?xml version="1.0" encoding="utf-8"?>
<BALLBAR><MACHINE_TESTED NAME="VMC 2"/><PLANE TEST_PLANE="XY"/><DATE_STARTED>2022-11-08</DATE_STARTED>
 <FEATURES><FEATURE NAME="AF_CIRCULARITY" DT="UT_LENGTH_UM">31.5</FEATURE>
 <FEATURE NAME="AF_SERVO_MISMATCH" DT="UT_TIME_MS">0.41</FEATURE>
 <FEATURE NAME="AF_BACKLASH_A_POS" DT="UT_LENGTH_UM">2.0</FEATURE></FEATURES></BALLBAR>"#;
    let bench = Bench::new();
    for sign in [1.0, -1.0] {
        let path = Path3 {
            sign,
            ..Path3::default()
        };
        // The oval is written along the path: the same in x, y both ways round, so even.
        assert_eq!(bench.import(&bench.put("k.csv", &kflop(&path)), &[]).0, 0);
    }
    let analyze = |file: &Path| {
        outcome(
            &giotto()
                .args(["analyze", "--json", "--ballbar"])
                .arg(file)
                .arg(bench.campaign())
                .output()
                .unwrap(),
        )
    };
    let utf16: Vec<u8> = [0xFF, 0xFE]
        .into_iter()
        .chain(b5r.encode_utf16().flat_map(u16::to_le_bytes))
        .collect();
    for bytes in [b5r.as_bytes().to_vec(), utf16] {
        let (code, out, err) = analyze(&bench.put("t.b5r", &bytes));
        assert_eq!(code, 0, "{err}");
        let found = &serde_json::from_str::<Value>(&out).unwrap()["ballbar20"];
        assert_eq!(
            (&found["machine"], &found["plane"]),
            (&"VMC 2".into(), &"XY".into())
        );
        assert_eq!(found["results"].as_array().unwrap().len(), 3);
        near(&found["results"][0]["giotto"][0], 40.0, 10.0); // an oval of 30 µm, and up to 20 µm of noise
        near(&found["results"][1]["giotto"][0], 0.0, 0.05);
        assert!(found["results"][2]["giotto"][0].is_null());
    }
    for (bad, says) in [
        ("<BALLBAR></BALLBAR>", "no FEATURE"),
        (
            "<B><FEATURE NAME=\"AF_X\" DT=\"UT_LENGTH_UM\">abc</FEATURE></B>",
            "expected a number",
        ),
        ("<B><FEATURE NAME=\"AF_X\">1</WRONG></B>", "XML"),
        ("plain text", "not XML"),
        ("", "is empty"),
    ] {
        let (code, out, err) = analyze(&bench.put("t.b5r", bad.as_bytes()));
        assert!(
            code == 3 && out.is_empty() && err.contains("t.b5r") && err.contains(says),
            "{bad}: {err}"
        );
    }
}
