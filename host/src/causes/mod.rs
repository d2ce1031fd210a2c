//! Causes: one file each. A cause knows its signature in measured circles, its element in the
//! simulation, its inverse if it has one, and the words for a person. Causes know nothing of each other.
//!
//! To add a cause: write its file, add it to [`Cause`] and to [`ALL`].
mod backlash;
mod bandwidth_mismatch;
pub mod cyclic_error;
mod feed_clamp;
mod harmonics;
mod higher_order_dynamics;
mod interpolation_chord;
mod joint_lag_mismatch;
mod joint_reversal;
mod lateral_play;
mod radius_offset;
mod reversal_spike;
mod scale_error;
mod scale_mismatch;
mod servo_mismatch;
mod squareness;
mod stick_slip;
mod straightness;
mod thermal_drift;
mod vibration;
mod view;
mod words;

pub use harmonics::{Harmonics, ORDERS};
pub use view::{RunView, Stroke};
pub use words::Words;

use crate::simulation::machine::Machine;
use giotto_shared::Axis;
use giotto_shared::term::Term;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The closed list of the contract.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs, reason = "each cause is documented in its own file")]
pub enum Cause {
    HigherOrderDynamics,
    RadiusOffset,
    ScaleError,
    ScaleMismatch,
    Squareness,
    ServoMismatch,
    BandwidthMismatch,
    Backlash,
    LateralPlay,
    ReversalSpike,
    CyclicError,
    Straightness,
    Vibration,
    InterpolationChord,
    FeedClamp,
    ThermalDrift,
    StickSlip,
    JointLagMismatch,
    JointReversal,
}

/// Every cause with what is known of it, in the order of the contract.
pub const ALL: [&dyn CauseModel; 19] = [
    &higher_order_dynamics::HigherOrderDynamics,
    &radius_offset::RadiusOffset,
    &scale_error::ScaleError,
    &scale_mismatch::ScaleMismatch,
    &squareness::Squareness,
    &servo_mismatch::ServoMismatch,
    &bandwidth_mismatch::BandwidthMismatch,
    &backlash::Backlash,
    &lateral_play::LateralPlay,
    &reversal_spike::ReversalSpike,
    &cyclic_error::CyclicError,
    &straightness::Straightness,
    &vibration::Vibration,
    &interpolation_chord::InterpolationChord,
    &feed_clamp::FeedClamp,
    &thermal_drift::ThermalDrift,
    &stick_slip::StickSlip,
    &joint_lag_mismatch::JointLagMismatch,
    &joint_reversal::JointReversal,
];

impl Cause {
    /// What is known of this cause.
    pub fn model(self) -> &'static dyn CauseModel {
        // ALL is in the order of the enum (asserted by a test), so the index is in range.
        ALL[self as usize]
    }

    /// Name in files and JSON.
    pub fn id(self) -> &'static str {
        self.model().words().id
    }

    /// The cause of this name in files and JSON.
    pub fn from_id(id: &str) -> Option<Self> {
        ALL.iter()
            .find(|model| model.words().id == id)
            .map(|model| model.cause())
    }
}

/// A cause with its fitted size: an entry of an extended model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Effect {
    /// Which cause.
    pub cause: Cause,
    /// Where, if it belongs to one axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<Axis>,
    /// Size in the contract's unit for this cause.
    pub value: f64,
    /// 95 % interval of `value`.
    #[serde(default)]
    pub ci95: [f64; 2],
    /// Further parameters by name, unit in the name (`pitch_mm`, `decay_s`, `phase_rad`, …).
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub params: BTreeMap<String, f64>,
}

impl Effect {
    /// A further parameter, or what the cause assumes without it.
    pub fn param(&self, name: &str, otherwise: f64) -> f64 {
        self.params.get(name).copied().unwrap_or(otherwise)
    }
}

/// How the search looks for a cause.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Evidence {
    /// The same deviation at the same place of every run: a signature linear in the value.
    Signature,
    /// Periodic in time, with a phase of its own in each run.
    Tone,
    /// The measured duration of the turn.
    Duration,
    /// Power near reversals without a fixed phase.
    Roughness,
    /// Not looked for in two-axis data.
    NotLooked,
}

/// How a shape parameter moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bend {
    /// Smoothly: a step that changes the signature by a few percent.
    Amount(f64),
    /// By choice: the other value.
    Choice(f64),
    /// In jerks: it has no slope to climb.
    Stiff,
}

/// What a cause has to say for itself.
pub trait CauseModel: Sync {
    /// Its name in the list.
    fn cause(&self) -> Cause;

    /// Words for a person.
    fn words(&self) -> &'static Words;

    /// How it shows.
    fn evidence(&self) -> Evidence {
        Evidence::Signature
    }

    /// Where it can sit: `[None]` for the machine as a whole, or each axis.
    fn axes(&self) -> &'static [Option<Axis>] {
        &[None]
    }

    /// Names of the parameters that bend the signature (time constants, pitch, …).
    fn shape_names(&self) -> &'static [&'static str] {
        &[]
    }

    /// Starting points for the shape parameters, over the runs at hand.
    fn shapes(&self, _views: &[RunView]) -> Vec<Vec<f64>> {
        vec![Vec::new()]
    }

    /// How shape parameter `which` moves from `value`. `travel_m` is the diameter of the largest circle.
    fn bend(&self, _which: usize, _value: f64, _travel_m: f64) -> Bend {
        Bend::Stiff
    }

    /// Brings shape parameters back to where they mean something.
    fn tidy(&self, _shape: &mut [f64]) {}

    /// Whether a value (in the contract's unit) is one that the cause can have at all.
    fn allows(&self, value: f64) -> bool {
        value.is_finite()
    }

    /// Number of linear columns: 2 where the phase of the signature is free.
    fn columns(&self) -> usize {
        1
    }

    /// A signature that is nothing but a mean and a few waves of ψ, m per unit of the contract's value.
    fn harmonics(&self, _axis: Option<Axis>, _shape: &[f64], _view: &RunView) -> Option<Harmonics> {
        None
    }

    /// Radial deviation in m per unit of the contract's value, at each sample of the run.
    fn signature(
        &self,
        axis: Option<Axis>,
        shape: &[f64],
        _column: usize,
        view: &RunView,
        out: &mut [f64],
    ) {
        let waves = self.harmonics(axis, shape, view).unwrap_or_default();
        for (out, psi) in out.iter_mut().zip(view.psi_rad.iter()) {
            *out = waves.at(*psi);
        }
    }

    /// All its columns in one go.
    fn signatures(
        &self,
        axis: Option<Axis>,
        shape: &[f64],
        view: &RunView,
        out: &mut [&mut [f64]],
    ) {
        for (column, out) in out.iter_mut().enumerate() {
            self.signature(axis, shape, column, view, out);
        }
    }

    /// Standard error of the closed form itself, as a share of the value: a perfect measurement would still be
    /// this uncertain. Measured against machines that move in the time domain.
    fn relative_doubt(&self) -> f64 {
        0.002
    }

    /// Puts the effect into a simulated machine.
    fn apply(&self, effect: &Effect, machine: &mut Machine);

    /// The term that the controller can correct; `None`: not compensable, see the words.
    fn term(&self, _effect: &Effect) -> Option<Term<f64>> {
        None
    }
}

/// Both axes, for causes that sit on one.
pub(crate) const EACH_AXIS: &[Option<Axis>] = &[Some(Axis::X), Some(Axis::Y)];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_is_in_the_order_of_the_enum_and_names_are_those_of_serde() {
        for (index, model) in ALL.iter().enumerate() {
            assert_eq!(model.cause() as usize, index, "{}", model.words().id);
            let id = serde_json::to_value(model.cause()).unwrap();
            assert_eq!(id, model.words().id);
            assert_eq!(Cause::from_id(model.words().id), Some(model.cause()));
        }
    }
}
