//! An effect as a model file holds it, and what it is refused for.
use super::{Cause, Effect, EffectError, Seat, Site};
use crate::toml_file::{TomlFileError, TomlText};
use giotto_shared::{Actuator, Plane};
use serde::{Deserialize, Serialize, Serializer};
use std::collections::BTreeMap;

/// An `[[effect]]` table, unchecked.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WrittenEffect {
    cause: Cause,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    axis: Option<Actuator>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    across: Option<Actuator>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    plane: Option<Plane>,
    value: f64,
    #[serde(default)]
    ci95: [f64; 2],
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    params: BTreeMap<String, toml::Value>,
}

/// What is wrong with one, and at which key.
#[derive(Debug)]
pub struct EffectFault {
    key: Vec<String>,
    what: String,
    expected: String,
    /// Whether the key is there.
    there: bool,
}

impl EffectFault {
    fn missing(key: &str, cause: Cause, expected: &str) -> Self {
        Self {
            key: vec![key.to_owned()],
            what: format!("{}: `{key}` is missing", cause.id()),
            expected: expected.to_owned(),
            there: false,
        }
    }

    fn wrong(key: &[&str], found: impl ToString, expected: impl ToString) -> Self {
        Self {
            key: key.iter().map(|k| (*k).to_owned()).collect(),
            what: found.to_string(),
            expected: expected.to_string(),
            there: true,
        }
    }

    /// As the refusal of effect `index` of a file.
    pub fn at(self, text: &TomlText, index: usize) -> TomlFileError {
        let index = index.to_string();
        let mut path = vec!["effect", index.as_str()];
        path.extend(self.key.iter().map(String::as_str));
        if self.there {
            text.value_error(&path, self.what, self.expected)
        } else {
            text.missed(&path, self.what, self.expected)
        }
    }
}

impl WrittenEffect {
    /// Checks it. `flat`: a file that knows no planes, whose pairs are X and Y.
    ///
    /// # Errors
    /// The first thing that is missing, unknown or impossible.
    pub fn checked(self, flat: bool) -> Result<Effect, EffectFault> {
        let [lo, hi] = self.ci95;
        for (at, bound) in [("0", lo), ("1", hi)] {
            if !bound.is_finite() {
                return Err(EffectFault::wrong(&["ci95", at], bound, "a finite number"));
            }
        }
        if lo > hi {
            let found = format!("[{lo}, {hi}]");
            return Err(EffectFault::wrong(&["ci95"], found, "lower end first"));
        }
        let site = self.site(flat)?;
        let mut given = Vec::with_capacity(self.params.len());
        for (name, value) in &self.params {
            let number = match value {
                toml::Value::Float(number) => *number,
                toml::Value::Integer(number) => *number as f64,
                other => {
                    let found = format!("{} ({})", other, other.type_str());
                    return Err(EffectFault::wrong(&["params", name], found, "a number"));
                }
            };
            given.push((name.as_str(), number));
        }
        Effect::new(self.cause, site, self.value, self.ci95, given).map_err(|error| match error {
            EffectError::Missing { name, expected, .. } => EffectFault {
                key: vec!["params".to_owned(), name.to_owned()],
                what: format!("{}: `{name}` is missing", self.cause.id()),
                expected,
                there: false,
            },
            EffectError::Unknown { name, expected, .. } => EffectFault {
                what: format!("{}: unknown parameter `{name}`", self.cause.id()),
                key: vec!["params".to_owned(), name],
                expected,
                there: false,
            },
            EffectError::Range {
                name: "value",
                value,
                expected,
                ..
            } => EffectFault::wrong(&["value"], value, expected),
            EffectError::Range {
                name,
                value,
                expected,
                ..
            } => EffectFault::wrong(&["params", name], value, expected),
            EffectError::Site { expected, .. } => {
                EffectFault::missing("axis", self.cause, expected)
            }
        })
    }

    fn site(&self, flat: bool) -> Result<Site, EffectFault> {
        const SLIDES: &str = "\"x\", \"y\" or \"z\"";
        const JOINTS: &str = "\"joint1\" to \"joint6\"";
        let seat = self.cause.model().seat();
        let unused = |key: &'static str, there: bool, takes: bool| {
            let words = format!("not for {}", self.cause.id());
            match there && !takes {
                true => Err(EffectFault::wrong(&[key], "given", words)),
                false => Ok(()),
            }
        };
        let named = !matches!(seat, Seat::Machine | Seat::Pair);
        unused("axis", self.axis.is_some(), named)?;
        unused("across", self.across.is_some(), seat == Seat::Across)?;
        unused(
            "plane",
            self.plane.is_some(),
            matches!(seat, Seat::Pair | Seat::PairOrJoint),
        )?;
        let axis = || {
            let missing = || EffectFault::missing("axis", self.cause, SLIDES);
            self.axis.ok_or_else(missing)
        };
        Ok(match seat {
            Seat::Machine => Site::Machine,
            Seat::One => Site::One(axis()?),
            Seat::MachineOrOne | Seat::MachineOrJoint => self.axis.map_or(Site::Machine, Site::One),
            Seat::Joint => match self.axis {
                Some(joint) => Site::One(joint),
                None => return Err(EffectFault::missing("axis", self.cause, JOINTS)),
            },
            Seat::PairOrJoint if self.axis.is_some() => self.axis.map_or(Site::Machine, Site::One),
            Seat::Pair | Seat::PairOrJoint => match (self.plane, flat) {
                (Some(plane), _) => Site::Pair(plane),
                (None, true) => Site::Pair(Plane::Xy),
                (None, false) => {
                    let planes = "\"xy\", \"yz\" or \"zx\"";
                    return Err(EffectFault::missing("plane", self.cause, planes));
                }
            },
            Seat::Across => {
                let axis = axis()?;
                let other = match (self.across, axis, flat) {
                    (Some(other), ..) => other,
                    (None, Actuator::X, true) => Actuator::Y,
                    (None, Actuator::Y, true) => Actuator::X,
                    _ => return Err(EffectFault::missing("across", self.cause, SLIDES)),
                };
                if Plane::of(axis, other).is_none() {
                    return Err(EffectFault::wrong(
                        &["across"],
                        other,
                        "another slide than the axis",
                    ));
                }
                Site::Across(axis, other)
            }
        })
    }
}

impl Serialize for Effect {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let site = self.site();
        let written = WrittenEffect {
            cause: self.cause(),
            axis: site.axis(),
            across: match site {
                Site::Across(_, other) => Some(other),
                _ => None,
            },
            plane: match site {
                Site::Pair(plane) => Some(plane),
                _ => None,
            },
            value: self.value(),
            ci95: self.ci95(),
            params: self
                .parameters()
                .iter()
                .map(|(name, value)| (name.to_owned(), toml::Value::Float(value)))
                .collect(),
        };
        written.serialize(serializer)
    }
}
