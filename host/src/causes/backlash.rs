//! Lost motion at a reversal: `r = d(B/2)·sgn(sinψ)·cosψ` for X in an XY circle,
//! `−d(B/2)·sgn(cosψ)·sinψ` for Y.
//!
//! The play is crossed while the axis turns round, in an angle √(2B/R); the shape parameter `play_m` (|B|) gives
//! the signature that ramp: after the reversal the output stands still until the input has come back by B.
use super::{Cause, CauseModel, Effect, Parameter, RunView, Seat, Site, Stroke, Words};
use crate::simulation::machine::Machine;
use giotto_shared::term::Term;

/// See the module.
pub struct Backlash;

const WORDS: Words = Words {
    id: "backlash",
    name: "backlash",
    unit: "mm",
    what: "a step where one axis turns round, outward in both directions: the axis loses motion",
    usual: "play or wind-up of the screw, rack, gear or belt",
    adjust: "take up the play mechanically, then set the backlash compensation of that axis",
    positive: "{a} loses {size} at each reversal: raise its backlash compensation by {size}, or take up the play of screw and nut",
    negative: "{a} jumps ahead by {size} at each reversal: lower its backlash compensation by {size}",
    elsewhere: None,
    never_told_from: &[],
    next: "a back-and-forth line of a few steps of the axis with a dial gauge",
    not_compensable: None,
};

/// Largest play, m: a millimetre is crossed in a few degrees of any circle worth measuring. A longer crossing is no
/// reversal any more but an oval, and belongs to another cause.
const LARGEST_PLAY_M: f64 = 1e-3;
/// In the contract's unit.
const SIZE: Parameter =
    Parameter::needed("value", [-5.0, 5.0], "mm: as much as a table may correct");

impl CauseModel for Backlash {
    fn cause(&self) -> Cause {
        Cause::Backlash
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

    fn shape_names(&self) -> &'static [&'static str] {
        &["play_m"]
    }

    fn shapes(&self, _views: &[RunView]) -> Vec<Vec<f64>> {
        [0.0, 5e-6, 20e-6, 60e-6].map(|play| vec![play]).to_vec()
    }

    fn tidy(&self, shape: &mut [f64]) {
        shape
            .iter_mut()
            .for_each(|play_m| *play_m = play_m.clamp(0.0, LARGEST_PLAY_M));
    }

    fn allows(&self, value_mm: f64) -> bool {
        value_mm.abs() <= LARGEST_PLAY_M * 1e3
    }

    fn signature(
        &self,
        site: Site,
        shape: &[f64],
        _column: usize,
        view: &RunView,
        out: &mut [f64],
    ) {
        let Site::One(axis) = site else { return };
        let play_m = shape.first().copied().unwrap_or(0.0);
        let swing = view.swing(axis);
        for (out, Stroke { facing, .. }) in out.iter_mut().zip(view.strokes_of(axis)) {
            let back_m = view.radius_m * (swing - facing);
            let crossed = if play_m > 0.0 {
                (back_m / play_m).min(1.0)
            } else {
                1.0
            };
            *out = 0.5e-3 * facing * (2.0 * crossed - 1.0);
        }
    }

    /// The servo smooths the step; the closed form does not.
    fn relative_doubt(&self) -> f64 {
        0.004
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        if let Site::One(axis) = effect.site() {
            machine.backlash_m[axis.index()] += effect.value() * 1e-3;
        }
    }

    fn term(&self, effect: &Effect) -> Option<Term<f64>> {
        let Site::One(actuator) = effect.site() else {
            return None;
        };
        Some(Term::Backlash {
            actuator,
            step_m: effect.value() * 1e-3,
        })
    }
}
