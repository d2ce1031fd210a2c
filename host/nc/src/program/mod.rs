//! A program as the segments that a controller runs.
//!
//! The reader is the one of `compensate`, which leaves alone what it does not understand. Here nothing may be left out: what
//! would make the machine do something else than the program says is an error with its place.
#[cfg(test)]
mod tests;
mod words;

use super::state::{Action, Arc, FeedMode, State};
use super::word::{self, Line, Word};
use giotto_shared::path::{Segment, Step};
use std::f64::consts::{PI, TAU};

/// What a program leaves open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Running {
    /// Where the machine stands, mm.
    pub start_mm: [f64; 3],
    /// Feed of G0, mm/s.
    pub rapid_mm_s: f64,
    /// How far the path may leave a joint where the program says neither G61 nor G64 P, mm.
    pub tolerance_mm: f64,
    /// M6 does nothing: the tool is in.
    pub tool_loaded: bool,
}

/// A step and the line it comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// From 1.
    pub line: usize,
    /// What to do.
    pub step: Step,
}

/// Something that no controller here can run.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{line}:{column}: {what}")]
pub struct NotRunnable {
    /// From 1.
    pub line: usize,
    /// From 1.
    pub column: usize,
    /// What it is, and what was expected.
    pub what: String,
}

/// The segments of a program, up to M2, M30 or its end.
///
/// # Errors
/// [`NotRunnable`] for the first line that cannot be run as it stands.
///
/// ```
/// use giotto_nc::program::{Running, blocks};
/// use giotto_shared::path::Segment;
///
/// let running = Running { start_mm: [0.0; 3], rapid_mm_s: 100.0, tolerance_mm: 0.01, tool_loaded: false };
/// let read = blocks(b"G21 G90\nG1 X10 F600\nM2\n", &running)?;
/// assert_eq!(read.len(), 1);
/// assert_eq!(read[0].line, 2);
/// assert!(matches!(read[0].step.segment, Segment::Line { to_m, feed_m_s }
///     if (to_m[0] - 0.01).abs() < 1e-12 && (feed_m_s - 0.01).abs() < 1e-12));
/// // What nobody here can run is refused with its place.
/// let refused = blocks(b"G21 G90\nG1 X10 F600\nG77 X3\n", &running).unwrap_err();
/// assert_eq!(refused.line, 3);
/// # Ok::<(), giotto_nc::program::NotRunnable>(())
/// ```
pub fn blocks(program: &[u8], running: &Running) -> Result<Vec<Block>, NotRunnable> {
    let mut reader = Reader {
        state: State::at(running.start_mm),
        running,
        tolerance_mm: running.tolerance_mm,
    };
    let mut blocks = Vec::new();
    for (index, line) in word::lines(program).enumerate() {
        let number = index + 1;
        let refused = |(column, what)| NotRunnable {
            line: number,
            column,
            what,
        };
        let segment = reader.segment(number, &line).map_err(refused)?;
        let tolerance_m = reader.tolerance_mm * 1e-3;
        blocks.extend(segment.map(|segment| Block {
            line: number,
            step: Step {
                segment,
                tolerance_m,
            },
        }));
        if ends(&line) {
            break;
        }
    }
    Ok(blocks)
}

/// M2 and M30.
fn ends(line: &Line<'_>) -> bool {
    line.words
        .iter()
        .any(|word| word.letter == b'M' && matches!(word.tenths(), 20 | 300))
}

struct Reader<'a> {
    state: State,
    running: &'a Running,
    tolerance_mm: f64,
}

/// Column and words.
type Trouble = (usize, String);

fn at(word: &Word, what: impl Into<String>) -> Trouble {
    (word.range.start + 1, what.into())
}

impl Reader<'_> {
    fn segment(&mut self, number: usize, line: &Line<'_>) -> Result<Option<Segment>, Trouble> {
        words::check(line, self.running.tool_loaded)?;
        if line
            .words
            .iter()
            .any(|word| word.letter == b'G' && word.tenths() == 40)
        {
            return words::dwell(line).map(Some);
        }
        let start = self.state.position();
        // The first work offset is none here, so that it moves nothing.
        let mut moves = line.clone();
        moves
            .words
            .retain(|word| !(word.letter == b'G' && word.tenths() == 540));
        let action = self.state.step(number, &moves);
        self.path_control(line)?;
        let first = line
            .words
            .iter()
            .find(|word| b"GXYZIJKR".contains(&word.letter));
        let column = first.map_or(1, |word| word.range.start + 1);
        match action {
            Action::Nothing | Action::Stop => Ok(None),
            Action::Arc(arc) => Ok(Some(self.arc(&arc))),
            Action::LostArc(left) => Err((column, left.to_string())),
            Action::Line(_) => self.line(line, start, false),
            Action::Other if self.state.is_rapid() => self.line(line, start, true),
            Action::Other => Err((
                column,
                "a motion that cannot be run; expected G0, G1, G2, G3 or G4".to_owned(),
            )),
        }
    }

    /// G61 and G64 P.
    fn path_control(&mut self, line: &Line<'_>) -> Result<(), Trouble> {
        for word in line.words.iter().filter(|word| word.letter == b'G') {
            match word.tenths() {
                610 | 611 => self.tolerance_mm = 0.0,
                640 => {
                    self.tolerance_mm = match line.word(b'P') {
                        None => self.running.tolerance_mm,
                        Some(p) if p.value >= 0.0 => p.value * self.state.unit_mm(),
                        Some(p) => return Err(at(p, "a tolerance below 0")),
                    }
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn line(
        &self,
        line: &Line<'_>,
        start: [Option<f64>; 3],
        rapid: bool,
    ) -> Result<Option<Segment>, Trouble> {
        let column = line.words.first().map_or(1, |word| word.range.start + 1);
        let known = |place: [Option<f64>; 3]| match place {
            [Some(x), Some(y), Some(z)] => Ok([x, y, z]),
            _ => Err((
                column,
                "where this block leads from or to is not known".to_owned(),
            )),
        };
        let (from, to) = (known(start)?, known(self.state.position())?);
        let length = from
            .iter()
            .zip(to)
            .map(|(a, b)| (b - a) * (b - a))
            .sum::<f64>()
            .sqrt();
        if length == 0.0 {
            return Ok(None);
        }
        let feed_mm_s = match self.state.feed() {
            _ if rapid => self.running.rapid_mm_s,
            (Some(feed), Some(FeedMode::PerMinute)) if feed > 0.0 => {
                feed * self.state.unit_mm() / 60.0
            }
            (Some(feed), Some(FeedMode::InverseTime)) if feed > 0.0 => length * feed / 60.0,
            _ => {
                return Err((
                    column,
                    "no feed for this block; expected F above 0".to_owned(),
                ));
            }
        };
        Ok(Some(Segment::Line {
            to_m: to.map(|mm| mm * 1e-3),
            feed_m_s: feed_mm_s * 1e-3,
        }))
    }

    /// An arc that ends where the program says: the radii of its start and end may differ by the rounding of the program,
    /// and the centre moves by half of that.
    fn arc(&self, arc: &Arc) -> Segment {
        let [a, b, c] = arc.plane.axes();
        let (chord, middle) = (
            [arc.end[0] - arc.start[0], arc.end[1] - arc.start[1]],
            [0, 1].map(|i| 0.5 * (arc.start[i] + arc.end[i])),
        );
        let square = chord[0] * chord[0] + chord[1] * chord[1];
        let mut centre = arc.centre;
        let mut sweep_rad = arc.sweep_rad;
        if square > 1e-18 {
            let along = (0..2)
                .map(|i| (middle[i] - centre[i]) * chord[i])
                .sum::<f64>()
                / square;
            centre = [0, 1].map(|i| centre[i] + along * chord[i]);
            let angle = |p: [f64; 2]| (p[1] - centre[1]).atan2(p[0] - centre[0]);
            // The same turn, to the last digit of these ends.
            let raw = angle(arc.end) - angle(arc.start) - sweep_rad;
            sweep_rad += (raw + PI).rem_euclid(TAU) - PI;
        }
        let (mut centre_m, mut normal) = ([0.0; 3], [0.0; 3]);
        let height_mm = arc
            .lift
            .map(|[from, _]| from)
            .or(self.state.position()[c])
            .unwrap_or(0.0);
        (centre_m[a], centre_m[b], centre_m[c]) =
            (centre[0] * 1e-3, centre[1] * 1e-3, height_mm * 1e-3);
        normal[c] = 1.0;
        let rise_m = arc.lift.map_or(0.0, |[from, to]| to - from) * 1e-3;
        Segment::Arc {
            centre_m,
            normal,
            sweep_rad,
            rise_m,
            feed_m_s: arc.feed_mm_s * 1e-3,
        }
    }
}
