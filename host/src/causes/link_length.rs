//! A link that is longer or shorter than the controller computes with: `r = n̂·u·δ`, u the link's direction, the same at every
//! speed, both ways: a change of size and an oval, ∝ R, that depend on the place. It is named by the joint before the link.
use super::arm::sites_with_shape;
use super::{
    ArmChain, Cause, CauseModel, Effect, Harmonics, Parameter, RunView, Seat, Site, Words,
};
use crate::simulation::machine::Machine;
use giotto_shared::term::Term;

/// See the module.
pub struct LinkLength;

const WORDS: Words = Words {
    id: "link_length",
    name: "link length",
    unit: "mm",
    what: "size and oval of circles depend on the place, at every speed alike: a link is longer or shorter than the controller has it",
    usual: "nominal instead of calibrated lengths, a repaired arm, warmth",
    adjust: "enter the calibrated length of that link",
    positive: "the link behind {a} is {size} longer than the controller has it: enter its calibrated length",
    negative: "the link behind {a} is {size} shorter than the controller has it: enter its calibrated length",
    elsewhere: None,
    never_told_from: &[],
    next: "the same circle at three more places of the work space",
    not_compensable: None,
};

/// In the contract's unit.
const SIZE: Parameter = Parameter::needed("value", [-100.0, 100.0], "mm");

impl CauseModel for LinkLength {
    fn cause(&self) -> Cause {
        Cause::LinkLength
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

    fn sites(&self, views: &[RunView]) -> Vec<Site> {
        sites_with_shape(self, views)
    }

    fn class(&self) -> Option<&'static str> {
        Some("geometry of an arm")
    }

    fn harmonics(&self, site: Site, _shape: &[f64], view: &RunView) -> Option<Harmonics> {
        let (Site::One(joint), Some(arm)) = (site, &view.arm) else {
            return None;
        };
        Some(arm.seen_link(joint.index())?.times(1e-3))
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        if let (Site::One(joint), Some(arm)) = (effect.site(), &mut machine.arm) {
            arm.longer_m[joint.index()] += effect.value() * 1e-3;
        }
    }

    fn joint_term(&self, effect: &Effect, arm: &ArmChain) -> Option<Term<f64>> {
        let Site::One(actuator) = effect.site() else {
            return None;
        };
        arm.placed.then_some(Term::LinkLength {
            actuator,
            longer_m: effect.value() * 1e-3,
        })
    }
}
