//! `MODEL.toml`: what `fit` and `diagnose` write and what `simulate`, `table` and `flash` read.
use crate::causes::{Effect, WrittenEffect};
use crate::kinematics::{Fault as KinematicsFault, Kinematics, WrittenKinematics};
use crate::toml_file::{TomlFileError, TomlProblem, TomlText};
use giotto_shared::model::{Cumulants, Element, RadiusModel, Response};
use serde::{Deserialize, Serialize, Serializer};
use std::path::Path;

/// Version of the file format written by this build.
pub const FORMAT: u32 = 2;
/// The format before planes: its pairs are X and Y.
const FLAT_FORMAT: u32 = 1;

const EXPECTED: &str = "a model as `giotto fit -o` and `giotto diagnose -o` write it";

/// A model of one machine.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelFile {
    /// Format version, [`FORMAT`]; files of format 1 are read too.
    pub format: u32,
    /// Name of the campaign it was fitted on.
    pub campaign: String,
    /// Machine, as the campaign names it.
    pub machine: String,
    /// Delay of the machine behind its command, s, where a diagnosis could tell it: dead time on top of the servo's own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub delay_s: Option<f64>,
    /// The radius law.
    pub servo: Servo,
    /// Where it was fitted: the table's bounds.
    pub valid: Valid,
    /// The arm, if the machine is one.
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "written")]
    pub kinematics: Option<Kinematics>,
    /// What diagnosis added, in order of share.
    #[serde(rename = "effect", skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<Effect>,
}

/// The same as it is written, before its effects are checked.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    format: u32,
    campaign: String,
    machine: String,
    delay_s: Option<f64>,
    servo: Servo,
    valid: Valid,
    kinematics: Option<WrittenKinematics>,
    #[serde(default, rename = "effect")]
    effects: Vec<WrittenEffect>,
}

/// The axis-matched servo response.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Servo {
    /// The paper's empirical model, Eq. 15.
    Beta {
        /// β1, s².
        beta1_s2: f64,
        /// β2, s⁴.
        beta2_s4: f64,
        /// Half-widths of the 95 % intervals, s² and s⁴.
        #[serde(default)]
        half_width95: [f64; 2],
    },
    /// One position loop 1/(1 + s/kv), exactly (Eq. 14 at low ω).
    Lag {
        /// kv, 1/s.
        kv_per_s: f64,
    },
    /// Second-order response.
    SecondOrder {
        /// ωn, rad/s.
        omega_n_rad_s: f64,
        /// ζ.
        zeta: f64,
    },
}

impl Servo {
    /// The element that it names; `None` for the paper's model, which names none.
    pub fn element(&self) -> Option<Element<f64>> {
        match *self {
            Self::Beta { .. } => None,
            Self::Lag { kv_per_s } => Some(Element::Lag { kv_per_s }),
            Self::SecondOrder {
                omega_n_rad_s,
                zeta,
            } => Some(Element::SecondOrder {
                omega_n_rad_s,
                zeta,
            }),
        }
    }

    /// κ2 and κ4.
    pub fn cumulants(&self) -> Cumulants<f64> {
        match self.element() {
            Some(element) => element.cumulants(),
            None => Cumulants::from(self.beta()),
        }
    }

    /// The same as 1 + aω² + bω⁴, which a diagnosis refines.
    pub fn response(&self) -> Response<f64> {
        self.element()
            .and_then(|element| Response::of(&element))
            .unwrap_or_else(|| Response::from(self.beta()))
    }

    /// The coefficients of Eq. 15.
    pub fn beta(&self) -> RadiusModel<f64> {
        match *self {
            Self::Beta {
                beta1_s2, beta2_s4, ..
            } => RadiusModel { beta1_s2, beta2_s4 },
            Self::Lag { .. } | Self::SecondOrder { .. } => RadiusModel::from(self.cumulants()),
        }
    }
}

/// Ranges that the fit has seen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Valid {
    /// Smallest and largest radius, mm.
    pub radius_mm: [f64; 2],
    /// Smallest and largest feed, mm/s.
    pub feed_mm_s: [f64; 2],
    /// Middle of the circles in the base of an arm, mm: from there the zeros and lengths of a table are counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre_mm: Option<[f64; 3]>,
}

impl ModelFile {
    /// Reads and checks a model.
    ///
    /// # Errors
    /// Whatever keeps the file from being used, with file, line and column.
    pub fn load(file: &Path) -> Result<Self, TomlFileError> {
        Self::of_text(&TomlText::read(file, EXPECTED)?)
    }

    /// As [`Self::load`], of a text; `file` is the name it goes by in errors.
    ///
    /// # Errors
    /// As [`Self::load`].
    ///
    /// ```
    /// use giotto::model_file::ModelFile;
    /// use std::path::Path;
    ///
    /// let text = "format = 2\ncampaign = \"lab\"\nmachine = \"mill\"\n\
    ///             [servo]\nkind = \"lag\"\nkv_per_s = 50.0\n\
    ///             [valid]\nradius_mm = [50.0, 150.0]\nfeed_mm_s = [20.0, 300.0]\n\
    ///             [[effect]]\ncause = \"backlash\"\naxis = \"z\"\nvalue = 0.008\n";
    /// let file = Path::new("model.toml");
    /// let model = ModelFile::parse(text, file)?;
    /// assert_eq!(model.effects[0].value(), 0.008);
    /// // A misspelt key is refused by file, line and name.
    /// let error = ModelFile::parse(&text.replace("kv_per_s", "kv"), file).unwrap_err().to_string();
    /// assert!(error.contains("model.toml:") && error.contains("kv"), "{error}");
    /// # Ok::<(), giotto::toml_file::TomlFileError>(())
    /// ```
    pub fn parse(text: &str, file: &Path) -> Result<Self, TomlFileError> {
        Self::of_text(&TomlText::new(file, text, EXPECTED))
    }

    fn of_text(text: &TomlText) -> Result<Self, TomlFileError> {
        // A newer format may have other keys: its number comes before them.
        match text.top("format") {
            Some(found) if !matches!(found.parse(), Ok(FLAT_FORMAT | FORMAT)) => {
                return Err(text.format_error(found, FORMAT));
            }
            // What is no TOML at all is said with its place below.
            None if text.top("servo").is_none() && text.parse::<toml::Table>().is_ok() => {
                return Err(text.missed(&[], "this is no model", EXPECTED));
            }
            Some(_) | None => {}
        }
        let written: Written = text.parse()?;
        let flat = written.format == FLAT_FORMAT;
        let mut effects = Vec::with_capacity(written.effects.len());
        for (index, effect) in written.effects.into_iter().enumerate() {
            effects.push(
                effect
                    .checked(flat)
                    .map_err(|fault| fault.at(text, index))?,
            );
        }
        let kinematics = written
            .kinematics
            .map(|block| block.checked().map_err(|fault| refused(text, &fault)))
            .transpose()?
            .filter(|kinematics| *kinematics != Kinematics::Slides);
        let model = Self {
            format: FORMAT,
            campaign: written.campaign,
            machine: written.machine,
            delay_s: written.delay_s,
            servo: written.servo,
            valid: written.valid,
            kinematics,
            effects,
        };
        if let Some((path, found, expected)) = model.joint_without_arm() {
            let path: Vec<&str> = path.iter().map(String::as_str).collect();
            return Err(text.value_error(&path, found, expected));
        }
        match model.fault() {
            None => Ok(model),
            Some(fault) => {
                let path: Vec<&str> = fault.path.iter().map(String::as_str).collect();
                Err(text.value_error(&path, fault.found, fault.expected))
            }
        }
    }

    /// Writes the model, whole or not at all.
    ///
    /// # Errors
    /// Numbers that [`Self::load`] would refuse, and what the operating system says.
    pub fn save(&self, file: &Path) -> Result<(), TomlFileError> {
        let text = self.to_text(file)?;
        crate::campaign::replace(file, &text).map_err(|e| {
            let problem = TomlProblem::Io {
                action: "written",
                reason: e.problem.to_string(),
            };
            TomlFileError::new((*e.at).clone(), problem)
        })
    }

    fn to_text(&self, file: &Path) -> Result<String, TomlFileError> {
        let text = toml::to_string(self).map_err(|e| {
            let problem = TomlProblem::Io {
                action: "written",
                reason: e.to_string(),
            };
            TomlFileError::new(crate::campaign::Place::file(file), problem)
        })?;
        Self::parse(&text, file)?;
        Ok(text)
    }

    /// An effect on a joint that the machine does not have: without the arm it would do nothing, and nobody would know.
    fn joint_without_arm(&self) -> Option<(Vec<String>, &'static str, String)> {
        let joints = self.kinematics.as_ref().map_or(&[][..], Kinematics::joints);
        self.effects.iter().enumerate().find_map(|(index, effect)| {
            let actuators = effect.site().actuators();
            let missing = actuators
                .iter()
                .find(|actuator| !actuator.is_slide() && !joints.contains(actuator))?;
            let path = ["effect", &index.to_string(), "axis"].map(ToString::to_string);
            let expected = match joints.last() {
                None => "a model with [kinematics], or an axis x, y, z".to_owned(),
                Some(last) => format!("a joint up to {last}"),
            };
            Some((path.to_vec(), missing.name(), expected))
        })
    }

    fn fault(&self) -> Option<Fault> {
        self.servo
            .fault()
            .or_else(|| self.valid.fault())
            .or_else(|| {
                let delay_s = self.delay_s?;
                let possible = (0.0..=LONGEST_DELAY_S).contains(&delay_s);
                Fault::unless(possible, &["delay_s"], delay_s, "a delay of 0 to 1 s")
            })
    }
}

fn written<S: Serializer>(
    kinematics: &Option<Kinematics>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    kinematics
        .as_ref()
        .map(WrittenKinematics::from)
        .serialize(serializer)
}

/// The refusal of a block at its key.
fn refused(text: &TomlText, fault: &KinematicsFault) -> TomlFileError {
    match fault {
        KinematicsFault::Missing { key, expected } => {
            let what = format!("`{key}` is missing");
            text.missed(&["kinematics", key], what, (*expected).to_owned())
        }
        KinematicsFault::Range {
            key,
            found,
            expected,
        } => text.value_error(&["kinematics", key], found, expected),
        KinematicsFault::Unused { key, expected } => {
            text.value_error(&["kinematics", key], "of another model", expected)
        }
    }
}

/// Longest delay of a machine behind its command that is no mistake, s.
const LONGEST_DELAY_S: f64 = 1.0;

const FINITE: &str = "a finite number";

/// A number that a model must not hold, and the way to it.
struct Fault {
    path: Vec<String>,
    found: String,
    expected: &'static str,
}

impl Fault {
    fn unless(
        ok: bool,
        path: &[&str],
        found: impl ToString,
        expected: &'static str,
    ) -> Option<Self> {
        let path = || path.iter().map(ToString::to_string).collect();
        (!ok).then(|| Self {
            path: path(),
            found: found.to_string(),
            expected,
        })
    }
}

impl Servo {
    fn fault(&self) -> Option<Fault> {
        let finite =
            |key, value: f64| Fault::unless(value.is_finite(), &["servo", key], value, FINITE);
        let positive = |key, value: f64| {
            Fault::unless(
                value > 0.0 && value.is_finite(),
                &["servo", key],
                value,
                "a positive number",
            )
        };
        match *self {
            Self::Beta {
                beta1_s2,
                beta2_s4,
                half_width95,
            } => finite("beta1_s2", beta1_s2)
                .or_else(|| finite("beta2_s4", beta2_s4))
                .or_else(|| {
                    half_width95.iter().enumerate().find_map(|(i, w)| {
                        let path = ["servo", "half_width95", &i.to_string()];
                        Fault::unless(
                            *w >= 0.0 && w.is_finite(),
                            &path,
                            w,
                            "zero or a positive number",
                        )
                    })
                }),
            Self::Lag { kv_per_s } => positive("kv_per_s", kv_per_s),
            Self::SecondOrder {
                omega_n_rad_s,
                zeta,
            } => positive("omega_n_rad_s", omega_n_rad_s).or_else(|| positive("zeta", zeta)),
        }
    }
}

impl Valid {
    fn fault(&self) -> Option<Fault> {
        let ranges = [("radius_mm", self.radius_mm), ("feed_mm_s", self.feed_mm_s)];
        let fault = ranges.into_iter().find_map(|(key, [lo, hi])| {
            let ok = 0.0 < lo && lo <= hi && hi.is_finite();
            let expected = "two positive numbers, the smaller first";
            Fault::unless(ok, &["valid", key], format!("[{lo}, {hi}]"), expected)
        });
        fault.or_else(|| {
            let centre = self.centre_mm?;
            let ok = centre.iter().all(|mm| mm.abs() <= 1e5);
            let expected = "three numbers in mm, −100000 to 100000, in the robot's base";
            Fault::unless(ok, &["valid", "centre_mm"], format!("{centre:?}"), expected)
        })
    }
}

#[cfg(test)]
mod tests;
