//! A bowed guide: moving along the axis shifts the other one by c·u². For X `r = (S/4)(sinψ + sin3ψ)`, for Y
//! `r = (S/4)(cosψ − cos3ψ)`, S = cR². The value is the bow S over the largest circle measured.
use super::view::axes_of;
use super::{Cause, CauseModel, EACH_AXIS, Effect, Harmonics, RunView, Words};
use crate::simulation::machine::Machine;
use giotto_shared::Axis;
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
    never_told_from: &[],
    next: "a straight line along the axis with a straight edge or laser",
    not_compensable: None,
};

impl CauseModel for Straightness {
    fn cause(&self) -> Cause {
        Cause::Straightness
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn axes(&self) -> &'static [Option<Axis>] {
        EACH_AXIS
    }

    fn harmonics(&self, axis: Option<Axis>, _shape: &[f64], view: &RunView) -> Option<Harmonics> {
        // cos²ψ·sinψ and sin²ψ·cosψ.
        let bow = 0.25e-6 * (view.radius_m / view.largest_radius_m).powi(2);
        Some(match axis {
            Some(Axis::Y) => Harmonics::wave(1, [bow, 0.0]).with(3, [-bow, 0.0]),
            _ => Harmonics::wave(1, [0.0, bow]).with(3, [0.0, bow]),
        })
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        for axis in axes_of(effect) {
            machine.straightness_per_m[axis.index()] += curvature_per_m(effect);
        }
    }

    fn term(&self, effect: &Effect) -> Option<Term<f64>> {
        Some(Term::Straightness {
            actuator: effect.axis?.into(),
            across: effect.axis?.other().into(),
            curvature_per_m: curvature_per_m(effect),
        })
    }
}

fn curvature_per_m(effect: &Effect) -> f64 {
    effect.value * 1e-6 / (effect.param("over_radius_mm", 300.0) * 1e-3).powi(2)
}
