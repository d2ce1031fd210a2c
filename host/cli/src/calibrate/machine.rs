//! What a controller moves, and what measures it: a simulated machine, or the machine of a LinuxCNC.
use super::{Args, Eyes, linuxcnc};
use crate::Failure;
use crate::ring::{Proof, bundled, prove, record};
use giotto::campaign::Campaign;
use giotto::simulation::{CircleTest, Machine, Plan};
use giotto_link::{Controller, Port};
use giotto_shared::Direction;
use giotto_shared::table::Table;
use giotto_shared::wire::Command;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// Where campaigns are kept.
pub(super) enum Folder {
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
pub(super) enum Behind {
    /// A simulated machine, and what measures it.
    Simulated(Box<Plan>),
    /// The machine of a LinuxCNC; campaigns in a folder.
    LinuxCnc(Folder),
}

impl Behind {
    pub(super) const fn is_simulated(&self) -> bool {
        matches!(self, Self::Simulated(_))
    }

    /// Runs the circles with the correction off.
    pub(super) fn measure(
        &self,
        controller: &mut Controller,
        circles: &[(f64, f64)],
        seed: u64,
        wish: &AtomicBool,
    ) -> Result<Campaign, Failure> {
        controller.command(Command::Bypass { on: true })?;
        match self {
            Self::Simulated(plan) => simulated(controller, plan, circles, seed),
            Self::LinuxCnc(folder) => linuxcnc::measure(circles, &folder.path().join("plan"), wish),
        }
    }

    /// Flashes a table and runs circles without and with it.
    pub(super) fn prove(
        &self,
        controller: &mut Controller,
        table: &Table,
        circles: &[(f64, f64)],
        seed: u64,
        wish: &AtomicBool,
    ) -> Result<Proof, Failure> {
        match self {
            Self::Simulated(plan) => {
                Ok(prove(controller, plan, table, circles, seed, &mut |_| ())?)
            }
            Self::LinuxCnc(folder) => {
                linuxcnc::prove(controller, table, circles, folder.path(), wish)
            }
        }
    }
}

/// The machine that is moved and looked at.
pub(super) fn behind(args: &Args) -> Result<Behind, Failure> {
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
    if args.output.is_some() {
        return Err(Failure::usage(
            "--output keeps the campaigns of a LinuxCNC; a simulated machine is measured again by --seed",
        ));
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
