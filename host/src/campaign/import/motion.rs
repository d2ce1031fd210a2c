//! Turns found from the motion along the circle: start, stop, pauses, laps, both directions, run-in and run-out, arcs.
//!
//! The angle that was passed for the first time is a clock of its own: where it takes long, the machine stands or is about
//! to. Rows that lie closer than the others there are left out, so that standing still makes no weight.
use super::turns::{LeftOut, Pass, Turn, Turns, Why};
use crate::campaign::thinned::Thinned;
use crate::campaign::{Problem, SHORTEST_ARC_DEG};
use std::f64::consts::TAU;
use std::ops::Range;

/// Turning back by less is noise or overshoot.
const TURN_BACK_RAD: f64 = 10.0 * TAU / 360.0;
/// A jump by more along the circle ends a passage.
const JUMP_RAD: f64 = 36.0 * TAU / 360.0;
/// Finest piece of the circle of which the duration is looked at.
const PIECE_RAD: f64 = TAU / 360.0;
/// A piece that takes so many times as long as usual is a stop or a ramp.
const SLOW: f64 = 2.0;

/// Angles of the rows of a file and which of them are on the circle.
pub(super) struct Track<'a> {
    pub(super) angle: &'a mut [f64],
    /// Rows on the circle, in order.
    pub(super) on: &'a [Range<usize>],
    /// Time, s; every n-th of long recordings, none where the file has none.
    pub(super) time: &'a Thinned<f64>,
}

/// A motion in one direction: its rows, first and last at the ends of it.
struct Leg {
    rows: Range<usize>,
    sign: f64,
    extent: f64,
}

/// How long each piece of a leg took.
struct Pace {
    piece: f64,
    duration: Vec<f64>,
    usual: f64,
    /// Typical angle between rows.
    spacing: f64,
}

impl Track<'_> {
    /// All turns.
    ///
    /// # Errors
    /// No motion of 180° or more in one direction.
    pub(super) fn turns(mut self) -> Result<Turns, Problem> {
        let legs = self.legs();
        let longest = legs.iter().map(|l| l.extent).fold(0.0, f64::max);
        let shortest = SHORTEST_ARC_DEG.to_radians();
        let passes: Vec<Pass> = legs
            .iter()
            .filter(|leg| leg.extent + self.spacing(leg) >= shortest)
            .map(|leg| self.pass(leg))
            .collect();
        // An arc beside whole turns is a run-in or a run-out.
        let whole = passes.iter().any(|p| p.arc_rad.is_none());
        let passes: Vec<Pass> = passes
            .into_iter()
            .filter(|p| !whole || p.arc_rad.is_none())
            .collect();
        if passes.is_empty() {
            return Err(Problem::ShortArc {
                covered_deg: longest.to_degrees(),
            });
        }
        Ok(Turns { passes })
    }

    /// Rows on the circle within a range.
    fn rows(&self, within: Range<usize>) -> impl Iterator<Item = usize> + '_ {
        let from = self.on.partition_point(|r| r.end <= within.start);
        let end = within.end;
        self.on[from..]
            .iter()
            .take_while(move |r| r.start < end)
            .flat_map(move |r| r.start.max(within.start)..r.end.min(end))
    }

    /// Unwraps the angles in place and divides them where the direction changes.
    fn legs(&mut self) -> Vec<Leg> {
        let mut legs = Vec::new();
        let mut turning = Turning::default();
        let (mut turns, mut last): (f64, Option<f64>) = (0.0, None);
        for range in self.on {
            for row in range.clone() {
                let raw = self.angle[row] + turns;
                let step = last.map_or(0.0, |l| raw - l);
                let whole = TAU * (step / TAU).round();
                turns -= whole;
                self.angle[row] = raw - whole;
                if last.is_some() && (step - whole).abs() > JUMP_RAD && row == range.start {
                    legs.extend(std::mem::take(&mut turning).end());
                }
                last = Some(self.angle[row]);
                legs.extend(turning.push(row, self.angle[row]));
            }
        }
        legs.extend(turning.end());
        legs
    }

    fn time(&self, row: usize) -> f64 {
        let Some((at, t)) = self.time.at(row) else {
            return row as f64;
        };
        match self.time.after(row) {
            Some((next, after)) if next > at => {
                t + (after - t) * (row - at) as f64 / (next - at) as f64
            }
            _ => t,
        }
    }

    /// Typical angle between rows while the machine moves: half of all motion is in larger steps. Standing still makes many
    /// steps and no motion.
    fn spacing(&self, leg: &Leg) -> f64 {
        let n = leg.rows.len();
        let stride = n.div_ceil(4096);
        let mut steps: Vec<f64> = leg
            .rows
            .clone()
            .step_by(stride)
            .filter(|k| k + 1 < leg.rows.end)
            .map(|k| self.angle[k + 1] - self.angle[k])
            .map(|step| (step - TAU * (step / TAU).round()).abs())
            .collect();
        steps.sort_unstable_by(f64::total_cmp);
        let half = 0.5 * steps.iter().sum::<f64>();
        let mut sum = 0.0;
        let typical = steps.iter().rev().find(|step| {
            sum += **step;
            sum >= half
        });
        // Between the rows of dense recordings there is more noise than motion.
        typical
            .copied()
            .unwrap_or(0.0)
            .min(8.0 * leg.extent / n as f64)
    }

    fn progress(&self, leg: &Leg, row: usize) -> f64 {
        leg.sign * (self.angle[row] - self.angle[leg.rows.start])
    }

    /// Durations of the pieces of a leg, by first passages.
    fn pace(&self, leg: &Leg) -> Pace {
        let spacing = self.spacing(leg);
        let wanted = PIECE_RAD.max(4.0 * spacing).min(leg.extent / 12.0);
        let pieces = (leg.extent / wanted).floor().max(1.0);
        let piece = leg.extent / pieces;
        let count = pieces as usize;
        let mut passed = Vec::with_capacity(count + 1);
        passed.push(self.time(leg.rows.start));
        let mut before = (0.0, leg.rows.start);
        for row in self.rows(leg.rows.clone()) {
            let p = self.progress(leg, row);
            let line = |passed: usize| passed as f64 * piece - 1e-9;
            if passed.len() <= count && p >= line(passed.len()) {
                let (from, to) = (self.time(before.1), self.time(row));
                while passed.len() <= count && p >= line(passed.len()) {
                    let share = (line(passed.len()) - before.0) / (p - before.0);
                    passed.push(from + (to - from) * share.clamp(0.0, 1.0));
                }
            }
            before = (p, row);
        }
        let duration: Vec<f64> = passed.windows(2).map(|w| w[1] - w[0]).collect();
        let mut sorted = duration.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let usual = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
        Pace {
            piece,
            duration,
            usual,
            spacing,
        }
    }

    /// The turns of a leg.
    fn pass(&self, leg: &Leg) -> Pass {
        let pace = self.pace(leg);
        let [from, to] = pace.steady(leg.extent);
        let spacing = pace.spacing;
        let tolerance = 2.0 * spacing + 1f64.to_radians();
        let laps = ((to - from + tolerance) / TAU).floor();
        let whole = leg.extent + spacing >= TAU - tolerance;
        let mut arc_rad = None;
        let start = if laps >= 2.0 {
            from
        } else if laps >= 1.0 {
            from + (0.5 * (to - from - TAU)).max(0.0)
        } else if whole {
            (0.5 * (from + to) - TAU / 2.0).clamp(0.0, (leg.extent - TAU).max(0.0))
        } else {
            arc_rad = Some(leg.extent + spacing);
            0.0
        };
        let mut turns = Vec::new();
        let mut rows = self.rows(leg.rows.clone());
        let reaches = |line: f64| move |row: &usize| self.progress(leg, *row) >= line;
        let mut first = if start <= 0.0 {
            leg.rows.start
        } else {
            rows.find(reaches(start)).unwrap_or(leg.rows.start)
        };
        for lap in 0..(laps.max(1.0) as usize) {
            let line = self.progress(leg, first) + TAU - 0.5 * spacing;
            let end = if arc_rad.is_some() {
                None
            } else {
                rows.find(reaches(line))
            };
            let end_row = end.unwrap_or(leg.rows.end);
            // What is left behind the last turn may close it but for its last spacing.
            let lasts = || leg.extent - self.progress(leg, first) + spacing;
            if lap > 0 && end.is_none() && lasts() < TAU - tolerance {
                break;
            }
            turns.push(self.turn(leg, &pace, first..end_row));
            first = end_row;
        }
        let rows_of = |angle: f64| (angle / spacing.max(1e-9)).round() as usize;
        let run_out = self.rows(first..leg.rows.end).next();
        Pass {
            sign: leg.sign,
            turns,
            arc_rad,
            motion: leg.rows.clone(),
            lead: [
                rows_of(start),
                run_out.map_or(0, |row| 1 + rows_of(leg.extent - self.progress(leg, row))),
            ],
        }
    }

    /// A turn without the rows that are not of it.
    fn turn(&self, leg: &Leg, pace: &Pace, rows: Range<usize>) -> Turn {
        let mut left_out: Vec<LeftOut> = Vec::new();
        let mut next = rows.start;
        let mut kept: Option<f64> = None;
        let mut out = |range: Range<usize>, why: Why| match left_out.last_mut() {
            Some(last) if last.rows.end == range.start && last.why == why => {
                last.rows.end = range.end;
            }
            _ => left_out.push(LeftOut { rows: range, why }),
        };
        for range in self.on {
            let on = range.start.max(rows.start)..range.end.min(rows.end);
            if on.is_empty() {
                continue;
            }
            if on.start > next {
                out(next..on.start, Why::OffCircle);
            }
            next = on.end;
            if !pace.any_slow(self.progress(leg, on.start), self.progress(leg, on.end - 1)) {
                kept = Some(self.progress(leg, on.end - 1));
                continue;
            }
            for row in on {
                let p = self.progress(leg, row);
                let near = kept.is_some_and(|kept| p < kept + 0.8 * pace.spacing);
                if near && pace.slow(p) {
                    out(row..row + 1, Why::Standing);
                } else {
                    kept = Some(kept.map_or(p, |k| k.max(p)));
                }
            }
        }
        if rows.end > next {
            out(next..rows.end, Why::OffCircle);
        }
        let moving = |l: &LeftOut| l.why == Why::Standing && l.rows.len() < 8;
        for l in &mut left_out {
            if moving(l) {
                l.why = Why::Ramp;
            } else if l.why == Why::Standing && self.jumps(leg, pace, l) {
                l.why = Why::Held;
            }
        }
        let last = left_out.last().map_or(0, |l| l.rows.end);
        let end = if last == rows.end {
            left_out.pop().map_or(rows.end, |l| l.rows.start)
        } else {
            rows.end
        };
        Turn {
            rows: rows.start..end,
            left_out,
            from_rad: 0.0,
        }
    }

    /// Whether the angle goes on behind a stop as if there had been none.
    fn jumps(&self, leg: &Leg, pace: &Pace, stop: &LeftOut) -> bool {
        let next = self.rows(stop.rows.end..leg.rows.end).next();
        let before = stop.rows.start.saturating_sub(1).max(leg.rows.start);
        next.is_some_and(|next| {
            let jump = self.progress(leg, next) - self.progress(leg, before);
            let time = self.time(next) - self.time(before);
            let expected = time / pace.usual * pace.piece;
            jump > 4.0 * pace.spacing && jump > 0.5 * expected
        })
    }
}

impl Pace {
    /// The part of a leg that runs at the usual rate, without start and stop.
    fn steady(&self, extent: f64) -> [f64; 2] {
        let n = self.duration.len();
        let mut off: Vec<f64> = self
            .duration
            .iter()
            .map(|d| (d / self.usual - 1.0).abs())
            .collect();
        off.sort_unstable_by(f64::total_cmp);
        let scatter = 1.4826 * off.get(n / 2).copied().unwrap_or(0.0);
        let limit = self.usual * (1.03 + (4.0 * scatter).min(0.3));
        let steady = |k: &usize| self.duration[*k] <= limit;
        let first = (0..n).find(steady).unwrap_or(0);
        let last = (0..n).rev().find(steady).unwrap_or(n.saturating_sub(1));
        let end = if last + 1 == n {
            extent
        } else {
            (last + 1) as f64 * self.piece
        };
        [first as f64 * self.piece, end]
    }

    fn slow(&self, progress: f64) -> bool {
        let k =
            ((progress / self.piece).max(0.0) as usize).min(self.duration.len().saturating_sub(1));
        // The first passage of the next line may be just behind a stop.
        let near = k.saturating_sub(1)..(k + 2).min(self.duration.len());
        self.duration[near].iter().any(|d| *d > SLOW * self.usual)
    }

    fn any_slow(&self, from: f64, to: f64) -> bool {
        let n = self.duration.len();
        let piece = |p: f64| ((p / self.piece).max(0.0) as usize).min(n.saturating_sub(1));
        let (from, to) = (piece(from).saturating_sub(1), (piece(to) + 2).min(n));
        self.duration[from.min(to)..to]
            .iter()
            .any(|d| *d > SLOW * self.usual)
    }
}

/// Follows an angle and tells where it turns back.
#[derive(Default)]
struct Turning {
    /// Rows and angles of the lowest and the highest since the last turn.
    ends: Option<[(usize, f64); 2]>,
    sign: f64,
    first: (usize, f64),
}

impl Turning {
    fn push(&mut self, row: usize, angle: f64) -> Option<Leg> {
        let Some([low, high]) = &mut self.ends else {
            self.ends = Some([(row, angle); 2]);
            return None;
        };
        if angle < low.1 {
            *low = (row, angle);
        }
        if angle > high.1 {
            *high = (row, angle);
        }
        if self.sign == 0.0 {
            if high.1 - low.1 > TURN_BACK_RAD {
                self.sign = if high.0 > low.0 { 1.0 } else { -1.0 };
                self.first = if high.0 > low.0 { *low } else { *high };
            }
            return None;
        }
        let far = if self.sign > 0.0 { *high } else { *low };
        if self.sign * (far.1 - angle) <= TURN_BACK_RAD {
            return None;
        }
        let leg = self.leg(far);
        self.sign = -self.sign;
        self.first = far;
        self.ends = Some(if self.sign > 0.0 {
            [far, (row, angle)]
        } else {
            [(row, angle), far]
        });
        Some(leg)
    }

    fn leg(&self, far: (usize, f64)) -> Leg {
        Leg {
            rows: self.first.0..far.0 + 1,
            sign: self.sign,
            extent: self.sign * (far.1 - self.first.1),
        }
    }

    fn end(self) -> Option<Leg> {
        let [low, high] = self.ends?;
        (self.sign != 0.0).then(|| self.leg(if self.sign > 0.0 { high } else { low }))
    }
}
