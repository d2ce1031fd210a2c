//! Numbers of an effect beside its size. Each cause declares its own; what is missing, misspelt or absurd is refused
//! where it is read, and no correction invents one.
use super::{Cause, Site};
use std::collections::BTreeMap;

/// A number that a cause may carry, in the unit that its name ends with.
#[derive(Debug)]
pub struct Parameter {
    /// Name in files, with its unit.
    pub name: &'static str,
    /// Smallest and largest possible value.
    pub range: [f64; 2],
    /// What it is, and where its range comes from.
    pub what: &'static str,
    /// Value where a file leaves it out: only for what no correction uses.
    pub otherwise: Option<f64>,
}

impl Parameter {
    /// One that has to be there.
    pub const fn needed(name: &'static str, range: [f64; 2], what: &'static str) -> Self {
        Self {
            name,
            range,
            what,
            otherwise: None,
        }
    }

    /// One that a file may leave out, since no correction uses it.
    pub const fn optional(
        name: &'static str,
        range: [f64; 2],
        otherwise: f64,
        what: &'static str,
    ) -> Self {
        Self {
            name,
            range,
            what,
            otherwise: Some(otherwise),
        }
    }

    fn allows(&self, value: f64) -> bool {
        let [lowest, highest] = self.range;
        value >= lowest && value <= highest
    }

    /// The range in words.
    pub fn expected(&self) -> String {
        let [lowest, highest] = self.range;
        format!("{lowest} to {highest}")
    }
}

/// Why numbers are not an effect of a cause.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EffectError {
    /// A parameter that the cause needs.
    #[error("{cause}: `{name}` is missing; expected {expected}")]
    Missing {
        /// The cause.
        cause: &'static str,
        /// The parameter.
        name: &'static str,
        /// What it may be.
        expected: String,
    },
    /// A parameter that the cause does not have.
    #[error("{cause}: `{name}` is not a parameter of it; expected {expected}")]
    Unknown {
        /// The cause.
        cause: &'static str,
        /// The name as given.
        name: String,
        /// The names it has.
        expected: String,
    },
    /// A number that it cannot be.
    #[error("{cause}: `{name}` is {value}; expected {expected}")]
    Range {
        /// The cause.
        cause: &'static str,
        /// The parameter, or `value`.
        name: &'static str,
        /// The number.
        value: f64,
        /// What it may be.
        expected: String,
    },
    /// A place where the cause cannot be.
    #[error("{cause}: it cannot sit there; expected {expected}")]
    Site {
        /// The cause.
        cause: &'static str,
        /// Where it can.
        expected: &'static str,
    },
}

/// Checked parameters of one effect.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parameters(BTreeMap<&'static str, f64>);

impl Parameters {
    /// Checks named numbers against what the cause declares.
    ///
    /// # Errors
    /// [`EffectError::Missing`], [`EffectError::Unknown`], [`EffectError::Range`] (NaN included).
    pub fn new<'a>(
        cause: Cause,
        given: impl IntoIterator<Item = (&'a str, f64)>,
    ) -> Result<Self, EffectError> {
        let declared = cause.model().parameters();
        let id = cause.id();
        let mut out = BTreeMap::new();
        for (name, value) in given {
            let Some(parameter) = declared.iter().find(|p| p.name == name) else {
                let names: Vec<&str> = declared.iter().map(|p| p.name).collect();
                let expected = if names.is_empty() {
                    "none".to_owned()
                } else {
                    names.join(", ")
                };
                return Err(EffectError::Unknown {
                    cause: id,
                    name: name.to_owned(),
                    expected,
                });
            };
            if !parameter.allows(value) {
                return Err(EffectError::Range {
                    cause: id,
                    name: parameter.name,
                    value,
                    expected: parameter.expected(),
                });
            }
            out.insert(parameter.name, value);
        }
        for parameter in declared {
            match (out.contains_key(parameter.name), parameter.otherwise) {
                (true, _) => {}
                (false, Some(value)) => {
                    out.insert(parameter.name, value);
                }
                (false, None) => {
                    return Err(EffectError::Missing {
                        cause: id,
                        name: parameter.name,
                        expected: parameter.expected(),
                    });
                }
            }
        }
        Ok(Self(out))
    }

    /// The number of a parameter that the cause declares; NaN for one of another cause.
    pub fn get(&self, parameter: &Parameter) -> f64 {
        self.0.get(parameter.name).copied().unwrap_or(f64::NAN)
    }

    /// Names and numbers, by name.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, f64)> {
        self.0.iter().map(|(name, value)| (*name, *value))
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// A cause with its size: an entry of an extended model. It holds every number that its cause needs.
///
/// ```
/// use giotto::causes::{Cause, Effect, EffectError, Site};
/// use giotto_shared::Actuator;
///
/// let cause = Cause::from_id("cyclic_error").unwrap();
/// let on_z = Site::One(Actuator::Z);
/// let full = [("pitch_mm", 10.0), ("phase_rad", 0.5)];
/// assert_eq!(Effect::new(cause, on_z, 2.0, [1.8, 2.2], full)?.value(), 2.0);
/// // Nothing is invented: a missing parameter is refused.
/// assert!(Effect::new(cause, on_z, 2.0, [1.8, 2.2], []).is_err());
/// # Ok::<(), EffectError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    cause: Cause,
    site: Site,
    value: f64,
    ci95: [f64; 2],
    parameters: Parameters,
}

impl Effect {
    /// Checks the place, the size and the parameters of an effect.
    ///
    /// # Errors
    /// [`EffectError`]: a place that the cause cannot have, a size or parameter beyond its physical range, a parameter
    /// that is missing or unknown.
    pub fn new<'a>(
        cause: Cause,
        site: Site,
        value: f64,
        ci95: [f64; 2],
        parameters: impl IntoIterator<Item = (&'a str, f64)>,
    ) -> Result<Self, EffectError> {
        let model = cause.model();
        if !model.seat().takes(site) {
            return Err(EffectError::Site {
                cause: cause.id(),
                expected: match model.seat() {
                    super::Seat::Machine => "no axis",
                    super::Seat::One => "an axis",
                    super::Seat::MachineOrOne => "an axis or none",
                    super::Seat::Pair => "a plane",
                    super::Seat::Across => "an axis and the one that shifts",
                    super::Seat::Joint => "a joint",
                    super::Seat::MachineOrJoint => "a joint or no axis",
                    super::Seat::PairOrJoint => "a plane or a joint",
                },
            });
        }
        let size = model.size();
        if !size.allows(value) {
            return Err(EffectError::Range {
                cause: cause.id(),
                name: "value",
                value,
                expected: size.expected(),
            });
        }
        Ok(Self {
            cause,
            site,
            value,
            ci95,
            parameters: Parameters::new(cause, parameters)?,
        })
    }

    /// Which cause.
    pub const fn cause(&self) -> Cause {
        self.cause
    }

    /// Where it sits.
    pub const fn site(&self) -> Site {
        self.site
    }

    /// Size in the contract's unit for this cause.
    pub const fn value(&self) -> f64 {
        self.value
    }

    /// 95 % interval of the size.
    pub const fn ci95(&self) -> [f64; 2] {
        self.ci95
    }

    /// Its further numbers.
    pub const fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// One of them.
    pub fn get(&self, parameter: &Parameter) -> f64 {
        self.parameters.get(parameter)
    }
}
