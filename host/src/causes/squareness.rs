//! Axes not square: `r = ½εR·sin2ψ`, the same both ways.
use super::{Cause, CauseModel, Effect, Harmonics, RunView, Words};
use crate::simulation::machine::Machine;
use giotto_shared::term::Term;
use giotto_shared::{Axis, Plane};

/// See the module.
pub struct Squareness;

const WORDS: Words = Words {
    id: "squareness",
    name: "squareness",
    unit: "um/m",
    what: "an oval at 45° that grows with the radius and is the same in both directions: the axes are not square to each other",
    usual: "alignment of the guides, a crash, a foundation that has settled; on a serial arm, link parameters",
    adjust: "align the axes or enter the squareness correction in the controller",
    never_told_from: &[],
    next: "the same circle in the other quadrants of the work space, or a square",
    not_compensable: None,
};

impl CauseModel for Squareness {
    fn cause(&self) -> Cause {
        Cause::Squareness
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn harmonics(&self, _axis: Option<Axis>, _shape: &[f64], view: &RunView) -> Option<Harmonics> {
        Some(Harmonics::wave(2, [0.0, 0.5e-6 * view.radius_m]))
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        machine.squareness_rad += effect.value * 1e-6;
    }

    fn term(&self, effect: &Effect) -> Option<Term<f64>> {
        Some(Term::Squareness {
            plane: Plane::Xy,
            shear_rad: effect.value * 1e-6,
        })
    }
}
