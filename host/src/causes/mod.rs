//! Causes: one file each. A cause knows its signature in measured circles, its element in the
//! simulation, its inverse if it has one, and the words for a person. Causes know nothing of each other.
use giotto_shared::Axis;
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
