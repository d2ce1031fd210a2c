//! Axes not square: `r = ½εR·sin2ψ`, the same both ways.
use super::{Cause, CauseModel, Effect, Harmonics, Parameter, RunView, Seat, Site, Words};
use crate::simulation::machine::Machine;
use giotto_shared::term::Term;

/// See the module.
pub struct Squareness;

const WORDS: Words = Words {
    id: "squareness",
    name: "squareness",
    unit: "um/m",
    what: "an oval at 45° that grows with the radius and is the same in both directions: the axes are not square to each other",
    usual: "alignment of the guides, a crash, a foundation that has settled; on a serial arm, link parameters",
    adjust: "align the axes or enter the squareness correction in the controller",
    positive: "the angle between {a} and {b} is {size} under 90°: open it by {size}",
    negative: "the angle between {a} and {b} is {size} over 90°: close it by {size}",
    elsewhere: None,
    never_told_from: &[],
    next: "the same circle in the other quadrants of the work space, or a square",
    not_compensable: None,
};

/// In the contract's unit.
const SIZE: Parameter = Parameter::needed(
    "value",
    [-1e4, 1e4],
    "µm/m: 1 %, as much as a table may correct",
);

impl CauseModel for Squareness {
    fn cause(&self) -> Cause {
        Cause::Squareness
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn size(&self) -> &'static Parameter {
        &SIZE
    }

    fn seat(&self) -> Seat {
        Seat::Pair
    }

    fn harmonics(&self, site: Site, _shape: &[f64], view: &RunView) -> Option<Harmonics> {
        let Site::Pair(plane) = site else { return None };
        let [first, second] = plane.axes().map(|axis| view.cosine(axis));
        Some(first.product(&second).times(1e-6 * view.radius_m))
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        if let Site::Pair(plane) = effect.site() {
            machine.squareness_rad[plane as usize] += effect.value() * 1e-6;
        }
    }

    fn term(&self, effect: &Effect) -> Option<Term<f64>> {
        let Site::Pair(plane) = effect.site() else {
            return None;
        };
        Some(Term::Squareness {
            plane,
            shear_rad: effect.value() * 1e-6,
        })
    }
}
