//! Columns named on the command line: `--columns time_s,-,x_mm,y_mm`.
use super::Format;
use super::layout::{Head, Layout, Quantity, split};
use super::named;

pub(super) fn recognise(head: &Head, given: &str) -> Result<Layout, String> {
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
        && (has(Quantity::Time) || has(Quantity::Angle));
    let planar = has(Quantity::Position(0)) && has(Quantity::Position(1));
    if !(polar || planar) {
        return Err(
            "--columns: expected x and y, or deviation (or radius) with time or angle".to_owned(),
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
                    format: Format::Columns,
                    separator,
                    decimal_comma: comma,
                    skip,
                    fields,
                });
            }
        }
    }
    Err(format!(
        "--columns: none of the first {} lines has numbers in those columns",
        head.lines.len()
    ))
}
