//! What `diagnose` said, in the words of the contract's JSON.
use serde_json::Value;

/// One entry of `findings`.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Cause.
    pub cause: String,
    /// `x`, `y` or none.
    pub axis: Option<String>,
    /// Stated probability.
    pub probability: f64,
    /// Estimate, in `unit`.
    pub value: f64,
    /// Its 95 % interval.
    pub ci95: [f64; 2],
    /// Unit.
    pub unit: String,
    /// Causes that cannot be told from it.
    pub indistinguishable_from: Vec<String>,
}

/// The answer of `diagnose`.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Outcome {
    /// Findings in order of share.
    pub findings: Vec<Finding>,
    /// `unexplained.present`.
    pub unexplained: bool,
    /// Baseline on runs left out, rms, µm.
    pub baseline_um: f64,
    /// Extended simulation on runs left out, rms, µm.
    pub extended_um: f64,
}

impl Outcome {
    /// Reads the contract's JSON; `None` where a field is missing or of another kind.
    pub fn from_json(json: &Value) -> Option<Self> {
        let findings = json.get("findings")?.as_array()?.iter().map(finding).collect::<Option<Vec<_>>>()?;
        Some(Self {
            findings,
            unexplained: json.pointer("/unexplained/present")?.as_bool()?,
            baseline_um: json.pointer("/baseline/heldout_rms_um")?.as_f64()?,
            extended_um: json.pointer("/extended/heldout_rms_um")?.as_f64()?,
        })
    }
}

fn finding(json: &Value) -> Option<Finding> {
    let estimate = json.get("estimate")?;
    let ci = estimate.get("ci95")?.as_array()?;
    Some(Finding {
        cause: json.get("cause")?.as_str()?.to_owned(),
        axis: json.get("axis")?.as_str().map(str::to_owned),
        probability: json.get("probability")?.as_f64()?,
        value: estimate.get("value")?.as_f64()?,
        // An interval may be open.
        ci95: [
            ci.first()?.as_f64().unwrap_or(f64::NEG_INFINITY),
            ci.get(1)?.as_f64().unwrap_or(f64::INFINITY),
        ],
        unit: estimate.get("unit")?.as_str()?.to_owned(),
        indistinguishable_from: json
            .get("indistinguishable_from")?
            .as_array()?
            .iter()
            .filter_map(|v| v.as_str().map(str::to_owned))
            .collect(),
    })
}
