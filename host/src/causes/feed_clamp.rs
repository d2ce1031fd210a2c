//! The controller slows arcs to a centripetal acceleration: f = min(f, √(a·R)); the turn lasts longer.
use super::{Cause, CauseModel, Effect, Evidence, Parameter, Words};
use crate::simulation::machine::Machine;

/// See the module.
pub struct FeedClamp;

const WORDS: Words = Words {
    id: "feed_clamp",
    name: "feed clamp",
    unit: "mm/s^2",
    what: "small fast circles run slower than programmed: the controller limits the centripetal acceleration",
    usual: "the acceleration limit of the controller, a smoothing or safety function",
    adjust: "programme speeds that the controller keeps, or raise its limit if the machine allows it",
    positive: "arcs are slowed to {size} of centripetal acceleration: raise that limit, or program what the machine can hold",
    negative: "arcs are slowed to {size} of centripetal acceleration: raise that limit, or program what the machine can hold",
    elsewhere: None,
    never_told_from: &[],
    next: "the duration of the turn, over speeds around the limit",
    not_compensable: Some(
        "the controller chooses the speed; a table that knows the clamp is valid below it",
    ),
};

/// In the contract's unit.
const SIZE: Parameter = Parameter::needed(
    "value",
    [1.0, 1e6],
    "mm/s²: from a crawl to a hundred times gravity",
);

impl CauseModel for FeedClamp {
    fn cause(&self) -> Cause {
        Cause::FeedClamp
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn size(&self) -> &'static Parameter {
        &SIZE
    }

    fn evidence(&self) -> Evidence {
        Evidence::Duration
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        machine.centripetal_limit_m_s2 = Some(effect.value() * 1e-3);
    }
}
