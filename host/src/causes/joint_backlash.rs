//! Play of a joint's gear: `δq = −(B/2)·sgn(q̇)`, seen as `n̂ᵀJe·δq`: a step where the joint turns back, not where a slide
//! would; a joint that does not turn back shows an oval that flips with the direction.
//!
//! The play is crossed while the joint turns round, which the shape parameter `play_rad` (|B|) gives the signature as a ramp.
//! Where the play lies before the joint's loop, the loop smooths the step: `smoothed_s` is the time constant of that, and since
//! the machine angle is behind the command by the same time, the smoothed step begins so much before the reversal.
use super::{
    ArmChain, Bend, Cause, CauseModel, Effect, Fitted, Parameter, RunView, Seat, Site, Words,
};
use crate::simulation::machine::Machine;
use giotto_shared::term::Term;
use std::f64::consts::TAU;

/// See the module.
pub struct JointBacklash;

const WORDS: Words = Words {
    id: "joint_backlash",
    name: "joint backlash",
    unit: "mrad",
    what: "a step where a joint of the arm turns back: its gear has play",
    usual: "wear or lost preload of the joint's gear",
    adjust: "take up the play of that joint's gear, or have it overhauled",
    positive: "the gear of {a} has {size} of play: take it up, or have the gear overhauled",
    negative: "{a} jumps ahead by {size} where it turns back: lower its backlash compensation by {size}",
    elsewhere: None,
    never_told_from: &[],
    next: "the joint alone, forth and back by a degree, with a dial gauge at the tool",
    not_compensable: None,
};

/// Largest play, rad: more is a broken gear.
const LARGEST_PLAY_RAD: f64 = 0.02;
/// In the contract's unit.
const SIZE: Parameter = Parameter::needed("value", [-20.0, 20.0], "mrad: more is a broken gear");

/// Smallest play whose crossing is followed, rad.
const SMALLEST_PLAY_RAD: f64 = 1e-6;
/// Time constants of a loop that smooths a step, s.
const SMOOTHED: [f64; 2] = [1e-4, 0.1];
/// Play whose step is smoothed by less than this lies behind the loop, s.
const BEHIND_S: f64 = 2e-3;
/// How the joint's loop smooths the step.
const SMOOTHED_S: Parameter = Parameter::optional(
    "smoothed_s",
    [0.0, 0.1],
    0.0,
    "time constant with which the joint's loop smooths the step; 0 where the play lies behind it",
);

impl CauseModel for JointBacklash {
    fn cause(&self) -> Cause {
        Cause::JointBacklash
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn size(&self) -> &'static Parameter {
        &SIZE
    }

    fn seat(&self) -> Seat {
        Seat::Joint
    }

    fn parameters(&self) -> &'static [&'static Parameter] {
        &[&SMOOTHED_S]
    }

    fn stated(&self, fit: &Fitted<'_>) -> Vec<(&'static Parameter, f64)> {
        let smoothed_s = fit.shape.get(1).copied();
        let stated = smoothed_s.map(|smoothed_s| (&SMOOTHED_S, smoothed_s));
        stated.into_iter().collect()
    }

    fn shape_names(&self) -> &'static [&'static str] {
        &["play_rad", "smoothed_s"]
    }

    fn shapes(&self, _views: &[RunView]) -> Vec<Vec<f64>> {
        let plays = [2e-5, 1e-4, 4e-4];
        let shapes = plays.map(|play| [5e-4, 8e-3].map(|smoothed| vec![play, smoothed]));
        shapes.concat()
    }

    fn bend(&self, _which: usize, value: f64, _travel_m: f64) -> Bend {
        Bend::Amount(0.1 * value)
    }

    fn tidy(&self, shape: &mut [f64]) {
        let [play_rad, smoothed_s] = shape else {
            return;
        };
        *play_rad = play_rad.abs().clamp(SMALLEST_PLAY_RAD, LARGEST_PLAY_RAD);
        *smoothed_s = smoothed_s.abs().clamp(SMOOTHED[0], SMOOTHED[1]);
    }

    fn allows(&self, value_mrad: f64) -> bool {
        value_mrad.abs() <= LARGEST_PLAY_RAD * 1e3
    }

    fn signature(
        &self,
        site: Site,
        shape: &[f64],
        _column: usize,
        view: &RunView,
        out: &mut [f64],
    ) {
        let (Site::One(joint), Some(arm)) = (site, &view.arm) else {
            return;
        };
        let joint = joint.index();
        let &[play_rad, smoothed_s] = shape else {
            return;
        };
        let omega = view.omega_rad_s;
        let crossings: Vec<(f64, f64, Crossing)> = arm
            .orbit
            .reversals(joint)
            .iter()
            .map(|reversal| {
                let bend = reversal.bend.abs();
                let crossing = Crossing::new(play_rad, smoothed_s, bend, omega);
                (reversal.angle_rad, reversal.bend.signum(), crossing)
            })
            .collect();
        for (out, psi) in out.iter_mut().zip(view.psi_rad.iter()) {
            let [_, rate, lever] = arm.orbit.at(joint, *psi);
            // Of all steps the one that began last.
            let last = crossings
                .iter()
                .map(|(angle_rad, side, crossing)| {
                    let since_s = view.sign * (psi - angle_rad) / omega + smoothed_s;
                    (since_s.rem_euclid(TAU / omega), side, crossing)
                })
                .min_by(|a, b| a.0.total_cmp(&b.0));
            // Behind the motion by half the play, once it is crossed.
            let behind = match last {
                None => (view.sign * rate).signum(),
                Some((since_s, side, crossing)) => side * (2.0 * crossing.at(since_s) - 1.0),
            };
            *out = -0.5e-3 * behind * lever;
        }
    }

    /// The play of real gears is not one gap.
    fn relative_doubt(&self) -> f64 {
        0.01
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        if let (Site::One(joint), Some(arm)) = (effect.site(), &mut machine.arm) {
            let joint = &mut arm.joints[joint.index()];
            joint.backlash_rad += effect.value() * 1e-3;
            joint.smoothed_s = effect.get(&SMOOTHED_S);
        }
    }

    fn joint_term(&self, effect: &Effect, arm: &ArmChain) -> Option<Term<f64>> {
        let Site::One(actuator) = effect.site() else {
            return None;
        };
        Some(Term::JointBacklash {
            actuator,
            play_rad: effect.value() * 1e-3,
            // Play that the loop smooths lies before it.
            loop_s: if effect.get(&SMOOTHED_S) < BEHIND_S {
                arm.lag_s
            } else {
                0.0
            },
        })
    }
}

/// Steps of the tabulated crossing.
const STEPS: usize = 240;

/// Share of the play that is crossed, smoothed, since the joint turned back.
struct Crossing {
    step_s: f64,
    shares: [f64; STEPS + 1],
}

impl Crossing {
    /// The joint goes away from its extreme as bend·(1 − cos ωt).
    fn new(play_rad: f64, smoothed_s: f64, bend: f64, omega_rad_s: f64) -> Self {
        let play_rad = play_rad.max(SMALLEST_PLAY_RAD);
        let smoothed_s = smoothed_s.max(SMOOTHED[0]);
        let crossed_s = (2.0 * play_rad / bend.max(1e-12)).sqrt() / omega_rad_s;
        let end_s = (1.5 * crossed_s + 8.0 * smoothed_s).min(TAU / omega_rad_s);
        let step_s = end_s / STEPS as f64;
        let keep = (-step_s / smoothed_s).exp();
        // A change spread evenly over the step.
        let take = 1.0 - smoothed_s / step_s * (1.0 - keep);
        let (mut before, mut share) = (0.0, 0.0);
        let mut shares = [0.0; STEPS + 1];
        for (step, slot) in shares.iter_mut().enumerate().skip(1) {
            let gone = bend * (1.0 - (omega_rad_s * step_s * step as f64).cos());
            let crossed = (gone / play_rad).min(1.0).max(before);
            share = keep * share + (1.0 - keep) * before + take * (crossed - before);
            before = crossed;
            *slot = share;
        }
        Self { step_s, shares }
    }

    fn at(&self, since_s: f64) -> f64 {
        let steps = since_s / self.step_s;
        let k = steps as usize;
        match self.shares.get(k..k + 2) {
            Some([this, next]) => this + (steps - k as f64) * (next - this),
            _ => self.shares[STEPS],
        }
    }
}
