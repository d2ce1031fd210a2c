//! Writing corrected circles as blocks, and the numbers of all blocks behind them.
use super::super::blend::Piece;
use super::super::correct::Plan;
use super::super::state::Arc;
use super::block::{Block, Said, said};
use super::read::Form;
use std::f64::consts::{PI, TAU};
use std::io;

/// Radii of a `CR` block are smaller, mm.
const LARGEST_MM: f64 = 99_999.0;
/// An arc that bulges by less is written as a line, mm: twice the last digit.
const STRAIGHT_MM: f64 = 2e-4;

/// Writes blocks and counts them.
pub(super) struct Writer {
    /// Number of the next block; `None`: they have none.
    next: Option<u64>,
    end: &'static str,
    /// Where the last corrected circle ended, if the next one goes on from there.
    from: Option<[f64; 2]>,
}

/// A block of a circle's course.
enum Course {
    Line([f64; 2]),
    /// About the pole.
    Centre {
        to: [f64; 2],
        ccw: bool,
    },
    Radius {
        to: [f64; 2],
        radius: f64,
        ccw: bool,
    },
}

impl Writer {
    pub(super) fn new(blocks: &[Option<Block<'_>>], end: &'static str) -> Self {
        let first = blocks.iter().flatten().find(|b| !b.words.is_empty());
        Self {
            next: first.and_then(|b| b.number),
            end,
            from: None,
        }
    }

    fn number(&mut self) -> String {
        match &mut self.next {
            Some(next) => {
                *next += 1;
                format!("{} ", *next - 1)
            }
            None => String::new(),
        }
    }

    /// A block as it was, under its number.
    pub(super) fn copied(
        &mut self,
        line: &[u8],
        block: Option<&Block<'_>>,
        moves: bool,
        out: &mut dyn io::Write,
    ) -> io::Result<()> {
        if moves {
            self.from = None;
        }
        let numbered = block.filter(|b| b.number.is_some());
        let (Some(block), Some(next)) = (numbered, self.next) else {
            return out.write_all(line);
        };
        self.next = Some(next + 1);
        if block.number == self.next.map(|n| n - 1) {
            return out.write_all(line);
        }
        let indent = line.iter().take_while(|b| b.is_ascii_whitespace()).count();
        let digits = line[indent..]
            .iter()
            .take_while(|b| b.is_ascii_digit())
            .count();
        out.write_all(&line[..indent])?;
        write!(out, "{next}")?;
        out.write_all(&line[indent + digits..])
    }

    pub(super) fn comment(&mut self, words: &str, out: &mut dyn io::Write) -> io::Result<()> {
        let number = self.number();
        write!(out, "{number}; {words}{}", self.end)
    }

    /// The blocks that take the place of a circle.
    pub(super) fn circle(
        &mut self,
        line: &[u8],
        block: &Block<'_>,
        (arc, form): (&Arc, Form),
        plan: &Plan,
        pieces: &[Piece],
        out: &mut dyn io::Write,
    ) -> io::Result<()> {
        let held = self.from.take().filter(|_| plan.entry.held);
        let mut from = held.unwrap_or(arc.start);
        let mut courses = Vec::new();
        for piece in pieces {
            course(&mut courses, from, piece, (arc, form));
            from = piece.end;
        }
        self.from = Some(from);
        // R0 and F stand in the first block; so does the comment.
        let kept: Vec<&str> = block.words[1..]
            .iter()
            .filter(|w| matches!(said(w.text), Said::Feed(_) | Said::Compensation(_)))
            .map(|w| w.text)
            .collect();
        let count = courses.len();
        for (k, course) in courses.iter().enumerate() {
            let number = self.number();
            write!(out, "{number}{}", words(course, arc))?;
            if k == 0 {
                for word in &kept {
                    write!(out, " {word}")?;
                }
                // A comment, up to the end of the line.
                out.write_all(super::text(&line[block.end..]))?;
            }
            // The last line of a file may have no end.
            if k + 1 < count || line.ends_with(b"\n") {
                out.write_all(self.end.as_bytes())?;
            }
        }
        Ok(())
    }
}

/// The blocks of a piece.
fn course(list: &mut Vec<Course>, from: [f64; 2], piece: &Piece, (arc, form): (&Arc, Form)) {
    let to = piece.end;
    let Some(centre) = piece.centre else {
        list.push(Course::Line(to));
        return;
    };
    let [a, b] = [from, to].map(|p| [p[0] - centre[0], p[1] - centre[1]]);
    let radius = b[0].hypot(b[1]);
    let side = if piece.ccw { 1.0 } else { -1.0 };
    let mut turn = (side * (b[1].atan2(b[0]) - a[1].atan2(a[0]))).rem_euclid(TAU);
    if piece.length_mm > PI * radius && turn < 1e-6 {
        turn = TAU;
    }
    if centre == arc.centre && form == Form::Centre {
        list.push(Course::Centre { to, ccw: piece.ccw });
        return;
    }
    let at = |angle: f64| {
        let (sin, cos) = (side * angle).sin_cos();
        [
            centre[0] + a[0] * cos - a[1] * sin,
            centre[1] + a[0] * sin + a[1] * cos,
        ]
    };
    let bulge = piece.length_mm * turn / 8.0;
    let straight = bulge < STRAIGHT_MM;
    let parts = if straight {
        1.0
    } else if radius > LARGEST_MM {
        (bulge / STRAIGHT_MM).sqrt().ceil()
    } else {
        // A half turn by its radius is doubtful to the last digit: parts of a third of a turn at most.
        (turn / (0.66 * PI)).ceil().max(1.0)
    };
    for k in 1..=parts as u32 {
        let end = if f64::from(k) >= parts {
            to
        } else {
            at(turn * f64::from(k) / parts)
        };
        list.push(if straight || radius > LARGEST_MM {
            Course::Line(end)
        } else {
            Course::Radius {
                to: end,
                radius,
                ccw: piece.ccw,
            }
        });
    }
}

fn words(course: &Course, arc: &Arc) -> String {
    let place = |p: &[f64; 2]| {
        let one = |slot: usize| {
            // The end of the circle as the program has it, where it is that.
            let digits = if p[slot] == arc.end[slot] { 6 } else { 4 };
            number(p[slot], digits)
        };
        format!("X{} Y{}", one(0), one(1))
    };
    let turn = |ccw: &bool| if *ccw { "DR+" } else { "DR-" };
    match course {
        Course::Line(to) => format!("L {}", place(to)),
        Course::Centre { to, ccw } => format!("C {} {}", place(to), turn(ccw)),
        Course::Radius { to, radius, ccw } => {
            format!("CR {} R{} {}", place(to), number(*radius, 4), turn(ccw))
        }
    }
}

/// With its sign, without zeros behind.
fn number(value: f64, digits: usize) -> String {
    let text = format!("{value:+.digits$}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "+0".into()
    } else {
        text.into()
    }
}
