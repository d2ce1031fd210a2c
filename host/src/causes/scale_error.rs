//! Both axes long by the same share: `r = R·s`.
use super::{Cause, CauseModel, Effect, Harmonics, Parameter, RunView, Seat, Site, Words};
use crate::simulation::machine::Machine;
use giotto_shared::Actuator;
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
    positive: "both axes travel {size} too far: lower the scale of both by {size}",
    negative: "both axes travel {size} too little: raise the scale of both by {size}",
    elsewhere: Some([
        "{a} alone travels {size} too far: lower its scale by {size}",
        "{a} alone travels {size} too little: raise its scale by {size}",
    ]),
    never_told_from: &[],
    next: "a wide range of radii, and the temperature of machine and bar",
    not_compensable: None,
};

/// In the contract's unit.
const SIZE: Parameter = Parameter::needed(
    "value",
    [-1e4, 1e4],
    "µm/m: 1 %, as much as a table may correct",
);

impl CauseModel for ScaleError {
    fn cause(&self) -> Cause {
        Cause::ScaleError
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn size(&self) -> &'static Parameter {
        &SIZE
    }

    fn seat(&self) -> Seat {
        Seat::MachineOrOne
    }

    fn harmonics(&self, site: Site, _shape: &[f64], view: &RunView) -> Option<Harmonics> {
        let size = 1e-6 * view.radius_m;
        Some(match site {
            Site::One(axis) => view.cosine(axis).squared().times(size),
            _ => Harmonics::mean(size),
        })
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        for (slide, scale) in Actuator::SLIDES.into_iter().zip(&mut machine.scale) {
            if matches!(effect.site(), Site::Machine) || effect.site() == Site::One(slide) {
                *scale += effect.value() * 1e-6;
            }
        }
    }

    fn term(&self, effect: &Effect) -> Option<Term<f64>> {
        let relative = effect.value() * 1e-6;
        match effect.site() {
            Site::Machine => Some(Term::ScaleError { relative }),
            Site::One(actuator) => Some(Term::AxisScale { actuator, relative }),
            _ => None,
        }
    }
}
