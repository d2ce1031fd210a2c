//! `[kinematics]` of a campaign: every key at its place, the whole checked, every run with its centre.
use super::{Source, Value};
use crate::campaign::error::{CampaignError, Place, Problem};
use crate::campaign::{Entry, Note};
use crate::kinematics::{Fault, KEYS, Kinematics, WrittenKinematics};
use std::ops::Range;
use toml::de::DeValue;

const NUMBER: &str = "a number in mm";
const TOOL: &str = "three numbers [x, y, z] in mm";
const ORIENTATION: &str = "four numbers [w, x, y, z]";
const CENTRE: &str =
    "the circle's centre [x, y, z] in the robot's base, in mm: the arm's joints depend on it";

impl Source<'_> {
    /// The kinematics of a block; `None` for slides.
    pub(super) fn kinematics(
        &mut self,
        value: &Value<'_>,
    ) -> Result<Option<Kinematics>, CampaignError> {
        let table = self.table(value, "kinematics")?;
        self.known_keys(table, &KEYS)?;
        let number = |key: &'static str| {
            table
                .get(key)
                .map(|v| self.within(v, key, NUMBER, |_| true))
                .transpose()
        };
        let text = |key| table.get(key).map(|v| self.string(v, key)).transpose();
        let tool = table.get("tool_mm");
        let orientation = table.get("orientation");
        let written = WrittenKinematics {
            model: text("model")?,
            robot: text("robot")?,
            a1_mm: number("a1_mm")?,
            a2_mm: number("a2_mm")?,
            b_mm: number("b_mm")?,
            c1_mm: number("c1_mm")?,
            c2_mm: number("c2_mm")?,
            c3_mm: number("c3_mm")?,
            c4_mm: number("c4_mm")?,
            tool_mm: tool.map(|v| self.numbers(v, "tool_mm", TOOL)).transpose()?,
            orientation: orientation
                .map(|v| self.numbers(v, "orientation", ORIENTATION))
                .transpose()?,
            branch: text("branch")?,
            l1_mm: number("l1_mm")?,
            l2_mm: number("l2_mm")?,
            elbow: text("elbow")?,
        };
        let kinematics = written.checked().map_err(|fault| {
            let at = |key: &str| {
                let entry = table.get_key_value(key);
                entry.map_or_else(|| value.span(), |(_, value)| value.span())
            };
            match fault {
                Fault::Missing { key, expected } => {
                    self.error(value.span(), Problem::MissingKey { key, expected })
                }
                Fault::Range {
                    key,
                    found,
                    expected,
                } => {
                    let problem = Problem::OutOfRange {
                        key,
                        value: found,
                        expected,
                    };
                    self.error(at(key), problem)
                }
                Fault::Unused { key, expected } => {
                    let problem = Problem::OutOfRange {
                        key,
                        value: "of another model".to_owned(),
                        expected,
                    };
                    self.error(at(key), problem)
                }
            }
        })?;
        if let (Kinematics::Opw(_), None) = (&kinematics, table.get("branch")) {
            self.notes.push(Note {
                at: Place::of_byte(self.file, self.text.as_bytes(), value.span().start),
                text: "`branch` is not given: elbow-up is taken".to_owned(),
            });
        }
        Ok((kinematics != Kinematics::Slides).then_some(kinematics))
    }

    /// Refuses a run without its centre: where the circle lies decides what the joints do.
    pub(super) fn with_centre(
        &self,
        entry: &Entry,
        span: Range<usize>,
    ) -> Result<(), CampaignError> {
        match entry.centre_m {
            Some(_) => Ok(()),
            None => Err(self.error(
                span,
                Problem::MissingKey {
                    key: "centre_mm",
                    expected: CENTRE,
                },
            )),
        }
    }

    fn numbers<const N: usize>(
        &self,
        value: &Value<'_>,
        key: &'static str,
        expected: &'static str,
    ) -> Result<[f64; N], CampaignError> {
        let DeValue::Array(list) = value.get_ref() else {
            return Err(self.wrong_type(value.span(), key, value.get_ref(), expected));
        };
        if list.len() != N {
            let problem = Problem::OutOfRange {
                key,
                value: format!("a list of {}", list.len()),
                expected,
            };
            return Err(self.error(value.span(), problem));
        }
        let mut out = [0.0; N];
        for (slot, value) in out.iter_mut().zip(list.iter()) {
            *slot = self.within(value, key, expected, |_| true)?;
        }
        Ok(out)
    }
}
