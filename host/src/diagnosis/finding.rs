//! What is reported of a cause.
use super::status::Status;
use crate::causes::remedy::spoken;
use crate::causes::{Cause, Effect};
use giotto_shared::Actuator;
use serde::Serialize;
use std::collections::BTreeMap;

/// An estimate with its 95 % interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Value in the contract's unit.
    pub value: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
    /// The contract's unit.
    pub unit: &'static str,
}

/// The largest thing that a cause does to a circle of the campaign.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Largest {
    /// Largest deviation, µm.
    pub max: f64,
    /// On a circle of this radius, mm …
    pub radius_mm: f64,
    /// … at this feed, mm/s.
    pub feed_mm_s: f64,
}

/// One cause, found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// Name in the closed list.
    pub cause: Cause,
    /// The actuator it is named by, or nothing.
    pub axis: Option<Actuator>,
    /// All actuators that it concerns: one, or two for a pair.
    pub actuators: Vec<Actuator>,
    /// Probability that it is there rather than the best explanation without it.
    pub probability: f64,
    /// How large.
    pub estimate: Estimate,
    /// How sure it is, in a class.
    pub status: Status,
    /// The largest thing it does to these circles.
    pub effect_um: Largest,
    /// What to set right, and on which side.
    pub remedy: String,
    /// Share of the baseline's explainable misfit, %.
    pub share_percent: f64,
    /// Root mean square over all samples of what it does to the circles, µm.
    pub rms_um: f64,
    /// What these data, or circles at all, cannot tell from it.
    pub indistinguishable_from: Vec<String>,
    /// Whether the controller can correct it.
    pub compensable: bool,
    /// The measurement that would make sure.
    pub next_measurement: String,
    /// What else the data say of it, in words.
    pub note: Option<String>,
    /// Further parameters (pitch, time constants), units in the names.
    pub params: BTreeMap<String, f64>,
    /// The same as entries of a model.
    #[serde(skip)]
    pub effects: Vec<Effect>,
}

impl Finding {
    /// Where it is, for a person: `x`, `x y` for a pair; nothing for the machine as a whole.
    pub fn place(&self) -> String {
        let names: Vec<&str> = self.actuators.iter().map(|a| a.name()).collect();
        names.join(" ")
    }

    /// Its name with its place, for a person: `backlash of X`, `servo mismatch of X and Y`, `joint zero of joint 2`.
    pub fn title(&self) -> String {
        let name = self.cause.model().words().name;
        let places: Vec<String> = self.actuators.iter().map(|a| spoken(a.name())).collect();
        if places.is_empty() {
            name.to_owned()
        } else {
            format!("{name} of {}", places.join(" and "))
        }
    }
}

/// What is left that matches nothing in the list.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Unexplained {
    /// Whether there is anything.
    pub present: bool,
    /// Its root mean square over all samples, µm.
    pub rms_um: f64,
    /// What it looks like.
    pub signature: Signature,
}

/// Description of an effect without a name.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Signature {
    /// Waves a turn, if it is a harmonic (0: the size).
    pub harmonic: Option<usize>,
    /// `even`, `odd` (flips with the direction).
    pub direction_parity: Option<&'static str>,
    /// Exponent of the feed.
    pub feed_exponent: Option<f64>,
    /// Exponent of the radius.
    pub radius_exponent: Option<f64>,
    /// Polar angle, if it sits at one place, degrees.
    pub angle_deg: Option<f64>,
    /// When in the campaign, if it depends on that.
    pub when: Option<String>,
    /// In words.
    pub words: Vec<String>,
}
