//! Campaigns made in memory, written, read back, and broken.
use super::*;
use std::f64::consts::PI;
use std::path::Path;

/// A ballbar run: 45 µm set-up offset, 30 µm too small, 0.1 µm steps.
fn ballbar(file: &str, direction: Direction, n: usize, turn_s: f64) -> Run {
    let d = f64::from(direction.sign());
    let angle = |k: usize| d * TAU * k as f64 / n as f64;
    let deviation = |k: usize| (-300.0 + 450.0 * angle(k).cos()).round() * 1e-7;
    Run {
        file: file.into(),
        radius_m: 0.1,
        feed_m_s: 0.2,
        direction,
        start_angle_rad: 0.0,
        started_s: Some(3.5),
        temperature_c: Some(21.0),
        centre_m: Some([-0.29, 0.987, 0.615]),
        frame: crate::campaign::Frame::default(),
        setup: None,
        samples: Samples {
            angle_rad: (0..n).map(angle).collect(),
            deviation_m: (0..n).map(deviation).collect(),
            time_s: Some((0..n).map(|k| turn_s * k as f64 / n as f64).collect()),
            angle_inferred: true,
        },
    }
}

fn close(a: &[f64], b: &[f64], tolerance: f64) {
    assert_eq!(a.len(), b.len());
    for (k, (a, b)) in a.iter().zip(b).enumerate() {
        assert!((a - b).abs() <= tolerance, "{k}: {a} against {b}");
    }
}

fn write_raw(dir: &Path, toml: &str, files: &[(&str, &str)]) {
    std::fs::write(dir.join("campaign.toml"), toml).unwrap();
    for (name, text) in files {
        std::fs::write(dir.join(name), text).unwrap();
    }
}

const ONE: &str = "[campaign]\nname = \"c\"\nmachine = \"m\"\n[[run]]\nfile = \"a.csv\"\nradius_mm = 100\nfeed_mm_s = 200\ndirection = \"cw\"\n";

#[test]
fn what_is_written_is_read_back() {
    let dir = tempfile::tempdir().unwrap();
    let turn = PI;
    let campaign = Campaign {
        name: "a \"quoted\" name".into(),
        machine: "m".into(),
        repeatability_m: None,
        table: None,
        kinematics: None,
        runs: vec![
            ballbar("run000.csv", Direction::Ccw, 500, turn),
            ballbar("b/run1.csv", Direction::Cw, 999, turn),
        ],
    };
    write(&campaign, dir.path()).unwrap();
    let (read, notes) = read_with_notes(dir.path()).unwrap();
    assert!(notes.is_empty(), "{notes:?}");
    assert_eq!(
        (&read.name, &read.machine),
        (&campaign.name, &campaign.machine)
    );
    for (a, b) in campaign.runs.iter().zip(&read.runs) {
        close(&a.samples.deviation_m, &b.samples.deviation_m, 1e-13);
        close(&a.samples.angle_rad, &b.samples.angle_rad, 1e-12);
        close(
            a.samples.time_s.as_ref().unwrap(),
            b.samples.time_s.as_ref().unwrap(),
            1e-9,
        );
        assert!(b.samples.angle_inferred);
        assert_eq!(
            (&a.file, a.radius_m, a.feed_m_s, a.direction),
            (&b.file, b.radius_m, b.feed_m_s, b.direction)
        );
        assert_eq!(
            (a.started_s, a.temperature_c, a.centre_m),
            (b.started_s, b.temperature_c, b.centre_m)
        );
        assert!((b.turn_s().unwrap() / turn - 1.0).abs() < 1e-9);
    }
}

#[test]
fn measured_angles_and_points_survive_a_round_trip() {
    let dir = tempfile::tempdir().unwrap();
    let mut polar = ballbar("polar.csv", Direction::Cw, 360, PI);
    polar.samples.angle_inferred = false;
    let mut points = polar.clone();
    polar.samples.time_s = None;
    points.file = "points.csv".into();
    // Points are taken about their own centre: leave the set-up offset out.
    points.samples.deviation_m = points
        .samples
        .angle_rad
        .iter()
        .map(|a| 1e-5 * (2.0 * a).cos())
        .collect();
    let campaign = Campaign {
        name: "c".into(),
        machine: "m".into(),
        repeatability_m: None,
        table: None,
        kinematics: None,
        runs: vec![polar, points],
    };
    write(&campaign, dir.path()).unwrap();
    let read = read(dir.path()).unwrap();
    for (a, b) in campaign.runs.iter().zip(&read.runs) {
        close(&a.samples.deviation_m, &b.samples.deviation_m, 2e-12);
        close(&a.samples.angle_rad, &b.samples.angle_rad, 1e-10);
        assert!(!b.samples.angle_inferred);
        assert_eq!(a.samples.time_s.is_some(), b.samples.time_s.is_some());
    }
    assert!((read.runs[1].turn_s().unwrap() / PI - 1.0).abs() < 1e-9);
}

#[test]
fn angles_come_from_the_order_of_samples_and_not_from_rounded_stamps() {
    let dir = tempfile::tempdir().unwrap();
    let n = 897;
    let tick = 0.00025;
    let turn = TAU * 0.1 / 0.2 * 1.02; // slower than programmed
    let mut csv = String::from("time_s,deviation_um\r\n");
    for k in 0..n {
        let t = (turn * k as f64 / n as f64 / tick).round() * tick;
        csv += &format!(
            "{:.5},{:.1}\r\n",
            7.0 + t,
            40.0 * (TAU * k as f64 / n as f64).cos()
        );
    }
    write_raw(
        dir.path(),
        &format!("{ONE}start_angle_deg = 90\n"),
        &[("a.csv", &csv)],
    );
    let run = &read(dir.path()).unwrap().runs[0];
    for (k, a) in run.samples.angle_rad.iter().enumerate() {
        assert!((a - (PI / 2.0 - TAU * k as f64 / n as f64)).abs() < 1e-12);
    }
    assert!((run.turn_s().unwrap() / turn - 1.0).abs() < tick / turn * 1.1);
    assert_eq!(run.samples.time_s.as_ref().unwrap()[0], 0.0);
}

#[test]
fn lost_samples_are_noted_and_angles_follow_the_stamps() {
    let dir = tempfile::tempdir().unwrap();
    let n = 1000;
    let kept = |k: &usize| !(300..320).contains(k);
    let mut csv = String::from("time_s,deviation_um\n");
    for k in (0..n).filter(kept) {
        csv += &format!(
            "{:.5},{:.1}\n",
            PI * k as f64 / n as f64,
            40.0 * (TAU * k as f64 / n as f64).cos()
        );
    }
    write_raw(dir.path(), ONE, &[("a.csv", &csv)]);
    let (campaign, notes) = read_with_notes(dir.path()).unwrap();
    let angle = &campaign.runs[0].samples.angle_rad;
    for (a, k) in angle.iter().zip((0..n).filter(kept)) {
        assert!((a + TAU * k as f64 / n as f64).abs() < 1e-4, "{a} at {k}");
    }
    assert_eq!(notes.len(), 1);
    assert!(notes[0].text.contains("20 samples"), "{}", notes[0]);
    assert_eq!(notes[0].at.line, Some(302));
}

#[test]
fn points_in_space_are_seen_from_the_positive_axis() {
    let dir = tempfile::tempdir().unwrap();
    let n = 200;
    // A circle in the plane across y (G18), 2° tilted, 3 m from the origin; clockwise seen from +y.
    let tilt = 2f64.to_radians();
    let mut csv = String::from("x_mm,y_mm,z_mm\n");
    for k in 0..n {
        let a = TAU * k as f64 / n as f64;
        let (u, v) = (100.05 * a.cos(), 100.05 * a.sin());
        // Seen from +y with x to the right, z points down: growing a in (x, z) runs clockwise.
        let (x, y, z) = (u * tilt.cos(), u * tilt.sin(), v);
        csv += &format!("{:.6},{:.6},{:.6}\n", 1000.0 + x, 2000.0 + y, 3000.0 + z);
    }
    write_raw(dir.path(), ONE, &[("a.csv", &csv)]);
    let manifest = Manifest::open(dir.path()).unwrap();
    let loaded = manifest.load(0).unwrap();
    let frame = loaded.location.unwrap();
    close(&frame.origin_m, &[1.0, 2.0, 3.0], 1e-8);
    let plane = frame.plane.unwrap();
    assert!((plane.tilt_rad - tilt).abs() < 1e-7, "{plane:?}");
    assert!(plane.flatness_m < 2e-9 && plane.normal[1] > 0.99);
    close(&loaded.run.samples.deviation_m, &vec![5e-5; n], 1e-8);
}

#[test]
fn a_long_file_is_read_in_pieces_and_its_faults_found() {
    let dir = tempfile::tempdir().unwrap();
    let n = 300_000; // several blocks
    let line = |k: usize| {
        format!(
            "{:.6},{:.1}\n",
            PI * k as f64 / n as f64,
            (k % 7) as f64 - 30.0
        )
    };
    let mut csv = String::from("time_s,deviation_um\n");
    (0..n).for_each(|k| csv += &line(k));
    write_raw(dir.path(), ONE, &[("a.csv", &csv)]);
    let run = &read(dir.path()).unwrap().runs[0];
    assert_eq!(run.samples.deviation_m.len(), n);
    for k in [0, 1, 65_000, 123_457, n - 1] {
        assert_eq!(run.samples.deviation_m[k], ((k % 7) as f64 - 30.0) * 1e-6);
    }
    let bad = 250_001;
    let at = csv.match_indices('\n').nth(bad).unwrap().0 + 1;
    csv.replace_range(at..at + 1, "x");
    write_raw(dir.path(), ONE, &[("a.csv", &csv)]);
    let error = read(dir.path()).unwrap_err();
    assert_eq!(
        (error.at.line, error.at.column),
        (Some(bad + 2), Some(1)),
        "{error}"
    );
}

#[test]
fn keys_that_look_like_slips_are_refused_and_others_noted() {
    let dir = tempfile::tempdir().unwrap();
    let mut csv = String::from("angle_deg,deviation_mm\n");
    (0..72).for_each(|k| csv += &format!("{},0.01\n", -5 * k));
    write_raw(
        dir.path(),
        &format!("{ONE}operator = \"me\"\n"),
        &[("a.csv", &csv)],
    );
    let (_, notes) = read_with_notes(dir.path()).unwrap();
    assert_eq!(notes.len(), 1);
    assert_eq!((notes[0].at.line, notes[0].at.column), (Some(9), Some(1)));
    for slip in [
        "start_angel_deg = 3",
        "temperature_k = 300",
        "Radius_mm = 1",
        "center_mm = [0,0,0]",
        "started = 1",
    ] {
        write_raw(dir.path(), &format!("{ONE}{slip}\n"), &[("a.csv", &csv)]);
        let error = read(dir.path()).unwrap_err();
        assert!(
            matches!(*error.problem, Problem::UnknownKey { .. }),
            "{slip}: {error}"
        );
        assert_eq!(error.at.line, Some(9));
    }
}

#[test]
fn one_wrong_label_in_twelve_is_named_and_two_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    // A turn of 100 mm at 200 mm/s takes π s.
    let runs = (0..12).map(|k| ballbar(&format!("run{k}.csv"), Direction::Ccw, 200 + k, PI));
    let campaign = Campaign {
        name: "labels".into(),
        machine: "bench".into(),
        repeatability_m: None,
        table: None,
        kinematics: None,
        runs: runs.collect(),
    };
    write(&campaign, dir.path()).unwrap();
    let file = dir.path().join("campaign.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let mislabel = |text: &str, run: &str| {
        let at = text.find(run).unwrap();
        let (before, after) = text.split_at(at);
        before.to_owned() + &after.replacen("feed_mm_s = 200.0", "feed_mm_s = 100.0", 1)
    };
    let one = mislabel(&text, "run4.csv");
    std::fs::write(&file, &one).unwrap();
    assert!(read(dir.path()).is_err());
    let manifest = Manifest::open(dir.path()).unwrap();
    let (labelled, _, left_out) = manifest.read_labelled().unwrap();
    assert_eq!((labelled.runs.len(), left_out.len()), (11, 1));
    assert_eq!(left_out[0].file, "run4.csv");
    assert!(left_out[0].error.contradicts_its_label());
    std::fs::write(&file, mislabel(&one, "run7.csv")).unwrap();
    let manifest = Manifest::open(dir.path()).unwrap();
    let refused = manifest.read_labelled().unwrap_err();
    assert!(refused.to_string().contains("run7.csv"), "{refused}");
}

#[test]
fn open_campaigns_are_read_without_a_note() {
    let Some(root) = std::env::var_os("GIOTTO_CAMPAIGNS") else {
        return;
    };
    for entry in std::fs::read_dir(root)
        .unwrap()
        .flatten()
        .filter(|e| e.path().is_dir())
    {
        let (campaign, notes) = read_with_notes(&entry.path()).unwrap();
        assert_eq!(campaign.runs.len(), 78);
        assert!(notes.is_empty(), "{}: {notes:?}", entry.path().display());
    }
}

#[test]
fn a_circle_keeps_its_plane_from_the_file_to_the_run() {
    let tilted = Frame::across([0.3, -0.2, 0.9]).unwrap();
    for frame in Plane::ALL.into_iter().map(Frame::of).chain([tilted]) {
        let dir = tempfile::tempdir().unwrap();
        let mut bar = ballbar("bar.csv", Direction::Cw, 360, PI);
        bar.samples.angle_inferred = false;
        bar.samples.deviation_m = bar
            .samples
            .angle_rad
            .iter()
            .map(|a| 1e-5 * (2.0 * a + 0.4).cos())
            .collect();
        bar.frame = frame;
        bar.setup = Some("A".into());
        let mut polar = bar.clone();
        polar.file = "polar.csv".into();
        polar.samples.time_s = None;
        let campaign = Campaign {
            name: "c".into(),
            machine: "m".into(),
            repeatability_m: Some(3e-6),
            table: Some("ab".repeat(32)),
            kinematics: None,
            runs: vec![bar, polar],
        };
        write(&campaign, dir.path()).unwrap();
        let read = read(dir.path()).unwrap();
        assert_eq!(
            (read.repeatability_m, &read.table),
            (Some(3e-6), &campaign.table)
        );
        for (a, b) in campaign.runs.iter().zip(&read.runs) {
            close(&a.samples.angle_rad, &b.samples.angle_rad, 1e-6);
            close(&a.samples.deviation_m, &b.samples.deviation_m, 1e-10);
            close(&a.frame.first(), &b.frame.first(), 1e-6);
            close(&a.frame.second(), &b.frame.second(), 1e-6);
            assert_eq!(b.setup.as_deref(), Some("A"));
        }
    }
}

#[test]
fn a_plane_that_the_points_contradict_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let rows: String = (0..360)
        .map(|k| f64::from(-k).to_radians().sin_cos())
        .map(|(sin, cos)| format!("{},0,{}\n", 100.0 * sin, 100.0 * cos))
        .collect();
    let file = format!("x_mm,y_mm,z_mm\n{rows}");
    write_raw(dir.path(), ONE, &[("a.csv", &file)]);
    assert_eq!(
        read(dir.path()).unwrap().runs[0].frame.plane(),
        Some(Plane::Zx)
    );
    for (plane, words) in [
        ("xy", "not the plane xy"),
        ("xz", "expected \"xy\", \"yz\" or \"zx\""),
    ] {
        let toml = ONE.replace("[[run]]", &format!("plane = \"{plane}\"\n[[run]]"));
        write_raw(dir.path(), &toml, &[("a.csv", &file)]);
        let refused = read(dir.path()).unwrap_err().to_string();
        assert!(refused.contains(words), "{refused}");
    }
}

/// A campaign of an arm: one circle by time, with this block and these lines of its run.
fn arm(block: &str, run: &str) -> (tempfile::TempDir, Result<Campaign, CampaignError>) {
    let dir = tempfile::tempdir().unwrap();
    let mut csv = "time_s,deviation_um\n".to_owned();
    for k in 0..200 {
        csv += &format!("{:.5},{:.1}\n", 0.031_416 * f64::from(k), (k * 37) % 11);
    }
    std::fs::write(dir.path().join("r.csv"), csv).unwrap();
    let toml = format!(
        "[campaign]\nname = \"arm\"\n{block}\n[[run]]\nfile = \"r.csv\"\nradius_mm = 100.0\nfeed_mm_s = 100.0\n\
         direction = \"ccw\"\n{run}\n"
    );
    std::fs::write(dir.path().join("campaign.toml"), toml).unwrap();
    let read = read(dir.path());
    (dir, read)
}

const SIX: &str = "[kinematics]\nrobot = \"abb-irb1600-6-1.45\"\ntool_mm = [0, 65, 149]\norientation = [0, 0, 1, 0]\nbranch = \"elbow-up\"";
const TWO: &str =
    "[kinematics]\nmodel = \"scara\"\nl1_mm = 475.0\nl2_mm = 720.0\nelbow = \"positive\"";

#[test]
fn an_arm_is_read_and_written_again() {
    for (block, centre) in [
        (SIX, "centre_mm = [-290, 987, 615]"),
        (TWO, "centre_mm = [760, 250, 600]"),
    ] {
        let (_dir, read_back) = arm(block, centre);
        let campaign = read_back.unwrap();
        let kinematics = campaign.kinematics.unwrap();
        let other = tempfile::tempdir().unwrap();
        write(&campaign, other.path()).unwrap();
        let again = read(other.path()).unwrap();
        assert_eq!(again.kinematics, Some(kinematics));
        assert_eq!(again.runs[0].centre_m, campaign.runs[0].centre_m);
    }
    let (_dir, slides) = arm("[kinematics]\nmodel = \"slides\"", "");
    assert_eq!(slides.unwrap().kinematics, None);
}

/// Each refusal names the place and what was expected.
#[test]
fn an_arm_that_cannot_be_is_refused_with_its_place() {
    let centre = "centre_mm = [-290, 987, 615]";
    let cases = [
        (SIX.to_owned(), "", "9:8: `centre_mm` is missing"),
        (
            SIX.to_owned(),
            "centre_mm = [-290, 1987, 615]",
            "9:1: a circle of radius 100 mm about [-290, 1987, 615] mm, at 0°: the arm does not reach there",
        ),
        (
            TWO.to_owned(),
            "centre_mm = [0, 50, 0]",
            "9:1: a circle of radius 100 mm about [0, 50, 0] mm, at 0°: the arm does not reach there",
        ),
        (
            TWO.replace("positive", "up"),
            centre,
            "7:9: `elbow` is \"up\"; expected \"positive\" or \"negative\"",
        ),
        (
            SIX.replace("irb1600", "irb1700"),
            centre,
            "4:9: `robot` is \"abb-irb1700-6-1.45\"; expected one of abb-irb1600-6-1.45",
        ),
        (
            SIX.replace("[0, 0, 1, 0]", "[0, 0, 2, 0]"),
            centre,
            "6:15: `orientation` is [0.0, 0.0, 2.0, 0.0], of length 2.0000; expected a unit quaternion",
        ),
        (
            SIX.replace("branch = \"elbow-up\"", "branch = \"up\""),
            centre,
            "7:10: `branch` is \"up\"; expected \"elbow-up\"",
        ),
        (
            SIX.replace("branch = \"elbow-up\"", "l1_mm = 3.0"),
            centre,
            "7:9: `l1_mm` is of another model",
        ),
        (
            TWO.replace("l2_mm = 720.0", ""),
            centre,
            "`l2_mm` is missing; expected a length",
        ),
        (
            TWO.replace("l2_mm = 720.0", "l2_mm = -3.0"),
            centre,
            "6:9: `l2_mm` is -3; expected a length above 0",
        ),
        (
            "[kinematics]\nmodel = \"delta\"".to_owned(),
            centre,
            "4:9: `model` is \"delta\"; expected \"opw\"",
        ),
    ];
    for (block, run, want) in cases {
        let (_dir, read) = arm(&block, run);
        let said = read.unwrap_err().to_string();
        assert!(said.contains(want), "{said}\nwanted: {want}");
    }
}
