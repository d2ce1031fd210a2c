//! Set-points every Δt joined by chords: scallops of period Δt, as deep as f²Δt²/(8R) before the servo smooths them.
use super::{Cause, CauseModel, Effect, Evidence, Words};
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
    never_told_from: &[],
    next: "the same circle at half the speed: the scallops shrink to a quarter, their period in time stays",
    not_compensable: Some("it arises in the interpolator behind the correction"),
};

/// Longest set-point period, s: the slowest controllers and stream protocols give 20 to 30 set-points a second. A longer
/// ripple is not made by set-points.
const LONGEST_S: f64 = 0.05;

impl CauseModel for InterpolationChord {
    fn cause(&self) -> Cause {
        Cause::InterpolationChord
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn evidence(&self) -> Evidence {
        Evidence::Tone
    }

    fn allows(&self, period_s: f64) -> bool {
        period_s > 0.0 && period_s <= LONGEST_S
    }

    fn apply(&self, effect: &Effect, machine: &mut Machine) {
        machine.interpolation_s = Some(effect.value);
    }
}
