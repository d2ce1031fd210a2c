//! The block `[kinematics]` as campaigns and models hold it: lengths in mm, checked where it is read.
use super::{Branch, Elbow, Kinematics, Opw, Robot, Scara};
use serde::{Deserialize, Serialize};

/// The block, unchecked. Every key of every model; which of them belong is for [`WrittenKinematics::checked`] to say.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "the fields are the keys of the contract")]
pub struct WrittenKinematics {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub robot: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub a1_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub a2_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub b_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub c1_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub c2_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub c3_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub c4_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tool_mm: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub orientation: Option<[f64; 4]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub branch: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub l1_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub l2_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub elbow: Option<String>,
}

/// What is wrong with a block, and at which key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fault {
    /// A key that the model needs.
    Missing {
        /// The key.
        key: &'static str,
        /// What it may be.
        expected: &'static str,
    },
    /// A value that it cannot have.
    Range {
        /// The key.
        key: &'static str,
        /// What it is.
        found: String,
        /// What it may be.
        expected: &'static str,
    },
    /// A key of another model.
    Unused {
        /// The key.
        key: &'static str,
        /// Where it belongs.
        expected: &'static str,
    },
}

/// Keys of the block, in the order in which they are written.
pub const KEYS: [&str; 15] = [
    "model",
    "robot",
    "a1_mm",
    "a2_mm",
    "b_mm",
    "c1_mm",
    "c2_mm",
    "c3_mm",
    "c4_mm",
    "tool_mm",
    "orientation",
    "branch",
    "l1_mm",
    "l2_mm",
    "elbow",
];

const MODELS: &str =
    "\"opw\" (six joints, spherical wrist), \"scara\" or \"slides\", or a `robot` by name";
const OF_ROBOTS: &str = "one of abb-irb1600-6-1.45, abb-irb1600-10-1.45, abb-irb2400-10, fanuc-r2000ib-200r, kuka-kr6-r700, \
                         staubli-tx40, staubli-tx2-140, staubli-tx2-160, staubli-tx2-160l; or model = \"opw\" with its lengths";
const LENGTH: &str = "a length of −10000 to 10000 mm";
const LINK: &str = "a length above 0, up to 10000 mm";
const TOOL: &str = "three numbers [x, y, z] in mm, −10000 to 10000, in the flange's frame";
const ORIENTATION: &str = "a unit quaternion [w, x, y, z]: the flange's frame in the base";
const BRANCH: &str = "\"elbow-up\", \"elbow-down\", \"elbow-up-flipped\" or \"elbow-down-flipped\"";
const ELBOW: &str = "\"positive\" or \"negative\": the sign of the second angle";
/// Longest length, mm.
const LONGEST_MM: f64 = 1e4;
/// By how much a quaternion may differ from unit length by rounding.
const UNIT: f64 = 1e-3;

impl WrittenKinematics {
    /// Checks it.
    ///
    /// # Errors
    /// The first [`Fault`].
    pub fn checked(&self) -> Result<Kinematics, Fault> {
        match (self.model.as_deref(), self.robot.as_deref()) {
            (Some("slides"), None) => {
                self.only("model = \"slides\" has no further keys", &["model"])?;
                Ok(Kinematics::Slides)
            }
            (Some("scara"), None) => self.scara(),
            (None | Some("opw"), Some(name)) => {
                let known = Robot::named(name).ok_or_else(|| Fault::Range {
                    key: "robot",
                    found: format!("\"{name}\""),
                    expected: OF_ROBOTS,
                })?;
                let allowed = ["model", "robot", "tool_mm", "orientation", "branch"];
                self.only("either a robot by name or its lengths", &allowed)?;
                let (tool_m, orientation, branch) = self.hand()?;
                Ok(Kinematics::Opw(known.with(tool_m, orientation, branch)))
            }
            (Some("opw"), None) => self.opw(),
            (None, None) => Err(Fault::Missing {
                key: "model",
                expected: MODELS,
            }),
            (Some(other), _) => Err(Fault::Range {
                key: "model",
                found: format!("\"{other}\""),
                expected: MODELS,
            }),
        }
    }

    fn scara(&self) -> Result<Kinematics, Fault> {
        self.only(
            "model = \"scara\" has l1_mm, l2_mm and elbow",
            &["model", "l1_mm", "l2_mm", "elbow"],
        )?;
        let (l1_m, l2_m) = (link("l1_mm", self.l1_mm)?, link("l2_mm", self.l2_mm)?);
        let elbow = match self.elbow.as_deref() {
            Some("positive") => Elbow::Positive,
            Some("negative") => Elbow::Negative,
            Some(other) => {
                return Err(Fault::Range {
                    key: "elbow",
                    found: format!("\"{other}\""),
                    expected: ELBOW,
                });
            }
            None => {
                return Err(Fault::Missing {
                    key: "elbow",
                    expected: ELBOW,
                });
            }
        };
        Ok(Kinematics::Scara(Scara { l1_m, l2_m, elbow }))
    }

    fn opw(&self) -> Result<Kinematics, Fault> {
        let of_scara = |key: &&str| matches!(*key, "l1_mm" | "l2_mm" | "elbow");
        let own: Vec<&str> = KEYS.into_iter().filter(|key| !of_scara(key)).collect();
        self.only("a scara's; model = \"opw\" has a1_mm … c4_mm", &own)?;
        let (tool_m, orientation, branch) = self.hand()?;
        Ok(Kinematics::Opw(Opw {
            a1_m: length("a1_mm", self.a1_mm)?,
            a2_m: length("a2_mm", self.a2_mm)?,
            b_m: length("b_mm", self.b_mm)?,
            c1_m: length("c1_mm", self.c1_mm)?,
            c2_m: link("c2_mm", self.c2_mm)?,
            c3_m: link("c3_mm", self.c3_mm)?,
            c4_m: length("c4_mm", self.c4_mm)?,
            tool_m,
            orientation,
            branch,
        }))
    }

    /// Tool, orientation and branch of six joints.
    fn hand(&self) -> Result<([f64; 3], [f64; 4], Branch), Fault> {
        let tool = self.tool_mm.ok_or(Fault::Missing {
            key: "tool_mm",
            expected: TOOL,
        })?;
        if tool.iter().any(|v| !(-LONGEST_MM..=LONGEST_MM).contains(v)) {
            return Err(Fault::Range {
                key: "tool_mm",
                found: format!("{tool:?}"),
                expected: TOOL,
            });
        }
        let given = self.orientation.ok_or(Fault::Missing {
            key: "orientation",
            expected: ORIENTATION,
        })?;
        let norm = given.iter().map(|v| v * v).sum::<f64>().sqrt();
        if !(1.0 - UNIT..=1.0 + UNIT).contains(&norm) {
            return Err(Fault::Range {
                key: "orientation",
                found: format!("{given:?}, of length {norm:.4}"),
                expected: ORIENTATION,
            });
        }
        let branch = match self.branch.as_deref() {
            None => Branch::ElbowUp,
            Some(name) => Branch::ALL
                .into_iter()
                .find(|(_, known)| *known == name)
                .map(|(branch, _)| branch)
                .ok_or_else(|| Fault::Range {
                    key: "branch",
                    found: format!("\"{name}\""),
                    expected: BRANCH,
                })?,
        };
        Ok((tool.map(|v| v / 1e3), given.map(|v| v / norm), branch))
    }

    /// Refuses keys that are there and not among the `allowed`.
    fn only(&self, expected: &'static str, allowed: &[&str]) -> Result<(), Fault> {
        let there = self.given();
        match there.into_iter().find(|key| !allowed.contains(key)) {
            Some(key) => Err(Fault::Unused { key, expected }),
            None => Ok(()),
        }
    }

    /// The keys that are there.
    fn given(&self) -> Vec<&'static str> {
        let there = [
            self.model.is_some(),
            self.robot.is_some(),
            self.a1_mm.is_some(),
            self.a2_mm.is_some(),
            self.b_mm.is_some(),
            self.c1_mm.is_some(),
            self.c2_mm.is_some(),
            self.c3_mm.is_some(),
            self.c4_mm.is_some(),
            self.tool_mm.is_some(),
            self.orientation.is_some(),
            self.branch.is_some(),
            self.l1_mm.is_some(),
            self.l2_mm.is_some(),
            self.elbow.is_some(),
        ];
        KEYS.into_iter()
            .zip(there)
            .filter_map(|(key, there)| there.then_some(key))
            .collect()
    }
}

fn length(key: &'static str, mm: Option<f64>) -> Result<f64, Fault> {
    let mm = mm.ok_or(Fault::Missing {
        key,
        expected: LENGTH,
    })?;
    match (-LONGEST_MM..=LONGEST_MM).contains(&mm) {
        true => Ok(mm / 1e3),
        false => Err(Fault::Range {
            key,
            found: mm.to_string(),
            expected: LENGTH,
        }),
    }
}

fn link(key: &'static str, mm: Option<f64>) -> Result<f64, Fault> {
    let length_m = length(key, mm)?;
    match length_m > 0.0 {
        true => Ok(length_m),
        false => Err(Fault::Range {
            key,
            found: (length_m * 1e3).to_string(),
            expected: LINK,
        }),
    }
}

/// A decimal of at most nine places: what the conversion of units left behind goes.
fn plain(v: f64) -> f64 {
    (v * 1e9).round() / 1e9
}

impl From<&Kinematics> for WrittenKinematics {
    fn from(kinematics: &Kinematics) -> Self {
        let mm = |m: f64| Some(plain(m * 1e3));
        match kinematics {
            Kinematics::Slides => Self {
                model: Some("slides".into()),
                ..Self::default()
            },
            Kinematics::Scara(scara) => Self {
                model: Some("scara".into()),
                l1_mm: mm(scara.l1_m),
                l2_mm: mm(scara.l2_m),
                elbow: Some(match scara.elbow {
                    Elbow::Positive => "positive".into(),
                    Elbow::Negative => "negative".into(),
                }),
                ..Self::default()
            },
            Kinematics::Opw(opw) => Self {
                model: Some("opw".into()),
                a1_mm: mm(opw.a1_m),
                a2_mm: mm(opw.a2_m),
                b_mm: mm(opw.b_m),
                c1_mm: mm(opw.c1_m),
                c2_mm: mm(opw.c2_m),
                c3_mm: mm(opw.c3_m),
                c4_mm: mm(opw.c4_m),
                tool_mm: Some(opw.tool_m.map(|m| plain(m * 1e3))),
                orientation: Some(opw.orientation.map(plain)),
                branch: Branch::ALL
                    .into_iter()
                    .find(|(branch, _)| *branch == opw.branch)
                    .map(|(_, name)| name.to_owned()),
                ..Self::default()
            },
        }
    }
}
