//! Dates of campaigns: days since 1970 and back, in the Gregorian calendar.
use std::fmt;

/// A day.
///
/// ```
/// use giotto::history::Date;
///
/// // The day of a measurement is found in the name of its folder.
/// let day = Date::find("mill-2026-05-14-after").unwrap();
/// assert_eq!(day.civil(), (2026, 5, 14));
/// assert_eq!(Date::new(2026, 2, 29), None);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Date {
    /// Days since 1970-01-01.
    pub days: i32,
}

/// Mean length of a month, days.
pub const MONTH_DAYS: f64 = 365.2425 / 12.0;

impl Date {
    /// Of year, month and day; `None` where there is no such day.
    pub fn new(year: i32, month: u32, day: u32) -> Option<Self> {
        if !(1970..=9999).contains(&year) || !(1..=12).contains(&month) || day == 0 {
            return None;
        }
        // Years that begin in March: the leap day is their last (after Hinnant's days_from_civil).
        let y = i64::from(if month <= 2 { year - 1 } else { year });
        let era = y.div_euclid(400);
        let of_era = y.rem_euclid(400);
        let of_year = i64::from((153 * ((month + 9) % 12) + 2) / 5 + day - 1);
        let of_era_days = of_era * 365 + of_era / 4 - of_era / 100 + of_year;
        let days = i32::try_from(era * 146_097 + of_era_days - 719_468).ok()?;
        let date = Self { days };
        (date.civil() == (year, month, day)).then_some(date)
    }

    /// Year, month and day.
    pub fn civil(self) -> (i32, u32, u32) {
        let z = i64::from(self.days) + 719_468;
        let era = z.div_euclid(146_097);
        let of_era = z.rem_euclid(146_097);
        let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
        let of_year = of_era - (365 * year + year / 4 - year / 100);
        let shifted = (5 * of_year + 2) / 153;
        let day = of_year - (153 * shifted + 2) / 5 + 1;
        let month = if shifted < 10 {
            shifted + 3
        } else {
            shifted - 9
        };
        let year = year + era * 400 + i64::from(month <= 2);
        (year as i32, month as u32, day as u32)
    }

    /// The first date in a text: `2026-05-14`, `2026-05` (its first day), `20260514`.
    pub fn find(text: &str) -> Option<Self> {
        let bytes = text.as_bytes();
        let digit = |i: usize| bytes.get(i).is_some_and(u8::is_ascii_digit);
        let number = |from: usize, count: usize| -> Option<u32> {
            (from..from + count)
                .all(digit)
                .then(|| text[from..from + count].parse().ok())?
        };
        let dash = |i: usize| {
            bytes
                .get(i)
                .is_some_and(|b| matches!(b, b'-' | b'_' | b'.'))
        };
        (0..bytes.len()).find_map(|i| {
            if i > 0 && digit(i - 1) {
                return None;
            }
            let year = i32::try_from(number(i, 4)?).ok()?;
            let compact = || Self::new(year, number(i + 4, 2)?, number(i + 6, 2)?);
            if !dash(i + 4) {
                return compact().filter(|_| !digit(i + 8));
            }
            let month = number(i + 5, 2).filter(|_| !digit(i + 7))?;
            let day = if dash(i + 7) {
                number(i + 8, 2).filter(|_| !digit(i + 10))
            } else {
                None
            };
            Self::new(year, month, day.unwrap_or(1))
        })
    }

    /// `May 2026`.
    pub fn month(self) -> String {
        const NAMES: [&str; 12] = [
            "January",
            "February",
            "March",
            "April",
            "May",
            "June",
            "July",
            "August",
            "September",
            "October",
            "November",
            "December",
        ];
        let (year, month, _) = self.civil();
        format!("{} {year}", NAMES[(month - 1) as usize % 12])
    }
}

impl fmt::Display for Date {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (year, month, day) = self.civil();
        write!(f, "{year:04}-{month:02}-{day:02}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_go_there_and_back() {
        assert_eq!(Date::new(1970, 1, 1), Some(Date { days: 0 }));
        assert_eq!(Date::new(2000, 3, 1), Some(Date { days: 11_017 }));
        assert_eq!(Date::new(2026, 2, 29), None);
        assert_eq!(Date::new(2024, 2, 29).unwrap().to_string(), "2024-02-29");
        for days in (0..40_000).step_by(17) {
            let (y, m, d) = Date { days }.civil();
            assert_eq!(Date::new(y, m, d), Some(Date { days }));
        }
    }

    #[test]
    fn dates_are_found_in_names() {
        for (text, date) in [
            ("mill 2026-05-14", Some("2026-05-14")),
            ("2026-05", Some("2026-05-01")),
            ("a_20260514_b", Some("2026-05-14")),
            ("R100_700", None),
            ("run2026", None),
            ("2026-13-01", None),
            ("irb1600 2025_12_31", Some("2025-12-31")),
            ("äö 2026.01.02", Some("2026-01-02")),
        ] {
            let found = Date::find(text).map(|d| d.to_string());
            assert_eq!(found.as_deref(), date, "{text}");
        }
    }
}
