//! The moves of a program, for who draws or measures them: what is known of each, in the order in which they are run.
use super::engine::reading;
use super::flow::{Order, order};
use super::state::{Action, FeedMode, State};
use super::word::{self, Line};
use super::{Options, heidenhain, rapid};

/// One move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    /// Line of the program, from 1.
    pub line: usize,
    /// Where it begins, mm; `None` where the program does not say.
    pub from_mm: [Option<f64>; 3],
    /// Where it ends, mm.
    pub to_mm: [Option<f64>; 3],
    /// How it gets there.
    pub kind: Kind,
    /// Speed along it, mm/s; `None` where the program does not say.
    pub feed_mm_s: Option<f64>,
    /// Counts what is no line or arc at a feed: stops, rapid moves, what is not understood. A corrected program has the same ones
    /// in the same order.
    pub group: usize,
}

/// How a move gets to its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// G0 and what is like it.
    Rapid,
    /// Straight on.
    Line,
    /// On a circle.
    Arc {
        /// Indices in XYZ of the plane's first and second axis and of the one across.
        axes: [usize; 3],
        /// In the plane, mm.
        centre_mm: [f64; 2],
        /// Positive from the first axis to the second.
        sweep_rad: f64,
    },
    /// On an arc of which no more is known.
    Unread,
}

/// The moves of a program.
///
/// ```
/// use giotto_nc::path::{Kind, moves};
///
/// let program = "G21 G17 G90\nG0 X0 Y0\nG1 X10 F600\nG3 X15 Y5 J5\nM2\n";
/// let list = moves(program.as_bytes(), &giotto_nc::Options::default());
/// assert_eq!(list.len(), 3);
/// assert!(matches!(list[2].kind, Kind::Arc { centre_mm: [10.0, 5.0], .. }));
/// assert_eq!((list[2].line, list[2].feed_mm_s), (4, Some(10.0)));
/// ```
pub fn moves(program: &[u8], options: &Options) -> Vec<Move> {
    let mut path = Path::default();
    if rapid::is_rapid(program) {
        let mut at = [None; 3];
        for (line, action) in rapid::actions(program) {
            let known = path.take(line, action, [at, at], None);
            at = known.unwrap_or(at);
        }
        return path.moves;
    }
    if heidenhain::is_klartext(program) {
        let mut at = [None; 3];
        for (line, action, feed_mm_s) in heidenhain::actions(program, options) {
            let known = path.take(line, action, [at, at], feed_mm_s);
            at = known.unwrap_or(at);
        }
        return path.moves;
    }
    match order(program) {
        Order::Straight => {
            let mut state = State::new(reading(program, options, false));
            for (index, line) in word::lines(program).enumerate() {
                path.step(&mut state, index + 1, &line);
            }
        }
        Order::Followed(order) => {
            let mut state = State::new(reading(program, options, true));
            let lines: Vec<Line<'_>> = word::lines(program).collect();
            for index in order {
                path.step(&mut state, index + 1, &lines[index]);
            }
        }
    }
    path.moves
}

#[derive(Default)]
struct Path {
    moves: Vec<Move>,
    group: usize,
}

impl Path {
    fn step(&mut self, state: &mut State, number: usize, line: &Line<'_>) {
        let from = state.position();
        let action = state.step(number, line);
        let ends = [from, state.position()];
        let rapid = state.is_rapid() && matches!(action, Action::Other);
        let feed = match state.feed() {
            (Some(feed), Some(FeedMode::PerMinute)) => Some(feed * state.unit_mm() / 60.0),
            (Some(feed), Some(FeedMode::InverseTime)) => {
                let length = distance(ends[0], ends[1]);
                length.map(|mm| mm * feed / 60.0)
            }
            _ => None,
        };
        self.take(number, action, ends, feed);
        if rapid {
            self.push(number, ends, Kind::Rapid, None);
        }
    }

    /// Takes an action; where it leads if it says so.
    fn take(
        &mut self,
        number: usize,
        action: Action,
        ends: [[Option<f64>; 3]; 2],
        feed: Option<f64>,
    ) -> Option<[Option<f64>; 3]> {
        match action {
            Action::Nothing => None,
            Action::Stop | Action::Other => {
                self.group += 1;
                None
            }
            Action::LostArc(_) => {
                self.group += 1;
                self.push(number, ends, Kind::Unread, None);
                self.group += 1;
                None
            }
            Action::Line(line) => {
                let feed = line.feed_mm_s.or(feed).filter(|f| *f > 0.0);
                self.push(number, [line.start, line.end], Kind::Line, feed);
                Some(line.end)
            }
            Action::Arc(arc) => {
                let axes = arc.plane.axes();
                let [a, b, c] = axes;
                let mut ends = ends;
                for (place, end, lift) in [(0, arc.start, 0), (1, arc.end, 1)] {
                    (ends[place][a], ends[place][b]) = (Some(end[0]), Some(end[1]));
                    if let Some(lifts) = arc.lift {
                        ends[place][c] = Some(lifts[lift]);
                    }
                }
                let kind = Kind::Arc {
                    axes,
                    centre_mm: arc.centre,
                    sweep_rad: arc.sweep_rad,
                };
                self.push(number, ends, kind, Some(arc.feed_mm_s));
                Some(ends[1])
            }
        }
    }

    fn push(
        &mut self,
        line: usize,
        [from_mm, to_mm]: [[Option<f64>; 3]; 2],
        kind: Kind,
        feed_mm_s: Option<f64>,
    ) {
        self.moves.push(Move {
            line,
            from_mm,
            to_mm,
            kind,
            feed_mm_s,
            group: self.group,
        });
    }
}

/// Distance in the axes that are known; `None` where none is.
fn distance(a: [Option<f64>; 3], b: [Option<f64>; 3]) -> Option<f64> {
    let known = a.iter().zip(b).filter_map(|(a, b)| Some(b? - (*a)?));
    let (sum, count) = known.fold((0.0, 0), |(sum, n), d| (sum + d * d, n + 1));
    (count > 0).then_some(f64::sqrt(sum))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn groups(program: &str) -> Vec<(usize, usize)> {
        let list = moves(program.as_bytes(), &Options::default());
        list.iter().map(|m| (m.line, m.group)).collect()
    }

    #[test]
    fn what_is_no_feed_move_begins_another_group() {
        let program = "G21 G17 G90 F600\nG0 X0 Y0\nG1 X10\n(a)\nG3 X15 Y5 J5\nG4 P1\nG1 Y9\n";
        assert_eq!(groups(program), [(2, 1), (3, 1), (5, 1), (7, 2)]);
    }

    #[test]
    fn a_subprogram_is_run_as_often_as_it_is_called() {
        let program =
            "O1\nG21 G17 G90 G0 X0 Y0 F600\nM98 P2\nG0 X0 Y0\nM98 P2\nM30\nO2\nG1 X5\nM99\n";
        let lines: Vec<usize> = groups(program).iter().map(|g| g.0).collect();
        assert_eq!(lines, [2, 8, 4, 8]);
    }

    #[test]
    fn an_arc_that_cannot_be_read_stands_alone() {
        let program = "G21 G17 G90 F600\nG0 X0 Y0\nG3 X9 Y9 I1 J5\nG1 X5\n";
        let list = moves(program.as_bytes(), &Options::default());
        assert_eq!(list[1].kind, Kind::Unread);
        assert!(list[0].group < list[1].group && list[1].group < list[2].group);
    }
}
