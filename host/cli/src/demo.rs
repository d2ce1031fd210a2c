//! `giotto demo`: the whole loop on a bundled campaign and a simulated machine.
use super::choice::whole;
use super::destination::{Destination, Kind as FileKind};
use super::failure::Failure;
use super::grid::{Grid, width};
use super::output::Output;
use super::proof_shown;
use crate::ring::{
    CIRCLES, DemoError, LEFT_M, Learned, Proof, REDUCTION_PERCENT, bundled, learn, picture, prove,
};
use giotto_link::{Controller, OpenOptions, Port, open};
use indicatif::ProgressBar;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Arguments of `giotto demo`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Controller that runs the circles: the firmware's library in this process, or its image in QEMU.
    #[arg(long, value_enum, default_value = "sim")]
    controller: Kind,
    /// Firmware image for `qemu`, instead of the one of this workspace.
    #[arg(long, value_name = "PATH")]
    image: Option<PathBuf>,
    /// Seed of every random draw: noise, set-up, spread, order of the runs.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u64>)]
    seed: u64,
    /// Write a picture of a circle before and after here.
    #[arg(long, value_name = "FILE.svg")]
    svg: Option<PathBuf>,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Sim,
    Qemu,
}

impl Kind {
    const fn name(self) -> &'static str {
        match self {
            Self::Sim => "sim",
            Self::Qemu => "qemu",
        }
    }

    fn open(self, image: Option<PathBuf>, out: Output) -> Result<Controller, Failure> {
        let port = match self {
            Self::Sim => Port::Sim,
            Self::Qemu => Port::Qemu,
        };
        Ok(open(
            &port,
            &OpenOptions {
                image,
                ..OpenOptions::default()
            },
            &mut |note| out.note(note),
        )?)
    }
}

impl From<DemoError> for Failure {
    fn from(error: DemoError) -> Self {
        match error {
            DemoError::Controller(error) => error.into(),
            other => Self::check(format_args!("the ring does not close: {other}")),
        }
    }
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    let started = Instant::now();
    let drawing = Destination::maybe(args.svg.as_deref(), FileKind::Svg, &[])?;
    let plan = bundled()?;
    out.say(format_args!(
        "The machine is SIMULATED: a {} and a ballbar with {:.1} µm noise. Controller: {}. Seed {}.",
        plan.machine_name,
        plan.instrument.noise_m * 1e6,
        match args.controller {
            Kind::Sim => "the firmware's library in this process",
            Kind::Qemu => "the firmware's image in QEMU",
        },
        args.seed
    ));
    // A controller that is not there should not be found out last.
    let mut controller = args.controller.open(args.image, out)?;
    let learned = learn(&plan, args.seed)?;
    show_learned(&learned, out);
    let bar = if out.draws() {
        ProgressBar::new_spinner()
    } else {
        ProgressBar::hidden()
    };
    bar.enable_steady_tick(Duration::from_millis(100));
    let proof = prove(
        &mut controller,
        &plan,
        &learned.table.table,
        &CIRCLES,
        args.seed,
        &mut |step| bar.set_message(step.to_owned()),
    );
    bar.finish_and_clear();
    let proof = proof?;
    if let Some(drawing) = &drawing {
        drawing.write(picture(&proof))?;
        let path = drawing.path().display();
        out.note(format_args!("picture written to {path}"));
    }
    if out.json {
        out.document(&document(
            args.controller,
            &plan.machine_name,
            args.seed,
            &proof,
        ))?;
    } else {
        show_proof(&proof, out);
        out.say(format_args!("{:.1} s", started.elapsed().as_secs_f64()));
    }
    if proof.holds() {
        return Ok(());
    }
    Err(Failure::check(format_args!(
        "the size error should fall by {REDUCTION_PERCENT} % or to {:.1} µm, and the out-of-roundness should fall",
        LEFT_M * 1e6
    )))
}

/// The contract's document; what the machine is, the seed and the form of each circle beside it.
fn document(kind: Kind, machine: &str, seed: u64, proof: &Proof) -> Value {
    json!({
        "controller": kind.name(),
        "simulated": true,
        "machine": machine,
        "seed": seed,
        "before": proof_shown::um(proof.before()),
        "after": proof_shown::um(proof.after()),
        "reduction_percent": proof.reduction_percent(),
        "circles": proof_shown::circles(proof),
    })
}

fn show_learned(learned: &Learned, out: Output) {
    let runs = &learned.report.runs;
    let rms = |of: fn(&giotto::analysis::RunAnalysis) -> f64| {
        (runs.iter().map(|r| of(r).powi(2)).sum::<f64>() / runs.len().max(1) as f64).sqrt() * 1e6
    };
    let range = |of: fn(&giotto::analysis::RunAnalysis) -> f64| {
        let values = runs.iter().map(|r| of(r) * 1e3);
        (
            values.clone().fold(f64::INFINITY, f64::min),
            values.fold(0.0, f64::max),
        )
    };
    let ((r0, r1), (f0, f1)) = (range(|r| r.radius_m), range(|r| r.feed_m_s));
    out.say(format_args!(
        "\n1 analyse   {} circles, R {r0:.0} to {r1:.0} mm, {f0:.0} to {f1:.0} mm/s, both ways: size error {:.1} µm rms, out-of-roundness {:.1} µm",
        runs.len(),
        rms(|r| r.radius_error_m),
        rms(|r| r.out_of_roundness_m)
    ));
    let fit = &learned.fit;
    let half = fit.ci95.map(|[low, high]| 0.5e6 * (high - low));
    out.say(format_args!(
        "2 fit       ΔR = β1 f²/R + β2 f⁴/R³: β1 = {:.3} ± {:.3} ·10⁻⁶ s², β2 = {:.4} ± {:.4} ·10⁻⁶ s⁴",
        fit.model.beta1_s2 * 1e6,
        half[0],
        fit.model.beta2_s4 * 1e6,
        half[1]
    ));
    if let Some(heldout) = &fit.heldout {
        out.say(format_args!(
            "            predicts each radius from the others: {:.2} µm rms, {:.2} % explained",
            heldout.rms_m * 1e6,
            heldout.explained_percent
        ));
    }
    show_diagnosis(&learned.diagnosis, out);
    let zone = learned.table.table.zones.first();
    out.say(format_args!(
        "            table: κ2, κ4 and {} terms{}",
        zone.map_or(0, |zone| zone.terms.len()),
        match learned.table.left_out.len() {
            0 => String::new(),
            n => format!("; {n} effects that no controller corrects are left out"),
        }
    ));
}

/// What is wrong beside the law, and what the extended simulation gains.
fn show_diagnosis(diagnosis: &giotto::diagnosis::Diagnosis, out: Output) {
    out.say(format_args!(
        "3 diagnose  against {}:",
        diagnosis.baseline.name
    ));
    let header = [
        "cause",
        "of",
        "size",
        "95 % from",
        "to",
        "unit",
        "share %",
        "correctable",
    ];
    let mut found = Grid::new(&header, 2, 2);
    for f in &diagnosis.findings {
        let shown = giotto::units::shown(f.estimate.value, f.estimate.ci95, f.estimate.unit);
        found.row([
            f.cause.model().words().name.to_owned(),
            f.place(),
            shown.value,
            shown.low,
            shown.high,
            shown.unit,
            format!("{:.1}", f.share_percent),
            if f.compensable { "yes" } else { "no" }.to_owned(),
        ]);
    }
    out.say(indented(&found));
    if diagnosis.unexplained.present {
        out.say(format_args!(
            "            unexplained: {:.2} µm rms",
            diagnosis.unexplained.rms_um
        ));
    }
    out.say(format_args!(
        "4 extend    on runs left out the simulation is off by {:.2} µm rms, before {:.2} (gain {:.1} %)",
        diagnosis.extended.heldout_rms_um, diagnosis.baseline.heldout_rms_um, diagnosis.gain_percent
    ));
}

fn show_proof(proof: &Proof, out: Output) {
    let flashed = &proof.flashed;
    out.say(format_args!(
        "5 flash     {} bytes in slot {}, read back, committed, confirmed as generation {}",
        flashed.bytes, flashed.slot, flashed.generation
    ));
    out.say("6 run       circles whose radii and speeds are not in the campaign, last of the steady turns measured:");
    out.say(indented(&proof_shown::grid(proof, 0)));
    let (before, after) = (proof.before(), proof.after());
    if proof.clamped > 0 {
        out.say(format_args!(
            "            {} set-points were clamped",
            proof.clamped
        ));
    }
    out.say(format_args!(
        "7 measure   radius size error {:.2} → {:.2} µm rms ({:.2} % less); out-of-roundness {:.1} → {:.1} µm, noise included",
        before.radius_error_rms_m * 1e6,
        after.radius_error_rms_m * 1e6,
        proof.reduction_percent(),
        before.out_of_roundness_m * 1e6,
        after.out_of_roundness_m * 1e6
    ));
}

fn indented(grid: &Grid) -> String {
    const INDENT: usize = 12;
    grid.text(width().saturating_sub(INDENT))
        .lines()
        .map(|line| format!("{:INDENT$}{line}", ""))
        .collect::<Vec<_>>()
        .join("\n")
}
