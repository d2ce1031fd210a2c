//! X longer than Y: `r = ½R(sx − sy)cos2ψ`, the same both ways.
use super::site::in_one_plane;
use super::{Cause, CauseModel, Effect, Harmonics, Parameter, RunView, Seat, Site, Words};
use crate::simulation::machine::Machine;
use giotto_shared::term::Term;

/// See the module.
pub struct ScaleMismatch;

const WORDS: Words = Words {
    id: "scale_mismatch",
    name: "scale mismatch",
    unit: "um/m",
    what: "an oval along the axes that grows with the radius and is the same in both directions: X and Y differ in scale",
    usual: "encoder or screw calibration of one axis, unequal warming of the axes",
    adjust: "set the scale of one axis",
    positive: "{a} travels {size} more than {b}: lower the scale of {a} by {size}, or raise that of {b}",
    negative: "{a} travels {size} less than {b}: raise the scale of {a} by {size}, or lower that of {b}",
    elsewhere: None,
    never_told_from: &[],
    next: "a line test along each axis with a laser or a scale",
    not_compensable: None,
};

/// In the contract's unit.
const SIZE: Parameter = Parameter::needed(
    "value",
    [-1e4, 1e4],
    "µm/m: 1 %, as much as a table may correct",
);

impl CauseModel for ScaleMismatch {
    fn cause(&self) -> Cause {
        Cause::ScaleMismatch
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

    /// Circles in several planes show the scale of each slide: what differs then follows.
    fn sites(&self, views: &[RunView]) -> Vec<Site> {
        if in_one_plane(views) {
            self.seat().sites(views)
        } else {
            Vec::new()
        }
    }

    fn harmonics(&self, site: Site, _shape: &[f64], view: &RunView) -> Option<Harmonics> {
        let Site::Pair(plane) = site else { return None };
        let [first, second] = plane.axes().map(|axis| view.cosine(axis).squared());
        Some(first.minus(&second).times(0.5e-6 * view.radius_m))
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        if let Site::Pair(plane) = effect.site() {
            let [first, second] = plane.axes().map(|axis| axis.index());
            machine.scale[first] += 0.5e-6 * effect.value();
            machine.scale[second] -= 0.5e-6 * effect.value();
        }
    }

    fn term(&self, effect: &Effect) -> Option<Term<f64>> {
        let Site::Pair(plane) = effect.site() else {
            return None;
        };
        Some(Term::ScaleMismatch {
            plane,
            relative: effect.value() * 1e-6,
        })
    }
}
