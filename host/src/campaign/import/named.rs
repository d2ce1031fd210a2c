//! Columns known by the words of the header, English or German, with a unit in brackets or at the end of the name.
use super::Format;
use super::layout::{Head, Layout, Quantity, split, unit};

pub(super) fn recognise(head: &Head) -> Option<Layout> {
    let header = head.line(0);
    let separator = [b';', b'\t', b',']
        .into_iter()
        .find(|&s| header.contains(char::from(s)))
        .unwrap_or(b' ');
    let row = head.line(1);
    let decimal_comma = separator != b',' && row.contains(',') && !row.contains('.');
    let mut fields = Vec::new();
    for (index, name) in split(header, separator).into_iter().enumerate() {
        if let Some((quantity, factor)) = column(name) {
            fields.push((index, quantity, factor));
        }
    }
    let has = |q| fields.iter().any(|f| f.1 == q);
    let planar = has(Quantity::Position(0)) && has(Quantity::Position(1));
    let radial = has(Quantity::Deviation) || has(Quantity::Radius);
    if !planar && !(radial && (has(Quantity::Time) || has(Quantity::Angle))) {
        return None;
    }
    let own = crate::campaign::is_contract_header(header);
    let format = if own {
        Format::Contract
    } else if decimal_comma {
        Format::German
    } else {
        Format::Named
    };
    Some(Layout {
        format,
        separator,
        decimal_comma,
        skip: 1,
        fields,
    })
}

/// Meaning and factor to SI of a column name such as `x_mm`, `X [mm]`, `Zeit (s)`, `Abweichung [µm]`.
pub(super) fn column(name: &str) -> Option<(Quantity, f64)> {
    let lower = name.trim().to_lowercase();
    let (word, given) = match lower.find(['[', '(']) {
        Some(at) => (
            lower[..at].trim(),
            Some(
                lower[at + 1..]
                    .trim_end_matches([']', ')'])
                    .trim()
                    .to_owned(),
            ),
        ),
        None => match lower.rsplit_once(['_', ' ']) {
            Some((word, tail)) if unit(tail).is_some() => (word, Some(tail.to_owned())),
            _ => (lower.as_str(), None),
        },
    };
    let (quantity, usual) = match word {
        "time" | "zeit" | "t" | "timestamp" => (Quantity::Time, "s"),
        "angle" | "winkel" | "phi" | "theta" => (Quantity::Angle, "deg"),
        "deviation" | "abweichung" | "radialabweichung" | "dr" => (Quantity::Deviation, "um"),
        "radius" | "r" => (Quantity::Radius, "mm"),
        "x" => (Quantity::Position(0), "mm"),
        "y" => (Quantity::Position(1), "mm"),
        "z" => (Quantity::Position(2), "mm"),
        _ => return None,
    };
    Some((quantity, unit(given.as_deref().unwrap_or(usual))?))
}
