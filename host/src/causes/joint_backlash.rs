//! Play of a joint's gear: `δq = −(B/2)·sgn(q̇)`, seen as `n̂ᵀJe·δq`: a step where the joint turns back, not where a slide
//! would; a joint that does not turn back shows an oval that flips with the direction.
//!
//! The play is crossed while the joint turns round; the shape parameter `play_rad` (|B|) gives the signature that ramp.
use super::{Cause, CauseModel, Effect, Parameter, RunView, Seat, Site, Words};
use crate::simulation::machine::Machine;

/// See the module.
pub struct JointBacklash;

const WORDS: Words = Words {
    id: "joint_backlash",
    name: "joint backlash",
    unit: "mrad",
    what: "a step where a joint of the arm turns back: its gear has play",
    usual: "wear or lost preload of the joint's gear",
    adjust: "take up the play of that joint's gear, or have it overhauled",
    never_told_from: &[],
    next: "the joint alone, forth and back by a degree, with a dial gauge at the tool",
    not_compensable: Some("the table has no model of the arm"),
};

/// Largest play, rad: more is a broken gear.
const LARGEST_PLAY_RAD: f64 = 0.02;
/// In the contract's unit.
const SIZE: Parameter = Parameter::needed("value", [-20.0, 20.0], "mrad: more is a broken gear");

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

    fn shape_names(&self) -> &'static [&'static str] {
        &["play_rad"]
    }

    fn shapes(&self, _views: &[RunView]) -> Vec<Vec<f64>> {
        [0.0, 2e-5, 1e-4, 4e-4].map(|play| vec![play]).to_vec()
    }

    fn tidy(&self, shape: &mut [f64]) {
        shape
            .iter_mut()
            .for_each(|play_rad| *play_rad = play_rad.clamp(0.0, LARGEST_PLAY_RAD));
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
        let play_rad = shape.first().copied().unwrap_or(0.0);
        let reversals = arm.orbit.reversals(joint);
        for (out, psi) in out.iter_mut().zip(view.psi_rad.iter()) {
            let [q, rate, lever] = arm.orbit.at(joint, *psi);
            // Behind the motion by half the play, once it is crossed.
            let behind = match super::arm::last_reversal(reversals, *psi, view.sign) {
                None => (view.sign * rate).signum(),
                Some((reversal, _)) => {
                    let [extreme, ..] = arm.orbit.at(joint, reversal.angle_rad);
                    let crossed = if play_rad > 0.0 {
                        ((q - extreme).abs() / play_rad).min(1.0)
                    } else {
                        1.0
                    };
                    reversal.bend.signum() * (2.0 * crossed - 1.0)
                }
            };
            *out = -0.5e-3 * behind * lever;
        }
    }

    /// The servo smooths the step; the closed form does not.
    fn relative_doubt(&self) -> f64 {
        0.01
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        if let (Site::One(joint), Some(arm)) = (effect.site(), &mut machine.arm) {
            arm.joints[joint.index()].backlash_rad += effect.value() * 1e-3;
        }
    }
}
