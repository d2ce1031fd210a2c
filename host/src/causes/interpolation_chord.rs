//! Set-points every Δt joined by chords: scallops of period Δt, as deep as f²Δt²/(8R) before the servo smooths them.
use super::{Amplitude, Cause, CauseModel, Effect, Evidence, Parameter, Words};
use crate::simulation::machine::Machine;

/// See the module.
pub struct InterpolationChord;

const WORDS: Words = Words {
    id: "interpolation_chord",
    name: "interpolation chord",
    unit: "s",
    what: "the controller issues too few set-points: the circle is a polygon whose sides last a fixed time",
    usual: "a slow interpolation cycle, points from a CAM program or a network at a low rate",
    adjust: "raise the set-point rate or switch on the fine interpolator of the drive",
    positive: "the path is a polygon with a set-point every {size}: shorten the cycle of the interpolator",
    negative: "the path is a polygon with a set-point every {size}: shorten the cycle of the interpolator",
    elsewhere: None,
    never_told_from: &[],
    next: "the same circle at half the speed: the scallops shrink to a quarter, their period in time stays",
    not_compensable: Some("it arises in the interpolator behind the correction"),
};

/// Longest set-point period, s: the slowest controllers and stream protocols give 20 to 30 set-points a second. A longer
/// ripple is not made by set-points.
const LONGEST_S: f64 = 0.05;
/// In the contract's unit.
const SIZE: Parameter = Parameter::needed(
    "value",
    [1e-5, 1.0],
    "s: from 100 kHz to one set-point a second",
);

/// Amplitude of the tone, µm: what the circles show; the controller does not use it.
const AMPLITUDE_UM: Parameter = Parameter::optional(
    "amplitude_um",
    [0.0, 1e4],
    0.0,
    "amplitude along the radius",
);
/// Frequency of the scallops, Hz: 1/Δt.
const FREQUENCY_HZ: Parameter =
    Parameter::optional("frequency_hz", [0.0, 1e5], 0.0, "set-points a second");

impl CauseModel for InterpolationChord {
    fn cause(&self) -> Cause {
        Cause::InterpolationChord
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn size(&self) -> &'static Parameter {
        &SIZE
    }

    fn evidence(&self) -> Evidence {
        Evidence::Tone(Amplitude::Centripetal)
    }

    fn of_frequency(&self, hz: f64, se_hz: f64) -> [f64; 2] {
        let period = 1.0 / hz;
        [period, 2.0 * se_hz * period * period]
    }

    fn allows(&self, period_s: f64) -> bool {
        period_s > 0.0 && period_s <= LONGEST_S
    }

    fn parameters(&self) -> &'static [&'static Parameter] {
        &[&AMPLITUDE_UM, &FREQUENCY_HZ]
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        machine.interpolation_s = Some(effect.value());
    }
}
