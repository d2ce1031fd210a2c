//! Values in the units that a person reads: µs, µm, µm/m. Files and JSON keep the contract's.

/// A value with its interval, in words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shown {
    /// The value, three digits, no exponent where one can be avoided.
    pub value: String,
    /// Lower end of its interval.
    pub low: String,
    /// Upper end.
    pub high: String,
    /// Unit with its proper letters.
    pub unit: String,
}

/// Factor from a unit of the contract to one that a person reads, and its name. `largest` decides between units of one
/// kind.
pub fn scale(contract: &str, largest: f64) -> (f64, String) {
    let named = |factor, name: &str| (factor, name.to_owned());
    match contract {
        "s" if largest < 1e-3 => named(1e6, "µs"),
        "s" => named(1e3, "ms"),
        // (1 ms)² is 1e-6 s².
        "s^2" => named(1e6, "ms²"),
        "s^4" => named(1e6, "10⁻⁶ s⁴"),
        "mm" => named(1e3, "µm"),
        "mm/s^2" => named(1e-3, "m/s²"),
        "mrad" if largest < 1.0 => named(1e3, "µrad"),
        other => (
            1.0,
            other
                .replace("um", "µm")
                .replace("^2", "²")
                .replace("^4", "⁴"),
        ),
    }
}

/// An estimate of the contract in the unit that a person reads.
///
/// ```
/// use giotto::units::shown;
///
/// let backlash = shown(0.0123, [0.0119, 0.0127], "mm");
/// assert_eq!(format!("{} {}", backlash.value, backlash.unit), "12.3 µm");
/// assert_eq!((backlash.low.as_str(), backlash.high.as_str()), ("11.9", "12.7"));
/// ```
pub fn shown(value: f64, interval: [f64; 2], contract: &str) -> Shown {
    let largest = interval.iter().fold(value.abs(), |m, v| m.max(v.abs()));
    let (factor, unit) = scale(contract, largest);
    let [low, high] = interval.map(|v| v * factor);
    // Value and interval with the same number of decimals, by the largest of them.
    let decimals = decimals(largest * factor);
    let text = |v: f64| signed_zero(format!("{v:.decimals$}"));
    Shown {
        value: text(value * factor),
        low: text(low),
        high: text(high),
        unit,
    }
}

/// Three digits: 123, 12.3, 1.23, 0.123.
pub fn number(value: f64) -> String {
    signed_zero(format!("{value:.*}", decimals(value.abs())))
}

fn decimals(size: f64) -> usize {
    if size == 0.0 || !size.is_finite() {
        return 1;
    }
    (2 - size.log10().floor() as i32).clamp(0, 6) as usize
}

/// `-0.0` reads as a mistake.
fn signed_zero(text: String) -> String {
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.to_owned(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_person_reads_micrometres_and_microseconds() {
        let of = |v, unit| {
            let shown = shown(v, [0.5 * v, 1.5 * v], unit);
            format!("{} {}", shown.value, shown.unit)
        };
        assert_eq!(of(5.8e-5, "s"), "58.0 µs");
        assert_eq!(of(0.004, "s"), "4.00 ms");
        assert_eq!(of(-0.0123, "mm"), "-12.3 µm");
        assert_eq!(of(1e-6, "s^2"), "1.00 ms²");
        assert_eq!(of(-2.3e-7, "s^4"), "-0.230 10⁻⁶ s⁴");
        assert_eq!(of(60.0, "um/m"), "60.0 µm/m");
        assert_eq!(of(1500.0, "mm/s^2"), "1.50 m/s²");
        assert_eq!(of(0.2, "mrad"), "200 µrad");
        assert_eq!(of(12.0, "Hz"), "12.0 Hz");
        assert_eq!(number(-1e-9), "-0.000000".trim_start_matches('-'));
        assert_eq!(number(1234.5), "1234");
    }
}
