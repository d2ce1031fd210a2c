//! Growth with campaign time: `r = R·α·ΔT(t)`, taken linear in time or settling (shape `settling`: time constant as a share of the campaign).
use super::{Cause, CauseModel, Effect, RunView, Words};
use crate::simulation::machine::Machine;
use giotto_shared::Axis;

/// See the module.
pub struct ThermalDrift;

const WORDS: Words = Words {
    id: "thermal_drift",
    name: "thermal drift",
    unit: "um/m over the campaign",
    what: "the circles change size while the campaign lasts, whatever their speed and direction",
    usual: "warming of drives, screws and the hall",
    adjust: "warm up before measuring; measure in random order with a repeated reference run",
    never_told_from: &[],
    next: "repeat the first run now and again: only time can have changed it",
    not_compensable: Some("it changes with time, and the controller does not know the temperature"),
};

impl CauseModel for ThermalDrift {
    fn cause(&self) -> Cause {
        Cause::ThermalDrift
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn shape_names(&self) -> &'static [&'static str] {
        &["settling"]
    }

    fn shapes(&self, views: &[RunView]) -> Vec<Vec<f64>> {
        // All runs at one time: nothing can drift.
        let spread = views.iter().any(|view| (view.elapsed - views[0].elapsed).abs() > 1e-9);
        if spread { [f64::INFINITY, 0.5, 0.2].map(|share| vec![share]).to_vec() } else { Vec::new() }
    }

    fn signature(&self, _axis: Option<Axis>, shape: &[f64], _column: usize, view: &RunView, out: &mut [f64]) {
        out.fill(
            1e-6 * view.radius_m * growth(shape.first().copied().unwrap_or(f64::INFINITY), view.elapsed),
        );
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        let campaign_s = effect.param("campaign_s", 3600.0);
        let settling = effect.param("settling", 0.0);
        // Slope at the start of what reaches `value` at the end of the campaign.
        let steeper = if settling > 0.0 { 1.0 / (settling * (1.0 - (-1.0 / settling).exp())) } else { 1.0 };
        machine.thermal_per_s = effect.value * 1e-6 * steeper / campaign_s;
        machine.thermal_settling_s = settling * campaign_s;
    }
}

/// Growth after a share of the campaign, 0 at the start and 1 at its end.
fn growth(settling: f64, elapsed: f64) -> f64 {
    if settling.is_finite() {
        (1.0 - (-elapsed / settling).exp()) / (1.0 - (-1.0 / settling).exp())
    } else {
        elapsed
    }
}
