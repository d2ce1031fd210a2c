//! Foreign files in their real layouts, good and broken, through the real binary.
#![allow(clippy::unwrap_used, reason = "a test may fail where it stands")]
use giotto_tests::command::{giotto, outcome};
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// A measured circular path in space: 80 µm too large, 30 µm oval, 4 µm noise, seen at 100 Hz; lead-in and lead-out
/// along the tangent, standing still before and after.
struct Path3 {
    radius_mm: f64,
    feed_mm_s: f64,
    sign: f64,
    turns: f64,
    tilt: f64,
    centre_mm: [f64; 3],
    lead_mm: f64,
    dwell: usize,
}

const SIZE_MM: f64 = 0.08;

impl Default for Path3 {
    fn default() -> Self {
        let centre_mm = [1832.4, -977.1, 611.8];
        Self {
            radius_mm: 100.0,
            feed_mm_s: 60.0,
            sign: 1.0,
            turns: 1.0,
            tilt: 0.02,
            centre_mm,
            lead_mm: 0.0,
            dwell: 0,
        }
    }
}

impl Path3 {
    /// Time (s), measured and wanted position (mm).
    fn points(&self) -> Vec<(f64, [f64; 3], [f64; 3])> {
        let step = self.feed_mm_s / 100.0;
        let lead = (self.lead_mm / step).round() as i64;
        let around = (self.turns * TAU * self.radius_mm / step).round() as i64;
        let place = |s: i64, radius: f64| {
            let on = s.clamp(0, around) as f64 * step / self.radius_mm;
            let beyond = (s - s.clamp(0, around)) as f64 * step;
            let a = self.sign * on;
            let (sin, cos) = a.sin_cos();
            [radius * cos - self.sign * sin * beyond, radius * sin + self.sign * cos * beyond]
        };
        let lift = |[u, v]: [f64; 2]| {
            let (sin, cos) = self.tilt.sin_cos();
            let [x, y, z] = self.centre_mm;
            [x + u * cos, y + v, z - u * sin]
        };
        let stand = self.dwell as i64;
        (-lead - stand..around + lead + stand)
            .enumerate()
            .map(|(k, s)| {
                let s = s.clamp(-lead, around + lead - 1);
                let noise = |m: u64| {
                    ((k as u64 * 2_654_435_761 + m * 40_503).wrapping_mul(0x9E37_79B9) >> 20 & 0xFFF) as f64
                };
                let bump = |m| (noise(m) / 4095.0 - 0.5) * 0.0138;
                let a = s as f64 * step / self.radius_mm;
                let [u, v] = place(s, self.radius_mm + SIZE_MM + 0.015 * (2.0 * a).cos());
                let measured = lift([u + bump(1), v + bump(2)]);
                (k as f64 / 100.0, measured, lift(place(s, self.radius_mm)))
            })
            .collect()
    }
}

fn leica(path: &Path3) -> Vec<u8> {
    let mut text = "X  [mm],Y  [mm],Z  [mm],U(95)  [mm],Temperatur [°C],Time Stamp,Name\r\n".to_owned();
    for (t, [x, y, z], _) in path.points() {
        let (minute, second) = (58 + (t / 60.0) as u32, t % 60.0);
        let (hour, minute) = (23 + minute / 60, minute % 60);
        let (day, hour) = (8 + hour / 24, hour % 24); // over midnight
        writeln!(
            text,
            "{x:.4},{y:.4},{z:.4},0.0152,20.1,'{day:02}.11.2022 {hour:02}:{minute:02}:{second:06.3},P\r"
        )
        .unwrap();
    }
    text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect() // Latin-1
}

fn spatial_analyzer(path: &Path3) -> Vec<u8> {
    let mut text = "// Exported from SpatialAnalyzer\n// Units: mm\n// Group, Name\n".to_owned();
    for (k, (t, [x, y, z], _)) in path.points().iter().enumerate() {
        let (minute, second) = (2 + (t / 60.0) as u32, (t % 60.0) as u32);
        writeln!(
            text,
            "Circle,  p{k},  {k},  {x:.4},  {y:.4},  {z:.4},  11/08/22 16:{minute:02}:{second:02}"
        )
        .unwrap();
    }
    text.into_bytes()
}

fn rtde(path: &Path3) -> Vec<u8> {
    let names = |who: &str| (0..6).map(|k| format!("{who}_TCP_pose_{k}")).collect::<Vec<_>>().join(" ");
    let mut text = format!("timestamp {} {}\n", names("target"), names("actual"));
    for (t, is, want) in path.points() {
        let pose =
            |p: [f64; 3]| format!("{:.7} {:.7} {:.7} 0.01 -3.14 0.02", p[0] / 1e3, p[1] / 1e3, p[2] / 1e3);
        writeln!(text, "{:.3} {} {}", 81_234.5 + t, pose(want), pose(is)).unwrap();
    }
    text.into_bytes()
}

fn kflop(path: &Path3) -> Vec<u8> {
    let mut text = "time,pos0,pos1,pos2,dest0,dest1,dest2\n".to_owned();
    for (t, [x, y, z], [a, b, c]) in path.points() {
        writeln!(text, "{t:.4},{x:.5},{y:.5},{z:.5},{a:.5},{b:.5},{c:.5}").unwrap();
    }
    text.into_bytes()
}

fn german(path: &Path3) -> Vec<u8> {
    let mut text = "\u{feff}Zeit [s];X [mm];Y [mm];Z [mm];Bemerkung\r\n".to_owned();
    for (t, [x, y, z], _) in path.points() {
        text += &format!("{t:.3};{x:.4};{y:.4};{z:.4};\r\n").replace('.', ",");
    }
    text.into_bytes()
}

fn bare(path: &Path3) -> Vec<u8> {
    let mut text = "some controller\nexport 7\n".to_owned();
    for (t, [x, y, _], _) in path.points() {
        writeln!(text, "{:.1}\t-1\t{:.6}\t{:.6}", t * 1e3, x / 1e3, y / 1e3).unwrap();
    }
    text.into_bytes()
}

struct Bench {
    dir: tempfile::TempDir,
}

impl Bench {
    fn new() -> Self {
        Self { dir: tempfile::tempdir().unwrap() }
    }

    fn put(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.dir.path().join(name);
        fs::write(&path, bytes).unwrap();
        path
    }

    fn campaign(&self) -> PathBuf {
        self.dir.path().join("campaign")
    }

    /// `giotto import FILE --radius 100 --feed 60 … -o campaign --json`
    fn import(&self, file: &Path, more: &[&str]) -> (i32, String, String) {
        let mut command = giotto();
        command
            .arg("import")
            .arg(file)
            .args(["--radius", "100", "--feed", "60", "--json", "-o"])
            .arg(self.campaign());
        outcome(&command.args(more).output().unwrap())
    }

    fn analyze(&self) -> Value {
        let (code, out, err) =
            outcome(&giotto().args(["analyze", "--json"]).arg(self.campaign()).output().unwrap());
        assert_eq!(code, 0, "{err}");
        serde_json::from_str(&out).unwrap()
    }
}

fn near(value: &Value, expected: f64, tolerance: f64) {
    let found = value.as_f64().unwrap_or(f64::NAN);
    assert!((found - expected).abs() <= tolerance, "{found} against {expected}");
}

type Maker = fn(&Path3) -> Vec<u8>;
const LAYOUTS: &[(&str, Maker, &str, &[&str])] = &[
    ("leica.csv", leica, "Leica tracker CSV", &[]),
    ("sa.txt", spatial_analyzer, "SpatialAnalyzer text", &[]),
    ("rtde.csv", rtde, "UR RTDE recording", &[]),
    ("kflop.csv", kflop, "KFLOP log", &[]),
    ("german.csv", german, "CSV with decimal commas", &[]),
    ("bare.txt", bare, "columns as given", &["--columns", "time_ms,-,x_m,y_m"]),
];

#[test]
fn each_layout_gives_the_same_circle() {
    for (name, make, format, more) in LAYOUTS {
        let bench = Bench::new();
        let tilt = if *name == "bare.txt" { 0.0 } else { 0.02 };
        let file = bench.put(name, &make(&Path3 { tilt, ..Path3::default() }));
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
    let path = Path3 { turns: 2.4, lead_mm: 40.0, dwell: 150, sign: -1.0, ..Path3::default() };
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
        (code, serde_json::from_str::<Value>(&out).unwrap()["runs"].as_array().unwrap().len()),
        (0, 1)
    );
    // What the points say is not overruled.
    let (code, _, err) = one.import(&one.put("rtde.csv", &rtde(&path)), &["--direction", "ccw"]);
    assert!(code == 3 && err.contains("clockwise (falling)") && err.contains("rtde.csv:"), "{code} {err}");
}

#[test]
fn an_arc_is_kept_as_one_and_a_short_one_refused() {
    let bench = Bench::new();
    let arc = bench.put("arc.csv", &leica(&Path3 { turns: 243.0 / 360.0, ..Path3::default() }));
    let (code, out, err) = bench.import(&arc, &[]);
    assert_eq!(code, 0, "{err}");
    near(&serde_json::from_str::<Value>(&out).unwrap()["runs"][0]["arc_deg"], 243.0, 1.0);
    assert!(fs::read_to_string(bench.campaign().join("campaign.toml")).unwrap().contains("arc_deg = 24"));
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
    let short = bench.put("short.csv", &leica(&Path3 { turns: 0.4, ..Path3::default() }));
    let (code, out, err) = bench.import(&short, &[]);
    assert!(
        code == 3 && out.is_empty() && err.contains("short.csv:2:1") && err.contains("at least 180°"),
        "{err}"
    );
    assert_eq!(fs::read(bench.campaign().join("campaign.toml")).unwrap(), before);
}

#[test]
fn a_campaign_keeps_its_own_words_and_nothing_is_half_done() {
    let bench = Bench::new();
    let good = bench.put("a.csv", &kflop(&Path3::default()));
    let more = ["--machine", "mill 7", "--temperature", "-2.5", "--started", "12", "--centre", "1,-2,3"];
    assert_eq!(bench.import(&good, &more).0, 0);
    let toml = bench.campaign().join("campaign.toml");
    let mut text = fs::read_to_string(&toml).unwrap();
    for part in
        ["machine = \"mill 7\"", "temperature_c = -2.5", "started_s = 12.0", "centre_mm = [1.0, -2.0, 3.0]"]
    {
        assert!(text.contains(part), "{part}: {text}");
    }
    text = text.replace("[[run]]", "# measured by hand   \n[[run]]");
    fs::write(&toml, &text).unwrap();
    let other = bench.put("b.csv", &kflop(&Path3 { sign: -1.0, ..Path3::default() }));
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
    assert!(code == 3 && out.is_empty() && err.contains("c.csv:2:7"), "{err}");
    assert_eq!((listing(), fs::read_to_string(&toml).unwrap()), (files, now));
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
        lines.join("\n").chars().map(|c| u32::from(c) as u8).collect::<Vec<u8>>()
    };
    #[allow(clippy::type_complexity, reason = "a table of cases, read once")]
    let cases: Vec<(&str, Vec<u8>, &[&str], &[&str])> = vec![
        (
            "text in a number",
            line(leica(&path), 7, ",0.0152", "x,0.0152"),
            &[],
            &["in.csv:7:", "not a number"],
        ),
        ("stamp is no date", line(leica(&path), 9, "'08.11", "'08.13"), &[], &["in.csv:9:", "date and time"]),
        (
            "row cut short",
            line(spatial_analyzer(&path), 12, "Circle,  ", ""),
            &[],
            &["in.csv:12:", "6 fields"],
        ),
        ("NaN", line(rtde(&path), 5, "0.01 -3.14", "nan -3.14"), &[], &[]), // a field that is not used may be anything
        ("NaN in a position", line(rtde(&path), 5, " ", " nan "), &[], &["in.csv:5:", "not finite"]),
        ("empty field", line(german(&path), 4, ";", ";;"), &[], &["in.csv:4:", "empty field"]),
        ("unknown header", b"a,b,c\n1,2,3\n".to_vec(), &[], &["in.csv:1:1", "no known layout", "--columns"]),
        ("layout asked for is another", leica(&path), &["--format", "rtde"], &["in.csv:1:1", "UR RTDE"]),
        ("unknown column", bare(&path), &["--columns", "time_ms,x_furlong"], &["x_furlong", "expected"]),
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
            kflop(&Path3 { radius_mm: 70.0, ..Path3::default() }),
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
                .chain((0..300).flat_map(|k| format!("{};{}\n", f64::from(k) * 0.0349, k % 7).into_bytes()))
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
            writeln!(wrong, "--- {name}: exit {code}, wanted {says:?}\n{out}{err}").unwrap();
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
    let bench = Bench::new();
    let (code, _, err) = bench.import(&bench.dir.path().join("nowhere.csv"), &[]);
    assert!(code == 3 && err.contains("nowhere.csv: no such file"), "{err}");
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
    let (code, out, err) =
        bench.import(&bench.put("bar.csv", text.replace('.', ",").as_bytes()), &["--direction", "cw"]);
    assert_eq!(code, 0, "{err}");
    let run = &serde_json::from_str::<Value>(&out).unwrap()["runs"][0];
    assert_eq!(run["rows_left_out"], serde_json::json!([40, 50]));
    assert_eq!(run["lines"], serde_json::json!([42, 541]));
    near(&bench.analyze()["runs"][0]["radius_error_um"], -12.0, 0.1);
    let mut text = "Zeit [s];Abweichung [µm]\n".to_owned();
    (0..500).for_each(|k| text += &if (100..120).contains(&k) { limit(k) } else { row(k) });
    let (code, _, err) =
        bench.import(&bench.put("bad.csv", text.replace('.', ",").as_bytes()), &["--direction", "cw"]);
    assert!(code == 3 && err.contains("bad.csv:102:1") && err.contains("-1000"), "{err}");
}

#[test]
fn a_foreign_file_stands_for_a_campaign() {
    let bench = Bench::new();
    let file = bench.put("tracker.csv", &leica(&Path3::default()));
    let (code, _, err) = outcome(&giotto().arg("analyze").arg(&file).output().unwrap());
    assert!(code == 2 && err.contains("--radius"), "{code} {err}");
    let rest = ["--radius", "100", "--feed", "60", "--json"];
    let (code, out, err) = outcome(&giotto().arg("analyze").arg(&file).args(rest).output().unwrap());
    assert_eq!(code, 0, "{err}");
    assert!(err.contains("Leica tracker CSV"), "{err}");
    near(&serde_json::from_str::<Value>(&out).unwrap()["runs"][0]["radius_error_um"], SIZE_MM * 1e3, 1.0);
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
        let path = Path3 { sign, ..Path3::default() };
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
    let utf16: Vec<u8> =
        [0xFF, 0xFE].into_iter().chain(b5r.encode_utf16().flat_map(u16::to_le_bytes)).collect();
    for bytes in [b5r.as_bytes().to_vec(), utf16] {
        let (code, out, err) = analyze(&bench.put("t.b5r", &bytes));
        assert_eq!(code, 0, "{err}");
        let found = &serde_json::from_str::<Value>(&out).unwrap()["ballbar20"];
        assert_eq!((&found["machine"], &found["plane"]), (&"VMC 2".into(), &"XY".into()));
        assert_eq!(found["results"].as_array().unwrap().len(), 3);
        near(&found["results"][0]["giotto"][0], 40.0, 10.0); // an oval of 30 µm, and up to 20 µm of noise
        near(&found["results"][1]["giotto"][0], 0.0, 0.05);
        assert!(found["results"][2]["giotto"][0].is_null());
    }
    for (bad, says) in [
        ("<BALLBAR></BALLBAR>", "no FEATURE"),
        ("<B><FEATURE NAME=\"AF_X\" DT=\"UT_LENGTH_UM\">abc</FEATURE></B>", "expected a number"),
        ("<B><FEATURE NAME=\"AF_X\">1</WRONG></B>", "XML"),
        ("plain text", "not XML"),
        ("", "is empty"),
    ] {
        let (code, out, err) = analyze(&bench.put("t.b5r", bad.as_bytes()));
        assert!(code == 3 && out.is_empty() && err.contains("t.b5r") && err.contains(says), "{bad}: {err}");
    }
}
