//! `giotto calibrate`: plan, run, record the machine's own feedback, diagnose, flash, prove, and take the table back if it
//! does not help.
mod linuxcnc;

use super::choice::whole;
use super::demo::{um, word};
use super::grid::{Grid, width};
use super::port::PortArgs;
use super::source::length;
use super::{Failure, Output};
use crate::ring::{Proof, Size, bundled, prove, record};
use giotto::campaign::Campaign;
use giotto::diagnosis::{self, Diagnosis, diagnose};
use giotto::simulation::{CircleTest, Machine, Plan};
use giotto::table_from_model::table_from_model;
use giotto_link::linuxcnc::drive;
use giotto_link::{Controller, Port};
use giotto_shared::Direction;
use giotto_shared::table::Table;
use giotto_shared::wire::Command;
use serde_json::{Value, json};
use std::f64::consts::TAU;
use std::io::{BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};

/// Arguments of `giotto calibrate`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(flatten)]
    port: PortArgs,
    /// The machine behind `sim` or `qemu`: a plan of `giotto simulate`, of which machine and instrument count; without it the
    /// demo's.
    #[arg(long, value_name = "PLAN.toml")]
    machine: Option<PathBuf>,
    /// What measures: the encoders of the slides, or a ballbar at the tool.
    #[arg(long, value_enum, default_value = "encoders")]
    measure: Eyes,
    /// Largest radius; without it 150 mm, less where the controller's soft limits are nearer.
    #[arg(long, value_name = "MM", value_parser = length)]
    max_radius: Option<f64>,
    /// Highest feed; without it the controller's.
    #[arg(long, value_name = "MM_S", value_parser = length)]
    max_feed: Option<f64>,
    /// Highest centripetal acceleration; without it the controller's.
    #[arg(long, value_name = "MM_S2", value_parser = length)]
    max_acceleration: Option<f64>,
    /// Where the campaigns of LinuxCNC are kept, a folder that is not there yet; without it they are forgotten.
    #[arg(long, short, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Seed of every random draw.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u64>)]
    seed: u64,
    /// Move and flash without asking.
    #[arg(long, short)]
    yes: bool,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum Eyes {
    Encoders,
    Ballbar,
}

/// Radius if nothing else is said, mm.
const USUAL_RADIUS_MM: f64 = 150.0;
/// Of the controller's room and feed so much is used: the correction needs some of them.
const SHARE: f64 = 0.8;
/// Of its acceleration so much is asked for across the path. Nearer to what the axes can do a machine turns so fast that its
/// radius error follows no longer from two cumulants: a lag of 20 ms with an average of 40 ms shrank circles of 24 mm by 8 %
/// at 18 rad/s, and nothing could be told from them.
const CENTRIPETAL: f64 = 0.2;
/// Radii and speeds of the plan, shares of the largest each; of every radius its own highest feed counts.
const RADII: [f64; 3] = [1.0, 0.6, 0.4];
const FEEDS: [f64; 4] = [0.1, 0.4, 0.7, 1.0];
/// Those of the circles that prove it: none of them is in the plan.
const PROOF: [[f64; 2]; 3] = [[0.9, 0.85], [0.7, 0.95], [0.5, 0.6]];
/// Turns and ramps of one circle, turns; way to it and rest, s.
const TURNS: f64 = 3.0;
const REST_S: f64 = 1.0;
/// Least share of the size error that has to go, or the table is taken back.
const LEAST_GAIN: f64 = 0.5;
/// What is below this is left as it is, m rms.
const SMALL_M: f64 = 0.5e-6;
/// What encoders do not see.
const UNSEEN: [&str; 3] = [
    "play behind them",
    "squareness of the slides",
    "their own scale",
];

/// Where campaigns are kept.
enum Folder {
    Kept(PathBuf),
    /// Goes when all is done.
    Temporary(tempfile::TempDir),
}

impl Folder {
    fn path(&self) -> &Path {
        match self {
            Self::Kept(path) => path,
            Self::Temporary(folder) => folder.path(),
        }
    }
}

/// What the controller moves.
enum Behind {
    /// A simulated machine, and what measures it.
    Simulated(Box<Plan>),
    /// The machine of a LinuxCNC; campaigns in a folder.
    LinuxCnc(Folder),
}

impl Behind {
    const fn is_simulated(&self) -> bool {
        matches!(self, Self::Simulated(_))
    }

    /// Runs the circles with the correction off.
    fn measure(
        &self,
        controller: &mut Controller,
        circles: &[(f64, f64)],
        seed: u64,
    ) -> Result<Campaign, Failure> {
        controller.command(Command::Bypass { on: true })?;
        match self {
            Self::Simulated(plan) => simulated(controller, plan, circles, seed),
            Self::LinuxCnc(folder) => linuxcnc::measure(circles, &folder.path().join("plan")),
        }
    }

    /// Flashes a table and runs circles without and with it.
    fn prove(
        &self,
        controller: &mut Controller,
        table: &Table,
        circles: &[(f64, f64)],
        seed: u64,
    ) -> Result<Proof, Failure> {
        match self {
            Self::Simulated(plan) => {
                Ok(prove(controller, plan, table, circles, seed, &mut |_| ())?)
            }
            Self::LinuxCnc(folder) => linuxcnc::prove(controller, table, circles, folder.path()),
        }
    }
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let machine = behind(&args)?;
    let mut controller = args.port.open(out)?;
    let limits = Limits::of(&args, &machine, &mut controller)?;
    let circles = limits.circles();
    propose(&limits, &circles, &controller, machine.is_simulated(), out);
    agreed(args.yes, "Move the machine", out)?;

    let bar = out.spinner("measuring");
    let campaign = machine.measure(&mut controller, &circles, args.seed);
    bar.finish_and_clear();
    let campaign = campaign?;
    let bar = out.spinner("diagnosing");
    let found = diagnose(
        &campaign,
        &diagnosis::Options {
            seed: args.seed,
            ..diagnosis::Options::default()
        },
    );
    bar.finish_and_clear();
    let found = found.map_err(|error| Failure::input(format_args!("the runs: {error}")))?;
    show_found(&found, out);
    if !found.worth_writing {
        let words = format!("nothing to flash: {}", found.recommendation.words);
        return Err(Failure::check(words));
    }
    agreed(
        args.yes,
        "Flash it, and run circles that were not measured",
        out,
    )?;
    let table = table_from_model(&found.model)
        .map_err(|error| Failure::input(format_args!("the model has no table: {error}")))?;

    let bar = out.spinner("proving");
    let proof = machine.prove(&mut controller, &table.table, &limits.proof(), args.seed);
    bar.finish_and_clear();
    let proof = proof?;
    let kept = helps(proof.before(), proof.after());
    if !kept {
        controller.command(Command::Rollback)?;
    }
    if out.json {
        let mut document = document(&args, &controller, &circles, &found, &proof, kept);
        document["simulated"] = json!(machine.is_simulated());
        out.document(&document)?;
    } else {
        show_proof(&proof, &args, out);
    }
    if kept {
        return Ok(());
    }
    Err(Failure::check(format_args!(
        "the size error should fall by {:.0} % and the out-of-roundness should not grow: the table was taken back",
        LEAST_GAIN * 100.0
    )))
}

/// The machine that is moved and looked at.
fn behind(args: &Args) -> Result<Behind, Failure> {
    match args.port.kind() {
        Port::Sim | Port::Qemu | Port::QemuBoard(_) => {}
        Port::LinuxCnc => return in_linuxcnc(args),
        Port::Device(name) => {
            return Err(Failure::controller(format_args!(
                "{name} gives no feedback: a controller of giotto sends set-points and hears nothing of the machine"
            ))
            .help("measure with a ballbar: giotto run circle …, then giotto import and giotto diagnose"));
        }
    }
    let mut plan = match &args.machine {
        Some(file) => Plan::load(file)?,
        None => bundled()?,
    };
    if args.measure == Eyes::Encoders {
        plan.machine = seen_by_encoders(&plan.machine);
    }
    Ok(Behind::Simulated(Box::new(plan)))
}

fn in_linuxcnc(args: &Args) -> Result<Behind, Failure> {
    if args.machine.is_some() || args.measure != Eyes::Encoders {
        return Err(Failure::usage(
            "LinuxCNC has a machine of its own, and its encoders measure",
        ));
    }
    if let Some(folder) = &args.output {
        if folder.exists() {
            return Err(Failure::input(format_args!(
                "{}: is there already",
                folder.display()
            )));
        }
        return Ok(Behind::LinuxCnc(Folder::Kept(folder.clone())));
    }
    let folder = tempfile::tempdir()
        .map_err(|error| Failure::input(format_args!("no folder for the runs: {error}")))?;
    Ok(Behind::LinuxCnc(Folder::Temporary(folder)))
}

/// The part of a machine that its own encoders see.
fn seen_by_encoders(machine: &Machine) -> Machine {
    let perfect = Machine::default();
    Machine {
        backlash_m: perfect.backlash_m,
        lateral_play_m: perfect.lateral_play_m,
        scale: perfect.scale,
        squareness_rad: perfect.squareness_rad,
        straightness_per_m: perfect.straightness_per_m,
        cyclic: perfect.cyclic,
        vibration: perfect.vibration,
        thermal_per_s: perfect.thermal_per_s,
        radius_offset_m: perfect.radius_offset_m,
        ..machine.clone()
    }
}

/// How far and how fast the plan may go.
#[derive(Clone, Copy, Debug)]
struct Limits {
    radius_mm: f64,
    feed_mm_s: f64,
    acceleration_mm_s2: f64,
}

/// To a tenth, as a person programs it.
fn tenths(value: f64) -> f64 {
    (value * 10.0).floor() / 10.0
}

impl Limits {
    fn of(args: &Args, machine: &Behind, controller: &mut Controller) -> Result<Self, Failure> {
        let (room_mm, feed_mm_s, acceleration_mm_s2) = if machine.is_simulated() {
            let (config, _) = controller.config()?;
            // Circles lie about the origin of the first two slides.
            let soft = config.soft_nm.iter().take(2).flatten();
            let room_mm = soft.fold(f64::INFINITY, |room, nm| {
                room.min(f64::from(*nm).abs() * 1e-6)
            });
            let [feed, acceleration] = [config.feed_m_s, config.acceleration_m_s2];
            (
                room_mm,
                1e3 * f64::from(feed),
                1e3 * f64::from(acceleration),
            )
        } else {
            let of = drive::limits()?;
            (of.room_mm, of.feed_mm_s, of.acceleration_mm_s2)
        };
        let least = |given: Option<f64>, limit: f64| given.unwrap_or(limit).min(limit);
        let limits = Self {
            radius_mm: args
                .max_radius
                .unwrap_or(USUAL_RADIUS_MM)
                .min(SHARE * room_mm),
            feed_mm_s: least(args.max_feed, SHARE * feed_mm_s),
            acceleration_mm_s2: least(args.max_acceleration, CENTRIPETAL * acceleration_mm_s2),
        };
        if limits.radius_mm < 1.0 {
            return Err(Failure::controller(format_args!(
                "the soft limits leave {room_mm:.1} mm about the origin: no room for a circle"
            )));
        }
        Ok(limits)
    }

    /// Highest feed on a radius, mm/s.
    fn highest(&self, radius_mm: f64) -> f64 {
        self.feed_mm_s
            .min((self.acceleration_mm_s2 * radius_mm).sqrt())
    }

    fn at(&self, [radius, feed]: [f64; 2]) -> (f64, f64) {
        let radius_mm = tenths(radius * self.radius_mm);
        (radius_mm, tenths(feed * self.highest(radius_mm)))
    }

    /// Radius, mm, and feed, mm/s, of the circles to be measured, each both ways.
    fn circles(&self) -> Vec<(f64, f64)> {
        let pairs = RADII.iter().flat_map(|r| FEEDS.map(|f| [*r, f]));
        pairs.map(|pair| self.at(pair)).collect()
    }

    fn proof(&self) -> [(f64, f64); 3] {
        PROOF.map(|pair| self.at(pair))
    }
}

/// How long the circles take, s.
fn duration_s(circles: &[(f64, f64)]) -> f64 {
    let both_ways = |(radius, feed): &(f64, f64)| 2.0 * (TURNS * TAU * radius / feed + REST_S);
    circles.iter().map(both_ways).sum()
}

fn propose(
    limits: &Limits,
    circles: &[(f64, f64)],
    controller: &Controller,
    simulated: bool,
    out: Output,
) {
    let which = if simulated {
        "the machine is SIMULATED"
    } else {
        "the machine will MOVE"
    };
    out.say(format_args!(
        "{}: {which}. {} circles about the origin, R {:.0} to {:.0} mm, up to {:.0} mm/s and {:.0} mm/s², both ways: {:.0} s of motion.",
        controller.port(),
        2 * circles.len(),
        RADII[2] * limits.radius_mm,
        limits.radius_mm,
        limits.feed_mm_s,
        limits.acceleration_mm_s2,
        duration_s(circles)
    ));
}

/// Asks at a terminal; elsewhere `--yes` has to have been said.
fn agreed(yes: bool, question: &str, out: Output) -> Result<(), Failure> {
    if yes {
        return Ok(());
    }
    if out.json || out.non_interactive || !std::io::stdin().is_terminal() {
        return Err(Failure::usage(format_args!("{question}: nobody to ask"))
            .help("--yes agrees beforehand"));
    }
    let mut stderr = std::io::stderr();
    // A terminal that takes no words takes no answer either.
    let _ = write!(stderr, "{question} (y/N)? ");
    let _ = stderr.flush();
    let mut line = String::new();
    let read = std::io::stdin().lock().read_line(&mut line).unwrap_or(0);
    if read > 0 && matches!(line.trim(), "y" | "Y" | "yes") {
        return Ok(());
    }
    Err(Failure::interrupted("not agreed: nothing was done"))
}

/// Circles on a simulated machine.
fn simulated(
    controller: &mut Controller,
    machine: &Plan,
    circles: &[(f64, f64)],
    seed: u64,
) -> Result<Campaign, Failure> {
    let mut runs = Vec::new();
    for (radius_mm, feed_mm_s) in circles {
        for direction in [Direction::Ccw, Direction::Cw] {
            let test = CircleTest::new(radius_mm * 1e-3, feed_mm_s * 1e-3, direction);
            let stream = 1 + runs.len() as u64;
            let mut run = record(controller, machine, &test, seed, stream)?;
            run.file = format!("run{:03}.csv", runs.len());
            runs.push(run);
        }
    }
    Ok(Campaign {
        name: "calibrate".to_owned(),
        machine: machine.machine_name.clone(),
        repeatability_m: None,
        table: None,
        kinematics: None,
        runs,
    })
}

fn show_found(found: &Diagnosis, out: Output) {
    for finding in &found.findings {
        out.tell(0, &finding.remedy);
    }
    out.tell(0, format_args!("{}.", found.recommendation.words));
    out.say(format_args!(
        "expected: off by {:.2} µm rms on circles left out, {:.2} by the simulation before",
        found.extended.heldout_rms_um, found.baseline.heldout_rms_um
    ));
}

/// Whether a table has earned its place.
fn helps(before: Size, after: Size) -> bool {
    let left = after.radius_error_rms_m;
    let smaller = left <= (1.0 - LEAST_GAIN) * before.radius_error_rms_m || left <= SMALL_M;
    smaller && after.out_of_roundness_m <= before.out_of_roundness_m + SMALL_M
}

fn show_proof(proof: &Proof, args: &Args, out: Output) {
    let header = [
        "R mm",
        "mm/s",
        "way",
        "ΔR before",
        "after",
        "roundness before",
        "after (µm)",
    ];
    let mut circles = Grid::new(&header, 0, 3);
    for pair in &proof.circles {
        let (before, after) = (&pair.before.analysis, &pair.after.analysis);
        circles.row([
            format!("{:.1}", before.radius_m * 1e3),
            format!("{:.1}", before.feed_m_s * 1e3),
            word(before.direction).to_owned(),
            format!("{:.2}", before.radius_error_m * 1e6),
            format!("{:+.2}", after.radius_error_m * 1e6),
            format!("{:.1}", before.out_of_roundness_m * 1e6),
            format!("{:.1}", after.out_of_roundness_m * 1e6),
        ]);
    }
    out.say(circles.text(width()));
    let (before, after) = (proof.before(), proof.after());
    out.say(format_args!(
        "radius size error {:.2} → {:.2} µm rms ({:.2} % less); flashed in slot {} as generation {}",
        before.radius_error_rms_m * 1e6,
        after.radius_error_rms_m * 1e6,
        proof.reduction_percent(),
        proof.flashed.slot,
        proof.flashed.generation
    ));
    if args.measure == Eyes::Encoders {
        out.tell(0, format_args!(
            "Encoders do not see {}. For these measure with a ballbar, the table at work: giotto import FILE … -o CAMPAIGN, then giotto diagnose CAMPAIGN.",
            UNSEEN.join(", ")
        ));
    }
}

fn document(
    args: &Args,
    controller: &Controller,
    circles: &[(f64, f64)],
    found: &Diagnosis,
    proof: &Proof,
    kept: bool,
) -> Value {
    let eyes = args.measure == Eyes::Encoders;
    let pair = |(radius, feed): &(f64, f64)| json!({ "radius_mm": radius, "feed_mm_s": feed });
    let proved: Vec<Value> = proof
        .circles
        .iter()
        .map(|pair| {
            let (before, after) = (&pair.before.analysis, &pair.after.analysis);
            json!({
                "radius_mm": (before.radius_m * 1e9).round() / 1e6,
                "feed_mm_s": (before.feed_m_s * 1e9).round() / 1e6,
                "direction": word(before.direction),
                "before_um": before.radius_error_m * 1e6,
                "after_um": after.radius_error_m * 1e6,
            })
        })
        .collect();
    json!({
        "port": controller.port(),
        "measured_by": if eyes { "encoders" } else { "ballbar" },
        "plan": circles.iter().map(pair).collect::<Vec<_>>(),
        "motion_s": duration_s(circles),
        "findings": found.findings,
        "expected": { "heldout_rms_um": found.extended.heldout_rms_um, "without_um": found.baseline.heldout_rms_um },
        "flashed": { "slot": proof.flashed.slot, "generation": proof.flashed.generation },
        "before": um(proof.before()),
        "after": um(proof.after()),
        "reduction_percent": proof.reduction_percent(),
        "circles": proved,
        "kept": kept,
        "not_seen": if eyes { UNSEEN.to_vec() } else { Vec::new() },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_without_gain_goes_back() {
        let um = |radius: f64, round: f64| Size {
            radius_error_rms_m: radius * 1e-6,
            out_of_roundness_m: round * 1e-6,
        };
        assert!(helps(um(90.0, 40.0), um(0.3, 7.0)));
        assert!(helps(um(0.6, 7.0), um(0.4, 7.2)));
        assert!(!helps(um(90.0, 40.0), um(60.0, 7.0)));
        assert!(!helps(um(90.0, 7.0), um(0.3, 9.0)));
        assert!(!helps(um(90.0, 7.0), um(f64::NAN, 7.0)));
    }

    #[test]
    fn a_plan_keeps_its_limits_and_the_proof_is_none_of_it() {
        let limits = Limits {
            radius_mm: 150.0,
            feed_mm_s: 800.0,
            acceleration_mm_s2: 4000.0,
        };
        let circles = limits.circles();
        assert_eq!(circles.len(), 12);
        for (radius, feed) in circles.iter().chain(&limits.proof()) {
            assert!(*radius <= 150.0 && *feed <= 800.0 && feed * feed / radius <= 4000.0);
        }
        for (radius, feed) in limits.proof() {
            assert!(circles.iter().all(|(r, f)| *r != radius && *f != feed));
        }
        let [slow, ..] = circles[..] else { panic!() };
        assert!((duration_s(&[slow]) - 2.0 * (3.0 * TAU * slow.0 / slow.1 + 1.0)).abs() < 1e-9);
    }
}
