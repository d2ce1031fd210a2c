//! Growth with campaign time: `r = R·α·ΔT(t)`, `ΔT` linear in time (shape `curvature` 0) or
//! settling: `(1 − e^{−ct})/(1 − e^{−c})`, `c` the campaign in time constants.
use super::{Bend, Cause, CauseModel, Effect, Fitted, Harmonics, Parameter, RunView, Site, Words};
use crate::simulation::machine::Machine;

/// See the module.
pub struct ThermalDrift;

const WORDS: Words = Words {
    id: "thermal_drift",
    name: "thermal drift",
    unit: "um/m over the campaign",
    what: "the circles change size while the campaign lasts, whatever their speed and direction",
    usual: "warming of drives, screws and the hall",
    adjust: "warm up before measuring; measure in random order with a repeated reference run",
    positive: "circles grew by {size}: warm up longer before measuring or working, or compensate for the temperature",
    negative: "circles shrank by {size}: warm up longer before measuring or working, or compensate for the temperature",
    elsewhere: None,
    never_told_from: &[],
    next: "repeat the first run now and again: only time can have changed it",
    not_compensable: Some("it changes with time, and the controller does not know the temperature"),
};

/// In the contract's unit.
const SIZE: Parameter = Parameter::needed("value", [-1e5, 1e5], "µm/m over the campaign");

/// Time constant as a share of the campaign.
const SETTLING: Parameter = Parameter::optional(
    "settling",
    [0.0, 1e3],
    0.0,
    "time constant as a share of the campaign; 0: it grows evenly",
);
/// Length of the campaign.
const CAMPAIGN_S: Parameter = Parameter::optional(
    "campaign_s",
    [1.0, 1e9],
    3600.0,
    "time from the first run to the last",
);

impl CauseModel for ThermalDrift {
    fn cause(&self) -> Cause {
        Cause::ThermalDrift
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn size(&self) -> &'static Parameter {
        &SIZE
    }

    fn parameters(&self) -> &'static [&'static Parameter] {
        &[&SETTLING, &CAMPAIGN_S]
    }

    fn stated(&self, fit: &Fitted<'_>) -> Vec<(&'static Parameter, f64)> {
        let curvature = fit.shape.first().filter(|curvature| **curvature > 1e-3);
        vec![
            (
                &SETTLING,
                curvature.map_or(0.0, |curvature| curvature.recip()),
            ),
            (&CAMPAIGN_S, fit.first_view.campaign_s),
        ]
    }

    fn shape_names(&self) -> &'static [&'static str] {
        &["curvature"]
    }

    fn shapes(&self, views: &[RunView]) -> Vec<Vec<f64>> {
        // All runs at one time: nothing can drift.
        let spread = views
            .iter()
            .any(|view| (view.elapsed - views[0].elapsed).abs() > 1e-9);
        if spread {
            [0.0, 2.0, 5.0].map(|curvature| vec![curvature]).to_vec()
        } else {
            Vec::new()
        }
    }

    fn bend(&self, _which: usize, _value: f64, _travel_m: f64) -> Bend {
        Bend::Amount(0.1)
    }

    fn tidy(&self, shape: &mut [f64]) {
        shape
            .iter_mut()
            .for_each(|value| *value = value.clamp(0.0, SETTLED));
    }

    fn harmonics(&self, _site: Site, shape: &[f64], view: &RunView) -> Option<Harmonics> {
        let growth = growth(shape.first().copied().unwrap_or(0.0), view.elapsed);
        Some(Harmonics::mean(1e-6 * view.radius_m * growth))
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        let (campaign_s, settling) = (effect.get(&CAMPAIGN_S), effect.get(&SETTLING));
        // Slope at the start of what reaches `value` at the end of the campaign.
        let steeper = if settling > 0.0 {
            1.0 / (settling * (1.0 - (-1.0 / settling).exp()))
        } else {
            1.0
        };
        machine.thermal_per_s = effect.value() * 1e-6 * steeper / campaign_s;
        machine.thermal_settling_s = settling * campaign_s;
    }
}

/// Most time constants to a campaign: with more, it is a machine of another size that was cold in the first runs.
const SETTLED: f64 = 5.0;

/// Growth after a share of the campaign, 0 at the start and 1 at its end; what would grow ever faster is taken as linear.
fn growth(curvature: f64, elapsed: f64) -> f64 {
    if curvature > 1e-3 {
        (-curvature * elapsed).exp_m1() / (-curvature).exp_m1()
    } else {
        elapsed
    }
}
