//! Unequal second cumulants: `r = −(Δκ2/4)(f²/R)·|G|·cos2ψ`, the same both ways: a filter before or behind the servo. Of a
//! joint `δq = ½Δκ2·q̈`.
use super::{
    ArmChain, Cause, CauseModel, Effect, Harmonics, Parameter, RunView, Seat, Site, Words,
};
use crate::simulation::machine::Machine;
use giotto_shared::term::Term;

/// See the module.
pub struct BandwidthMismatch;

const WORDS: Words = Words {
    id: "bandwidth_mismatch",
    name: "bandwidth mismatch",
    unit: "s^2",
    what: "an oval along the axes that grows with the centripetal acceleration and is the same in both directions: one axis shrinks more than the other",
    usual: "unequal acceleration filters or resonances of the two axes",
    adjust: "match the acceleration and jerk filters of the axes",
    positive: "{a} rounds off its motion more than {b}, by {size}: shorten the filter of {a}, or lengthen that of {b}",
    negative: "{b} rounds off its motion more than {a}, by {size}: shorten the filter of {b}, or lengthen that of {a}",
    elsewhere: Some([
        "{a} rounds off its motion more than the other joints, by {size}: shorten its filter, or lengthen those of the others",
        "{a} rounds off its motion less than the other joints, by {size}: lengthen its filter, or shorten those of the others",
    ]),
    never_told_from: &[],
    next: "circles at the highest safe speed, or a frequency response of each axis",
    not_compensable: None,
};

/// In the contract's unit.
const SIZE: Parameter = Parameter::needed(
    "value",
    [-1e-2, 1e-2],
    "s²: a lag of 100 ms on one axis alone",
);

impl CauseModel for BandwidthMismatch {
    fn cause(&self) -> Cause {
        Cause::BandwidthMismatch
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn size(&self) -> &'static Parameter {
        &SIZE
    }

    fn seat(&self) -> Seat {
        Seat::PairOrJoint
    }

    fn harmonics(&self, site: Site, _shape: &[f64], view: &RunView) -> Option<Harmonics> {
        if let (Site::One(joint), Some(arm)) = (site, &view.arm) {
            // δq = ½Δκ2·q̈ of the joint.
            let rates = arm.rates(view);
            let answers = std::array::from_fn(|n| arm.answers[n] * rates[n] * rates[n] * 0.5);
            return Some(arm.seen(joint.index(), &answers));
        }
        let Site::Pair(plane) = site else { return None };
        let size = -0.25 * view.radius_m * view.omega_rad_s.powi(2) * view.gain;
        let [first, second] = plane.axes().map(|axis| view.cosine(axis).squared());
        Some(first.minus(&second).times(size))
    }

    fn is_mutual(&self) -> bool {
        true
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        match (effect.site(), &mut machine.arm) {
            (Site::Pair(plane), _) => machine.split_bandwidth(plane, effect.value()),
            (Site::One(joint), Some(arm)) => {
                arm.joints[joint.index()].kappa2_s2 += effect.value();
            }
            _ => {}
        }
    }

    fn term(&self, effect: &Effect) -> Option<Term<f64>> {
        let Site::Pair(plane) = effect.site() else {
            return None;
        };
        Some(Term::BandwidthMismatch {
            plane,
            delta_kappa2_s2: effect.value(),
        })
    }

    fn joint_term(&self, effect: &Effect, _arm: &ArmChain) -> Option<Term<f64>> {
        let Site::One(actuator) = effect.site() else {
            return None;
        };
        if actuator.is_slide() {
            return None;
        }
        Some(Term::JointLag {
            actuator,
            delta_tau_s: 0.0,
            delta_kappa2_s2: effect.value(),
        })
    }
}
