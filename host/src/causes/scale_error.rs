//! Both axes long by the same share: `r = R·s`.
use super::{Cause, CauseModel, Effect, Harmonics, RunView, Words};
use crate::simulation::machine::Machine;
use giotto_shared::Axis;
use giotto_shared::term::Term;

/// See the module.
pub struct ScaleError;

const WORDS: Words = Words {
    id: "scale_error",
    name: "scale error",
    unit: "um/m",
    what: "every circle is wrong in proportion to its radius",
    usual: "scale or encoder calibration, a machine at another temperature than at its calibration",
    adjust: "set the scale of both axes, or measure at 20 °C",
    never_told_from: &[],
    next: "a wide range of radii, and the temperature of machine and bar",
    not_compensable: None,
};

impl CauseModel for ScaleError {
    fn cause(&self) -> Cause {
        Cause::ScaleError
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn harmonics(&self, _axis: Option<Axis>, _shape: &[f64], view: &RunView) -> Option<Harmonics> {
        Some(Harmonics::mean(1e-6 * view.radius_m))
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        machine.scale[0] += effect.value * 1e-6;
        machine.scale[1] += effect.value * 1e-6;
    }

    fn term(&self, effect: &Effect) -> Option<Term<f64>> {
        Some(Term::ScaleError {
            relative: effect.value * 1e-6,
        })
    }
}
