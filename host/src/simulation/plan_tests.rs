//! Plans: what is read, what is refused and where, and that a seed is a seed.
use super::machine::{AccDec, PositionLoop};
use super::{Instrument, Machine, Plan, campaign};
use crate::toml_file::TomlFileError;
use giotto_shared::Direction;

const PLAN: &str = r#"[campaign]
name = "lab"
machine = "mill"

[machine]
moving_average_s = 0.04
squareness_um_per_m = 40.0
both = { kv_per_s = 50.0, feed_forward = 0.2 }
x = { backlash_um = 8.0, kv_per_s = 48.0 }

[instrument]
noise_um = 1.0
spread_um = 0.5
resolution_um = 0.1
setup_um = [20.0, -10.0]

[grid]
radii_mm = [100.0, 300.0]
feeds_mm_s = [20.0, 700.0, 300.0]
"#;

fn load(text: &str) -> Result<Plan, TomlFileError> {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("plan.toml");
    std::fs::write(&file, text).unwrap();
    std::fs::write(
        dir.path().join("model.toml"),
        "format = 1\ncampaign = \"c\"\nmachine = \"m\"\n[servo]\nkind = \"lag\"\nkv_per_s = 40.0\n[valid]\nradius_mm = [1.0, 2.0]\nfeed_mm_s = [1.0, 2.0]\n[[effect]]\ncause = \"backlash\"\naxis = \"y\"\nvalue = 0.004\n",
    )
    .unwrap();
    Plan::load(&file).map_err(|mut e| {
        e.at.file = e.at.file.file_name().unwrap().into();
        e
    })
}

fn refuse(from: &str, to: &str) -> String {
    assert!(PLAN.contains(from), "{from}");
    load(&PLAN.replacen(from, to, 1)).unwrap_err().to_string()
}

#[test]
fn reads_a_grid_and_a_machine() {
    let plan = load(PLAN).unwrap();
    assert_eq!(plan.tests.len(), 12);
    assert!(plan.shuffle);
    assert_eq!(plan.machine.acc_dec, AccDec::MovingAverage(0.04));
    assert_eq!(
        plan.machine.servo[0],
        PositionLoop {
            kv_per_s: 48.0,
            feed_forward: 0.2
        }
    );
    assert_eq!(
        plan.machine.servo[1],
        PositionLoop {
            kv_per_s: 50.0,
            feed_forward: 0.2
        }
    );
    assert!((plan.machine.backlash_m[0] - 8e-6).abs() < 1e-18 && plan.machine.backlash_m[1] == 0.0);
    assert!((plan.instrument.setup_m[1] + 10e-6).abs() < 1e-18);
}

#[test]
fn model_and_runs_may_stand_instead() {
    let runs = "model = \"model.toml\"\n[[run]]\nradius_mm = 100.0\nfeed_mm_s = 50.0\ndirection = \"cw\"\nstarted_s = 30.0\n[[run]]\nradius_mm = 150.0\nfeed_mm_s = 60.0\ndirection = \"ccw\"\nstart_angle_deg = 90.0\ncentre_mm = [1.0, 2.0, 3.0]\n";
    let plan = load(runs).unwrap();
    assert_eq!(plan.machine.servo[0].kv_per_s, 40.0);
    assert!((plan.machine.backlash_m[1] - 4e-6).abs() < 1e-15 && plan.machine.backlash_m[0] == 0.0);
    assert_eq!(plan.instrument, Instrument::ballbar());
    let result = campaign(&plan, 4);
    assert_eq!(result.runs[0].started_s, Some(30.0));
    assert_eq!(result.runs[0].direction, Direction::Cw);
    // 1.5 turns of 12.566 s and a pause of 20 s later.
    assert_eq!(result.runs[1].started_s, Some(68.8));
    assert_eq!(result.runs[1].centre_m.map(|c| c[1]), Some(0.002));
}

#[test]
fn refusals_name_the_place() {
    assert_eq!(
        refuse("noise_um = 1.0", "noise_um = -1.0"),
        "plan.toml:12:12: `instrument.noise_um` is -1; expected 0 to 10000"
    );
    assert_eq!(
        refuse("[100.0, 300.0]", "[100.0, nan]"),
        "plan.toml:18:20: `grid.radii_mm` is NaN; expected 0.01 to 100000"
    );
    assert!(
        refuse("[100.0, 300.0]", "[]").starts_with("plan.toml:18:12: `grid.radii_mm` is empty")
    );
    assert!(
        refuse("moving_average_s = 0.04", "moving_average_s = -0.04")
            .starts_with("plan.toml:6:20: `machine.moving_average_s`")
    );
    assert!(
        refuse("moving_average_s", "moving_avarage_s").starts_with("plan.toml:6:1: unknown key")
    );
    assert!(
        refuse("[campaign]", "model = \"model.toml\"\n[campaign]")
            .starts_with("plan.toml:1:9: `model` and")
    );
    assert!(
        refuse("[grid]", "[grid]\norder = \"fastest\"").contains("plan.toml:18:9: unknown variant")
    );
    assert!(
        refuse("[grid]", "[grid]\ndirections = []").contains("`grid.directions` leaves no runs")
    );
    assert!(
        refuse(
            "[grid]",
            "[[run]]\nradius_mm = 1.0\nfeed_mm_s = 1.0\ndirection = \"cw\"\n[grid]"
        )
        .contains("[grid] and [[run]]")
    );
    assert_eq!(
        load("[campaign]\nname = \"x\"\n").unwrap_err().to_string(),
        "plan.toml:1:1: the plan has no runs; expected a [grid] or at least one [[run]]"
    );
    let run = "[[run]]\nradius_mm = 100.0\nfeed_mm_s = 0.0\ndirection = \"cw\"\n";
    assert_eq!(
        load(run).unwrap_err().to_string(),
        "plan.toml:3:13: `run.feed_mm_s` is 0; expected 0.01 to 100000"
    );
    assert!(
        load("model = \"gone.toml\"\n")
            .unwrap_err()
            .to_string()
            .contains("gone.toml: no such file")
    );
}

#[test]
fn seed_fixes_everything() {
    let plan = load(PLAN).unwrap();
    let first = campaign(&plan, 11);
    let one_thread = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    assert_eq!(one_thread.install(|| campaign(&plan, 11)), first);
    let other = campaign(&plan, 12);
    let feeds =
        |c: &crate::campaign::Campaign| c.runs.iter().map(|r| r.feed_m_s).collect::<Vec<_>>();
    assert_ne!(feeds(&other), feeds(&first), "another seed, another order");
    assert!(
        first
            .runs
            .windows(2)
            .all(|r| r[0].started_s < r[1].started_s)
    );
}

/// What is written is what is read, through the campaign's own border.
#[test]
fn written_campaign_reads_back() {
    let mut plan = load(PLAN).unwrap();
    plan.machine = Machine {
        backlash_m: plan.machine.backlash_m,
        ..Machine::default()
    };
    let made = campaign(&plan, 3);
    let dir = tempfile::tempdir().unwrap();
    crate::campaign::write(&made, dir.path()).unwrap();
    let read = crate::campaign::read(dir.path()).unwrap();
    assert_eq!(read.runs.len(), made.runs.len());
    for (a, b) in made.runs.iter().zip(&read.runs) {
        let off = a.samples.deviation_m.iter().zip(&b.samples.deviation_m);
        assert!(off.map(|(x, y)| (x - y).abs()).fold(0.0, f64::max) < 1e-12);
        let off = a.samples.angle_rad.iter().zip(&b.samples.angle_rad);
        assert!(off.map(|(x, y)| (x - y).abs()).fold(0.0, f64::max) < 1e-6);
        assert!((a.turn_s().unwrap() - b.turn_s().unwrap()).abs() < 1e-6);
    }
}
