//! Turns of deviations over time. A ballbar knows nothing of the angle: a turn is found by its duration at the programmed
//! feed, by what repeats itself, and by where the readings stand still.
use super::turns::{LeftOut, Pass, Turn, Turns, Why};
use crate::campaign::manifest::Entry;
use crate::campaign::{Problem, check, sample_noise};
use std::f64::consts::TAU;
use std::ops::Range;

/// A pause without rows, and a stop, last at least this share of a turn.
const PAUSE: f64 = 0.1;
const STOP: f64 = 1.0 / 24.0;
/// Feeds of controllers are right within this share.
const FEED: f64 = 0.03;
/// Beyond the programmed feed no override goes further.
const SHORTEST_TURN: f64 = 0.79;
/// Means that stand for the readings when stops are looked for.
const MEANS: usize = 720;

/// Rows of deviations over time.
pub(super) struct Rows<'a> {
    time: &'a [f64],
    deviation: &'a [f64],
    /// Typical spacing, s.
    spacing: f64,
    /// Noise of a reading, m.
    noise: f64,
    /// A turn at the programmed feed, s.
    turn: f64,
}

/// What was found, and what is to be said of it.
pub(super) struct Found {
    pub(super) turns: Turns,
    /// Rows within the range of the instrument.
    pub(super) inside: Range<usize>,
    pub(super) notes: Vec<String>,
}

/// A passage before it is known which way it goes.
struct Piece {
    turns: Vec<Turn>,
    arc_rad: Option<f64>,
    /// Angle that was passed altogether.
    moved_rad: f64,
}

/// Finds the turns.
///
/// # Errors
/// Readings that last less than half a turn, or that only a wrong unit explains.
pub(super) fn turns(time: &[f64], deviation: &[f64], entry: &Entry) -> Result<Found, Problem> {
    let inside = |k: &usize| deviation[*k].abs() < check::INSTRUMENT_LIMIT_M;
    let (mut from, mut to) = (0, deviation.len());
    if (0..to).filter(inside).count() * 2 > to {
        // Readings beyond the range at either end are feed-in and feed-out.
        from = (0..to).find(inside).unwrap_or(0);
        to = (0..to).rfind(inside).map_or(to, |k| k + 1);
    }
    let mut steps: Vec<f64> = time[from..to].windows(2).map(|w| w[1] - w[0]).collect();
    let middle = steps.len() / 2;
    let spacing = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    let rows = Rows {
        time,
        deviation,
        spacing,
        noise: sample_noise(&deviation[from..to]),
        turn: TAU * entry.radius_m / entry.feed_m_s,
    };
    let whole = rows.lasts(from..to);
    check::slowness(entry, whole).map_err(|e| *e.problem)?;
    let mut notes = Vec::new();
    let mut pieces = Vec::new();
    for range in rows.divided(from..to) {
        pieces.push((range.clone(), rows.piece(range, entry, &mut notes)?));
    }
    let mut passes = Vec::new();
    let given = entry.direction.sign();
    let (mut sign, mut at_rad) = (f64::from(given), 0.0);
    for k in 0..pieces.len() {
        if k > 0 {
            let turn = |p: &Piece| p.turns.first().map_or(0..0, |t| t.rows.clone());
            let same = rows.same_way(turn(&pieces[k - 1].1), turn(&pieces[k].1));
            sign = if same { sign } else { -sign };
            let words = if sign > 0.0 {
                "counter-clockwise"
            } else {
                "clockwise"
            };
            let reason = if same {
                "its readings repeat those before"
            } else {
                "after the pause it goes back"
            };
            notes.push(format!("turn {} is taken as {words}: {reason}", k + 1));
        }
        let piece = &pieces[k].1;
        let placed = piece.turns.iter().map(|turn| Turn {
            from_rad: at_rad + sign * turn.from_rad,
            ..turn.clone()
        });
        let turns: Vec<Turn> = placed.collect();
        let range = &pieces[k].0;
        let end = turns.last().map_or(range.end, |t| t.rows.end);
        let lead = |t: &Turn| {
            if t.from_rad == at_rad {
                0
            } else {
                t.rows.start - range.start
            }
        };
        passes.push(Pass {
            sign,
            arc_rad: piece.arc_rad,
            motion: range.clone(),
            lead: turns.first().map_or([0; 2], |t| match lead(t) {
                0 => [0, 0],
                lead => [lead, range.end - end],
            }),
            turns,
        });
        at_rad += sign * piece.moved_rad;
    }
    Ok(Found {
        turns: Turns { passes },
        inside: from..to,
        notes,
    })
}

impl Rows<'_> {
    /// How long rows last, one spacing counted for the last.
    fn lasts(&self, rows: Range<usize>) -> f64 {
        let n = rows.len() as f64;
        let span = self.time[rows.end - 1] - self.time[rows.start];
        // Even stamps without a hole: the rounding of the last one makes no turn longer.
        let even = span * n / (n - 1.0);
        if (even - span) > 2.0 * self.spacing {
            span + self.spacing
        } else {
            even
        }
    }

    fn row_at(&self, rows: &Range<usize>, seconds: f64) -> usize {
        let t = self.time[rows.start] + seconds - 1e-9;
        rows.start + self.time[rows.clone()].partition_point(|v| *v < t)
    }

    /// Divides the rows where the test pauses between turns, with rows or without.
    fn divided(&self, rows: Range<usize>) -> Vec<Range<usize>> {
        let whole = |r: &Range<usize>| self.lasts(r.clone()) > 0.9 * self.turn;
        let mut parts = Vec::new();
        let mut rest = rows;
        while let Some(pause) = self
            .pause(&rest)
            .filter(|pause| whole(&(rest.start..pause.start)) && whole(&(pause.end..rest.end)))
        {
            parts.push(rest.start..pause.start);
            rest = pause.end..rest.end;
        }
        parts.push(rest);
        parts
    }

    /// The first pause behind a turn.
    fn pause(&self, rows: &Range<usize>) -> Option<Range<usize>> {
        let hole = (rows.start + 1..rows.end).find(|&k| {
            let step = self.time[k] - self.time[k - 1];
            step > PAUSE * self.turn && step > 4.0 * self.spacing
        });
        if let Some(k) = hole {
            return Some(k..k);
        }
        let fits = |turns: f64| (turns - turns.round()).abs() < FEED;
        if fits(self.lasts(rows.clone()) / self.turn) {
            return None;
        }
        let stops = self.stops(rows);
        stops.into_iter().find(|stop| {
            stop.start > rows.start
                && stop.end < rows.end
                && self.lasts(rows.start..stop.start) > 0.9 * self.turn
                && self.lasts(stop.end..rows.end) > 0.9 * self.turn
        })
    }

    /// Stretches over which the readings stand still within their noise.
    fn stops(&self, rows: &Range<usize>) -> Vec<Range<usize>> {
        let width = rows.len().div_ceil(MEANS);
        let means: Vec<f64> = self.deviation[rows.clone()]
            .chunks(width)
            .map(|c| c.iter().sum::<f64>() / c.len() as f64)
            .collect();
        // A drift of the mean of a stop is below what its noise allows.
        let limit = 4.0 * self.noise / (width as f64).sqrt() + 1e-9;
        let least = (STOP * self.turn / (self.spacing * width as f64)).max(8.0 / width as f64);
        let mut stops = Vec::new();
        let mut from = 0;
        while from < means.len() {
            let (mut sum, mut to) = (means[from], from + 1);
            while to < means.len() && (means[to] - sum / (to - from) as f64).abs() <= limit {
                sum += means[to];
                to += 1;
            }
            if (to - from) as f64 >= least {
                stops.push(rows.start + from * width..(rows.start + to * width).min(rows.end));
                from = to;
            } else {
                from += 1;
            }
        }
        stops
    }

    /// The turns of a stretch without pause.
    fn piece(
        &self,
        rows: Range<usize>,
        entry: &Entry,
        notes: &mut Vec<String>,
    ) -> Result<Piece, Problem> {
        let lasts = self.lasts(rows.clone());
        let ratio = lasts / self.turn;
        if (ratio - 1.0).abs() <= FEED {
            return Ok(one(rows));
        }
        if ratio < SHORTEST_TURN || (ratio < 1.0 - FEED && !self.closes(&rows)) {
            let covered_deg = 360.0 * ratio;
            if covered_deg < 180.0 {
                return Err(Problem::TooShort {
                    measured_s: lasts,
                    programmed_s: self.turn,
                    share: ratio,
                });
            }
            notes.push(format!(
                "{covered_deg:.1}° at the programmed feed: an arc, for its ends do not make a turn"
            ));
            return Ok(Piece {
                arc_rad: Some(TAU * ratio),
                moved_rad: TAU * ratio,
                ..one(rows)
            });
        }
        if let Some(laps) = check::laps(entry, lasts, &self.deviation[rows.clone()]) {
            return Ok(self.laps(&rows, lasts / f64::from(laps), laps as usize, 0.0));
        }
        if ratio > 1.0 + FEED {
            if let Some(turn_s) = self.period(&rows) {
                let laps = ((lasts + 2.0 * self.spacing) / turn_s).floor().max(1.0);
                let over = lasts - laps * turn_s;
                let lead = if laps > 1.0 { 0.0 } else { 0.5 * over };
                notes.push(format!(
                    "the readings repeat after {turn_s:.3} s: {:.0}° of run-in and run-out",
                    360.0 * over / turn_s
                ));
                return Ok(self.laps(&rows, turn_s, laps as usize, lead));
            }
            if let Some(piece) = self.without_stops(&rows, notes) {
                return Ok(piece);
            }
        }
        Ok(one(rows))
    }

    /// Laps of equal duration behind a lead.
    fn laps(&self, rows: &Range<usize>, turn_s: f64, laps: usize, lead_s: f64) -> Piece {
        let edge = |k: usize| {
            if k == laps && lead_s <= 0.5 * self.spacing {
                let end = self.row_at(rows, turn_s * laps as f64);
                return end.min(rows.end);
            }
            self.row_at(rows, lead_s + turn_s * k as f64 - 0.5 * self.spacing)
        };
        let turn = |k: usize| Turn {
            rows: edge(k)..edge(k + 1),
            left_out: Vec::new(),
            from_rad: TAU * (self.time[edge(k)] - self.time[rows.start]) / turn_s,
        };
        Piece {
            turns: (0..laps).map(turn).collect(),
            arc_rad: None,
            moved_rad: TAU * self.lasts(rows.clone()) / turn_s,
        }
    }

    /// One turn of the programmed duration where the rest stands still: before it, behind it or once within.
    fn without_stops(&self, rows: &Range<usize>, notes: &mut Vec<String>) -> Option<Piece> {
        let stops = self.stops(rows);
        let slack = self.turn / 30.0;
        let head = stops
            .first()
            .filter(|s| s.start == rows.start)
            .map_or(rows.start, |s| s.end);
        let tail = stops
            .last()
            .filter(|s| s.end == rows.end)
            .map_or(rows.end, |s| s.start);
        if tail <= head + 8 {
            return None;
        }
        let moving = self.lasts(head..tail);
        // Ends of a stop blur by what the form does not move there.
        if moving < self.turn + slack && moving > self.turn - 2.0 * slack - 2.0 * STOP * self.turn {
            let middle = 0.5 * (self.time[head] + self.time[tail - 1] + self.spacing);
            let from = (middle - 0.5 * self.turn - self.time[rows.start]).max(0.0);
            let first = self.row_at(rows, from - 0.5 * self.spacing);
            let end = self.row_at(rows, from + self.turn - 0.5 * self.spacing);
            return Some(Piece {
                turns: vec![Turn {
                    rows: first..end,
                    left_out: Vec::new(),
                    from_rad: 0.0,
                }],
                arc_rad: None,
                moved_rad: TAU,
            });
        }
        // Where the form is hardly more than the noise, a flat part of it is no stop.
        let values = &self.deviation[rows.clone()];
        let [low, high] = values
            .iter()
            .fold([f64::MAX, f64::MIN], |[l, h], v| [l.min(*v), h.max(*v)]);
        if high - low < 30.0 * self.noise {
            return None;
        }
        let stop = stops
            .into_iter()
            .filter(|s| s.start > head && s.end < tail)
            .max_by_key(Range::len)?;
        let over = moving - self.turn;
        let long = self.lasts(stop.clone());
        if over < 0.5 * long || over > long + slack {
            return None;
        }
        let middle = 0.5 * (self.time[stop.start] + self.time[stop.end - 1]);
        let at = |t: f64| self.row_at(rows, t - self.time[rows.start]);
        let pause = at(middle - 0.5 * over).max(head + 1)..at(middle + 0.5 * over).min(tail - 1);
        notes.push(format!("a stop of {over:.2} s is taken out of the time"));
        Some(Piece {
            turns: vec![Turn {
                rows: head..tail,
                left_out: vec![LeftOut {
                    rows: pause,
                    why: Why::Standing,
                }],
                from_rad: 0.0,
            }],
            arc_rad: None,
            moved_rad: TAU,
        })
    }

    /// Readings as they would be at even spacing, by steps of `step` seconds.
    fn even(&self, rows: &Range<usize>, step: f64) -> Vec<f64> {
        let count = (self.lasts(rows.clone()) / step) as usize;
        let mut k = rows.start;
        let at = |i: usize| {
            let t = self.time[rows.start] + i as f64 * step;
            while k + 2 < rows.end && self.time[k + 1] < t {
                k += 1;
            }
            let (a, b) = (self.time[k], self.time[k + 1]);
            let share = ((t - a) / (b - a).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            self.deviation[k] + share * (self.deviation[k + 1] - self.deviation[k])
        };
        (0..count).map(at).collect()
    }

    /// The duration after which the readings repeat, near that of the programmed feed.
    fn period(&self, rows: &Range<usize>) -> Option<f64> {
        let step = self.turn / 1440.0;
        let values = self.even(rows, step);
        let n = values.len();
        // Means of as many rows as a step holds.
        let averaged = (step / self.spacing).max(1.0);
        let noise = self.noise / averaged.sqrt();
        let least = 1440 / 18;
        let misfit = |lag: usize| {
            let m = (n - lag) as f64;
            let sum: f64 = (0..n - lag)
                .map(|k| (values[k + lag] - values[k]).powi(2))
                .sum();
            sum / m
        };
        let spread = |from: usize| {
            let part = &values[from..];
            let mean = part.iter().sum::<f64>() / part.len() as f64;
            part.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / part.len() as f64
        };
        let lags = (SHORTEST_TURN * 1440.0) as usize..n.saturating_sub(least).min(2000);
        let allowed = |lag: usize| 2.0 * (1.5 * noise).powi(2) + 0.01 * spread(lag);
        let fits =
            |lag: &usize| spread(*lag) > (4.0 * noise).powi(2) && misfit(*lag) <= allowed(*lag);
        // Of all that fit the nearest to the programmed feed, then the best beside it.
        let near = lags.filter(fits).min_by_key(|lag| lag.abs_diff(1440))?;
        let best = (near.saturating_sub(30)..(near + 30).min(n - least))
            .min_by(|a, b| misfit(*a).total_cmp(&misfit(*b)))?;
        let refined = if best > 1 && best + 1 < n - least {
            let (a, b, c) = (misfit(best - 1), misfit(best), misfit(best + 1));
            let bend = a - 2.0 * b + c;
            if bend > 0.0 {
                0.5 * (a - c) / bend
            } else {
                0.0
            }
        } else {
            0.0
        };
        let found = (best as f64 + refined.clamp(-1.0, 1.0)) * step;
        // Where the programmed duration fits as well, it is the better guess.
        let programmed = 1440.min(n - least);
        let as_good = misfit(programmed) <= 1.2 * misfit(best) && programmed == 1440;
        Some(if as_good { self.turn } else { found })
    }

    /// Whether the last reading leads to the first.
    fn closes(&self, rows: &Range<usize>) -> bool {
        let values = &self.deviation[rows.clone()];
        let m = (values.len() / 60).clamp(1, 64);
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
        let n = values.len();
        // Straight on from both ends to the seam.
        let first = 1.5 * mean(&values[..m]) - 0.5 * mean(&values[m..2 * m]);
        let last = 1.5 * mean(&values[n - m..]) - 0.5 * mean(&values[n - 2 * m..n - m]);
        let [low, high] = values
            .iter()
            .fold([f64::MAX, f64::MIN], |[l, h], v| [l.min(*v), h.max(*v)]);
        (first - last).abs() <= (0.25 * (high - low)).max(8.0 * self.noise)
    }

    /// Whether a turn goes the way of another: its readings repeat, forwards rather than backwards.
    fn same_way(&self, one: Range<usize>, other: Range<usize>) -> bool {
        const POINTS: usize = 360;
        let even = |rows: &Range<usize>| self.even(rows, self.lasts(rows.clone()) / POINTS as f64);
        let (a, b) = (even(&one), even(&other));
        let n = a.len().min(b.len());
        // Where a turn begins is known to within a spacing or two.
        let misfit = |partner: &dyn Fn(usize) -> usize| {
            let shifted = |shift: usize| -> f64 {
                (0..n)
                    .map(|k| (a[k] - b[(partner(k) + shift) % n]).powi(2))
                    .sum()
            };
            [0, 1, 2, n - 1, n - 2]
                .map(shifted)
                .into_iter()
                .fold(f64::MAX, f64::min)
        };
        misfit(&|k| k) < 0.4 * misfit(&|k| n - 1 - k)
    }
}

/// All rows as one turn.
fn one(rows: Range<usize>) -> Piece {
    Piece {
        turns: vec![Turn {
            rows,
            left_out: Vec::new(),
            from_rad: 0.0,
        }],
        arc_rad: None,
        moved_rad: TAU,
    }
}
