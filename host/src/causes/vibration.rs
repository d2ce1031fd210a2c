//! A tone of fixed frequency: order 2πR·f0/f, which moves over the circle with speed and radius.
use super::{Cause, CauseModel, Effect, Evidence, Words};
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
    never_told_from: &[],
    next: "an accelerometer on the tool, with the drives on and at rest",
    not_compensable: Some("it is faster than the position loop and its phase is not known"),
};

impl CauseModel for Vibration {
    fn cause(&self) -> Cause {
        Cause::Vibration
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn evidence(&self) -> Evidence {
        Evidence::Tone
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        machine.vibration = Some(Tone {
            frequency_hz: effect.value,
            amplitude_m: effect.param("amplitude_um", 0.0) * 1e-6,
            phase_rad: effect.param("phase_rad", 0.0),
        });
    }
}
