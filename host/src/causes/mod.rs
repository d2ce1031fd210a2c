//! Causes: one file each. A cause knows its signature in measured circles, its element in the
//! simulation, its inverse if it has one, and the words for a person. Causes know nothing of each other.
//!
//! To add a cause: write its file, name its module and add one line to the list of `register`.
pub mod arm;
mod backlash;
mod bandwidth_mismatch;
mod cyclic_error;
mod feed_clamp;
mod harmonics;
mod higher_order_dynamics;
mod interpolation_chord;
mod joint_backlash;
mod joint_cyclic_error;
mod joint_lag_mismatch;
mod joint_reversal;
mod joint_zero;
mod lateral_play;
mod link_length;
mod motion;
mod parameter;
mod radius_offset;
pub mod remedy;
mod reversal_spike;
mod scale_error;
mod scale_mismatch;
mod servo_mismatch;
mod site;
mod squareness;
mod stick_slip;
mod straightness;
mod thermal_drift;
mod vibration;
mod words;
mod written;

pub use harmonics::{Harmonics, ORDERS};
pub use motion::{RunView, Stroke};
pub use parameter::{Effect, EffectError, Parameter, Parameters};
pub use site::{Seat, Site};
pub use words::Words;
pub(crate) use written::WrittenEffect;

use crate::simulation::machine::Machine;
use giotto_shared::term::Term;
use serde::{Deserialize, Serialize};

/// Makes [`Cause`] and [`ALL`] from one list, in the order of the contract.
macro_rules! register {
    ($($file:ident::$name:ident),* $(,)?) => {
        /// The closed list of the contract.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
        #[serde(rename_all = "snake_case")]
        #[allow(missing_docs, reason = "each cause is documented in its own file")]
        #[non_exhaustive]
        pub enum Cause { $($name),* }

        /// Every cause with what is known of it, in the order of the contract.
        pub const ALL: &[&dyn CauseModel] = &[$(&$file::$name),*];
    };
}

register! {
    higher_order_dynamics::HigherOrderDynamics,
    radius_offset::RadiusOffset,
    scale_error::ScaleError,
    scale_mismatch::ScaleMismatch,
    squareness::Squareness,
    servo_mismatch::ServoMismatch,
    bandwidth_mismatch::BandwidthMismatch,
    backlash::Backlash,
    lateral_play::LateralPlay,
    reversal_spike::ReversalSpike,
    cyclic_error::CyclicError,
    straightness::Straightness,
    vibration::Vibration,
    interpolation_chord::InterpolationChord,
    feed_clamp::FeedClamp,
    thermal_drift::ThermalDrift,
    stick_slip::StickSlip,
    joint_lag_mismatch::JointLagMismatch,
    joint_reversal::JointReversal,
    joint_backlash::JointBacklash,
    joint_cyclic_error::JointCyclicError,
    joint_zero::JointZero,
    link_length::LinkLength,
}

impl Cause {
    /// What is known of this cause.
    pub fn model(self) -> &'static dyn CauseModel {
        // Both come of one list, so the index is in range.
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

/// How the amplitude of a tone follows the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Amplitude {
    /// The same at every speed: a structure that swings.
    Constant,
    /// ∝ f²/R: the height of a chord's arc, an interpolator.
    Centripetal,
}

impl Amplitude {
    /// The other law.
    pub const fn other(self) -> Self {
        match self {
            Self::Constant => Self::Centripetal,
            Self::Centripetal => Self::Constant,
        }
    }
}

/// The cause that shows by this evidence, which one cause at most has.
pub fn shown_by(evidence: Evidence) -> Option<&'static dyn CauseModel> {
    ALL.iter()
        .copied()
        .find(|model| model.evidence() == evidence)
}

/// The cause that is the fourth order of the response which all axes share.
pub fn of_response() -> Option<&'static dyn CauseModel> {
    ALL.iter().copied().find(|model| model.is_response())
}

/// How the search looks for a cause.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Evidence {
    /// The same deviation at the same place of every run: a signature linear in the value.
    Signature,
    /// Periodic in time, with a phase of its own in each run and an amplitude that follows a law.
    Tone(Amplitude),
    /// The measured duration of the turn.
    Duration,
    /// Power near reversals without a fixed phase.
    Roughness,
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

    /// What kind of place it sits at.
    fn seat(&self) -> Seat {
        Seat::Machine
    }

    /// The sites that these runs can tell of.
    fn sites(&self, views: &[RunView]) -> Vec<Site> {
        self.seat().sites(views)
    }

    /// Its size in the contract's unit: what a real machine can have.
    fn size(&self) -> &'static Parameter;

    /// Its further numbers in a model file.
    fn parameters(&self) -> &'static [&'static Parameter] {
        &[]
    }

    /// Its further numbers from what was fitted.
    fn stated(&self, _fit: &Fitted<'_>) -> Vec<(&'static Parameter, f64)> {
        Vec::new()
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

    /// Whether it can have such a value beside these causes on the same actuator.
    fn allows_beside(&self, value: f64, _others: &[Cause]) -> bool {
        self.allows(value)
    }

    /// Whether it makes a step or teeth where its actuator turns round: a short pulse there looks like their shoulder.
    fn makes_steps(&self) -> bool {
        false
    }

    /// Whether it can take on the form of other things: beside much that is unexplained it needs to be larger.
    fn flexible(&self) -> bool {
        !self.shape_names().is_empty()
    }

    /// The class of causes that circles at one place cannot tell from each other: one of it is stated, the others beside it.
    fn class(&self) -> Option<&'static str> {
        None
    }

    /// Whether it is how one joint differs from the mean of all: of two joints, what is one's is the other's as well.
    fn is_mutual(&self) -> bool {
        false
    }

    /// Where it is periodic in the turn of a joint: the lowest and highest ratio that these runs can show.
    fn ratios(&self, _views: &[RunView], _joint: usize) -> Option<[f64; 2]> {
        None
    }

    /// Number of linear columns: 2 where the phase of the signature is free.
    fn columns(&self) -> usize {
        1
    }

    /// A signature that is nothing but a mean and a few waves of ψ, m per unit of the contract's value.
    fn harmonics(&self, _site: Site, _shape: &[f64], _view: &RunView) -> Option<Harmonics> {
        None
    }

    /// Radial deviation in m per unit of the contract's value, at each sample of the run.
    fn signature(
        &self,
        site: Site,
        shape: &[f64],
        _column: usize,
        view: &RunView,
        out: &mut [f64],
    ) {
        let waves = self.harmonics(site, shape, view).unwrap_or_default();
        for (out, psi) in out.iter_mut().zip(view.psi_rad.iter()) {
            *out = waves.at(*psi);
        }
    }

    /// All its columns in one go.
    fn signatures(&self, site: Site, shape: &[f64], view: &RunView, out: &mut [&mut [f64]]) {
        for (column, out) in out.iter_mut().enumerate() {
            self.signature(site, shape, column, view, out);
        }
    }

    /// Standard error of the closed form itself, as a share of the value: a perfect measurement would still be
    /// this uncertain. Measured against machines that move in the time domain.
    fn relative_doubt(&self) -> f64 {
        0.002
    }

    /// Puts the effect into a simulated machine.
    fn apply(&self, effect: &Effect, machine: &mut Machine);

    /// Whether it is the fourth order of the response that all axes share: it is refined with that response and stands in a
    /// model's servo law, not beside it.
    fn is_response(&self) -> bool {
        false
    }

    /// Where its first shape parameter is a period in place, found by a spectrum: the finest wave looked for, 1/m.
    fn finest_wave_per_m(&self, _views: &[RunView]) -> Option<f64> {
        None
    }

    /// Of a cause that shows as a tone: its value and half the 95 % interval, from frequency and standard error in Hz.
    fn of_frequency(&self, hz: f64, se_hz: f64) -> [f64; 2] {
        [hz, 2.0 * se_hz]
    }

    /// Whether the controller can correct it: by a term, or by κ4 of the chain.
    fn is_compensable(&self, effect: &Effect) -> bool {
        self.term(effect).is_some()
            || self.joint_term(effect, &ArmChain::ANY).is_some()
            || self.kappa4_s4(effect).is_some()
    }

    /// What it adds to κ4 of the chain of all axes, s⁴, where a table corrects it so.
    fn kappa4_s4(&self, _effect: &Effect) -> Option<f64> {
        None
    }

    /// The term that the controller can correct; `None`: not compensable, see the words.
    fn term(&self, _effect: &Effect) -> Option<Term<f64>> {
        None
    }

    /// The same of a joint, where the controller is told the arm.
    fn joint_term(&self, _effect: &Effect, _arm: &ArmChain) -> Option<Term<f64>> {
        None
    }
}

/// What all joints of an arm have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmChain {
    /// How many turn.
    pub turning: usize,
    /// Time constant of their loops, s; 0 where it is not known.
    pub lag_s: f64,
    /// Whether it is known from where zeros and lengths are counted.
    pub placed: bool,
}

impl ArmChain {
    /// For asking whether there is a term at all.
    pub(crate) const ANY: Self = Self {
        turning: 6,
        lag_s: 0.0,
        placed: true,
    };
}

/// What a fit says of a cause beside its size.
#[derive(Clone, Copy, Debug)]
pub struct Fitted<'a> {
    /// Where it sits.
    pub site: Site,
    /// Shape parameters, in the order of the cause's names.
    pub shape: &'a [f64],
    /// Amount of each of its columns.
    pub amounts: &'a [f64],
    /// The runs.
    pub first_view: &'a RunView,
}

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
