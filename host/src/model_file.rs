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
            None if text.top("servo").is_none() => {
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
        [("radius_mm", self.radius_mm), ("feed_mm_s", self.feed_mm_s)]
            .into_iter()
            .find_map(|(key, [lo, hi])| {
                let ok = 0.0 < lo && lo <= hi && hi.is_finite();
                let expected = "two positive numbers, the smaller first";
                Fault::unless(ok, &["valid", key], format!("[{lo}, {hi}]"), expected)
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::causes::{ALL, Cause, Seat, Site};
    use giotto_shared::Actuator;

    const TEXT: &str = r#"format = 1
campaign = "lab"
machine = "ABB"

[servo]
kind = "beta"
beta1_s2 = -2.329e-5
beta2_s4 = -2.3e-7
half_width95 = [2.1e-6, 1.3e-7]

[valid]
radius_mm = [100.0, 300.0]
feed_mm_s = [20.0, 700.0]

[[effect]]
cause = "backlash"
axis = "x"
value = 0.012
ci95 = [0.011, 0.013]

[[effect]]
cause = "cyclic_error"
axis = "y"
value = 2.5
ci95 = [2.0, 3.0]

[effect.params]
pitch_mm = 10.0
phase_rad = 0.5
"#;

    fn refuse(from: &str, to: &str) -> String {
        assert!(TEXT.contains(from));
        ModelFile::parse(&TEXT.replacen(from, to, 1), Path::new("M.toml"))
            .unwrap_err()
            .to_string()
    }

    #[test]
    fn reads_what_it_should() {
        let model = ModelFile::parse(TEXT, Path::new("M.toml")).unwrap();
        assert_eq!(
            model.servo,
            Servo::Beta {
                beta1_s2: -2.329e-5,
                beta2_s4: -2.3e-7,
                half_width95: [2.1e-6, 1.3e-7]
            }
        );
        assert_eq!(model.effects[0].cause(), Cause::Backlash);
        assert_eq!(model.effects[0].site(), Site::One(Actuator::X));
        let parameters: Vec<_> = model.effects[1].parameters().iter().collect();
        assert_eq!(parameters, [("phase_rad", 0.5), ("pitch_mm", 10.0)]);
    }

    #[test]
    fn refusals_name_the_place() {
        assert_eq!(
            refuse("format = 1", "format = 7"),
            "M.toml:1:10: format 7, and this build reads format 2"
        );
        assert_eq!(
            refuse("beta2_s4 = -2.3e-7", "beta2_s4 = nan"),
            "M.toml:8:12: `servo.beta2_s4` is NaN; expected a finite number"
        );
        assert_eq!(
            refuse("radius_mm = [100.0, 300.0]", "radius_mm = [300.0, 100.0]"),
            "M.toml:12:13: `valid.radius_mm` is [300, 100]; expected two positive numbers, the smaller first"
        );
        assert_eq!(
            refuse("value = 2.5", "value = inf"),
            "M.toml:24:9: `effect.value` is inf; expected 0 to 1000"
        );
        let delayed = refuse("\n[servo]", "delay_s = 7.5\n[servo]");
        assert!(
            delayed.ends_with("`delay_s` is 7.5; expected a delay of 0 to 1 s"),
            "{delayed}"
        );
        assert!(
            refuse("pitch_mm = 10.0", "pitch_mm = nan")
                .starts_with("M.toml:28:12: `effect.params.pitch_mm`")
        );
        assert!(
            refuse("[2.0, 3.0]", "[3.0, 2.0]").contains("M.toml:25:8: `effect.ci95` is [3, 2]")
        );
        assert!(
            refuse("-2.329e-5", "\"small\"").starts_with("M.toml:"),
            "text for a number"
        );
        assert!(refuse("kind = \"beta\"", "kind = \"magic\"").contains("magic"));
        assert!(
            refuse("machine = \"ABB\"", "machin = \"ABB\"").starts_with("M.toml:3:1: unknown key")
        );
        assert!(refuse("machine = \"ABB\"", "machine = \"ABB").starts_with("M.toml:3:"));
        assert!(
            refuse("\"backlash\"", "\"gremlin\"")
                .contains("M.toml:16:9: unknown variant `gremlin`")
        );
        let lag = TEXT.replace("kind = \"beta\"", "kind = \"lag\"\nkv_per_s = -3.0");
        let error = ModelFile::parse(&lag, Path::new("M.toml"))
            .unwrap_err()
            .to_string();
        assert_eq!(
            error,
            "M.toml:7:12: `servo.kv_per_s` is -3; expected a positive number"
        );
    }

    #[test]
    fn files_go_round() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("model.toml");
        let mut model = ModelFile::parse(TEXT, Path::new("M.toml")).unwrap();
        for servo in [
            model.servo,
            Servo::Lag {
                kv_per_s: 1.0 / 3.0 * 100.0,
            },
            Servo::SecondOrder {
                omega_n_rad_s: 38.0 + f64::EPSILON * 64.0,
                zeta: 0.72,
            },
        ] {
            model.servo = servo;
            model.save(&file).unwrap();
            assert_eq!(ModelFile::load(&file).unwrap(), model);
        }
        model.valid.radius_mm = [f64::NAN, 1.0];
        assert!(
            model
                .save(&file)
                .unwrap_err()
                .to_string()
                .contains("valid.radius_mm")
        );
        assert!(
            ModelFile::load(&file).unwrap().effects[0]
                .value()
                .is_finite(),
            "the old file is whole"
        );
        assert!(
            ModelFile::load(dir.path())
                .unwrap_err()
                .to_string()
                .contains("is a directory")
        );
        assert!(
            ModelFile::load(&dir.path().join("no"))
                .unwrap_err()
                .to_string()
                .contains("no such file")
        );
        std::fs::write(&file, b"format = 1\nmachine = \"\xff\"").unwrap();
        assert!(
            ModelFile::load(&file)
                .unwrap_err()
                .to_string()
                .contains(":2:12: not UTF-8")
        );
    }

    /// A whole effect of a cause, as a file would hold it, and the names of its parameters that have to be there.
    fn whole(cause: Cause) -> (String, Vec<&'static str>) {
        let place = match cause.model().seat() {
            Seat::Machine | Seat::MachineOrOne | Seat::MachineOrJoint => "",
            Seat::One => "axis = \"z\"\n",
            Seat::Pair | Seat::PairOrJoint => "plane = \"zx\"\n",
            Seat::Joint => "axis = \"joint2\"\n",
            Seat::Across => "axis = \"z\"\nacross = \"y\"\n",
        };
        let inside = |[lowest, highest]: [f64; 2]| 0.9 * lowest + 0.1 * highest;
        let value = inside(cause.model().size().range);
        let params: String = cause
            .model()
            .parameters()
            .iter()
            .map(|p| format!("{} = {:?}\n", p.name, inside(p.range)))
            .collect();
        let needed = cause.model().parameters().iter();
        let needed = needed.filter(|p| p.otherwise.is_none()).map(|p| p.name);
        (
            format!(
                "[[effect]]\ncause = \"{}\"\n{place}value = {value:?}\nci95 = [0.0, 0.0]\n[effect.params]\n{params}",
                cause.id()
            ),
            needed.collect(),
        )
    }

    fn with_effect(effect: &str) -> Result<ModelFile, TomlFileError> {
        let head = TEXT.split("[[effect]]").next().unwrap();
        let head = head.replace("format = 1", "format = 2");
        ModelFile::parse(&format!("{head}{effect}"), Path::new("M.toml"))
    }

    /// All causes, all parameters: missing, misspelt, of another unit, no number, beyond what can be.
    #[test]
    fn no_number_of_an_effect_is_invented() {
        let first_line = TEXT.split("[[effect]]").next().unwrap().lines().count();
        for model in ALL {
            let (text, needed) = whole(model.cause());
            let id = model.words().id;
            let read = with_effect(&text).unwrap();
            assert_eq!(read.effects[0].cause(), model.cause());
            let again = with_effect(
                &toml::to_string(&Only {
                    effect: &read.effects,
                })
                .unwrap(),
            );
            assert_eq!(
                again.unwrap().effects,
                read.effects,
                "{id}: written and read back"
            );
            let refused = |text: String, words: &[&str]| {
                let error = with_effect(&text).err();
                let error = error
                    .unwrap_or_else(|| panic!("{id} is taken:\n{text}"))
                    .to_string();
                for word in words {
                    assert!(error.contains(word), "{id}: {error}, without {word}");
                }
                let line: usize = error.split(':').nth(1).unwrap().parse().unwrap();
                assert!(line > first_line, "{id}: {error}");
            };
            for key in ["axis", "plane", "across"] {
                if text.contains(&format!("\n{key} = ")) {
                    let without: Vec<&str> = text
                        .lines()
                        .filter(|line| !line.starts_with(&format!("{key} = ")))
                        .collect();
                    refused(without.join("\n"), &[key]);
                } else {
                    let more = text.replace("\nvalue", &format!("\n{key} = \"xy\"\nvalue"));
                    assert!(with_effect(&more).is_err(), "{id} takes `{key}`");
                }
            }
            for parameter in model.parameters() {
                let name = parameter.name;
                let line = text
                    .lines()
                    .find(|line| line.starts_with(&format!("{name} = ")))
                    .unwrap();
                let but = |new: &str| text.replace(line, new);
                if needed.contains(&name) {
                    refused(but(""), &[name, "missing"]);
                }
                let stem = name.rsplit_once('_').map_or(name, |(stem, _)| stem);
                for other in [
                    format!("{name}x"),
                    format!("{stem}_furlong"),
                    stem.to_owned(),
                ] {
                    if !model.parameters().iter().any(|p| p.name == other) {
                        refused(but(&format!("{other} = 1.0")), &[]);
                    }
                }
                let beyond = format!("{:?}", 2.0 * parameter.range[1] + 1.0);
                for value in ["nan", "inf", "-inf", &beyond, "\"10\""] {
                    refused(but(&format!("{name} = {value}")), &[name]);
                }
            }
            let size = text.lines().find(|line| line.starts_with("value")).unwrap();
            let beyond = format!("{:?}", 2.0 * model.size().range[1] + 1.0);
            for value in ["nan", "inf", &beyond] {
                refused(text.replace(size, &format!("value = {value}")), &["value"]);
            }
            refused(text.replace(size, ""), &["value"]);
            refused(
                text.replace("[effect.params]", "[effect.parms]"),
                &["parms"],
            );
        }
    }

    #[derive(Serialize)]
    struct Only<'a> {
        effect: &'a [Effect],
    }

    #[test]
    fn a_file_without_planes_means_x_and_y() {
        let flat = TEXT.replace(
            "cause = \"backlash\"\naxis = \"x\"\nvalue = 0.012",
            "cause = \"squareness\"\nvalue = 0.012",
        );
        let read = ModelFile::parse(&flat, Path::new("M.toml")).unwrap();
        assert_eq!(read.format, FORMAT);
        assert_eq!(read.effects[0].site(), Site::Pair(giotto_shared::Plane::Xy));
        let now = flat.replace("format = 1", "format = 2");
        let refused = ModelFile::parse(&now, Path::new("M.toml")).unwrap_err();
        assert!(
            refused.to_string().contains("`plane` is missing"),
            "{refused}"
        );
    }
}
