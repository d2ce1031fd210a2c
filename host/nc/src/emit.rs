//! Writing arcs as blocks. Each arc leaves modes, feed and motion in force as its own line would have left them, so that
//! no other line has to be touched.
use super::blend::Piece;
use super::correct::Plan;
use super::digits::push_number;
use super::state::{Arc, FeedMode, Plane, Shared, sub};
use super::word::{Counts, Line, VIA, Word};

/// Writes the blocks that take the place of arcs.
pub(super) struct Writer {
    /// End of the lines of the program.
    end: Vec<u8>,
    /// How far from its programmed end the last corrected arc ended as written, mm, and its plane.
    aside: Option<([f64; 2], Plane)>,
}

impl Writer {
    pub(super) fn new(end: &[u8]) -> Self {
        Self {
            end: end.to_vec(),
            aside: None,
        }
    }

    /// The blocks of an arc, appended to `out`.
    pub(super) fn arc(
        &mut self,
        line: &Line<'_>,
        arc: &Arc,
        plan: &Plan,
        pieces: &[Piece],
        out: &mut Vec<u8>,
    ) {
        let aside = self.aside.take();
        let carried = aside.filter(|(_, plane)| plan.entry.held && *plane == arc.plane);
        let [dx, dy] = carried.map_or([0.0; 2], |(aside, _)| aside);
        let start = [arc.start[0] + dx, arc.start[1] + dy];
        let mut block = Block::new(line, arc, pieces, start);
        let factor = plan.twin.feed_factor;
        let even = scaled_feed(arc, factor);
        let mut in_force = arc.feed_word;
        for (k, piece) in pieces.iter().enumerate() {
            let last = k + 1 == pieces.len();
            let code: &[u8] = match piece.centre {
                None => b"G1",
                Some(_) if piece.ccw => b"G3",
                Some(_) => b"G2",
            };
            let mut words = Vec::with_capacity(64);
            block.end(piece, last, &mut words);
            block.height(piece, &mut words);
            block.along(piece, k, &mut words);
            block.centre(piece, &mut words);
            let feed = match arc.modes.feed_mode {
                // Each block takes its own time at the speed of the arc.
                FeedMode::InverseTime => {
                    Some(60.0 * arc.feed_mm_s * factor * piece.speed / piece.length_mm)
                }
                _ => Some(even * piece.speed).filter(|feed| *feed != in_force),
            };
            in_force = feed.unwrap_or(in_force);
            if let Some(feed) = feed {
                words.extend_from_slice(b" F");
                push_number(&mut words, feed, 6);
            }
            if k == 0 {
                first(line, code, &words, arc.plane, feed.is_some(), out);
            } else {
                out.extend_from_slice(code);
                out.extend_from_slice(&words);
            }
            out.extend_from_slice(if last { line.end } else { &self.end });
            block.place = block.next;
        }
        if in_force != arc.feed_word && arc.modes.feed_mode == FeedMode::PerMinute {
            if line.end.is_empty() {
                out.extend_from_slice(&self.end);
            }
            out.push(b'F');
            push_number(out, arc.feed_word, 6);
            out.extend_from_slice(line.end);
        }
        self.aside = Some((sub(block.place, arc.end), arc.plane));
    }
}

/// F word with the angular rate kept: the block, with its lift, takes its time.
fn scaled_feed(arc: &Arc, factor: f64) -> f64 {
    if factor == 1.0 {
        return arc.feed_word;
    }
    let climb = arc.lift.map_or(0.0, |[from, to]| to - from);
    let length = arc.length_mm();
    arc.feed_word * (length * factor).hypot(climb) / length.hypot(climb)
}

/// The words of the blocks of one arc.
struct Block<'a> {
    line: &'a Line<'a>,
    arc: &'a Arc,
    unit: f64,
    decimals: usize,
    scale: f64,
    /// Last block on the arc itself.
    arc_ends: usize,
    /// Where the block begins and ends as written, mm.
    place: [f64; 2],
    next: [f64; 2],
    height: f64,
    shared: [Option<f64>; 4],
}

impl<'a> Block<'a> {
    fn new(line: &'a Line<'a>, arc: &'a Arc, pieces: &[Piece], place: [f64; 2]) -> Self {
        let (unit, decimals, scale) = if arc.modes.inch {
            (25.4, 6, 1e6)
        } else {
            (1.0, 5, 1e5)
        };
        Self {
            line,
            arc,
            unit,
            decimals,
            scale,
            arc_ends: pieces.iter().rposition(|p| !p.beyond).unwrap_or(0),
            place,
            next: place,
            height: arc.lift.map_or(0.0, |[from, _]| from / unit),
            shared: arc.shared.map(|s| s.map(|s| s.from)),
        }
    }

    fn round(&self, mm: f64) -> f64 {
        (mm / self.unit * self.scale).round() / self.scale * self.unit
    }

    /// A word of the arc in the program's own digits, where it holds as it stands.
    fn kept(&self, letter: u8) -> Option<&'a [u8]> {
        let holds = |w: &&Word| self.arc.modes.absolute && w.counts != Counts::FromStart;
        let word = self.line.word(letter).filter(holds)?;
        Some(self.line.text[word.range.start + 1..word.range.end].trim_ascii())
    }

    fn end(&mut self, piece: &Piece, last: bool, words: &mut Vec<u8>) {
        let arc = self.arc;
        let [a, b, _] = arc.plane.axes();
        for (slot, axis) in [a, b].into_iter().enumerate() {
            let letter = b"XYZ"[axis];
            // On a line along an axis the other coordinate is that of the arc's end.
            let at_end = last && piece.end[slot] == arc.end[slot];
            words.extend_from_slice(&[b' ', letter]);
            if at_end && let Some(text) = self.kept(letter) {
                self.next[slot] = piece.end[slot];
                words.extend_from_slice(text);
                continue;
            }
            let decimals = if at_end { 9 } else { self.decimals + 1 };
            self.next[slot] = if at_end {
                piece.end[slot]
            } else {
                self.round(piece.end[slot])
            };
            let from = if arc.modes.absolute {
                0.0
            } else {
                self.place[slot]
            };
            push_number(words, (self.next[slot] - from) / self.unit, decimals);
        }
    }

    fn height(&mut self, piece: &Piece, words: &mut Vec<u8>) {
        let Some([from, to]) = self.arc.lift else {
            return;
        };
        let letter = b"XYZ"[self.arc.plane.axes()[2]];
        if piece.beyond {
            return;
        }
        words.extend_from_slice(&[b' ', letter]);
        let ends = piece.share >= 1.0;
        if ends && let Some(text) = self.kept(letter) {
            words.extend_from_slice(text);
            return;
        }
        let target = if ends {
            to / self.unit
        } else {
            self.round(from + (to - from) * piece.share) / self.unit
        };
        let start = if self.arc.modes.absolute {
            0.0
        } else {
            self.height
        };
        push_number(words, target - start, self.decimals + 1);
        self.height = target;
    }

    /// Extruder and rotary axes, evenly along the arc.
    fn along(&mut self, piece: &Piece, k: usize, words: &mut Vec<u8>) {
        for (slot, shared) in self.arc.shared.iter().enumerate() {
            let Some(Shared {
                letter,
                from,
                to,
                relative,
            }) = *shared
            else {
                continue;
            };
            if piece.beyond {
                continue;
            }
            words.extend_from_slice(&[b' ', letter]);
            let ends = k == self.arc_ends;
            if ends
                && !relative
                && let Some(word) = self.line.word(letter)
            {
                let text = &self.line.text[word.range.start + 1..word.range.end];
                words.extend_from_slice(text.trim_ascii());
                continue;
            }
            let target = if ends {
                to
            } else {
                ((from + (to - from) * piece.share) * 1e5).round() * 1e-5
            };
            let start = match (relative, &mut self.shared[slot]) {
                (true, Some(start)) => std::mem::replace(start, target),
                _ => 0.0,
            };
            push_number(words, target - start, 7);
        }
    }

    fn centre(&self, piece: &Piece, words: &mut Vec<u8>) {
        let Some(centre) = piece.centre else {
            return;
        };
        let [a, b, _] = self.arc.plane.axes();
        for (slot, axis) in [a, b].into_iter().enumerate() {
            let from = if self.arc.modes.absolute_centres {
                0.0
            } else {
                self.place[slot]
            };
            words.extend_from_slice(&[b' ', b"IJK"[axis]]);
            push_number(words, (centre[slot] - from) / self.unit, self.decimals + 1);
        }
        if piece.more_turns > 0 {
            words.extend_from_slice(format!(" P{}", piece.more_turns + 1).as_bytes());
        }
    }
}

/// The original line with its geometry replaced and the rest in place.
fn first(
    line: &Line<'_>,
    code: &[u8],
    words: &[u8],
    plane: Plane,
    new_feed: bool,
    out: &mut Vec<u8>,
) {
    let [a, b, _] = plane.axes();
    // A third centre word, which is 0, stays.
    let geometry = |w: &Word| {
        b"XYZ".contains(&w.letter)
            || [b"IJK"[a], b"IJK"[b]].contains(&w.letter)
            || matches!(w.letter, b'R' | b'P' | b'E' | b'A' | b'B' | b'C')
            || VIA.contains(&w.letter)
            || (w.letter == b'F' && new_feed)
    };
    // Without its leading blank.
    let words = words.trim_ascii_start();
    let begin = out.len();
    let mut at = 0;
    let mut written = false;
    let has_code = line.words.iter().any(Word::is_motion);
    for word in &line.words {
        if word.is_motion() {
            out.extend_from_slice(&line.text[at..word.range.start]);
            out.extend_from_slice(code);
            at = word.range.end;
        } else if geometry(word) {
            out.extend_from_slice(&line.text[at..word.range.start]);
            if !written {
                if out[begin..]
                    .last()
                    .is_some_and(|b| !b.is_ascii_whitespace())
                {
                    out.push(b' ');
                }
                if !has_code {
                    out.extend_from_slice(code);
                    out.push(b' ');
                }
                out.extend_from_slice(words);
                written = true;
            } else {
                // One blank between words is enough where a word was taken out.
                while out[begin..].last().is_some_and(u8::is_ascii_whitespace) {
                    out.pop();
                }
            }
            at = word.range.end;
        }
    }
    let rest = &line.text[at..];
    if rest.first().is_some_and(|b| !b.is_ascii_whitespace()) {
        out.push(b' ');
    }
    out.extend_from_slice(rest);
}
