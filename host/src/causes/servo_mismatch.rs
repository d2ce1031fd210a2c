//! One axis lags more than the other: `r = d·½fΔτ·sin2ψ`.
//!
//! With loops of unequal gain the response differs by −jωΔτ·G², so that the oval is turned by the lag φ once
//! more and shrunk by |G|²: `d·½fΔτ|G|²·sin(2ψ − dφ)`. With unequal dead times it is not. The shape parameter
//! `turned` (1 or 0) is that choice.
use super::{Bend, Cause, CauseModel, Effect, Harmonics, RunView, Words};
use crate::simulation::machine::Machine;
use giotto_shared::term::Term;
use giotto_shared::{Axis, Plane};

/// See the module.
pub struct ServoMismatch;

const WORDS: Words = Words {
    id: "servo_mismatch",
    name: "servo mismatch",
    unit: "s",
    what: "an oval at 45° that grows with the speed and flips with the direction: one axis follows later than the other",
    usual: "unequal position gains (kv) or velocity feed-forward of the two axes, unequal dead times",
    adjust: "match kv of the axes: raise that of the axis that lags",
    never_told_from: &["dead_time_mismatch"],
    next: "a straight line at 45° at several speeds, forth and back: no circle can tell a gain from a dead time",
    not_compensable: None,
};

impl CauseModel for ServoMismatch {
    fn cause(&self) -> Cause {
        Cause::ServoMismatch
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn shape_names(&self) -> &'static [&'static str] {
        &["turned"]
    }

    fn shapes(&self, _views: &[RunView]) -> Vec<Vec<f64>> {
        vec![vec![1.0], vec![0.0]]
    }

    fn bend(&self, _which: usize, turned: f64, _travel_m: f64) -> Bend {
        Bend::Choice(1.0 - turned)
    }

    fn harmonics(&self, _axis: Option<Axis>, shape: &[f64], view: &RunView) -> Option<Harmonics> {
        let turned = shape.first().copied().unwrap_or(1.0);
        let size = 0.5 * view.sign * view.feed_m_s * (1.0 + turned * (view.gain * view.gain - 1.0));
        // sin(2ψ − turn)
        let (sin, cos) = (turned * view.sign * view.lag_rad).sin_cos();
        Some(Harmonics::wave(2, [-size * sin, size * cos]))
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        if effect.param("turned", 1.0) > 0.5 {
            machine.split_lag(effect.value);
        } else {
            machine.split_dead_time(effect.value);
        }
    }

    fn term(&self, effect: &Effect) -> Option<Term<f64>> {
        Some(Term::ServoMismatch {
            plane: Plane::Xy,
            delta_tau_s: effect.value,
        })
    }
}
