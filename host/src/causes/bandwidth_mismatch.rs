//! Unequal second cumulants: `r = −(Δκ2/4)(f²/R)·|G|·cos2ψ`, the same both ways: a filter before or behind the servo.
use super::{Cause, CauseModel, Effect, Harmonics, RunView, Words};
use crate::simulation::machine::Machine;
use giotto_shared::term::Term;
use giotto_shared::{Axis, Plane};

/// See the module.
pub struct BandwidthMismatch;

const WORDS: Words = Words {
    id: "bandwidth_mismatch",
    name: "bandwidth mismatch",
    unit: "s^2",
    what: "an oval along the axes that grows with the centripetal acceleration and is the same in both directions: one axis shrinks more than the other",
    usual: "unequal acceleration filters or resonances of the two axes",
    adjust: "match the acceleration and jerk filters of the axes",
    never_told_from: &[],
    next: "circles at the highest safe speed, or a frequency response of each axis",
    not_compensable: None,
};

impl CauseModel for BandwidthMismatch {
    fn cause(&self) -> Cause {
        Cause::BandwidthMismatch
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn harmonics(&self, _axis: Option<Axis>, _shape: &[f64], view: &RunView) -> Option<Harmonics> {
        let size = -0.25 * view.radius_m * view.omega_rad_s.powi(2) * view.gain;
        Some(Harmonics::wave(2, [size, 0.0]))
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        machine.split_bandwidth(effect.value);
    }

    fn term(&self, effect: &Effect) -> Option<Term<f64>> {
        Some(Term::BandwidthMismatch {
            plane: Plane::Xy,
            delta_kappa2_s2: effect.value,
        })
    }
}
