//! A program as the segments that a controller runs.
//!
//! The reader is the one of `compensate`, which leaves alone what it does not understand. Here nothing may be left out: what
//! would make the machine do something else than the program says is an error with its place.
use super::state::{Action, Arc, FeedMode, State};
use super::word::{self, Line, Sort, Word};
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
        self.check(line)?;
        if line
            .words
            .iter()
            .any(|word| word.letter == b'G' && word.tenths() == 40)
        {
            return dwell(line).map(Some);
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

    /// Every word is one whose meaning is kept.
    fn check(&self, line: &Line<'_>) -> Result<(), Trouble> {
        let behind = line.words.last().map_or(0, |word| word.range.end);
        let unread = |what: &str| {
            let blanks = line.text[behind..]
                .iter()
                .take_while(|byte| byte.is_ascii_whitespace())
                .count();
            Err((behind + blanks + 1, what.to_owned()))
        };
        match line.sort {
            Sort::Plain => {}
            Sort::Optional => {
                return Err((
                    1,
                    "an optional block: remove it, or the slash before it".to_owned(),
                ));
            }
            Sort::Flow(_) => {
                return Err((
                    1,
                    "O-words: the order of lines would not be that of execution".to_owned(),
                ));
            }
            Sort::Unread | Sort::Setting => {
                return unread(
                    "parameters, expressions or settings; expected words with plain numbers",
                );
            }
        }
        for word in &line.words {
            if word.value.is_nan() {
                return Err((
                    word.range.start + 1,
                    "parameters, expressions or settings; expected words with plain numbers"
                        .to_owned(),
                ));
            }
            match word.letter {
                b'G' => match word.tenths() {
                    0 | 10 | 20 | 30 | 40 | 170 | 180 | 190 | 200 | 210 | 400 | 490 | 540 | 610
                    | 611 | 640 | 800 | 900 | 901 | 910 | 911 | 930 | 940 | 970 => {}
                    _ => {
                        return Err(at(
                            word,
                            format!("G{} cannot be run on a controller", word.value),
                        ));
                    }
                },
                b'M' => match word.tenths() {
                    0 | 10 | 600 => {
                        return Err(at(
                            word,
                            format!(
                                "M{} waits for a person, which a controller cannot",
                                word.value
                            ),
                        ));
                    }
                    60 if self.running.tool_loaded => {}
                    60 => {
                        return Err(at(word, "M6 changes a tool, which a controller cannot"));
                    }
                    // End, spindle, coolant.
                    20 | 300 | 30 | 40 | 50 | 70 | 80 | 90 => {}
                    _ => {
                        return Err(at(
                            word,
                            format!("M{} cannot be run on a controller", word.value),
                        ));
                    }
                },
                b'A' | b'B' | b'C' | b'U' | b'V' | b'W' => {
                    return Err(at(word, "another axis than X, Y and Z"));
                }
                b'N' | b'O' | b'X' | b'Y' | b'Z' | b'I' | b'J' | b'K' | b'R' | b'P' | b'F'
                | b'S' | b'T' => {}
                letter => {
                    return Err(at(
                        word,
                        format!("a word {} that means nothing here", char::from(letter)),
                    ));
                }
            }
        }
        Ok(())
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

/// G4 P, seconds.
fn dwell(line: &Line<'_>) -> Result<Segment, Trouble> {
    let code = line.words.iter().find(|word| word.letter == b'G');
    let other = line
        .words
        .iter()
        .find(|word| b"XYZIJKR".contains(&word.letter));
    if let Some(other) = other {
        return Err(at(other, "words in the block that do not go with G4 P"));
    }
    match line.word(b'P') {
        Some(p) if p.value > 0.0 => Ok(Segment::Dwell { time_s: p.value }),
        Some(p) => Err(at(p, "a dwell of no time; expected seconds above 0")),
        None => Err((
            code.map_or(1, |word| word.range.start + 1),
            "G4 without P, its seconds".to_owned(),
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn running() -> Running {
        Running {
            start_mm: [0.0; 3],
            rapid_mm_s: 200.0,
            tolerance_mm: 0.0,
            tool_loaded: false,
        }
    }

    fn read(program: &str) -> Result<Vec<Block>, NotRunnable> {
        blocks(program.as_bytes(), &running())
    }

    /// Where the machine is after each block, µm.
    fn ends_um(blocks: &[Block]) -> Vec<[f64; 3]> {
        let mut at = [0; 3];
        let mut ends = Vec::new();
        for block in blocks {
            at = block.step.segment.exact(at).unwrap().end_nm(at);
            ends.push(at.map(|nm| (f64::from(nm) * 1e-3 * 100.0).round() / 100.0));
        }
        ends
    }

    #[test]
    fn lines_arcs_helices_and_dwells() {
        let program = "%\nG21 G90 G17 F600\nG0 X10\nG1 Y5 (feed) F1200\nG3 X5 Y10 I-5\nG2 X5 Y10 I5 J0 Z-2 P2\nG4 P0.25\n\
                       G18 G3 X9 Z-2 I2 K0\nG91 G1 X1 Z2\nM3 S1000\nM30\nG1 X99\n";
        let blocks = read(program).unwrap();
        let lines: Vec<usize> = blocks.iter().map(|block| block.line).collect();
        assert_eq!(lines, [3, 4, 5, 6, 7, 8, 9]);
        let feeds: Vec<f64> = blocks
            .iter()
            .map(|block| match block.step.segment {
                Segment::Line { feed_m_s, .. } | Segment::Arc { feed_m_s, .. } => feed_m_s,
                Segment::Dwell { time_s } => time_s,
            })
            .collect();
        assert_eq!((feeds[0], feeds[1], feeds[4]), (0.2, 0.02, 0.25));
        let expected = [
            [10e3, 0.0, 0.0],
            [10e3, 5e3, 0.0],
            [5e3, 10e3, 0.0],
            [5e3, 10e3, -2e3],
            [5e3, 10e3, -2e3],
            [9e3, 10e3, -2e3],
            [10e3, 10e3, 0.0],
        ];
        assert_eq!(ends_um(&blocks), expected);
        // Two turns, the other way; G18's first axis is Z, its normal +Y.
        let Segment::Arc {
            sweep_rad, rise_m, ..
        } = blocks[3].step.segment
        else {
            panic!()
        };
        assert!((sweep_rad + 2.0 * TAU).abs() < 1e-9 && rise_m == -2e-3);
        let Segment::Arc {
            sweep_rad, normal, ..
        } = blocks[5].step.segment
        else {
            panic!()
        };
        assert!(
            (sweep_rad.abs() - PI).abs() < 1e-9 && normal == [0.0, 1.0, 0.0],
            "{sweep_rad}"
        );
    }

    #[test]
    fn an_arc_whose_radii_differ_by_rounding_ends_where_it_says() {
        let mut program = String::from("F600\n");
        for n in 1..=12 {
            let (s, c) = (f64::from(n) * 0.5).sin_cos();
            let (bs, bc) = (f64::from(n - 1) * 0.5).sin_cos();
            let place = |c: f64, s: f64| {
                (
                    (20.0 * c * 1e3).round() / 1e3 - 20.0,
                    (20.0 * s * 1e3).round() / 1e3,
                )
            };
            let ((x, y), (bx, by)) = (place(c, s), place(bc, bs));
            program.push_str(&format!(
                "G3 X{x:.3} Y{y:.3} I{:.3} J{:.3}\n",
                -20.0 - bx,
                -by
            ));
        }
        let blocks = read(&program).unwrap();
        let ends = ends_um(&blocks);
        for (block, end) in program.lines().skip(1).zip(ends) {
            let word = |letter: char| {
                let rest = &block[block.find(letter).unwrap() + 1..];
                rest.split(' ').next().unwrap().parse::<f64>().unwrap() * 1e3
            };
            assert!(
                (end[0] - word('X')).abs() < 0.02 && (end[1] - word('Y')).abs() < 0.02,
                "{block}: {end:?}"
            );
        }
    }

    #[test]
    fn path_control_is_exact_stop_or_a_tolerance() {
        let program =
            "F600\nG1 X1\nG64 P0.02\nG1 Y1\nG61\nG1 X0\nG64\nG1 Y0\nG20 G64 P0.001 G1 X1\n";
        let running = Running {
            tolerance_mm: 0.005,
            ..running()
        };
        let blocks = blocks(program.as_bytes(), &running).unwrap();
        let tolerances: Vec<f64> = blocks
            .iter()
            .map(|block| block.step.tolerance_m * 1e6)
            .collect();
        for (got, expected) in tolerances.iter().zip([5.0, 20.0, 0.0, 5.0, 25.4]) {
            assert!((got - expected).abs() < 1e-9, "{tolerances:?}");
        }
    }

    #[test]
    fn what_cannot_be_run_is_named_with_its_place() {
        let cases = [
            ("G1 X1", "1:1: no feed"),
            ("F600\nG1 X1 A3", "2:7: another axis"),
            ("F600\n/G1 X1", "2:1: an optional block"),
            ("F600 G1 X#1", "1:9: parameters"),
            ("o100 if [1]", "1:1: O-words"),
            ("G92 X0", "1:1: G92 cannot"),
            ("G28", "1:1: G28 cannot"),
            ("G1 F600 X1\nM0", "2:1: M0 waits"),
            ("F600\nX1e9", "2:3: a word E"),
            ("T1 M6", "1:4: M6 changes a tool"),
            ("G1 F600 X1\nM66", "2:1: M66 cannot"),
            ("G4", "1:1: G4 without P"),
            ("G4 P-1", "1:4: a dwell"),
            ("G4 P1 X1", "1:7: words"),
            ("G64 P-1", "1:5: a tolerance"),
            ("F600\nG3 X1 Y1 I5", "2:1: centre, radius"),
            ("G95 F1", "1:1: G95 cannot"),
            ("G80 X1", "1:1: a motion"),
        ];
        for (program, words) in cases {
            let error = read(program).unwrap_err().to_string();
            assert!(error.starts_with(words), "{program:?}: {error}");
        }
        // G54 is the machine's own coordinates here; comments, line numbers, spindle and coolant are nothing to a path.
        let loaded = Running {
            tool_loaded: true,
            ..running()
        };
        assert_eq!(blocks(b"T1 M6\n", &loaded).unwrap(), []);
        assert_eq!(read("N10 G54 G17 (part) M8 T1 S500\n").unwrap(), []);
    }
}
