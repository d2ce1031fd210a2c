//! SpatialAnalyzer text: lines of `//`, then `group,  name,  index,  X,  Y,  Z,  MM/DD/YY hh:mm:ss` in mm.
use super::Format;
use super::layout::{DateOrder, Head, Layout, Quantity, split};

const MM: f64 = 1e-3;

pub(super) fn recognise(head: &Head) -> Option<Layout> {
    let skip = head
        .lines
        .iter()
        .take_while(|l| l.trim_start().starts_with("//"))
        .count();
    let row = split(head.line(skip), b',');
    if skip == 0 || row.len() < 6 || row[3..6].iter().any(|f| f.parse::<f64>().is_err()) {
        return None;
    }
    let mut fields: Vec<_> = (0..3)
        .map(|axis| (3 + axis, Quantity::Position(axis), MM))
        .collect();
    if row.len() > 6 {
        fields.push((6, Quantity::Stamp(DateOrder::MonthDayYear), 1.0));
    }
    Some(Layout::new(Format::SpatialAnalyzer, b',', skip, fields))
}
