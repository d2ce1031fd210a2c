//! One axis lags more than the other: `r = d·½fΔτ·sin2ψ`.
//!
//! With loops of unequal gain the response differs by −jωΔτ·G², so that the oval is turned by the lag φ once
//! more and shrunk by |G|²: `d·½fΔτ|G|²·sin(2ψ − dφ)`. With unequal dead times it is not. The shape parameter
//! `turned` (1 or 0) is that choice.
use super::{
    Bend, Cause, CauseModel, Effect, Fitted, Harmonics, Parameter, RunView, Seat, Site, Words,
};
use crate::simulation::machine::Machine;
use giotto_shared::term::Term;

/// See the module.
pub struct ServoMismatch;

const WORDS: Words = Words {
    id: "servo_mismatch",
    name: "servo mismatch",
    unit: "s",
    what: "an oval at 45° that grows with the speed and flips with the direction: one axis follows later than the other",
    usual: "unequal position gains (kv) or velocity feed-forward of the two axes, unequal dead times",
    adjust: "match kv of the axes: raise that of the axis that lags",
    positive: "{a} follows {size} later than {b}: raise kv of {a}, or lower that of {b}",
    negative: "{b} follows {size} later than {a}: raise kv of {b}, or lower that of {a}",
    elsewhere: None,
    never_told_from: &["dead_time_mismatch"],
    next: "a straight line at 45° at several speeds, forth and back: no circle can tell a gain from a dead time",
    not_compensable: None,
};

/// In the contract's unit.
const SIZE: Parameter =
    Parameter::needed("value", [-0.02, 0.02], "s: as much as a table may correct");

/// Whether the loops' gains differ (1) or their dead times (0).
const TURNED: Parameter = Parameter::optional(
    "turned",
    [0.0, 1.0],
    1.0,
    "1: unequal gains of the loops, 0: unequal dead times",
);

impl CauseModel for ServoMismatch {
    fn cause(&self) -> Cause {
        Cause::ServoMismatch
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

    fn parameters(&self) -> &'static [&'static Parameter] {
        &[&TURNED]
    }

    fn stated(&self, fit: &Fitted<'_>) -> Vec<(&'static Parameter, f64)> {
        let turned = fit.shape.first().copied();
        turned.map(|turned| (&TURNED, turned)).into_iter().collect()
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

    fn harmonics(&self, site: Site, shape: &[f64], view: &RunView) -> Option<Harmonics> {
        let Site::Pair(plane) = site else { return None };
        let turned = shape.first().copied().unwrap_or(1.0);
        let shrunk = 1.0 + turned * (view.gain * view.gain - 1.0);
        let late_rad = turned * view.sign * view.lag_rad;
        let [first, second] = plane.axes().map(|axis| {
            view.cosine(axis)
                .product(&view.velocity(axis).seen_from(late_rad))
        });
        Some(first.minus(&second).times(-0.5 * view.feed_m_s * shrunk))
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        let Site::Pair(plane) = effect.site() else {
            return;
        };
        if effect.get(&TURNED) > 0.5 {
            machine.split_lag(plane, effect.value());
        } else {
            machine.split_dead_time(plane, effect.value());
        }
    }

    fn term(&self, effect: &Effect) -> Option<Term<f64>> {
        let Site::Pair(plane) = effect.site() else {
            return None;
        };
        Some(Term::ServoMismatch {
            plane,
            delta_tau_s: effect.value(),
        })
    }
}
