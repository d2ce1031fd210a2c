//! Serial arm whose joints lag unequally: mean `r = −½·f·d·(A12 − A21)`, A = J·diag(τ)·J⁻¹.
use super::{Cause, CauseModel, Effect, Harmonics, Parameter, RunView, Site, Words};
use crate::simulation::machine::Machine;

/// See the module.
pub struct JointLagMismatch;

const WORDS: Words = Words {
    id: "joint_lag_mismatch",
    name: "joint lag mismatch",
    unit: "s",
    what: "one direction draws larger circles than the other, in proportion to the speed: the joints of a serial arm lag unequally",
    usual: "unequal position gains of the joints",
    adjust: "match the position gains of the joints that move in this plane",
    positive: "{a} follows {size} later than the joints on average: raise its gain",
    negative: "{a} follows {size} earlier than the joints on average: lower its gain, or raise that of the others",
    never_told_from: &[],
    next: "the same circles at another place of the work space, where the Jacobian differs",
    not_compensable: Some("the table has no model of the arm: its size changes with the place"),
};

/// In the contract's unit.
const SIZE: Parameter = Parameter::needed("value", [-1.0, 1.0], "s: a lag of a second");

impl CauseModel for JointLagMismatch {
    fn cause(&self) -> Cause {
        Cause::JointLagMismatch
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn size(&self) -> &'static Parameter {
        &SIZE
    }

    fn harmonics(&self, _site: Site, _shape: &[f64], view: &RunView) -> Option<Harmonics> {
        Some(Harmonics::mean(-0.5 * view.feed_m_s * view.sign))
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        machine.cross_lag_s += effect.value();
    }
}
