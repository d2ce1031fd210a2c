//! A carriage that shifts sideways with its direction of travel: `r = −d(L/2)|sinψ|` (X moves, Y shifts),
//! `−d(L/2)|cosψ|` (Y moves, X shifts). It moves the mean radius by −dL/π.
use super::view::axes_of;
use super::{Cause, CauseModel, EACH_AXIS, Effect, RunView, Words};
use crate::simulation::machine::Machine;
use giotto_shared::Axis;
use giotto_shared::term::Term;

/// See the module.
pub struct LateralPlay;

const WORDS: Words = Words {
    id: "lateral_play",
    name: "lateral play",
    unit: "mm",
    what: "one axis shifts sideways when the other turns round, so that one direction draws larger circles than the other",
    usual: "play in the guides of one axis",
    adjust: "adjust the gibs or replace the guide blocks of that axis",
    never_told_from: &[],
    next: "a line along the moving axis, forth and back, with an indicator square to it",
    not_compensable: None,
};

impl CauseModel for LateralPlay {
    fn cause(&self) -> Cause {
        Cause::LateralPlay
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn axes(&self) -> &'static [Option<Axis>] {
        EACH_AXIS
    }

    fn signature(
        &self,
        axis: Option<Axis>,
        _shape: &[f64],
        _column: usize,
        view: &RunView,
        out: &mut [f64],
    ) {
        let side = usize::from(axis != Some(Axis::Y));
        for (out, direction) in out.iter_mut().zip(view.direction.iter()) {
            *out = -0.5e-3 * view.sign * direction[side].abs();
        }
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        for axis in axes_of(effect) {
            machine.lateral_play_m[axis.index()] += effect.value * 1e-3;
        }
    }

    fn term(&self, effect: &Effect) -> Option<Term<f64>> {
        Some(Term::LateralPlay {
            actuator: effect.axis?.into(),
            across: effect.axis?.other().into(),
            shift_m: effect.value * 1e-3,
        })
    }
}
