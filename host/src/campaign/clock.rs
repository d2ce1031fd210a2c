//! Time stamps, seen once and forgotten: order, duration, spacing, the largest hole.
use super::error::{CampaignError, Problem};
use super::manifest::Entry;
use super::thinned::Thinned;

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
    spacings: Thinned<f64>,
    largest: Option<(usize, f64)>,
}

impl Stamps {
    /// The next stamps; they are returned as time since the first one.
    pub(super) fn take(&mut self, time: &mut [f64]) {
        for t in time {
            if self.rows == 0 {
                self.first_s = *t;
            }
            *t -= self.first_s;
            if self.rows > 0 {
                let hole = *t - self.last_s;
                if hole < 0.0 && self.backwards.is_none() {
                    self.backwards = Some((self.rows, self.last_s, *t));
                }
                self.spacings.push(hole);
                if self.largest.is_none_or(|(_, largest)| hole > largest) {
                    self.largest = Some((self.rows, hole));
                }
                self.distinct += usize::from(hole != 0.0);
            } else {
                self.distinct = 1;
            }
            self.last_s = *t;
            self.rows += 1;
        }
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
            return refuse(self.rows.saturating_sub(1), Problem::TimeConstant { at_s: self.first_s });
        }
        // Stamps are rounded to the ticks of the instrument: spacings scatter by up to a tick, a lost sample adds a spacing.
        let mut spacings = self.spacings.into_values();
        spacings.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| spacings[((spacings.len() - 1) as f64 * share).round() as usize];
        let central = &spacings[spacings.len() / 20..spacings.len() - spacings.len() / 20];
        let spacing_s = central.iter().sum::<f64>() / central.len() as f64;
        let limit = spacing_s + f64::max(1.05 * (at(0.95) - at(0.05)), 0.5 * spacing_s);
        let gap = self.largest.filter(|(_, hole)| *hole > limit).map(|(row, hole)| (row, hole - spacing_s));
        let (last, n) = (self.last_s, self.rows as f64);
        let turn_s = if gap.is_some() { last + spacing_s } else { last * n / (n - 1.0) };
        Ok(Clock { turn_s, spacing_s, gap })
    }
}
