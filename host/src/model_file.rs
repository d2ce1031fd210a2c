//! `MODEL.toml`: what `fit` and `diagnose` write and what `simulate`, `table` and `flash` read.
use crate::causes::Effect;
use crate::toml_file::{TomlFileError, TomlProblem, TomlText};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Version of the file format written by this build.
pub const FORMAT: u32 = 1;

const EXPECTED: &str = "a model as `giotto fit -o` and `giotto diagnose -o` write it";

/// A model of one machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelFile {
    /// Format version, [`FORMAT`].
    pub format: u32,
    /// Name of the campaign it was fitted on.
    pub campaign: String,
    /// Machine, as the campaign names it.
    pub machine: String,
    /// Delay of the machine behind its command, s, where a diagnosis could tell it: dead time on top of the servo's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delay_s: Option<f64>,
    /// The radius law.
    pub servo: Servo,
    /// Where it was fitted: the table's bounds.
    pub valid: Valid,
    /// What diagnosis added, in order of share.
    #[serde(default, rename = "effect", skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<Effect>,
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
    pub fn parse(text: &str, file: &Path) -> Result<Self, TomlFileError> {
        Self::of_text(&TomlText::new(file, text, EXPECTED))
    }

    fn of_text(text: &TomlText) -> Result<Self, TomlFileError> {
        // A newer format may have other keys: its number comes before them.
        match text.top("format") {
            Some(found) if found.parse() != Ok(FORMAT) => {
                return Err(text.format_error(found, FORMAT));
            }
            Some(_) | None => {}
        }
        let model: Self = text.parse()?;
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
            .or_else(|| {
                self.effects.iter().enumerate().find_map(|(i, effect)| {
                    let i = i.to_string();
                    let finite = |path: &[&str], value: f64| {
                        Fault::unless(value.is_finite(), path, value, FINITE)
                    };
                    let [lo, hi] = effect.ci95;
                    finite(&["effect", &i, "value"], effect.value)
                        .or_else(|| finite(&["effect", &i, "ci95", "0"], lo))
                        .or_else(|| finite(&["effect", &i, "ci95", "1"], hi))
                        .or_else(|| {
                            let expected = "lower end first";
                            Fault::unless(
                                lo <= hi,
                                &["effect", &i, "ci95"],
                                format!("[{lo}, {hi}]"),
                                expected,
                            )
                        })
                        .or_else(|| {
                            effect
                                .params
                                .iter()
                                .find_map(|(k, v)| finite(&["effect", &i, "params", k], *v))
                        })
                })
            })
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
    use crate::causes::Cause;
    use giotto_shared::Axis;

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
        assert_eq!(model.effects[0].cause, Cause::Backlash);
        assert_eq!(model.effects[0].axis, Some(Axis::X));
        assert_eq!(model.effects[1].params["pitch_mm"], 10.0);
    }

    #[test]
    fn refusals_name_the_place() {
        assert_eq!(
            refuse("format = 1", "format = 7"),
            "M.toml:1:10: format 7, and this build reads format 1"
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
            "M.toml:24:9: `effect.value` is inf; expected a finite number"
        );
        let delayed = refuse("\n[servo]", "delay_s = 7.5\n[servo]");
        assert!(delayed.ends_with("`delay_s` is 7.5; expected a delay of 0 to 1 s"), "{delayed}");
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
            refuse("machine = \"ABB\"", "machin = \"ABB\"")
                .starts_with("M.toml:3:1: unknown field")
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
        model.effects[0].value = f64::NAN;
        assert!(
            model
                .save(&file)
                .unwrap_err()
                .to_string()
                .contains("effect.value")
        );
        assert!(
            ModelFile::load(&file).unwrap().effects[0].value.is_finite(),
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
}
