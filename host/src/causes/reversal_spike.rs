//! Friction turns its sign where an axis reverses, and the loop needs time to follow: an outward pulse after
//! the reversal (inward where a friction compensation is set too high), `r = A·p(t)·|cosψ|` for X, `|sinψ|` for Y.
//!
//! The friction does not jump: over a presliding travel x0 it goes as 1 − 2e^{−x/x0} (Dahl; LuGre without a
//! Stribeck dip, doi 10.1109/9.376053). The loop answers a step of it with e^{−t/decay} − e^{−t/rise}, scaled
//! to peak 1. At high acceleration the pulse keeps its height and duration; at very low speed it is smeared.
use super::{Bend, Cause, CauseModel, Effect, Fitted, Parameter, RunView, Seat, Site, Words};
use crate::simulation::machine::Machine;
use giotto_shared::term::Term;

/// See the module.
pub struct ReversalSpike;

const WORDS: Words = Words {
    id: "reversal_spike",
    name: "reversal spike",
    unit: "um",
    what: "a short spike just after an axis turns round, of the same height at every speed: outward by friction, inward where its compensation is set too high",
    usual: "friction of guides and drives against a loop that integrates slowly",
    adjust: "lubricate; raise the integral gain; set the friction (quadrant) compensation of that axis",
    positive: "{a} lags by up to {size} just after it turns back: raise its friction compensation by {size}, or lubricate the guide",
    negative: "{a} is pushed {size} too far after it turns back: lower its friction compensation by {size}",
    elsewhere: None,
    never_told_from: &[],
    next: "the same circle slower and faster: the spike keeps its height and its duration in time",
    not_compensable: None,
};

/// Decay of the loop's answer, s: from the fastest current-bound drives to an integral time that no one would keep.
const DECAYS_S: [f64; 2] = [5e-4, 0.4];
/// Shortest rise, s: the cycle of a fast position loop.
const SHORTEST_RISE_S: f64 = 5e-5;
/// Presliding travel of guides and gears, m: ball tracks to wound-up drives.
const PRESLIDINGS_M: [f64; 2] = [1e-8, 5e-4];
/// In the contract's unit.
const SIZE: Parameter =
    Parameter::needed("value", [-1e4, 1e4], "µm: a table corrects 5 mm at most");

/// Time constant of the decay.
const DECAY_S: Parameter = Parameter::needed(
    "decay_s",
    [1e-3, 1.0],
    "time constant with which the loop takes the pulse away; a table takes 1 ms to 1 s",
);
/// Time constant of the rise.
const RISE_S: Parameter = Parameter::optional(
    "rise_s",
    [0.0, 1.0],
    0.002,
    "time constant of the rise, shorter than the decay; the controller does not use it",
);
/// Travel over which friction turns its sign.
const PRESLIDING_M: Parameter = Parameter::optional(
    "presliding_m",
    [0.0, 0.01],
    0.0,
    "travel over which friction turns its sign; the controller does not use it",
);

impl CauseModel for ReversalSpike {
    fn cause(&self) -> Cause {
        Cause::ReversalSpike
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn size(&self) -> &'static Parameter {
        &SIZE
    }

    fn seat(&self) -> Seat {
        Seat::One
    }

    fn parameters(&self) -> &'static [&'static Parameter] {
        &[&DECAY_S, &RISE_S, &PRESLIDING_M]
    }

    fn stated(&self, fit: &Fitted<'_>) -> Vec<(&'static Parameter, f64)> {
        match fit.shape {
            &[decay_s, rise_s, presliding_m] => vec![
                (&DECAY_S, decay_s),
                (&RISE_S, rise_s),
                (&PRESLIDING_M, presliding_m),
            ],
            _ => Vec::new(),
        }
    }

    fn shape_names(&self) -> &'static [&'static str] {
        &["decay_s", "rise_s", "presliding_m"]
    }

    fn shapes(&self, _views: &[RunView]) -> Vec<Vec<f64>> {
        let mut shapes = Vec::new();
        for decay in [0.006, 0.015, 0.04, 0.1] {
            for rise in [0.15, 0.6] {
                for presliding in [2e-6, 3e-5] {
                    shapes.push(vec![decay, rise * decay, presliding]);
                }
            }
        }
        shapes
    }

    fn bend(&self, _which: usize, value: f64, _travel_m: f64) -> Bend {
        Bend::Amount(0.05 * value)
    }

    fn tidy(&self, shape: &mut [f64]) {
        let [decay_s, rise_s, presliding_m] = shape else {
            return;
        };
        *decay_s = decay_s.abs().clamp(DECAYS_S[0], DECAYS_S[1]);
        *rise_s = rise_s.abs().clamp(SHORTEST_RISE_S, *decay_s);
        *presliding_m = presliding_m.abs().clamp(PRESLIDINGS_M[0], PRESLIDINGS_M[1]);
    }

    /// Friction opposes the new direction: the spike is outward. An inward one is a compensation that is set too high, unless
    /// the actuator has play or sticks: then it is the shoulder of that step for the most part.
    fn allows_beside(&self, peak_um: f64, others: &[Cause]) -> bool {
        peak_um > 0.0 || !others.iter().any(|other| other.model().makes_steps())
    }

    fn signature(
        &self,
        site: Site,
        shape: &[f64],
        _column: usize,
        view: &RunView,
        out: &mut [f64],
    ) {
        let (&[decay_s, rise_s, presliding_m], Site::One(axis)) = (shape, site) else {
            return;
        };
        let reach_m = view.radius_m * view.swing(axis);
        let pulse = Pulse::new(decay_s, rise_s, presliding_m, reach_m, view);
        let steps_a_half_turn = view.half_turn_s() / pulse.step_s;
        for (out, stroke) in out.iter_mut().zip(view.strokes_of(axis)) {
            // Against the new direction of travel, seen along the radius.
            *out = 1e-6 * stroke.facing * pulse.after(stroke.share * steps_a_half_turn);
        }
    }

    /// The height of a spike hangs on the shape of its rise, which differs from friction law to friction law.
    fn relative_doubt(&self) -> f64 {
        0.02
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        let Site::One(axis) = effect.site() else {
            return;
        };
        let mut friction = machine.friction[axis.index()].unwrap_or_default();
        friction.peak_m += effect.value() * 1e-6;
        friction.decay_s = effect.get(&DECAY_S);
        friction.rise_s = effect.get(&RISE_S);
        friction.presliding_m = effect.get(&PRESLIDING_M);
        machine.friction[axis.index()] = Some(friction);
    }

    fn term(&self, effect: &Effect) -> Option<Term<f64>> {
        let Site::One(actuator) = effect.site() else {
            return None;
        };
        Some(Term::ReversalSpike {
            actuator,
            peak_m: effect.value() * 1e-6,
            decay_s: effect.get(&DECAY_S),
        })
    }
}

/// Time after which a pulse is over, s: the loop's answer, and the time to slide five presliding lengths, x = ½(f²/R)t².
fn ending_s(decay_s: f64, presliding_m: f64, reach_m: f64, omega_rad_s: f64) -> f64 {
    14.0 * decay_s + (10.0 * presliding_m / reach_m).sqrt() / omega_rad_s
}

/// Steps of the tabulated pulse.
const STEPS: usize = 300;
/// Presliding lengths after which the friction has turned to the last bit.
const SLID: f64 = 38.0;

/// The pulse after a reversal of one run, tabulated; it changes sign from one reversal to the next.
pub(super) struct Pulse {
    step_s: f64,
    values: [f64; STEPS + 1],
}

impl Pulse {
    fn new(decay_s: f64, rise_s: f64, presliding_m: f64, reach_m: f64, view: &RunView) -> Self {
        let decay_s = decay_s.abs().max(1e-4);
        let rise_s = rise_s.abs().clamp(1e-5, 0.95 * decay_s);
        let presliding_m = presliding_m.abs().max(1e-8);
        let half_turn_s = view.half_turn_s();
        let end_s = ending_s(decay_s, presliding_m, reach_m, view.omega_rad_s).min(half_turn_s);
        // Where pulses overlap, the one before is still dying away with the other sign.
        let passes = if end_s < half_turn_s { 1 } else { 3 };
        let times = [decay_s, rise_s];
        Self::tabulated(
            times,
            [presliding_m, reach_m],
            view.omega_rad_s,
            end_s,
            passes,
        )
    }

    /// The pulse after one reversal, to its end; `reach` is the travel's second derivative over ω² there, in the unit of the
    /// presliding travel.
    pub(super) fn alone([decay_s, rise_s, presliding]: [f64; 3], reach: f64, omega: f64) -> Self {
        let decay_s = decay_s.abs().max(1e-4);
        let rise_s = rise_s.abs().clamp(1e-5, 0.95 * decay_s);
        let presliding = presliding.abs().max(1e-8);
        let end_s = ending_s(decay_s, presliding, reach, omega);
        Self::tabulated([decay_s, rise_s], [presliding, reach], omega, end_s, 1)
    }

    /// Value so many seconds after the reversal.
    pub(super) fn at(&self, since_s: f64) -> f64 {
        self.after(since_s / self.step_s)
    }

    fn tabulated(
        [decay_s, rise_s]: [f64; 2],
        [presliding_m, reach_m]: [f64; 2],
        omega_rad_s: f64,
        end_s: f64,
        passes: usize,
    ) -> Self {
        let step_s = end_s / STEPS as f64;
        let peak_s = (decay_s / rise_s).ln() * decay_s * rise_s / (decay_s - rise_s);
        let peak = (-peak_s / decay_s).exp() - (-peak_s / rise_s).exp();
        let keep = [decay_s, rise_s].map(|tau| (-step_s / tau).exp());
        // A change of friction spread evenly over a step.
        let take = [decay_s, rise_s].map(|tau| tau / step_s * (1.0 - (-step_s / tau).exp()));
        let mut friction_steps = [0.0; STEPS];
        let mut before = -1.0;
        let (turn_sin, turn_cos) = (omega_rad_s * step_s).sin_cos();
        let (mut sin, mut cos) = (0.0, 1.0);
        for slot in &mut friction_steps {
            (cos, sin) = (
                cos * turn_cos - sin * turn_sin,
                sin * turn_cos + cos * turn_sin,
            );
            let travel = reach_m * (1.0 - cos);
            if travel > SLID * presliding_m {
                *slot = 1.0 - before;
                break;
            }
            let friction = 1.0 - 2.0 * (-travel / presliding_m).exp();
            *slot = friction - before;
            before = friction;
        }
        let mut values = [0.0; STEPS + 1];
        let mut state = [0.0; 2];
        for _ in 0..passes {
            state = state.map(|x: f64| -x);
            values[0] = 0.5 * (state[0] - state[1]) / peak;
            for (k, change) in friction_steps.iter().enumerate() {
                for i in 0..2 {
                    state[i] = keep[i] * state[i] + take[i] * change;
                }
                values[k + 1] = 0.5 * (state[0] - state[1]) / peak;
            }
        }
        Self { step_s, values }
    }

    /// Value so many steps after the reversal, linear in between; the error is below 1 % of the peak.
    fn after(&self, steps: f64) -> f64 {
        let k = steps as usize;
        match self.values.get(k..k + 2) {
            Some([this, next]) => this + (steps - k as f64) * (next - this),
            _ => 0.0,
        }
    }
}
