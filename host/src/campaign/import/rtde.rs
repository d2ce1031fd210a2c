//! Universal Robots RTDE recorder: a header, `timestamp` (s), `actual_TCP_pose_0..5` (m, rad) and, if recorded,
//! `target_TCP_pose_0..5`; blanks or commas between the fields.
use super::Format;
use super::layout::{Head, Layout, Quantity, split};

pub(super) fn recognise(head: &Head) -> Option<Layout> {
    let header = head.line(0);
    let separator = if header.contains(',') { b',' } else { b' ' };
    let mut fields = Vec::new();
    for (index, name) in split(header, separator).into_iter().enumerate() {
        let axis = |prefix: &str| {
            let digit: usize = name.strip_prefix(prefix)?.parse().ok()?;
            (digit < 3).then_some(digit)
        };
        if name == "timestamp" {
            fields.push((index, Quantity::Time, 1.0));
        } else if let Some(axis) = axis("actual_TCP_pose_") {
            fields.push((index, Quantity::Position(axis), 1.0));
        } else if let Some(axis) = axis("target_TCP_pose_") {
            fields.push((index, Quantity::Target(axis), 1.0));
        }
    }
    let positions = fields
        .iter()
        .filter(|f| matches!(f.1, Quantity::Position(_)))
        .count();
    (positions == 3).then(|| Layout::new(Format::Rtde, separator, 1, fields))
}
