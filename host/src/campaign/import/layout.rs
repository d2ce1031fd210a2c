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

impl Quantity {
    /// Its name in words.
    pub(in crate::campaign) fn name(self) -> &'static str {
        match self {
            Self::Time | Self::Stamp(_) => "time",
            Self::Angle => "the angle",
            Self::Deviation => "the deviation",
            Self::Radius => "the radius",
            Self::Position(_) => "a position",
            Self::Target(_) => "a position that was wanted",
        }
    }
}

/// Order of the parts of a date.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::campaign) enum DateOrder {
    /// 08.11.2022 16:17:28.353
    DayMonthYear,
    /// 11/08/22 16:17:28
    MonthDayYear,
    /// 2024-05-02T09:00:00.050, with a zone or without; the time of day alone.
    YearMonthDay,
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
    /// Fields of a row, where they are always so many; 0 where rows may differ.
    pub(super) width: usize,
    /// Whether the file leaves the unit of positions and of time open.
    pub(super) open: Open,
    /// What the reader of the file should know: columns that were not understood, which of two was taken.
    pub(super) notes: Vec<String>,
}

/// Units that a file does not give.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Open {
    pub(super) length: bool,
    pub(super) time: bool,
    /// A "grad" that may be a degree or a 400th of a turn.
    pub(super) angle: bool,
}

impl Layout {
    /// A layout whose units are known.
    pub(super) fn new(
        format: Format,
        separator: u8,
        skip: usize,
        fields: Vec<(usize, Quantity, f64)>,
    ) -> Self {
        Self {
            format,
            separator,
            decimal_comma: false,
            skip,
            fields,
            width: 0,
            open: Open::default(),
            notes: Vec::new(),
        }
    }
}

/// Lines in which a header is looked for.
const LINES: usize = 400;

/// First lines of a file, decoded without failing: what is not UTF-8 is Latin-1.
#[derive(Debug)]
pub(super) struct Head {
    pub(super) lines: Vec<String>,
}

impl Head {
    /// `cut`: the last line may go on behind the bytes.
    pub(super) fn of(bytes: &[u8], cut: bool) -> Self {
        let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
        let end = memchr::memrchr(b'\n', bytes).filter(|_| cut);
        let whole = &bytes[..end.unwrap_or(bytes.len())];
        let lines = whole.split(|&b| b == b'\n').take(LINES).map(latin1);
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
        "m" | "s" | "sec" | "secs" | "second" | "seconds" | "sekunden" | "secondes" | "rad"
        | "radians" | "meter" | "meters" | "metre" | "metres" => 1.0,
        "mm" | "ms" | "msec" | "mrad" | "millimeter" | "millimeters" | "millimetres" => 1e-3,
        "cm" => 1e-2,
        "um" | "µm" | "μm" | "us" | "µs" | "μs" | "usec" | "micron" | "microns" => 1e-6,
        "nm" | "ns" | "nsec" => 1e-9,
        "in" | "inch" | "inches" => 0.0254,
        "deg" | "°" | "degree" | "degrees" | "grad" => std::f64::consts::PI / 180.0,
        "gon" | "grads" | "gradian" | "gradians" => std::f64::consts::PI / 200.0,
        "min" => 60.0,
        _ => return None,
    })
}

/// Whether a field says that there is no value.
pub(super) fn is_missing(field: &str) -> bool {
    let field = field.trim();
    field.is_empty()
        || [
            "nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "-nan", "inf", "-inf", "nil",
        ]
        .iter()
        .any(|word| field.eq_ignore_ascii_case(word))
        || field.starts_with("-1.#")
        || field.starts_with("1.#")
}

/// Whether a field is a time of day, with a date or without.
pub(super) fn is_stamp(field: &str) -> bool {
    let field = field.trim().trim_start_matches('\'');
    field.bytes().filter(|b| *b == b':').count() == 2
        && field.bytes().filter(u8::is_ascii_digit).count() >= 5
        && field
            .bytes()
            .all(|b| b.is_ascii_digit() || b"-/.,:TZ+ ".contains(&b))
}
