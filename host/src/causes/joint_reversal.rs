//! Serial arm: reversal spikes where a joint, not an axis, stands still. Not looked for in two-axis data: such spikes come out as unexplained, with their place.
use super::{Cause, CauseModel, Effect, Evidence, Words};
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
    never_told_from: &[],
    next: "the same circle elsewhere: the spikes move with the joint angles",
    not_compensable: Some("the table has no model of the arm"),
};

impl CauseModel for JointReversal {
    fn cause(&self) -> Cause {
        Cause::JointReversal
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn evidence(&self) -> Evidence {
        Evidence::NotLooked
    }

    /// Without a model of the arm there is nothing to move: the simulation has two straight axes.
    fn apply(&self, _effect: &Effect, _machine: &mut Machine) {}
}
