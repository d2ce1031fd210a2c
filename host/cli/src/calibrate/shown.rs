//! What is said of a calibration.
use super::limits::Limits;
use super::{Args, Eyes};
use crate::Output;
use crate::grid::width;
use crate::proof_shown;
use crate::ring::Proof;
use giotto::diagnosis::Diagnosis;
use giotto_link::Controller;
use serde_json::{Value, json};

/// What encoders do not see.
const UNSEEN: [&str; 3] = [
    "play behind them",
    "squareness of the slides",
    "their own scale",
];

pub(super) fn propose(limits: &Limits, controller: &Controller, simulated: bool, out: Output) {
    let circles = limits.circles();
    let which = if simulated {
        "the machine is SIMULATED"
    } else {
        "the machine will MOVE"
    };
    out.say(format_args!(
        "{}: {which}. {} circles about the origin, R {:.0} to {:.0} mm, up to {:.0} mm/s and {:.0} mm/s², both ways: {:.0} s of motion.",
        controller.port(),
        2 * circles.len(),
        limits.least_radius_mm(),
        limits.radius_mm,
        limits.feed_mm_s,
        limits.acceleration_mm_s2,
        limits.duration_s(&circles)
    ));
}

pub(super) fn found(found: &Diagnosis, out: Output) {
    for finding in &found.findings {
        out.tell(0, &finding.remedy);
    }
    out.tell(0, format_args!("{}.", found.recommendation.words));
    out.say(format_args!(
        "expected: off by {:.2} µm rms on circles left out, {:.2} by the simulation before",
        found.extended.heldout_rms_um, found.baseline.heldout_rms_um
    ));
}

pub(super) fn proof(proof: &Proof, args: &Args, out: Output) {
    out.say(proof_shown::grid(proof, 1).text(width()));
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

pub(super) fn document(
    args: &Args,
    controller: &Controller,
    limits: &Limits,
    found: &Diagnosis,
    proof: &Proof,
    kept: bool,
    simulated: bool,
) -> Value {
    let circles = limits.circles();
    let eyes = args.measure == Eyes::Encoders;
    let pair = |(radius, feed): &(f64, f64)| json!({ "radius_mm": radius, "feed_mm_s": feed });
    json!({
        "port": controller.port(),
        "simulated": simulated,
        "measured_by": if eyes { "encoders" } else { "ballbar" },
        "plan": circles.iter().map(pair).collect::<Vec<_>>(),
        "motion_s": limits.duration_s(&circles),
        "findings": found.findings,
        "expected": { "heldout_rms_um": found.extended.heldout_rms_um, "without_um": found.baseline.heldout_rms_um },
        "flashed": { "slot": proof.flashed.slot, "generation": proof.flashed.generation },
        "before": proof_shown::um(proof.before()),
        "after": proof_shown::um(proof.after()),
        "reduction_percent": proof.reduction_percent(),
        "circles": proof_shown::circles(proof),
        "kept": kept,
        "not_seen": if eyes { UNSEEN.to_vec() } else { Vec::new() },
    })
}
