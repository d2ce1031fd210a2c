//! Leica tracker CSV: `X  [mm],Y  [mm],Z  [mm],U(95)  [mm],…,Time Stamp,…`, Latin-1, stamps
//! `'08.11.2022 16:17:28.353`.
use super::Format;
use super::layout::{DateOrder, Head, Layout, Quantity, split, unit};

pub(super) fn recognise(head: &Head) -> Option<Layout> {
    let header = head.line(0);
    let separator = if header.contains(';') { b';' } else { b',' };
    let mut fields = Vec::new();
    let mut tracker = false;
    for (index, name) in split(header, separator).into_iter().enumerate() {
        let (word, bracket) = name
            .split_once('[')
            .map_or((name, None), |(w, b)| (w.trim(), b.split(']').next()));
        let axis = ["X", "Y", "Z"].iter().position(|a| *a == word);
        match (axis, bracket) {
            (Some(axis), Some(bracket)) => {
                fields.push((index, Quantity::Position(axis), unit(bracket)?))
            }
            (None, _) if word.eq_ignore_ascii_case("time stamp") => {
                fields.push((index, Quantity::Stamp(DateOrder::DayMonthYear), 1.0));
                tracker = true;
            }
            (None, _) if word.starts_with("U(95)") => tracker = true,
            _ => {}
        }
    }
    let positions = fields
        .iter()
        .filter(|f| matches!(f.1, Quantity::Position(_)))
        .count();
    let decimal_comma = separator == b';';
    (tracker && positions >= 2).then(|| Layout {
        decimal_comma,
        ..Layout::new(Format::Leica, separator, 1, fields)
    })
}
