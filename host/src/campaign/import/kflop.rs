//! KFLOP log: `time,pos0,pos1,pos2,dest0,dest1,dest2`. The file does not name its units: seconds and millimetres
//! are assumed, and the circle must then have the programmed radius.
use super::Format;
use super::layout::{Head, Layout, Quantity, split};

const MM: f64 = 1e-3;

pub(super) fn recognise(head: &Head) -> Option<Layout> {
    let names = split(head.line(0), b',');
    let mut fields = Vec::new();
    for (index, name) in names.iter().enumerate() {
        let axis = |prefix: &str| {
            name.strip_prefix(prefix)?
                .parse()
                .ok()
                .filter(|&a: &usize| a < 3)
        };
        if *name == "time" {
            fields.push((index, Quantity::Time, 1.0));
        } else if let Some(axis) = axis("pos") {
            fields.push((index, Quantity::Position(axis), MM));
        } else if let Some(axis) = axis("dest") {
            fields.push((index, Quantity::Target(axis), MM));
        }
    }
    let has = |q| fields.iter().any(|f| f.1 == q);
    let complete = has(Quantity::Time) && has(Quantity::Position(0)) && has(Quantity::Position(1));
    complete.then(|| Layout::new(Format::Kflop, b',', 1, fields))
}
