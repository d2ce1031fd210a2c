//! Response that one servo lag cannot give: the paper's f⁴/R³ (Eq. 15).
//!
//! (R/Rm)² = 1 + κ2 ω² + b ω⁴ is exact for a lag (b = 0) and for a second-order response (b = 1/ωn⁴), so the
//! signature is taken there; the value is β2 beyond the lag's own 3κ2²/8: −b/2.
use super::{Cause, CauseModel, Effect, Harmonics, Parameter, RunView, Site, Words};
use crate::simulation::machine::Machine;

/// See the module.
pub struct HigherOrderDynamics;

const WORDS: Words = Words {
    id: "higher_order_dynamics",
    name: "higher-order dynamics",
    unit: "s^4",
    what: "the size of the circles does not follow the square of the speed alone: the chain behind the command is not one servo lag",
    usual: "flexible joints or drives, a loop tuned with little damping, filters in series",
    adjust: "use the extended model; if the gain may be changed, raise the damping or lower the acceleration of small fast circles",
    // Of the size at lower speeds, not of a lag: circles that grow with speed have none.
    positive: "at the highest speeds circles come out larger than their size at lower speeds foretells: the machine swings out; lower \
                   the feed-forward, or the jerk and acceleration of the path",
    negative: "at the highest speeds circles come out smaller than their size at lower speeds foretells: shorten the acceleration \
                   filters, or raise the damping of the loop",
    elsewhere: None,
    never_told_from: &[],
    next: "smaller radii at the highest safe speed, and a step or line test with an accelerometer",
    not_compensable: None,
};

/// In the contract's unit.
const SIZE: Parameter = Parameter::needed("value", [-1e-3, 1e-3], "s⁴: a resonance at 5 rad/s");

impl CauseModel for HigherOrderDynamics {
    fn cause(&self) -> Cause {
        Cause::HigherOrderDynamics
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn size(&self) -> &'static Parameter {
        &SIZE
    }

    fn harmonics(&self, _site: Site, _shape: &[f64], view: &RunView) -> Option<Harmonics> {
        if let Some(arm) = &view.arm {
            return Some(arm.per_beta2);
        }
        let (r, w) = (view.radius_m, view.omega_rad_s);
        Some(Harmonics::mean(r * w.powi(4) * view.gain.powi(3)))
    }

    fn is_response(&self) -> bool {
        true
    }

    /// κ4 = 24β2 − 3κ2².
    fn kappa4_s4(&self, effect: &Effect) -> Option<f64> {
        Some(24.0 * effect.value())
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        machine.add_beta2(effect.value());
    }
}
