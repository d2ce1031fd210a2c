//! A constant error of the radius: `r = offset`.
use super::{Cause, CauseModel, Effect, Harmonics, Parameter, RunView, Site, Words};
use crate::simulation::machine::Machine;
use giotto_shared::term::Term;

/// See the module.
pub struct RadiusOffset;

const WORDS: Words = Words {
    id: "radius_offset",
    name: "radius offset",
    unit: "mm",
    what: "every circle is wrong by the same length, whatever its radius, speed and direction",
    usual: "calibration of the ball, the bar or the tool",
    adjust: "calibrate the length of the bar and the tool centre point",
    positive: "every circle is {size} too large: enter the bar's length {size} shorter, or raise the tool radius by {size}",
    negative: "every circle is {size} too small: enter the bar's length {size} longer, or lower the tool radius by {size}",
    elsewhere: None,
    never_told_from: &[],
    next: "a wide range of radii: a scale error grows with R, an offset does not",
    not_compensable: None,
};

/// In the contract's unit.
const SIZE: Parameter =
    Parameter::needed("value", [-5.0, 5.0], "mm: as much as a table may correct");

impl CauseModel for RadiusOffset {
    fn cause(&self) -> Cause {
        Cause::RadiusOffset
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn size(&self) -> &'static Parameter {
        &SIZE
    }

    fn harmonics(&self, _site: Site, _shape: &[f64], _view: &RunView) -> Option<Harmonics> {
        Some(Harmonics::mean(1e-3))
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        machine.radius_offset_m += effect.value() * 1e-3;
    }

    fn term(&self, effect: &Effect) -> Option<Term<f64>> {
        Some(Term::RadiusOffset {
            offset_m: effect.value() * 1e-3,
        })
    }
}
