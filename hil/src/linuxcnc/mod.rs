//! The loop closed in LinuxCNC, a controller by others: measured, explained, flashed into the running component, measured
//! again on circles and a part that were never measured.
//!
//! LinuxCNC's threads run by a clock that a busy computer makes late. Nothing that is judged depends on it: samples are taken
//! by the tick, the machine is made of components of the same thread, and programs wait for each other.
//!
//! | file | holds |
//! |---|---|
//! | `commands` | the program `giotto` against the running component |
//! | `machine` | the machine of LinuxCNC's own components, its INI and HAL |
//! | `session`, `driver.py` | LinuxCNC started as an ordinary user, and told what to do |
//! | `samples` | what halsampler writes |
//! | `programs` | circles, and a part |
mod commands;
mod machine;
mod programs;
mod samples;
mod session;

use commands::Commands;
use giotto::analysis::of_campaign;
use giotto::campaign::import::{Format, Options, add};
use giotto::campaign::{Direction, Plane, read};
use giotto::diagnosis::{self, diagnose};
use giotto::model_file::ModelFile;
use giotto::planning::{self, Limits, propose};
pub use machine::Play;
pub use programs::Circle;
use serde_json::{Value, json};
pub use session::LinuxCncError;
use session::Session;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Of the radius error, the out-of-roundness and the contour error so many percent have to go.
pub const BARS_PERCENT: [f64; 3] = [98.0, 70.0, 90.0];
/// The same of the short scenario: from a dozen circles in one plane the fourth cumulant is not told from a lag's, and play not
/// from friction; both show in corners.
pub const SHORT_BARS_PERCENT: [f64; 3] = [98.0, 70.0, 70.0];
/// What the function may take, µs: the median.
pub const UPDATE_BAR_US: f64 = 20.0;

/// By so much may the contour error differ between a correction switched off and none.
const BYPASSED: f64 = 0.01;

/// What one way of correcting, or none, leaves.
#[derive(Clone, Debug, Default)]
pub struct Left {
    /// By circle, µm: radius error and out-of-roundness.
    pub circles_um: Vec<[f64; 2]>,
    /// Largest contour error of the part, µm.
    pub contour_um: f64,
}

impl Left {
    fn radius_um(&self) -> f64 {
        let square: f64 = self
            .circles_um
            .iter()
            .map(|[radius, _]| radius * radius)
            .sum();
        (square / self.circles_um.len().max(1) as f64).sqrt()
    }

    fn roundness_um(&self) -> f64 {
        let sum: f64 = self.circles_um.iter().map(|[_, round]| round).sum();
        sum / self.circles_um.len().max(1) as f64
    }

    /// Radius error (root mean square), out-of-roundness (mean), contour error, µm.
    pub fn figures_um(&self) -> [f64; 3] {
        [self.radius_um(), self.roundness_um(), self.contour_um]
    }

    /// How much less than before, percent.
    pub fn gains_percent(&self, before: &Self) -> [f64; 3] {
        let (now, was) = (self.figures_um(), before.figures_um());
        [0, 1, 2].map(|k| 100.0 * (1.0 - now[k] / was[k]))
    }
}

/// The whole scenario's result.
#[derive(Clone, Debug)]
pub struct Report {
    /// Circles never measured before.
    pub circles: Vec<Circle>,
    /// Without correction; by the component; by `compensate`.
    pub before: Left,
    /// See `before`.
    pub component: Left,
    /// See `before`; not in the short scenario.
    pub compensated: Option<Left>,
    /// What was found.
    pub findings: Vec<String>,
    /// Runs that were diagnosed.
    pub runs: usize,
    /// Ticks of the proof before the first enable, and of the part after the last, in which the output was not the input to the bit.
    pub touched: [usize; 2],
    /// The part's contour error while the correction was switched off by `bypass on`, µm.
    pub bypassed_um: f64,
    /// Largest acceleration of the set-points that a drive got on the part: without correction, and with it, mm/s².
    pub hardest_mm_s2: [f64; 2],
    /// Commands of `giotto` that did what they say.
    pub commands: Vec<String>,
    /// Time of the function: the median of looks, and the longest, µs.
    pub update_us: [f64; 2],
}

impl Report {
    fn bars_percent(&self) -> [f64; 3] {
        match self.compensated {
            Some(_) => BARS_PERCENT,
            None => SHORT_BARS_PERCENT,
        }
    }

    /// Whether all bars are met.
    pub fn meets_bars(&self) -> bool {
        let gains = self.component.gains_percent(&self.before);
        gains
            .iter()
            .zip(self.bars_percent())
            .all(|(gain, bar)| *gain >= bar)
            && self.update_us[0] <= UPDATE_BAR_US
            && self.touched == [0; 2]
            && self.hardest_mm_s2[1] <= machine::DRIVE
            && (self.bypassed_um / self.before.contour_um - 1.0).abs() < BYPASSED
    }

    /// One JSON document.
    pub fn document(&self) -> Value {
        let left = |left: &Left| {
            let [radius, round, contour] = left.figures_um();
            let gains = left.gains_percent(&self.before);
            json!({
                "radius_error_rms_um": radius, "out_of_roundness_um": round, "contour_um": contour,
                "gain_percent": gains, "circles_um": left.circles_um,
            })
        };
        json!({
            "before": left(&self.before), "component": left(&self.component), "compensate": self.compensated.as_ref().map(left),
            "findings": self.findings, "runs": self.runs, "touched_ticks": self.touched,
            "bypassed_contour_um": self.bypassed_um, "commands": self.commands, "update_us": self.update_us,
            "hardest_mm_s2": self.hardest_mm_s2, "drive_mm_s2": machine::DRIVE, "bars_percent": self.bars_percent(),
            "met": self.meets_bars(),
        })
    }
}

const fn circle(radius_mm: f64, feed_mm_s: f64, ccw: bool, plane: Plane) -> Circle {
    let direction = if ccw { Direction::Ccw } else { Direction::Cw };
    Circle {
        radius_mm,
        feed_mm_s,
        direction,
        plane,
    }
}

/// With what the first look is taken, each both ways: slow circles, which show play and scale sharply, and fast ones in all planes.
const FIRST: [(f64, f64, Plane); 12] = [
    (60.0, 20.0, Plane::Xy),
    (30.0, 50.0, Plane::Xy),
    (100.0, 200.0, Plane::Xy),
    (60.0, 400.0, Plane::Xy),
    (30.0, 20.0, Plane::Yz),
    (60.0, 50.0, Plane::Yz),
    (20.0, 300.0, Plane::Yz),
    (30.0, 100.0, Plane::Yz),
    (100.0, 20.0, Plane::Zx),
    (30.0, 50.0, Plane::Zx),
    (60.0, 100.0, Plane::Zx),
    (30.0, 300.0, Plane::Zx),
];

/// The same of the short scenario, in one plane.
const FIRST_SHORT: [(f64, f64, Plane); 6] = [
    (20.0, 20.0, Plane::Xy),
    (30.0, 50.0, Plane::Xy),
    (30.0, 120.0, Plane::Xy),
    (60.0, 200.0, Plane::Xy),
    (10.0, 150.0, Plane::Xy),
    (60.0, 370.0, Plane::Xy),
];

/// A circle as fast as a planner with this acceleration, mm/s², runs it: LinuxCNC gives 0.87 of it to a curve.
fn within(circle: Circle, acceleration: f64) -> Circle {
    let fastest = (0.85 * acceleration * circle.radius_mm).sqrt();
    Circle {
        feed_mm_s: circle.feed_mm_s.min(fastest.floor()),
        ..circle
    }
}

fn first(short: bool, acceleration: f64) -> Vec<Circle> {
    let list: &[_] = if short { &FIRST_SHORT } else { &FIRST };
    list.iter()
        .copied()
        .flat_map(|(radius_mm, feed_mm_s, plane)| {
            [true, false].map(|ccw| circle(radius_mm, feed_mm_s, ccw, plane))
        })
        .map(|circle| within(circle, acceleration))
        .collect()
}

/// With what it is proven.
const PROOF: [Circle; 7] = [
    circle(20.0, 20.0, true, Plane::Xy),
    circle(20.0, 100.0, true, Plane::Xy),
    circle(20.0, 280.0, false, Plane::Yz),
    circle(50.0, 200.0, true, Plane::Zx),
    circle(80.0, 300.0, false, Plane::Xy),
    circle(150.0, 400.0, true, Plane::Yz),
    circle(200.0, 400.0, false, Plane::Zx),
];

const PROOF_SHORT: [Circle; 3] = [
    circle(20.0, 100.0, true, Plane::Xy),
    circle(50.0, 300.0, false, Plane::Xy),
    circle(80.0, 350.0, true, Plane::Xy),
];

fn proof(short: bool, acceleration: f64) -> Vec<Circle> {
    let list: &[Circle] = if short { &PROOF_SHORT } else { &PROOF };
    let reachable = list.iter().map(|circle| within(*circle, acceleration));
    reachable.collect()
}

fn failed(what: impl std::fmt::Display) -> LinuxCncError {
    LinuxCncError::failed(what)
}

/// Columns of the samples.
fn import(
    file: PathBuf,
    folder: &Path,
    radius_mm: f64,
    feed_mm_s: f64,
    direction: Direction,
) -> Result<(), LinuxCncError> {
    let options = Options {
        format: Format::Columns,
        columns: Some("time_ms,-,-,-,x_mm,y_mm,z_mm".to_owned()),
        setup: Some("A".to_owned()),
        machine: Some("LinuxCNC scenario".to_owned()),
        ..Options::of_circle(radius_mm * 1e-3, feed_mm_s * 1e-3, direction)
    };
    add(&[file], folder, &options, &|_, _| ())
        .map(drop)
        .map_err(failed)
}

/// Runs circles and adds them to a campaign; in how many ticks the component changed anything.
fn measure(
    session: &mut Session,
    name: &str,
    program: &[u8],
    circles: &[(f64, f64, Direction)],
    campaign: &Path,
) -> Result<usize, LinuxCncError> {
    let recording = samples::run(session, name, program, 800)?;
    let recorded = recording.runs();
    // A plan begins with a warm-up.
    let warm_up = usize::from(name == "plan");
    let runs = recorded.get(warm_up..).unwrap_or_default();
    if runs.len() != circles.len() {
        let lengths: Vec<usize> = recorded.iter().map(|rows| rows.len()).collect();
        return Err(failed(format!(
            "{name}: {} runs recorded, {} expected; rows: {lengths:?}",
            runs.len(),
            circles.len()
        )));
    }
    for (k, (rows, (radius_mm, feed_mm_s, direction))) in runs.iter().zip(circles).enumerate() {
        let file = samples::write(rows, &session.folder, &format!("{name}{k:02}.txt"))?;
        import(file, campaign, *radius_mm, *feed_mm_s, *direction).map_err(|error| {
            failed(format!(
                "{name}, R {radius_mm} mm, {feed_mm_s} mm/s: {error}"
            ))
        })?;
    }
    Ok(recording.touched())
}

/// The circles and the part, run once.
struct Proof {
    left: Left,
    /// Ticks in which the component changed anything.
    touched: usize,
    /// On the part, mm/s².
    hardest: f64,
}

/// Runs the proof; `programs`: circles and part, as they are or compensated.
fn prove(
    session: &mut Session,
    name: &str,
    proof: &[Circle],
    programs: [&[u8]; 2],
) -> Result<Proof, LinuxCncError> {
    let [circles, part] = programs;
    let folder = session.place(format!("{name}-campaign"));
    let touched = measure(session, name, circles, &listed(proof), &folder)?;
    let campaign = read(&folder).map_err(failed)?;
    let report = of_campaign(&campaign)
        .map_err(|(run, error)| failed(format!("{name}, run {run}: {error}")))?;
    let circles_um = report
        .runs
        .iter()
        .map(|run| [run.radius_error_m * 1e6, run.out_of_roundness_m * 1e6])
        .collect();
    let recording = samples::run(session, &format!("{name}-part"), part, 60)?;
    Ok(Proof {
        left: Left {
            circles_um,
            contour_um: samples::contour(&recording.rows) * 1e3,
        },
        touched: touched + recording.touched(),
        hardest: samples::hardest(&recording.rows),
    })
}

/// What the component's function takes, µs: median of some looks, and the longest.
fn update_us(session: &mut Session) -> Result<[f64; 2], LinuxCncError> {
    let mut looks = Vec::new();
    for _ in 0..31 {
        looks.push(
            session
                .get("giotto.update.time")?
                .parse::<f64>()
                .map_err(failed)?,
        );
    }
    looks.sort_by(f64::total_cmp);
    let longest = session
        .get("giotto.update.tmax")?
        .parse::<f64>()
        .map_err(failed)?;
    // LinuxCNC counts in its processor's cycles, or in ns where it has no counter.
    Ok([looks[looks.len() / 2], longest].map(|time| time / cycles_per_us()))
}

/// Cycles that LinuxCNC counts in a microsecond.
fn cycles_per_us() -> f64 {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let mhz = text.lines().find_map(|line| {
        let (name, value) = line.split_once(':')?;
        (name.trim() == "cpu MHz").then(|| value.trim().parse().ok())?
    });
    mhz.unwrap_or(1000.0)
}

fn model_of(
    campaign: &Path,
    note: &mut dyn FnMut(&str),
) -> Result<(ModelFile, Vec<String>, usize), LinuxCncError> {
    let campaign = read(campaign).map_err(failed)?;
    let diagnosis = diagnose(&campaign, &diagnosis::Options::default()).map_err(failed)?;
    let findings = diagnosis
        .findings
        .iter()
        .map(|finding| {
            let estimate = serde_json::to_value(finding).unwrap_or_default();
            format!(
                "{} {} {}",
                estimate["cause"], estimate["axis"], estimate["estimate"]["value"]
            )
        })
        .collect::<Vec<_>>();
    note(&format!("found: {}", findings.join("; ")));
    Ok((diagnosis.model, findings, campaign.runs.len()))
}

/// What the scenario is run with.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The component.
    pub component: PathBuf,
    /// The program `giotto`.
    pub giotto: PathBuf,
    /// Where the play lies.
    pub play: Play,
    /// What LinuxCNC may ask of an axis, mm/s².
    pub acceleration: f64,
    /// Fewer circles, one plane, no rewritten programs: some minutes.
    pub short: bool,
    /// Programs, samples and campaigns stay here.
    pub keep: Option<PathBuf>,
}

/// What LinuxCNC may ask of an axis unless something else is said, mm/s².
pub const ACCELERATION: f64 = machine::ACCELERATION;

/// Runs the scenario.
///
/// # Errors
/// [`LinuxCncError::Skipped`] where there is no LinuxCNC.
pub fn run(setup: &Setup, note: &mut dyn FnMut(&str)) -> Result<Report, LinuxCncError> {
    if let Some(folder) = &setup.keep
        && folder.join("campaign").exists()
    {
        let folder = folder.display();
        return Err(failed(format!(
            "{folder} holds an earlier run: its circles would count as well"
        )));
    }
    let mut commands = Commands::new(&setup.giotto)?;
    let mut session = Session::start(
        &setup.component,
        setup.play,
        setup.acceleration,
        setup.keep.as_deref(),
    )?;
    session.order(&json!({ "do": "up" }))?;
    note("LinuxCNC runs; first circles");
    let campaign = session.place("campaign");
    let circles = first(setup.short, setup.acceleration);
    measure(
        &mut session,
        "first",
        programs::circles(&circles).as_bytes(),
        &listed(&circles),
        &campaign,
    )?;
    if !setup.short {
        planned(&mut session, &campaign, note)?;
    }
    let (model, findings, runs) = model_of(&campaign, note)?;

    let proof = proof(setup.short, setup.acceleration);
    let (circles, part) = (programs::circles(&proof), programs::PART);
    let plain = [circles.as_bytes(), part.as_bytes()];
    note("the proof without correction");
    let before = prove(&mut session, "before", &proof, plain)?;
    let compensated = if setup.short {
        None
    } else {
        note("the same programs, compensated");
        let rewritten = compensated(&model, setup.acceleration, plain, note);
        let [circles, part] = &rewritten;
        Some(prove(&mut session, "compensated", &proof, [circles, part])?)
    };

    note("flashed into the running component; the proof with it");
    let file = session.place("model.toml");
    model.save(&file).map_err(failed)?;
    commands.flash(&file)?;
    session.set("giotto.enable", "1")?;
    let component = prove(&mut session, "component", &proof, plain)?;
    let update_us = update_us(&mut session)?;
    note("the other commands");
    commands.there_and_back(&campaign)?;
    commands.bypass(true)?;
    let bypassed = samples::run(&mut session, "bypassed", part.as_bytes(), 60)?;
    commands.bypass(false)?;
    commands.stop(&mut session)?;
    session.set("giotto.enable", "0")?;
    // The offset goes in half a second.
    std::thread::sleep(Duration::from_secs(1));
    let after = samples::run(&mut session, "after", part.as_bytes(), 60)?;
    Ok(Report {
        circles: proof,
        touched: [before.touched, after.touched()],
        before: before.left,
        component: component.left,
        compensated: compensated.map(|proof| proof.left),
        hardest_mm_s2: [before.hardest, component.hardest],
        findings,
        runs,
        bypassed_um: samples::contour(&bypassed.rows) * 1e3,
        commands: commands.done,
        update_us,
    })
}

fn listed(circles: &[Circle]) -> Vec<(f64, f64, Direction)> {
    circles
        .iter()
        .map(|c| (c.radius_mm, c.feed_mm_s, c.direction))
        .collect()
}

/// Programs rewritten for a model.
fn compensated(
    model: &ModelFile,
    acceleration: f64,
    plain: [&[u8]; 2],
    note: &mut dyn FnMut(&str),
) -> [Vec<u8>; 2] {
    let options = giotto_nc::Options {
        acceleration_mm_s2: 0.8 * acceleration,
        max_offset_mm: 5.0,
        all_planes: true,
        ..giotto_nc::Options::default()
    };
    plain.map(|program| {
        let done = giotto_nc::compensate(program, model, &options);
        let corrected =
            |arc: &&giotto_nc::Report| matches!(arc.fate, giotto_nc::Fate::Corrected { .. });
        let rewritten = done.arcs.iter().filter(corrected).count();
        note(&format!(
            "{rewritten} of {} arcs rewritten",
            done.arcs.len()
        ));
        done.program
    })
}

/// Runs the program of `giotto plan`.
fn planned(
    session: &mut Session,
    folder: &Path,
    note: &mut dyn FnMut(&str),
) -> Result<(), LinuxCncError> {
    let campaign = read(folder).map_err(failed)?;
    let diagnosis = diagnose(&campaign, &diagnosis::Options::default()).map_err(failed)?;
    let options = planning::Options {
        limits: Limits {
            radii_m: vec![0.03, 0.06],
            largest_radius_m: Some(0.06),
            highest_feed_m_s: Some(0.4),
            highest_acceleration_m_s2: Some(2.4),
        },
        most_runs: 1,
        seed: 1,
    };
    let mut plan = propose(&campaign, &diagnosis, &options);
    // There is nothing to warm up in this machine.
    plan.warm_up_turns = 1;
    note(&format!("{} planned runs", plan.runs.len()));
    if plan.runs.is_empty() {
        return Ok(());
    }
    let list: Vec<(f64, f64, Direction)> = plan
        .runs
        .iter()
        .map(|step| (step.radius_mm, step.feed_mm_s, step.direction))
        .collect();
    let program = plan.gcode(&campaign.name);
    measure(session, "plan", program.as_bytes(), &list, folder).map(drop)
}
