//! Teeth near the reversals while an axis is slow: the axis sticks and jumps.
use super::{Cause, CauseModel, Effect, Evidence, Parameter, Seat, Site, Words};
use crate::simulation::machine::Machine;

/// See the module.
pub struct StickSlip;

const WORDS: Words = Words {
    id: "stick_slip",
    name: "stick-slip",
    unit: "um",
    what: "teeth near the reversals of an axis at low axis speed: it sticks and jumps",
    usual: "dry guides, a worn lubrication system, low stiffness of the drive",
    adjust: "lubricate; raise the integral gain with care; avoid very low axis speeds",
    positive: "{a} sticks and slips by {size} when it is slow: lubricate its guide, or raise the gain at low speed",
    negative: "{a} sticks and slips by {size} when it is slow: lubricate its guide, or raise the gain at low speed",
    elsewhere: None,
    never_told_from: &[],
    next: "a slow line along the axis at several speeds",
    not_compensable: Some("its teeth have no fixed place"),
};

/// In the contract's unit.
const SIZE: Parameter = Parameter::needed("value", [0.0, 1e4], "µm");

/// Speed of the axis below which it sticks.
const BELOW_MM_S: Parameter = Parameter::needed(
    "below_mm_s",
    [1e-3, 1e4],
    "speed of the axis below which it sticks",
);

impl CauseModel for StickSlip {
    fn cause(&self) -> Cause {
        Cause::StickSlip
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn makes_steps(&self) -> bool {
        true
    }

    fn size(&self) -> &'static Parameter {
        &SIZE
    }

    fn seat(&self) -> Seat {
        Seat::One
    }

    fn evidence(&self) -> Evidence {
        Evidence::Roughness
    }

    fn parameters(&self) -> &'static [&'static Parameter] {
        &[&BELOW_MM_S]
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        let Site::One(axis) = effect.site() else {
            return;
        };
        let mut friction = machine.friction[axis.index()].unwrap_or_default();
        friction.stick_slip_m += effect.value() * 1e-6;
        // It stands still between slips.
        friction.stick_travel_m = friction.stick_slip_m.abs().max(1e-7);
        friction.stick_speed_m_s = effect.get(&BELOW_MM_S) * 1e-3;
        machine.friction[axis.index()] = Some(friction);
    }
}
