//! Time stamps, seen once and forgotten: order, duration, spacing, the largest hole.
use super::column_sums::{bounds, sum};
use super::error::{CampaignError, Problem};
use super::manifest::Entry;
use super::thinned::Thinned;

/// So many spacings tell what is typical.
const SPACINGS: usize = 1 << 13;

/// What the time stamps of a run say.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    /// Duration of the recorded rows plus one spacing, s.
    pub(super) turn_s: f64,
    /// Typical spacing, s.
    pub(super) spacing_s: f64,
    /// The largest hole: row after it and its length beyond one spacing, s.
    pub(super) gap: Option<(usize, f64)>,
}

/// Collects what [`Clock`] is made of, row by row.
#[derive(Debug, Default)]
pub(super) struct Stamps {
    rows: usize,
    first_s: f64,
    last_s: f64,
    distinct: usize,
    backwards: Option<(usize, f64, f64)>,
    spacings: Thinned<f64, SPACINGS>,
    largest: Option<(usize, f64)>,
}

impl Stamps {
    /// The next stamps; they are returned as time since the first one.
    pub(super) fn take(&mut self, time: &mut [f64]) {
        let Some((&first, &last)) = time.first().zip(time.last()) else {
            return;
        };
        // The first stamp of all has no hole before it.
        let before = (self.rows > 0).then_some(self.last_s);
        if before.is_none() {
            (self.first_s, self.distinct) = (first, 1);
        }
        let first_s = self.first_s;
        time.iter_mut().for_each(|t| *t -= first_s);
        let mut holes = Vec::with_capacity(time.len());
        holes.extend(before.map(|before| time[0] - before));
        holes.extend(time.windows(2).map(|w| w[1] - w[0]));
        let skipped = time.len() - holes.len();
        let [lowest, highest] = bounds(&holes);
        if let (true, None) = (lowest < 0.0, self.backwards)
            && let Some(k) = holes
                .iter()
                .position(|hole| *hole < 0.0)
                .map(|k| k + skipped)
        {
            let from_s = k.checked_sub(1).map_or(self.last_s, |k| time[k]);
            self.backwards = Some((self.rows + k, from_s, time[k]));
        }
        if self.largest.is_none_or(|(_, largest)| highest > largest)
            && let Some(k) = holes.iter().position(|hole| *hole == highest)
        {
            self.largest = Some((self.rows + k + skipped, highest));
        }
        self.distinct += holes.iter().filter(|hole| **hole != 0.0).count();
        self.spacings.extend(holes.len(), |k| holes[k]);
        self.last_s = last - first_s;
        self.rows += time.len();
    }

    /// Stamps in whole seconds under many samples tell neither order nor feed.
    pub(super) fn coarse(&self) -> bool {
        self.distinct * 4 < self.rows
    }

    /// Time stamps must grow.
    pub(super) fn clock(self, entry: &Entry, field: usize) -> Result<Clock, CampaignError> {
        let refuse = |row, problem| Err(CampaignError::new(entry.place(row, field), problem));
        if let Some((row, from, to)) = self.backwards {
            let (from_s, to_s) = (from + self.first_s, to + self.first_s);
            return refuse(row, Problem::TimeBackwards { from_s, to_s });
        }
        if self.last_s <= 0.0 {
            return refuse(
                self.rows.saturating_sub(1),
                Problem::TimeConstant { at_s: self.first_s },
            );
        }
        // Stamps are rounded to the ticks of the instrument: spacings scatter by up to a tick, a lost sample adds a spacing.
        // None is negative, so their order is that of their bits.
        let mut spacings: Vec<u64> = self
            .spacings
            .into_values()
            .into_iter()
            .map(f64::to_bits)
            .collect();
        let rank = |share: f64| (spacings.len().saturating_sub(1) as f64 * share).round() as usize;
        let (low, high) = (rank(0.05), rank(0.95));
        let longest_s = f64::from_bits(*spacings.select_nth_unstable(high).1);
        let shortest_s = f64::from_bits(*spacings[..=high].select_nth_unstable(low).1);
        let central: Vec<f64> = spacings[low..=high]
            .iter()
            .map(|bits| f64::from_bits(*bits))
            .collect();
        let spacing_s = sum(&central) / central.len() as f64;
        let limit = spacing_s + f64::max(1.05 * (longest_s - shortest_s), 0.5 * spacing_s);
        let gap = self
            .largest
            .filter(|(_, hole)| *hole > limit)
            .map(|(row, hole)| (row, hole - spacing_s));
        let (last, n) = (self.last_s, self.rows as f64);
        let turn_s = if gap.is_some() {
            last + spacing_s
        } else {
            last * n / (n - 1.0)
        };
        Ok(Clock {
            turn_s,
            spacing_s,
            gap,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn stamps_say_the_same_in_whatever_pieces_they_come(
            steps in prop::collection::vec(prop_oneof![6 => Just(10), 2 => 8..13, 1 => -3..40], 1..200),
            piece in 1..200_usize,
        ) {
            let mut at = 7;
            let times: Vec<f64> = steps
                .iter()
                .map(|step| {
                    at += step;
                    f64::from(at) / 1024.0
                })
                .collect();
            let (mut whole, mut pieces) = (Stamps::default(), Stamps::default());
            let (mut at_once, mut one_by_one) = (times.clone(), times);
            whole.take(&mut at_once);
            one_by_one.chunks_mut(piece).for_each(|part| pieces.take(part));
            prop_assert_eq!(at_once, one_by_one);
            prop_assert_eq!(format!("{whole:?}"), format!("{pieces:?}"));
        }
    }
}
