//! Serial arm: reversal spikes where a joint, not an axis, stands still. Not looked for in two-axis data: such spikes come out as unexplained, with their place.
use super::{Cause, CauseModel, Effect, Evidence, Parameter, Words};
use crate::simulation::machine::Machine;

/// See the module.
pub struct JointReversal;

const WORDS: Words = Words {
    id: "joint_reversal",
    name: "joint reversal",
    unit: "um",
    what: "spikes where a joint of a serial arm turns round, not at the quadrants",
    usual: "friction of one joint",
    adjust: "friction compensation of that joint",
    positive: "{a} sticks where it turns back, {size} at the tool: raise its friction compensation, look at its gear",
    negative: "{a} is pushed too far where it turns back, {size} at the tool: lower its friction compensation",
    never_told_from: &[],
    next: "the same circle elsewhere: the spikes move with the joint angles",
    not_compensable: Some("the table has no model of the arm"),
};

/// In the contract's unit.
const SIZE: Parameter = Parameter::needed("value", [-1e4, 1e4], "µm at the tool");

impl CauseModel for JointReversal {
    fn cause(&self) -> Cause {
        Cause::JointReversal
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn size(&self) -> &'static Parameter {
        &SIZE
    }

    fn evidence(&self) -> Evidence {
        Evidence::NotLooked
    }

    /// Without a model of the arm there is nothing to move: the simulation has straight axes.
    fn apply(&self, _effect: &Effect, _machine: &mut Machine) {}
}
