//! Teeth near the reversals while an axis is slow: the axis sticks and jumps.
use super::view::axes_of;
use super::{Cause, CauseModel, EACH_AXIS, Effect, Evidence, Words};
use crate::simulation::machine::Machine;
use giotto_shared::Axis;

/// See the module.
pub struct StickSlip;

const WORDS: Words = Words {
    id: "stick_slip",
    name: "stick-slip",
    unit: "um",
    what: "teeth near the reversals of an axis at low axis speed: it sticks and jumps",
    usual: "dry guides, a worn lubrication system, low stiffness of the drive",
    adjust: "lubricate; raise the integral gain with care; avoid very low axis speeds",
    never_told_from: &[],
    next: "a slow line along the axis at several speeds",
    not_compensable: Some("its teeth have no fixed place"),
};

impl CauseModel for StickSlip {
    fn cause(&self) -> Cause {
        Cause::StickSlip
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn axes(&self) -> &'static [Option<Axis>] {
        EACH_AXIS
    }

    fn evidence(&self) -> Evidence {
        Evidence::Roughness
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        for axis in axes_of(effect) {
            let mut friction = machine.friction[axis.index()].unwrap_or_default();
            friction.stick_slip_m += effect.value * 1e-6;
            // It stands still between slips.
            friction.stick_travel_m = friction.stick_slip_m.abs().max(1e-7);
            friction.stick_speed_m_s = effect.param("below_mm_s", 5.0) * 1e-3;
            machine.friction[axis.index()] = Some(friction);
        }
    }
}
