//! What the fields of a text file mean.
use super::Format;

/// What a field holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::campaign) enum Quantity {
    /// Seconds, from any origin.
    Time,
    /// Date and time of day.
    Stamp(DateOrder),
    /// Polar angle.
    Angle,
    /// Measured length minus programmed radius.
    Deviation,
    /// Measured length.
    Radius,
    /// x, y, z.
    Position(usize),
    /// x, y, z that the controller wanted.
    Target(usize),
}

/// Order of the parts of a date.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::campaign) enum DateOrder {
    /// 08.11.2022 16:17:28.353
    DayMonthYear,
    /// 11/08/22 16:17:28
    MonthDayYear,
}

/// A text file of numbers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layout {
    pub(super) format: Format,
    /// Separator of fields; a blank stands for any run of blanks.
    pub(super) separator: u8,
    /// `,` marks decimals.
    pub(super) decimal_comma: bool,
    /// Lines before the first row.
    pub(super) skip: usize,
    /// Field, meaning and factor to SI.
    pub(super) fields: Vec<(usize, Quantity, f64)>,
}

/// First lines of a file, decoded without failing: what is not UTF-8 is Latin-1.
#[derive(Debug)]
pub(super) struct Head {
    pub(super) lines: Vec<String>,
}

impl Head {
    pub(super) fn of(bytes: &[u8]) -> Self {
        let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
        let lines = bytes.split(|&b| b == b'\n').take(40).map(latin1);
        Self {
            lines: lines.map(|l| l.trim_end_matches('\r').to_owned()).collect(),
        }
    }

    pub(super) fn line(&self, index: usize) -> &str {
        self.lines.get(index).map_or("", String::as_str)
    }
}

/// Text of bytes that are UTF-8 or else Latin-1.
pub(super) fn latin1(bytes: &[u8]) -> String {
    std::str::from_utf8(bytes).map_or_else(
        |_| bytes.iter().map(|&b| char::from(b)).collect(),
        str::to_owned,
    )
}

/// Splits a line at a separator, quotes and blanks around fields taken off.
pub(super) fn split(line: &str, separator: u8) -> Vec<&str> {
    if separator == b' ' {
        return line
            .split_ascii_whitespace()
            .map(|f| f.trim_matches('"'))
            .collect();
    }
    line.split(char::from(separator))
        .map(|f| f.trim().trim_matches('"').trim())
        .collect()
}

/// Metres, seconds or radians in a unit, by its usual spellings.
pub(super) fn unit(text: &str) -> Option<f64> {
    Some(match text.trim().to_ascii_lowercase().as_str() {
        "m" | "s" | "sec" | "rad" => 1.0,
        "mm" | "ms" | "mrad" => 1e-3,
        "um" | "µm" | "μm" | "us" | "µs" | "micron" | "microns" => 1e-6,
        "nm" | "ns" => 1e-9,
        "in" | "inch" | "inches" => 0.0254,
        "deg" | "°" | "grad" => std::f64::consts::PI / 180.0,
        "min" => 60.0,
        _ => return None,
    })
}
