//! What `diagnose` said, in the words of the contract's JSON.
use giotto::diagnosis::{Options, diagnose};
use giotto::model_file::ModelFile;
use serde_json::Value;
use std::path::Path;

/// One entry of `findings`.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Cause.
    pub cause: String,
    /// What it sits on: `actuators`, or `axis` where there is no such field.
    pub actuators: Vec<String>,
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
    /// Flashing is recommended.
    pub flash: bool,
    /// Files of the runs that were left out.
    pub left_out: Vec<String>,
}

impl Outcome {
    /// Diagnoses the campaign in `dir`, with its `model.toml` if there is one, through the contract's JSON.
    pub fn of(dir: &Path) -> Result<Self, String> {
        // As the command does: the odd run whose file contradicts its label is left out and named.
        let manifest = giotto::campaign::Manifest::open(dir).map_err(|e| e.to_string())?;
        let (campaign, _, mislabelled) = manifest.read_labelled().map_err(|e| e.to_string())?;
        let model = dir.join("model.toml");
        let model = if model.exists() {
            Some(ModelFile::load(&model).map_err(|e| e.to_string())?)
        } else {
            None
        };
        let diagnosis = diagnose(
            &campaign,
            &Options {
                model,
                ..Options::default()
            },
        )
        .map_err(|e| e.to_string())?;
        let json = serde_json::to_value(&diagnosis).map_err(|e| e.to_string())?;
        let mut outcome =
            Self::from_json(&json).ok_or_else(|| format!("not as the contract has it: {json}"))?;
        outcome
            .left_out
            .extend(mislabelled.into_iter().map(|run| run.file));
        Ok(outcome)
    }

    /// Reads the contract's JSON; `None` where a field is missing or of another kind.
    pub fn from_json(json: &Value) -> Option<Self> {
        let findings = json
            .get("findings")?
            .as_array()?
            .iter()
            .map(finding)
            .collect::<Option<Vec<_>>>()?;
        Some(Self {
            findings,
            unexplained: json.pointer("/unexplained/present")?.as_bool()?,
            baseline_um: json.pointer("/baseline/heldout_rms_um")?.as_f64()?,
            extended_um: json.pointer("/extended/heldout_rms_um")?.as_f64()?,
            flash: json
                .pointer("/recommendation/action")
                .is_some_and(|action| action == "flash"),
            left_out: json
                .get("left_out")
                .and_then(Value::as_array)
                .into_iter()
                .flatten()
                .filter_map(|run| run.get("file")?.as_str().map(str::to_owned))
                .collect(),
        })
    }
}

fn finding(json: &Value) -> Option<Finding> {
    let estimate = json.get("estimate")?;
    let ci = estimate.get("ci95")?.as_array()?;
    Some(Finding {
        cause: json.get("cause")?.as_str()?.to_owned(),
        actuators: match json.get("actuators") {
            Some(list) => list
                .as_array()?
                .iter()
                .map(|a| a.as_str().map(str::to_owned))
                .collect::<Option<_>>()?,
            None => json
                .get("axis")?
                .as_str()
                .map(str::to_owned)
                .into_iter()
                .collect(),
        },
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
