//! X longer than Y: `r = ½R(sx − sy)cos2ψ`, the same both ways.
use super::{Cause, CauseModel, Effect, Harmonics, RunView, Words};
use crate::simulation::machine::Machine;
use giotto_shared::term::Term;
use giotto_shared::{Axis, Plane};

/// See the module.
pub struct ScaleMismatch;

const WORDS: Words = Words {
    id: "scale_mismatch",
    name: "scale mismatch",
    unit: "um/m",
    what: "an oval along the axes that grows with the radius and is the same in both directions: X and Y differ in scale",
    usual: "encoder or screw calibration of one axis, unequal warming of the axes",
    adjust: "set the scale of one axis",
    never_told_from: &[],
    next: "a line test along each axis with a laser or a scale",
    not_compensable: None,
};

impl CauseModel for ScaleMismatch {
    fn cause(&self) -> Cause {
        Cause::ScaleMismatch
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn harmonics(&self, _axis: Option<Axis>, _shape: &[f64], view: &RunView) -> Option<Harmonics> {
        Some(Harmonics::wave(2, [0.5e-6 * view.radius_m, 0.0]))
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        machine.scale[0] += 0.5e-6 * effect.value;
        machine.scale[1] -= 0.5e-6 * effect.value;
    }

    fn term(&self, effect: &Effect) -> Option<Term<f64>> {
        Some(Term::ScaleMismatch {
            plane: Plane::Xy,
            relative: effect.value * 1e-6,
        })
    }
}
