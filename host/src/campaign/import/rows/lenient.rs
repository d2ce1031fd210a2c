//! A row read with all leniency of its layout: blanks of other alphabets, odd stamps, missing values.
use super::days;
use crate::campaign::Problem;
use crate::campaign::import::layout::{DateOrder, Layout, Quantity, is_missing, latin1, split};
use crate::campaign::table::shorten;

/// Reads a row with all leniency; `false` for a row of the usual width in which a value is missing, as instruments write it
/// when they lose the target.
pub(super) fn slow(
    layout: &Layout,
    line: &[u8],
    values: &mut [f64],
) -> Result<bool, (usize, Problem)> {
    let text;
    let line = match std::str::from_utf8(line) {
        Ok(line) => line,
        Err(_) => {
            text = latin1(line);
            &text
        }
    };
    let line = line.trim_end_matches(['\n', '\r']);
    let needed = layout.fields.iter().map(|f| f.0 + 1).max().unwrap_or(0);
    let parts = split(line, layout.separator);
    if parts.len() < needed {
        return Err((
            line.chars().count().max(1),
            Problem::Ragged {
                found: parts.len(),
                expected: needed,
            },
        ));
    }
    let used = || layout.fields.iter().map(|f| parts[f.0]);
    if parts.len() == layout.width && used().any(is_missing) {
        return Ok(false);
    }
    for (&(at, quantity, factor), value) in layout.fields.iter().zip(values) {
        let field = parts[at];
        let column = || {
            line[..field.as_ptr() as usize - line.as_ptr() as usize]
                .chars()
                .count()
                + 1
        };
        let name = || quantity.name().to_owned();
        *value = if let Quantity::Stamp(order) = quantity {
            seconds(field, order).ok_or_else(|| {
                (
                    column(),
                    Problem::NotAStamp {
                        text: field.to_owned(),
                    },
                )
            })?
        } else {
            let parsed = if layout.decimal_comma && field.contains(',') {
                fast_float2::parse::<f64, _>(field.replace(',', "."))
            } else {
                fast_float2::parse::<f64, _>(field)
            };
            match parsed {
                Ok(v) if v.is_finite() => v * factor,
                Ok(_) => {
                    return Err((
                        column(),
                        Problem::NotFinite {
                            text: field.to_owned(),
                            column: name(),
                        },
                    ));
                }
                Err(_) if field.is_empty() => {
                    return Err((column(), Problem::EmptyField { column: name() }));
                }
                Err(_) => {
                    let text = shorten(field);
                    return Err((
                        column(),
                        Problem::NotANumber {
                            text,
                            column: name(),
                        },
                    ));
                }
            }
        };
    }
    Ok(true)
}

/// Seconds of a stamp since 1970 (UTC assumed; only differences are used).
pub(super) fn seconds(text: &str, order: DateOrder) -> Option<f64> {
    let text = text.trim().trim_start_matches('\'').trim();
    let (date, clock) = match text.split_once([' ', 'T']) {
        Some((date, clock)) => (Some(date), clock),
        None => (None, text),
    };
    // The zone is the same all along.
    let clock = clock.trim().trim_end_matches('Z');
    let clock = clock.split(['+', '-']).next().unwrap_or(clock);
    let mut clock = clock.split(':');
    let (hour, minute) = (
        clock.next()?.parse::<f64>().ok()?,
        clock.next()?.parse::<f64>().ok()?,
    );
    let second = clock.next()?.replace(',', ".").parse::<f64>().ok()?;
    if clock.next().is_some() {
        return None;
    }
    let days = date.map_or(Some(0), |date| days(date, order))?;
    Some(days as f64 * 86_400.0 + hour * 3600.0 + minute * 60.0 + second)
}
