//! A joint that stands at another angle than its controller reads: `r = n̂ᵀJe·δ`, the same at every speed, both ways: over a
//! circle a change of size and an oval, ∝ R, that depend on the place. From one place it looks as a link of another length does.
use super::arm::sites_with_shape;
use super::{
    ArmChain, Cause, CauseModel, Effect, Harmonics, Parameter, RunView, Seat, Site, Words,
};
use crate::simulation::machine::Machine;
use giotto_shared::term::Term;

/// See the module.
pub struct JointZero;

const WORDS: Words = Words {
    id: "joint_zero",
    name: "joint zero",
    unit: "mrad",
    what: "size and oval of circles depend on the place, at every speed alike: a joint's zero is off",
    usual: "a calibration mark or revolution counter set wrong after a repair or a collision",
    adjust: "calibrate that joint's zero again",
    positive: "{a} stands {size} further than its controller reads: set its zero again, {size} less",
    negative: "{a} stands {size} less far than its controller reads: set its zero again, {size} more",
    elsewhere: None,
    never_told_from: &[],
    next: "the same circle at three more places of the work space",
    not_compensable: None,
};

/// In the contract's unit.
const SIZE: Parameter = Parameter::needed("value", [-100.0, 100.0], "mrad: about six degrees");

impl CauseModel for JointZero {
    fn cause(&self) -> Cause {
        Cause::JointZero
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
        Some(arm.seen_constant(joint.index()).times(1e-3))
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        if let (Site::One(joint), Some(arm)) = (effect.site(), &mut machine.arm) {
            arm.joints[joint.index()].zero_rad += effect.value() * 1e-3;
        }
    }

    fn joint_term(&self, effect: &Effect, arm: &ArmChain) -> Option<Term<f64>> {
        let Site::One(actuator) = effect.site() else {
            return None;
        };
        arm.placed.then_some(Term::JointZero {
            actuator,
            offset_rad: effect.value() * 1e-3,
        })
    }
}
