//! Seeds that thresholds may be set on, and seeds whose results are published: never the same.
use std::ops::Range;

/// Seeds of tests, of development, of any threshold. (Those above [`PUBLISHED`] were met in studies of before and
/// belong here too.)
pub const TUNING: Range<u64> = 0..1_000_000;
/// Seeds of the published page. Nobody sets anything on these.
pub const PUBLISHED: Range<u64> = 1_000_000..2_000_000;

/// Room for the campaigns of one row.
const ROW: u64 = 1_000;

/// The seed of campaign `index` of the row called `row`; `round` draws other rows from the same range.
pub fn seed(range: &Range<u64>, round: u64, row: &str, index: u64) -> u64 {
    let rows = (range.end - range.start) / ROW;
    let hash = row
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325 ^ round, |h: u64, b| {
            (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3)
        });
    range.start + (hash ^ (hash >> 29)) % rows * ROW + index % ROW
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_tuned_on_is_never_published() {
        const { assert!(TUNING.end <= PUBLISHED.start) };
        for (row, index) in [("backlash", 0), ("null_lag", 999), ("arm6_sound", 12_345)] {
            for round in 0..5 {
                assert!(TUNING.contains(&seed(&TUNING, round, row, index)));
                assert!(PUBLISHED.contains(&seed(&PUBLISHED, round, row, index)));
            }
        }
    }
}
