//! A bowed guide: moving along the axis shifts the other one by c·u². For X `r = (S/4)(sinψ + sin3ψ)`, for Y
//! `r = (S/4)(cosψ − cos3ψ)`, S = cR². The value is the bow S over the largest circle measured.
use super::{Cause, CauseModel, Effect, Fitted, Harmonics, Parameter, RunView, Seat, Site, Words};
use crate::simulation::machine::Machine;
use giotto_shared::term::Term;

/// See the module.
pub struct Straightness;

const WORDS: Words = Words {
    id: "straightness",
    name: "straightness",
    unit: "um",
    what: "three smooth lobes that grow with the square of the radius and are the same in both directions: a guide is bowed",
    usual: "a bent or unevenly seated guide, sag of a cross beam",
    adjust: "re-seat the guide or enter a straightness (sag) correction",
    positive: "the guide of {a} bows by {size} over the circle, its ends towards plus: align or map it",
    negative: "the guide of {a} bows by {size} over the circle, its ends towards minus: align or map it",
    elsewhere: None,
    never_told_from: &[],
    next: "a straight line along the axis with a straight edge or laser",
    not_compensable: None,
};

/// In the contract's unit.
const SIZE: Parameter = Parameter::needed("value", [-1e4, 1e4], "µm of bow");

/// Radius over which the bow was measured.
const OVER_RADIUS_MM: Parameter = Parameter::needed(
    "over_radius_mm",
    [1.0, 1e4],
    "radius of the circle over which the bow is so large",
);

impl CauseModel for Straightness {
    fn cause(&self) -> Cause {
        Cause::Straightness
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn size(&self) -> &'static Parameter {
        &SIZE
    }

    fn seat(&self) -> Seat {
        Seat::Across
    }

    fn parameters(&self) -> &'static [&'static Parameter] {
        &[&OVER_RADIUS_MM]
    }

    fn stated(&self, fit: &Fitted<'_>) -> Vec<(&'static Parameter, f64)> {
        vec![(&OVER_RADIUS_MM, fit.first_view.largest_radius_m * 1e3)]
    }

    fn harmonics(&self, site: Site, _shape: &[f64], view: &RunView) -> Option<Harmonics> {
        let Site::Across(moving, shifted) = site else {
            return None;
        };
        let bow = 1e-6 * (view.radius_m / view.largest_radius_m).powi(2);
        let along = view.cosine(moving).squared();
        Some(along.product(&view.cosine(shifted)).times(bow))
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        if let Site::Across(moving, shifted) = effect.site() {
            machine.straightness_per_m[moving.index()][shifted.index()] += curvature_per_m(effect);
        }
    }

    fn term(&self, effect: &Effect) -> Option<Term<f64>> {
        let Site::Across(actuator, across) = effect.site() else {
            return None;
        };
        Some(Term::Straightness {
            actuator,
            across,
            curvature_per_m: curvature_per_m(effect),
        })
    }
}

fn curvature_per_m(effect: &Effect) -> f64 {
    effect.value() * 1e-6 / (effect.get(&OVER_RADIUS_MM) * 1e-3).powi(2)
}
