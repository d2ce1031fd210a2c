//! A tone of fixed frequency: order 2πR·f0/f, which moves over the circle with speed and radius.
use super::{Amplitude, Cause, CauseModel, Effect, Evidence, Parameter, Seat, Words};
use crate::simulation::machine::Machine;
use crate::simulation::machine::Vibration as Tone;

/// See the module.
pub struct Vibration;

const WORDS: Words = Words {
    id: "vibration",
    name: "vibration",
    unit: "Hz",
    what: "a ripple of fixed frequency in time: its number of waves on the circle changes with the speed",
    usual: "a structural resonance excited by the motion, a motor or a neighbour machine",
    adjust: "stiffen or damp the structure; keep accelerations below those that excite it; set a notch filter",
    positive: "something swings at {size}: find it with a shaker or an accelerometer; stiffen or damp it, or keep the speed from it",
    negative: "something swings at {size}: find it with a shaker or an accelerometer; stiffen or damp it, or keep the speed from it",
    elsewhere: None,
    never_told_from: &[],
    next: "an accelerometer on the tool, with the drives on and at rest",
    not_compensable: Some("it is faster than the position loop and its phase is not known"),
};

/// In the contract's unit.
const SIZE: Parameter = Parameter::needed("value", [1e-3, 1e5], "Hz");

/// Amplitude of the tone, µm: what the circles show; the controller does not use it.
const AMPLITUDE_UM: Parameter = Parameter::optional(
    "amplitude_um",
    [0.0, 1e4],
    0.0,
    "amplitude along the radius",
);
/// The same number once more, as the tone was found.
const FREQUENCY_HZ: Parameter =
    Parameter::optional("frequency_hz", [0.0, 1e5], 0.0, "frequency of the tone");
/// Phase at the start of the campaign: new in each run of a real machine.
const PHASE_RAD: Parameter = Parameter::optional(
    "phase_rad",
    [-6.3, 6.3],
    0.0,
    "phase at the start of the campaign",
);

impl CauseModel for Vibration {
    fn cause(&self) -> Cause {
        Cause::Vibration
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn size(&self) -> &'static Parameter {
        &SIZE
    }

    fn seat(&self) -> Seat {
        Seat::MachineOrOne
    }

    fn evidence(&self) -> Evidence {
        Evidence::Tone(Amplitude::Constant)
    }

    fn parameters(&self) -> &'static [&'static Parameter] {
        &[&AMPLITUDE_UM, &FREQUENCY_HZ, &PHASE_RAD]
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        machine.vibration = Some(Tone {
            frequency_hz: effect.value(),
            amplitude_m: effect.get(&AMPLITUDE_UM) * 1e-6,
            phase_rad: effect.get(&PHASE_RAD),
        });
    }
}
