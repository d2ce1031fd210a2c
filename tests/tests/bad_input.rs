//! Broken campaigns against the real binary: exit 3, the place, the reason; never a panic, never half a result.
#![allow(clippy::unwrap_used, reason = "a test may fail where it stands")]
use giotto_tests::command::{giotto, outcome};
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

const N: usize = 240;

/// A ballbar run of R 100 mm at 200 mm/s: 45 µm set-up offset, 20 µm oval, a little noise.
fn rows(direction: f64, lap: impl Fn(usize) -> f64) -> Vec<[f64; 2]> {
    let turn = TAU * 100.0 / 200.0;
    let row = |k: usize| {
        let a = direction * lap(k);
        let noise = ((k * 7919 + 13) % 17) as f64 / 10.0 - 0.8;
        [
            turn * k as f64 / N as f64,
            -30.0 + 45.0 * a.cos() + 20.0 * (2.0 * a).sin() + noise,
        ]
    };
    (0..N).map(row).collect()
}

fn turn(k: usize) -> f64 {
    TAU * k as f64 / N as f64
}

fn csv(header: &str, rows: &[[f64; 2]]) -> String {
    let mut text = format!("{header}\n");
    rows.iter()
        .for_each(|[t, v]| writeln!(text, "{t:.5},{v:.1}").unwrap());
    text
}

fn good() -> String {
    csv("time_s,deviation_um", &rows(1.0, turn))
}

fn with_angles(direction: f64) -> String {
    let rows: Vec<_> = (0..N)
        .map(|k| [direction * turn(k).to_degrees(), (k % 5) as f64 * 0.1])
        .collect();
    csv("angle_deg,deviation_um", &rows)
}

fn points(radius: f64, arc: f64) -> String {
    let mut text = "x_mm,y_mm\n".to_owned();
    for k in 0..N {
        let a = arc * k as f64 / N as f64;
        writeln!(
            text,
            "{:.7},{:.7}",
            5.0 * radius + radius * a.cos(),
            radius * a.sin()
        )
        .unwrap();
    }
    text
}

const TOML: &str = r#"[campaign]
name = "bench"
machine = "mill"
[[run]]
file = "a.csv"
radius_mm = 100.0
feed_mm_s = 200.0
direction = "ccw"
[[run]]
file = "b.csv"
radius_mm = 100.0
feed_mm_s = 200.0
direction = "cw"
"#;

/// The good campaign: every case breaks one thing of it.
fn lay_out(dir: &Path) {
    fs::write(dir.join("campaign.toml"), TOML).unwrap();
    fs::write(dir.join("a.csv"), good()).unwrap();
    fs::write(
        dir.join("b.csv"),
        csv("time_s,deviation_um", &rows(-1.0, |k| turn(k) + 0.01)),
    )
    .unwrap();
}

enum Break {
    /// Replace the text in campaign.toml.
    Toml(&'static str, &'static str),
    /// Replace the whole of campaign.toml.
    WholeToml(&'static [u8]),
    /// Replace a.csv.
    Csv(fn() -> Vec<u8>),
    /// Replace line n (from 1) of a.csv.
    Line(usize, &'static str),
    /// Anything else.
    Do(fn(&Path)),
}
use Break::{Csv, Do, Line, Toml, WholeToml};

fn bytes(text: impl Into<String>) -> Vec<u8> {
    text.into().into_bytes()
}

/// Name, what is broken, and what the message must say: the place first.
const CASES: &[(&str, Break, &[&str])] = &[
    // campaign.toml
    (
        "no campaign.toml",
        Do(|d| fs::remove_file(d.join("campaign.toml")).unwrap()),
        &["campaign.toml: no such file"],
    ),
    (
        "campaign.toml is empty",
        WholeToml(b""),
        &["campaign.toml", "is empty"],
    ),
    (
        "campaign.toml is blank",
        WholeToml(b" \n\n"),
        &["campaign.toml", "is empty"],
    ),
    (
        "campaign.toml is not UTF-8",
        WholeToml(b"[campaign]\nname = \"M\xFCnchen\"\n"),
        &["campaign.toml:2:10", "UTF-8"],
    ),
    (
        "not TOML",
        Toml("radius_mm = 100.0", "radius_mm 100.0"),
        &["campaign.toml:6:", "TOML"],
    ),
    (
        "decimal comma in TOML",
        Toml("100.0", "100,0"),
        &["campaign.toml:6:"],
    ),
    (
        "no [campaign]",
        Toml("[campaign]\nname = \"bench\"\nmachine = \"mill\"\n", ""),
        &["campaign.toml:1:", "[campaign]"],
    ),
    (
        "no runs",
        WholeToml(b"[campaign]\nname = \"c\"\nmachine = \"m\"\n"),
        &["campaign.toml:1:", "no runs"],
    ),
    (
        "empty list of runs",
        WholeToml(b"run = []\n[campaign]\nname = \"c\"\n"),
        &["campaign.toml:1:7", "no runs"],
    ),
    (
        "one bracket",
        WholeToml(b"[campaign]\nname = \"c\"\n[run]\nfile = \"a.csv\"\n"),
        &["campaign.toml:3:", "[[run]]"],
    ),
    (
        "no file key",
        Toml("file = \"a.csv\"\n", ""),
        &["campaign.toml:4:1", "file", "missing"],
    ),
    (
        "no radius key",
        Toml("radius_mm = 100.0\n", ""),
        &["campaign.toml:4:1", "radius_mm", "missing"],
    ),
    (
        "no feed key",
        Toml("feed_mm_s = 200.0\n", ""),
        &["campaign.toml:4:1", "feed_mm_s"],
    ),
    (
        "no direction key",
        Toml("direction = \"ccw\"\n", ""),
        &["campaign.toml:4:1", "direction"],
    ),
    (
        "misspelt key",
        Toml("feed_mm_s", "feed_mms"),
        &["campaign.toml:7:1", "feed_mms", "did you mean feed_mm_s"],
    ),
    (
        "key without its unit",
        Toml("feed_mm_s", "feed"),
        &["campaign.toml:7:1", "did you mean feed_mm_s"],
    ),
    (
        "radius as text",
        Toml("100.0", "\"100\""),
        &["campaign.toml:6:13", "text", "expected a radius"],
    ),
    (
        "file as number",
        Toml("\"a.csv\"", "7"),
        &["campaign.toml:5:8", "number", "text in quotes"],
    ),
    (
        "negative radius",
        Toml("100.0", "-100.0"),
        &["campaign.toml:6:13", "-100"],
    ),
    ("radius 0", Toml("100.0", "0"), &["campaign.toml:6:13"]),
    (
        "radius NaN",
        Toml("100.0", "nan"),
        &["campaign.toml:6:13", "NaN"],
    ),
    (
        "radius infinite",
        Toml("100.0", "inf"),
        &["campaign.toml:6:13"],
    ),
    (
        "feed 0",
        Toml("200.0", "0.0"),
        &["campaign.toml:7:13", "above 0"],
    ),
    (
        "negative feed",
        Toml("200.0", "-200.0"),
        &["campaign.toml:7:13"],
    ),
    (
        "unknown direction",
        Toml("\"ccw\"", "\"left\""),
        &["campaign.toml:8:13", "left", "\"ccw\" or \"cw\""],
    ),
    (
        "direction in capitals",
        Toml("\"ccw\"", "\"CCW\""),
        &["campaign.toml:8:13", "CCW"],
    ),
    (
        "two numbers for a centre",
        Toml("\"ccw\"", "\"ccw\"\ncentre_mm = [1, 2]"),
        &["campaign.toml:9:13", "three numbers"],
    ),
    (
        "text in a centre",
        Toml("\"ccw\"", "\"ccw\"\ncentre_mm = [1, 2, \"z\"]"),
        &["campaign.toml:9:20"],
    ),
    (
        "start angle in turns of text",
        Toml("\"ccw\"", "\"ccw\"\nstart_angle_deg = \"0\""),
        &["campaign.toml:9:19"],
    ),
    (
        "start before the campaign",
        Toml("\"ccw\"", "\"ccw\"\nstarted_s = -5"),
        &["campaign.toml:9:13", "0 or more"],
    ),
    (
        "key twice",
        Toml("\"ccw\"", "\"ccw\"\ndirection = \"cw\""),
        &["campaign.toml:9:1", "TOML"],
    ),
    (
        "run listed twice",
        Toml("b.csv", "a.csv"),
        &["campaign.toml:10:8", "a.csv", "twice", "line 5"],
    ),
    (
        "run listed twice, spelt otherwise",
        Toml("b.csv", "./a.csv"),
        &["campaign.toml:10:8", "twice"],
    ),
    (
        "file outside the campaign",
        Toml("a.csv", "../a.csv"),
        &["campaign.toml:5:8", "leaves"],
    ),
    (
        "absolute file",
        Toml("a.csv", "/etc/hostname"),
        &["campaign.toml:5:8", "leaves"],
    ),
    // The file of a run
    (
        "missing file",
        Do(|d| fs::remove_file(d.join("a.csv")).unwrap()),
        &["a.csv: no such file"],
    ),
    (
        "directory for a file",
        Do(|d| {
            fs::remove_file(d.join("a.csv")).unwrap();
            fs::create_dir(d.join("a.csv")).unwrap();
        }),
        &["a.csv: is a directory"],
    ),
    ("empty file", Csv(Vec::new), &["a.csv: is empty"]),
    (
        "header only",
        Csv(|| bytes("time_s,deviation_um\n")),
        &["a.csv:1:1", "0 sample"],
    ),
    (
        "one point",
        Csv(|| bytes("time_s,deviation_um\n0,1\n")),
        &["a.csv:2:1", "1 sample"],
    ),
    (
        "header wrong",
        Line(1, "time,dev"),
        &["a.csv:1:1", "time,dev", "time_s,deviation_um"],
    ),
    (
        "header half right",
        Line(1, "time_s,deviation_nm"),
        &["a.csv:1:8", "deviation_nm"],
    ),
    (
        "no header",
        Csv(|| bytes(good().lines().skip(1).collect::<Vec<_>>().join("\n"))),
        &["a.csv:1:1", "no header"],
    ),
    (
        "column twice",
        Line(1, "time_s,time_s"),
        &["a.csv:1:8", "twice"],
    ),
    (
        "deviation alone",
        Csv(|| bytes("deviation_um\n1\n2\n")),
        &["a.csv:1:1"],
    ),
    (
        "x without y",
        Csv(|| bytes("x_mm,z_mm\n1,2\n")),
        &["a.csv:1:1"],
    ),
    (
        "NaN",
        Line(17, "0.2094,NaN"),
        &["a.csv:17:8", "NaN", "deviation_um"],
    ),
    (
        "infinity",
        Line(17, "0.2094,-inf"),
        &["a.csv:17:8", "finite"],
    ),
    (
        "text in a number",
        Line(40, "0.5105,12a"),
        &["a.csv:40:8", "12a", "deviation_um"],
    ),
    (
        "unit in a number",
        Line(40, "0.5105 s,12"),
        &["a.csv:40:1", "0.5105 s", "time_s"],
    ),
    (
        "empty field",
        Line(40, "0.5105,"),
        &["a.csv:40:8", "empty field", "deviation_um"],
    ),
    (
        "too few fields",
        Line(40, "0.5105"),
        &["a.csv:40:", "1 fields", "expected 2"],
    ),
    (
        "too many fields",
        Line(40, "0.5105,1.0,2.0"),
        &["a.csv:40:", "3 fields", "expected 2"],
    ),
    (
        "decimal comma",
        Csv(|| bytes(good().replace('.', ","))),
        &["a.csv:2:1", "decimal comma"],
    ),
    (
        "German locale",
        Csv(|| bytes(good().replace(',', ";").replace('.', ","))),
        &["a.csv:1:7", "semicolons"],
    ),
    (
        "semicolons below a good header",
        Line(9, "0,08;1,5"),
        &["a.csv:9:", "semicolons"],
    ),
    (
        "tabs",
        Csv(|| bytes(good().replace(',', "\t"))),
        &["a.csv:1:1"],
    ),
    ("empty line", Line(40, ""), &["a.csv:40:1", "empty line"]),
    (
        "header again",
        Line(40, "time_s,deviation_um"),
        &["a.csv:40:1", "time_s"],
    ),
    (
        "not UTF-8",
        Csv(|| [b"time_s,deviation_um\n0.0,1.0\n0.1,\xB5\n".as_slice()].concat()),
        &["a.csv:3:5", "UTF-8"],
    ),
    (
        "header not UTF-8",
        Csv(|| b"time_s,deviation_\xB5m\n0.0,1.0\n".to_vec()),
        &["a.csv:1:18", "UTF-8"],
    ),
    (
        "UTF-16",
        Csv(|| good().encode_utf16().flat_map(u16::to_le_bytes).collect()),
        &["a.csv:1:"],
    ),
    (
        "binary",
        Csv(|| {
            (0..20_000u32)
                .map(|k| (k.wrapping_mul(2_654_435_761) >> 13) as u8)
                .collect()
        }),
        &["a.csv:1:"],
    ),
    (
        "ends in the middle of a row",
        Csv(|| {
            let mut t = good();
            t.truncate(t.len() - 8);
            t.push('.');
            bytes(t)
        }),
        &["a.csv:241:"],
    ),
    // What the numbers say
    (
        "time goes back",
        Line(100, "0.5,0.0"),
        &["a.csv:100:1", "time goes back"],
    ),
    (
        "time stands still",
        Csv(|| {
            bytes(csv(
                "time_s,deviation_um",
                &(0..N).map(|k| [3.0, k as f64 * 0.1]).collect::<Vec<_>>(),
            ))
        }),
        &["a.csv:241:1", "stands still"],
    ),
    (
        "time in milliseconds",
        Csv(|| {
            bytes(csv(
                "time_s,deviation_um",
                &rows(1.0, turn)
                    .iter()
                    .map(|[t, v]| [t * 1e3, *v])
                    .collect::<Vec<_>>(),
            ))
        }),
        &["a.csv:", "1000 times as long", "ms"],
    ),
    (
        "feed in m/s",
        Toml("200.0", "0.2"),
        &["a.csv:", "1000 times shorter", "feed were in m/s"],
    ),
    (
        "feed in mm/min",
        Toml("200.0", "12000"),
        &["a.csv:", "60 times as long", "mm/min"],
    ),
    (
        "radius in m",
        Toml("100.0", "0.1"),
        &["a.csv:", "1000 times as long", "radius in m"],
    ),
    (
        "deviation in µm called mm",
        Line(1, "time_s,deviation_mm"),
        &["a.csv:2:9", "unit may be wrong"],
    ),
    (
        "noise in µm called mm",
        Csv(|| {
            bytes(csv(
                "time_s,deviation_mm",
                &rows(1.0, turn)
                    .iter()
                    .enumerate()
                    .map(|(k, [t, _])| [*t, ((k * 7919 + 13) % 17) as f64 / 10.0 - 0.8])
                    .collect::<Vec<_>>(),
            ))
        }),
        &["a.csv:2:9", "scatter"],
    ),
    (
        "radius called deviation",
        Csv(|| {
            bytes(csv(
                "time_s,deviation_mm",
                &rows(1.0, turn)
                    .iter()
                    .map(|[t, v]| [*t, 100.0 + v / 1e3])
                    .collect::<Vec<_>>(),
            ))
        }),
        &["a.csv:2:9", "look like radii"],
    ),
    (
        "radius in m in the file",
        Csv(|| {
            bytes(csv(
                "time_s,radius_mm",
                &rows(1.0, turn)
                    .iter()
                    .map(|[t, _]| [*t, 0.1])
                    .collect::<Vec<_>>(),
            ))
        }),
        &["a.csv:2:9", "as if in metres"],
    ),
    (
        "huge deviation",
        Line(50, "0.64141,99999"),
        &["a.csv:50:9", "outlier"],
    ),
    (
        "a lone spike",
        Line(50, "0.64141,4000"),
        &["a.csv:50:9", "neighbours"],
    ),
    (
        "ballbar at its limit",
        Csv(|| {
            bytes(csv(
                "time_s,deviation_um",
                &rows(1.0, turn)
                    .iter()
                    .map(|[t, v]| [*t, (v * 30.0).clamp(-1000.0, 1000.0)])
                    .collect::<Vec<_>>(),
            ))
        }),
        &["a.csv:", "its limit", "1000"],
    ),
    (
        "half a circle",
        Csv(|| bytes(csv("time_s,deviation_um", &rows(1.0, turn)[..N / 2]))),
        &["a.csv:121:1", "0.50 of a turn"],
    ),
    (
        "two laps",
        Csv(|| {
            bytes(csv(
                "time_s,deviation_um",
                &rows(1.0, |k| 2.0 * turn(k))
                    .iter()
                    .map(|[t, v]| [t * 2.0, *v])
                    .collect::<Vec<_>>(),
            ))
        }),
        &["a.csv:", "2 laps"],
    ),
    (
        "a long hole",
        Csv(|| {
            let r = rows(1.0, turn);
            bytes(csv("time_s,deviation_um", &[&r[..50], &r[100..]].concat()))
        }),
        &["a.csv:52:1", "missing", "75°"],
    ),
    (
        "clockwise called counter-clockwise",
        Csv(|| bytes(with_angles(-1.0))),
        &["a.csv:241:1", "clockwise (falling)", "\"ccw\""],
    ),
    (
        "half a circle of angles",
        Csv(|| bytes(with_angles(0.5))),
        &["a.csv:241:1", "180.0°", "one full turn"],
    ),
    (
        "two laps of angles",
        Csv(|| bytes(with_angles(2.0))),
        &["a.csv:", "2.00 turns"],
    ),
    (
        "angle stands still",
        Csv(|| bytes(with_angles(0.0))),
        &["a.csv:241:1", "angle stands still"],
    ),
    (
        "angle jumps back",
        Csv(|| {
            let t = with_angles(1.0);
            let l: Vec<_> = t.lines().collect();
            bytes(
                l.iter()
                    .enumerate()
                    .map(|(k, r)| if k == 99 { l[80] } else { r })
                    .collect::<Vec<_>>()
                    .join("\n"),
            )
        }),
        &["a.csv:100:1", "jumps back by 27.00"],
    ),
    (
        "angles in radians",
        Csv(|| bytes(with_angles(TAU / 360.0))),
        &["a.csv:241:1", "6.3°"],
    ),
    (
        "points in metres",
        Csv(|| bytes(points(0.1, TAU))),
        &["a.csv:2:1", "as if in metres"],
    ),
    (
        "points in micrometres",
        Csv(|| bytes(points(1e5, TAU))),
        &["a.csv:2:1", "as if in micrometres"],
    ),
    (
        "diameter for radius",
        Csv(|| bytes(points(50.0, TAU))),
        &["a.csv:2:1", "diameter"],
    ),
    (
        "points on a line",
        Csv(|| {
            let mut t = "x_mm,y_mm\n".to_owned();
            (0..N).for_each(|k| writeln!(t, "{k},{}", 2 * k).unwrap());
            bytes(t)
        }),
        &["a.csv:2:1", "no circle", "line"],
    ),
    (
        "one point over and over",
        Csv(|| bytes(format!("x_mm,y_mm\n{}", "100,0\n".repeat(N)))),
        &["a.csv:2:1", "no circle", "coincide"],
    ),
    (
        "points the wrong way round",
        Csv(|| bytes(points(100.0, -TAU))),
        &["a.csv:241:1", "clockwise"],
    ),
    (
        "half a circle of points",
        Csv(|| bytes(points(100.0, TAU / 2.0))),
        &["a.csv:241:1", "one full turn"],
    ),
    (
        "the same file twice",
        Do(|d| {
            fs::copy(d.join("a.csv"), d.join("b.csv")).unwrap();
        }),
        &["b.csv:", "same measurement", "a.csv"],
    ),
];

#[test]
fn the_campaign_that_the_cases_break_is_good() {
    let dir = tempfile::tempdir().unwrap();
    lay_out(dir.path());
    let (code, out, err) = outcome(&giotto().arg("analyze").arg(dir.path()).output().unwrap());
    assert_eq!(code, 0, "{out}{err}");
    assert!(
        out.contains("a.csv") && out.contains("b.csv") && err.is_empty(),
        "{out}{err}"
    );
    for good in [with_angles(1.0), points(100.0, TAU)] {
        fs::write(dir.path().join("a.csv"), good).unwrap();
        let (code, out, err) = outcome(&giotto().arg("analyze").arg(dir.path()).output().unwrap());
        assert_eq!(code, 0, "{out}{err}");
    }
}

#[test]
fn each_broken_campaign_is_refused_by_name_and_place() {
    assert!(CASES.len() >= 40);
    let mut wrong = String::new();
    for (name, what, says) in CASES {
        let dir = tempfile::tempdir().unwrap();
        let dir = dir.path();
        lay_out(dir);
        match what {
            Toml(from, to) => {
                assert!(TOML.contains(from), "{name}");
                fs::write(dir.join("campaign.toml"), TOML.replacen(from, to, 1)).unwrap();
            }
            WholeToml(text) => fs::write(dir.join("campaign.toml"), text).unwrap(),
            Csv(text) => fs::write(dir.join("a.csv"), text()).unwrap(),
            Line(number, text) => {
                let old = good();
                let mut lines: Vec<&str> = old.lines().collect();
                lines[number - 1] = text;
                fs::write(dir.join("a.csv"), lines.join("\n") + "\n").unwrap();
            }
            Do(act) => act(dir),
        }
        for json in [false, true] {
            let mut command = giotto();
            command.arg("analyze").arg(dir);
            if json {
                command.arg("--json");
            }
            let (code, out, err) = outcome(&command.output().unwrap());
            let what_instead = ["expected", "TOML", "did you mean"]
                .iter()
                .any(|s| err.contains(s));
            let told =
                err.starts_with("error: ") && says.iter().all(|s| err.contains(s)) && what_instead;
            if code != 3 || !out.is_empty() || err.contains("panicked") || !told {
                writeln!(
                    wrong,
                    "--- {name}: exit {code}, wanted {says:?}\n{out}{err}"
                )
                .unwrap();
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}
