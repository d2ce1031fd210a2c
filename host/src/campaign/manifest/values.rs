//! Values of a TOML file as what they have to be, or a refusal with their place.
use super::super::error::{CampaignError, Place, Problem};
use super::{Note, Source, Value};
use std::ops::Range;
use toml::de::{DeTable, DeValue};

impl Source<'_> {
    pub(super) fn within(
        &self,
        value: &Value<'_>,
        key: &'static str,
        expected: &'static str,
        ok: fn(f64) -> bool,
    ) -> Result<f64, CampaignError> {
        let number = match value.get_ref() {
            DeValue::Float(f) => f.as_str().replace('_', "").parse::<f64>().ok(),
            DeValue::Integer(i) => i64::from_str_radix(&i.as_str().replace('_', ""), i.radix())
                .ok()
                .map(|v| v as f64),
            _ => None,
        };
        match number {
            None => Err(self.wrong_type(value.span(), key, value.get_ref(), expected)),
            Some(v) if v.is_finite() && ok(v) => Ok(v),
            Some(v) => Err(self.error(
                value.span(),
                Problem::OutOfRange {
                    key,
                    value: v.to_string(),
                    expected,
                },
            )),
        }
    }

    pub(super) fn string(&self, value: &Value<'_>, key: &str) -> Result<String, CampaignError> {
        match value.get_ref() {
            DeValue::String(s) => Ok(s.clone().into_owned()),
            other => Err(self.wrong_type(value.span(), key, other, "text in quotes")),
        }
    }

    pub(super) fn table<'v, 'a>(
        &self,
        value: &'v Value<'a>,
        key: &str,
    ) -> Result<&'v DeTable<'a>, CampaignError> {
        match value.get_ref() {
            DeValue::Table(t) => Ok(t),
            other => Err(self.wrong_type(value.span(), key, other, "a table")),
        }
    }

    pub(super) fn wrong_type(
        &self,
        span: Range<usize>,
        key: &str,
        found: &DeValue<'_>,
        expected: &'static str,
    ) -> CampaignError {
        let found = match found {
            DeValue::String(s) => format!("the text \"{}\"", crate::campaign::table::shorten(s)),
            DeValue::Integer(i) => format!("the number {}", i.as_str()),
            DeValue::Float(f) => format!("the number {}", f.as_str()),
            DeValue::Boolean(b) => format!("the boolean {b}"),
            DeValue::Datetime(d) => format!("the date {d}"),
            DeValue::Array(_) => "a list".to_owned(),
            DeValue::Table(_) => "a table".to_owned(),
        };
        self.error(
            span,
            Problem::WrongType {
                key: key.to_owned(),
                found,
                expected,
            },
        )
    }

    /// A key that looks like a slip of a known one is refused; any other is kept for its owner and noted.
    pub(super) fn known_keys(
        &mut self,
        table: &DeTable<'_>,
        known: &[&'static str],
    ) -> Result<(), CampaignError> {
        for key in table
            .keys()
            .filter(|k| !known.contains(&k.get_ref().as_ref()))
        {
            let name = key.get_ref().as_ref();
            if let Some(close) = known.iter().find(|k| is_slip(name, k)) {
                return Err(self.error(
                    key.span(),
                    Problem::UnknownKey {
                        key: name.to_owned(),
                        known: close,
                    },
                ));
            }
            let at = Place::of_byte(self.file, self.text.as_bytes(), key.span().start);
            self.notes.push(Note {
                at,
                text: format!("unknown key `{name}` is not used"),
            });
        }
        Ok(())
    }
}

/// Whether `found` is `known` but for letter case, a missing unit, or up to two edits.
fn is_slip(found: &str, known: &str) -> bool {
    let lower = found.to_ascii_lowercase();
    let stem = known
        .trim_end_matches("_mm_s")
        .trim_end_matches("_mm")
        .trim_end_matches("_deg");
    let stem = stem.trim_end_matches("_s").trim_end_matches("_c");
    lower == known
        || lower == stem
        || lower
            .strip_prefix(stem)
            .is_some_and(|rest| rest.starts_with('_'))
        || edits(&lower, known) <= if known.len() > 5 { 2 } else { 1 }
        || (known == "centre_mm" && lower.starts_with("center"))
}

/// Levenshtein distance, bytes.
fn edits(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.bytes().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, y) in b.bytes().enumerate() {
            let next = (diagonal + usize::from(x != y))
                .min(row[j] + 1)
                .min(row[j + 1] + 1);
            diagonal = std::mem::replace(&mut row[j + 1], next);
        }
    }
    row[b.len()]
}
