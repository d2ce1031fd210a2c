//! Columns named on the command line: `--columns time_s,-,x_mm,y_mm`.
use super::Format;
use super::grid::Grid;
use super::layout::{Head, Layout, Quantity, split};
use super::named;

/// `alone`: a single column of lengths is a turn of evenly spaced readings.
pub(super) fn recognise(head: &Head, given: &str, alone: bool) -> Result<Layout, String> {
    let mut fields = Vec::new();
    for (index, name) in given.split(',').map(str::trim).enumerate() {
        if matches!(name, "-" | "") {
            continue;
        }
        let Some((quantity, factor)) = named::column(name) else {
            return Err(format!(
                "--columns: \"{name}\" is not known; expected time_s, angle_deg, deviation_um, radius_mm, x_mm, y_mm, z_mm \
                 (or another unit: x_m, time_ms, …), or - for a column to skip"
            ));
        };
        fields.push((index, quantity, factor));
    }
    let has = |q| fields.iter().any(|f| f.1 == q);
    let polar = (has(Quantity::Deviation) || has(Quantity::Radius))
        && (has(Quantity::Time) || has(Quantity::Angle) || alone);
    let axes = (0..3).filter(|axis| has(Quantity::Position(*axis))).count();
    if !(polar || axes >= 2) {
        return Err(
            "--columns: expected x and y (or another two axes), or deviation (or radius) with time or angle"
                .to_owned(),
        );
    }
    let wanted = given.split(',').count();
    // The first line that has numbers where they should be, whatever stands before it.
    for (skip, line) in head.lines.iter().enumerate() {
        for separator in [b';', b'\t', b',', b' '] {
            let parts = split(line, separator);
            let comma = separator != b',' && line.contains(',');
            let number = |f: &&str| {
                if comma {
                    f.replace(',', ".").parse::<f64>()
                } else {
                    f.parse()
                }
                .is_ok()
            };
            if parts.len() >= wanted
                && fields
                    .iter()
                    .all(|(at, ..)| parts.get(*at).is_some_and(number))
            {
                return Ok(Layout {
                    decimal_comma: comma,
                    ..Layout::new(Format::Columns, separator, skip, fields)
                });
            }
        }
    }
    Err(format!(
        "--columns: none of the first {} lines has numbers in those columns",
        head.lines.len()
    ))
}

/// What `--columns` could be for a file: its columns by their names as far as they are understood.
pub(super) fn example(head: &Head) -> Option<String> {
    let grid = Grid::of(head)?;
    let names = grid.names(head).map_or_else(Vec::new, |n| n.names);
    let usual = |quantity| match quantity {
        Quantity::Time | Quantity::Stamp(_) => "time_s",
        Quantity::Angle => "angle_deg",
        Quantity::Deviation => "deviation_um",
        Quantity::Radius => "radius_mm",
        Quantity::Position(axis) => ["x_mm", "y_mm", "z_mm"][axis],
        Quantity::Target(_) => "-",
    };
    let understood = |k: usize| {
        let name = names.get(k)?;
        named::column(name).map(|(quantity, _)| usual(quantity))
    };
    let mut list: Vec<&str> = (0..grid.width)
        .map(|k| understood(k).unwrap_or("-"))
        .collect();
    // Where nothing is understood, any columns show how it is written.
    if list.iter().filter(|n| **n != "-").count() < 2 && !list.contains(&"x_mm") {
        let free: Vec<usize> = grid
            .numbers
            .iter()
            .copied()
            .filter(|k| list[*k] == "-")
            .collect();
        let words: &[&str] = match (list.contains(&"time_s"), free.len()) {
            (true, 1) => &["deviation_um"],
            (false, 1) => &["radius_mm"],
            (true, _) | (false, 2) => &["x_mm", "y_mm"],
            (false, _) => &["time_s", "x_mm", "y_mm"],
        };
        free.iter().zip(words).for_each(|(k, word)| list[*k] = word);
    }
    Some(list.join(","))
}
