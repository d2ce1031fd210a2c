//! The measuring programs, read back: by the reader of `giotto compensate`, and by the `gcode` crate.
use crate::{self as nc, Fate, Options, rapid};
use giotto::model_file::{FORMAT, ModelFile, Servo, Valid};
use giotto::planning::{Plan, Purpose, Step};
use giotto_shared::Direction;

fn plan() -> Plan {
    let step = |radius_mm, feed_mm_s, direction, purpose| Step {
        radius_mm,
        feed_mm_s,
        direction,
        plane: giotto_shared::Plane::Xy,
        purpose,
    };
    let runs = vec![
        step(100.0, 150.0, Direction::Ccw, Purpose::Reference),
        step(62.5, 200.0, Direction::Cw, Purpose::Test),
        step(150.0, 300.0, Direction::Ccw, Purpose::Test),
        step(100.0, 150.0, Direction::Ccw, Purpose::Reference),
    ];
    Plan {
        open: Vec::new(),
        line_tests: Vec::new(),
        runs,
        separations: Vec::new(),
        warm_up_turns: 3,
        duration_s: 700.0,
        seed: 5,
    }
}

fn model() -> ModelFile {
    ModelFile {
        format: FORMAT,
        campaign: "c".into(),
        machine: "m".into(),
        servo: Servo::Lag { kv_per_s: 40.0 },
        valid: Valid {
            radius_mm: [50.0, 300.0],
            feed_mm_s: [20.0, 700.0],
            centre_mm: None,
        },
        kinematics: None,
        effects: Vec::new(),
        delay_s: None,
    }
}

/// Radius and feed of every arc, in order: quarter, turns, quarter for the warm-up and each run.
fn expected(plan: &Plan, blocks_a_turn: usize) -> Vec<(f64, f64)> {
    let circle =
        |s: &Step, turns: usize| vec![(s.radius_mm, s.feed_mm_s); 2 + turns * blocks_a_turn];
    let runs = plan.runs.iter().flat_map(|s| circle(s, 1));
    circle(&plan.runs[0], plan.warm_up_turns)
        .into_iter()
        .chain(runs)
        .collect()
}

fn seen(arcs: &[nc::Report]) -> Vec<(f64, f64)> {
    let of = |report: &nc::Report| match report.fate {
        Fate::Corrected {
            radius_mm,
            feed_mm_s,
            ..
        } => (
            (radius_mm * 1e3).round() / 1e3,
            (feed_mm_s * 1e3).round() / 1e3,
        ),
        Fate::Left(left) => panic!("line {}: {left}", report.line),
    };
    arcs.iter().map(of).collect()
}

#[test]
fn our_own_readers_see_the_circles_of_the_plan() {
    let plan = plan();
    let options = Options {
        max_offset_mm: 5.0,
        ..Options::default()
    };
    let nc = nc::compensate(plan.gcode("lab").as_bytes(), &model(), &options);
    assert_eq!(seen(&nc.arcs), expected(&plan, 1));
    let module = plan.rapid("lab");
    assert!(rapid::is_rapid(module.as_bytes()));
    let robot = rapid::compensate(module.as_bytes(), &model(), &options);
    assert_eq!(seen(&robot.arcs), expected(&plan, 2), "{module}");
}

/// An independent reader: places, senses and feeds of all moves; every turn closes, no jump between blocks.
#[test]
fn the_gcode_crate_sees_them_too() {
    use ::gcode::{Code, Value};
    let plan = plan();
    let text = plan.gcode("line\n(break) %");
    let read = ::gcode::parse(text.trim().trim_matches('%')).unwrap();
    let (mut place, mut turns, mut waits) = ([f32::NAN; 2], Vec::new(), 0);
    for code in read.blocks.iter().flat_map(|b| &b.codes) {
        let g = match code {
            Code::General(g) => g,
            Code::Miscellaneous(m) => {
                waits += usize::from(m.number.major() == 0);
                continue;
            }
            _ => continue,
        };
        let get = |letter: char| {
            g.args
                .iter()
                .find(|a| a.letter == letter)
                .map(|a| match a.value {
                    Value::Literal(v) => v,
                    _ => panic!("not a number"),
                })
        };
        let (Some(x), Some(y)) = (get('X'), get('Y')) else {
            continue;
        };
        if let (Some(i), Some(j)) = (get('I'), get('J')) {
            let centre = [place[0] + i, place[1] + j];
            assert!(
                centre[0].abs() < 1e-4 && centre[1].abs() < 1e-4,
                "{centre:?}"
            );
            if (place[0] - x).hypot(place[1] - y) < 1e-4 {
                assert!(
                    y.abs() < 1e-4,
                    "the measured turn begins at angle 0: {x} {y}"
                );
                turns.push((g.number.major(), x, get('F').unwrap() / 60.0));
            }
        }
        place = [x, y];
    }
    let code = |s: &Step| if s.direction == Direction::Ccw { 3 } else { 2 };
    let of = |s: &Step| (code(s), s.radius_mm as f32, s.feed_mm_s as f32);
    let warm = std::iter::repeat_n(of(&plan.runs[0]), plan.warm_up_turns);
    let wanted: Vec<_> = warm.chain(plan.runs.iter().map(of)).collect();
    assert_eq!(turns.len(), wanted.len());
    for (a, b) in turns.iter().zip(&wanted) {
        assert!(
            a.0 == b.0 && (a.1 - b.1).abs() < 1e-3 && (a.2 - b.2).abs() < 1e-3,
            "{a:?} {b:?}"
        );
    }
    assert_eq!(
        waits,
        2 * (plan.runs.len() + 1),
        "a stop before and after each"
    );
}

/// A bar of ±1 mm sees the run come and go: both ends of the tangents lie outside its range.
#[test]
fn tangents_begin_beyond_the_bar() {
    let plan = plan();
    let text = plan.gcode("lab");
    let number = |line: &str, letter: char| -> f64 {
        let word = line.split(' ').find(|w| w.starts_with(letter)).unwrap();
        word[1..].parse().unwrap()
    };
    let lines: Vec<&str> = text.lines().collect();
    let waits: Vec<usize> = (0..lines.len())
        .filter(|k| lines[*k].starts_with("M0"))
        .collect();
    for (n, at) in waits.iter().enumerate() {
        let place = lines[..*at].iter().rfind(|l| l.starts_with("G1")).unwrap();
        let step = &plan.runs[(n / 2).saturating_sub(1)];
        let far = number(place, 'X').hypot(number(place, 'Y')) - step.radius_mm;
        assert!(far > 1.4, "{place}: {far}");
    }
}

/// LinuxCNC's own interpreter, where `GIOTTO_RS274` names it: every arc of the plan, no complaint.
#[test]
fn linuxcnc_reads_the_plan() {
    let Some(rs274) = std::env::var_os("GIOTTO_RS274") else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let (file, table, out) = (
        dir.path().join("p.ngc"),
        dir.path().join("tool.tbl"),
        dir.path().join("out"),
    );
    std::fs::write(&file, plan().gcode("lab")).unwrap();
    std::fs::write(&table, "T1 P1 D6\n").unwrap();
    let arguments = [
        std::ffi::OsStr::new("-g"),
        "-t".as_ref(),
        table.as_ref(),
        file.as_ref(),
        out.as_ref(),
    ];
    let run = std::process::Command::new(rs274)
        .args(arguments)
        .output()
        .unwrap();
    let canon = std::fs::read_to_string(&out).unwrap();
    assert!(
        run.status.success() && canon.contains("PROGRAM_END"),
        "{canon}{run:?}"
    );
    assert_eq!(
        canon.matches("ARC_FEED(").count(),
        expected(&plan(), 1).len(),
        "{canon}"
    );
}
