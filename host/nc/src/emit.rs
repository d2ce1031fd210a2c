//! Writing the program: rewritten arcs as blocks, the rest byte by byte.
use super::blend::{self, Piece};
use super::correct::Plan;
use super::state::{Action, Arc, FeedMode};
use super::word::{Line, Word};
use super::{Compensated, Fate, Left, Report};
use std::fmt::Write as _;

pub(super) fn emit(
    lines: &[Line<'_>],
    actions: &[Action],
    plans: &[Option<Result<Plan, Left>>],
) -> Compensated {
    let end = lines
        .iter()
        .map(|l| l.end)
        .find(|e| !e.is_empty())
        .unwrap_or(b"\n");
    let mut out = Writer {
        program: Vec::new(),
        end,
        place: None,
        modal: None,
        feed: None,
    };
    let mut arcs = Vec::new();
    for (i, line) in lines.iter().enumerate() {
        let fate = match (&actions[i], plans[i]) {
            (Action::Arc(arc), Some(Ok(plan))) => {
                let pieces = blend::pieces(arc, plan.twin.delta_mm, plan.entry, plan.exit);
                out.arc(line, arc, &plan, &pieces);
                let (radius_mm, feed_mm_s, delta_mm) =
                    (arc.radius_mm, arc.feed_mm_s, plan.twin.delta_mm);
                Some(Fate::Corrected {
                    radius_mm,
                    feed_mm_s,
                    delta_mm,
                    blocks: pieces.len(),
                    joint_share: plan.joint_share(),
                })
            }
            (action, plan) => {
                out.copy(line, action);
                plan.and_then(Result::err).map(Fate::Left)
            }
        };
        arcs.extend(fate.map(|fate| Report { line: i + 1, fate }));
    }
    Compensated {
        program: out.program,
        arcs,
    }
}

struct Writer<'a> {
    program: Vec<u8>,
    end: &'a [u8],
    /// Where the last rewritten arc ended as written, if the next one goes on from there, in program units.
    place: Option<[f64; 2]>,
    /// Motion in force and that of the original, where they differ.
    modal: Option<&'static str>,
    /// F word to be set again, in program units.
    feed: Option<f64>,
}

impl Writer<'_> {
    /// A line that is not rewritten.
    fn copy(&mut self, line: &Line<'_>, action: &Action) {
        self.place = None;
        if line.has(b'F') {
            self.feed = None;
        } else if *action != Action::Nothing
            && let Some(feed) = self.feed.take()
        {
            self.program
                .extend_from_slice(format!("F{}", number(feed, 6)).as_bytes());
            self.program.extend_from_slice(self.end);
        }
        let motion = line.words.iter().find(|w| is_motion(w));
        let mut text = line.text.to_vec();
        if motion.is_some() {
            self.modal = None;
        } else if matches!(action, Action::Arc(_) | Action::LostArc(_))
            && let Some(modal) = self.modal.take()
        {
            // The arc relied on the direction of the one before, whose last block may have the other one.
            let at = line
                .words
                .iter()
                .find(|w| !b"N".contains(&w.letter))
                .map_or(0, |w| w.range.start);
            text.splice(at..at, format!("{modal} ").into_bytes());
        }
        self.program.extend_from_slice(&text);
        self.program.extend_from_slice(line.end);
    }

    /// The blocks of an arc.
    fn arc(&mut self, line: &Line<'_>, arc: &Arc, plan: &Plan, pieces: &[Piece]) {
        let modes = arc.modes;
        let (unit, decimals) = if modes.inch { (25.4, 6) } else { (1.0, 5) };
        let scale = 10f64.powi(decimals);
        let round = |v: f64| (v / unit * scale).round() / scale;
        let axes = arc.plane.axes();
        let [a, b, c] = axes;
        let mut place = self
            .place
            .take()
            .unwrap_or_else(|| arc.start.map(|v| v / unit));
        let mut height = arc.lift.map_or(0.0, |[from, _]| from / unit);
        let factor = plan.twin.feed_factor;
        let total: f64 = pieces.iter().map(|p| p.length_mm).sum();
        let own = if arc.sweep_rad > 0.0 { "G3" } else { "G2" };
        let mut last_code = own;
        for (k, piece) in pieces.iter().enumerate() {
            let last = k + 1 == pieces.len();
            let code = match piece.centre {
                None => "G1",
                Some(_) if piece.ccw => "G3",
                Some(_) => "G2",
            };
            last_code = code;
            let mut words = String::new();
            // The end of the arc, if it is where it was, in the program's own digits.
            let kept = |letter: usize| {
                let word = line
                    .word(b"XYZ"[letter])
                    .filter(|_| last && modes.absolute)?;
                std::str::from_utf8(&line.text[word.range.start + 1..word.range.end])
                    .ok()
                    .map(str::trim)
            };
            let at_programmed_end = piece.end == arc.end;
            let mut next = place;
            for (slot, axis) in [a, b].into_iter().enumerate() {
                let target = piece.end[slot] / unit;
                let letter = char::from(b"XYZ"[axis]);
                if at_programmed_end && let Some(text) = kept(axis) {
                    next[slot] = target;
                    let _ = write!(words, "{letter}{text} "); // writing to a String cannot fail
                } else {
                    next[slot] = if at_programmed_end && last {
                        target
                    } else {
                        round(piece.end[slot])
                    };
                    let value = if modes.absolute {
                        next[slot]
                    } else {
                        next[slot] - place[slot]
                    };
                    let _ = write!(words, "{letter}{} ", number(value, decimals + 1));
                }
            }
            if let Some([from, to]) = arc.lift {
                let letter = char::from(b"XYZ"[c]);
                let target = if last {
                    to / unit
                } else {
                    round(from + (to - from) * piece.share)
                };
                match kept(c) {
                    Some(text) => _ = write!(words, "{letter}{text} "),
                    None => {
                        let value = if modes.absolute {
                            target
                        } else {
                            target - height
                        };
                        let _ = write!(words, "{letter}{} ", number(value, decimals + 1));
                    }
                }
                height = target;
            }
            if let Some(centre) = piece.centre {
                for (slot, axis) in [a, b].into_iter().enumerate() {
                    let from = if modes.absolute_centres {
                        0.0
                    } else {
                        place[slot]
                    };
                    let letter = char::from(b"IJK"[axis]);
                    let _ = write!(
                        words,
                        "{letter}{} ",
                        number(centre[slot] / unit - from, decimals + 1)
                    );
                }
                if piece.more_turns > 0 {
                    let _ = write!(words, "P{} ", piece.more_turns + 1);
                }
            }
            let feed = match modes.feed_mode {
                FeedMode::InverseTime => {
                    // The programmed time, longer by the radius where the feed is kept, shared out by length.
                    let slower = if factor == 1.0 {
                        1.0 + plan.twin.delta_mm / arc.radius_mm
                    } else {
                        1.0
                    };
                    Some(arc.feed_word / slower * total / piece.length_mm)
                }
                _ if factor != 1.0 && (k == 0) => Some(self.scaled_feed(arc, factor)),
                _ => None,
            };
            if let Some(feed) = feed {
                let _ = write!(words, "F{} ", number(feed, 6));
            }
            let words = words.trim_end();
            if k == 0 {
                self.first(line, code, words, &axes, feed.is_some());
            } else {
                self.program
                    .extend_from_slice(format!("{code} {words}").as_bytes());
            }
            self.program
                .extend_from_slice(if last { line.end } else { self.end });
            place = next;
        }
        self.modal = (last_code != own).then_some(own);
        if factor != 1.0 && modes.feed_mode == FeedMode::PerMinute {
            self.feed = Some(arc.feed_word);
        } else if line.has(b'F') {
            self.feed = None;
        }
        self.place = Some(place);
    }

    /// F word with the angular rate kept: the block, with its lift, takes its time.
    fn scaled_feed(&self, arc: &Arc, factor: f64) -> f64 {
        let climb = arc.lift.map_or(0.0, |[from, to]| to - from);
        let length = arc.length_mm();
        arc.feed_word * (length * factor).hypot(climb) / length.hypot(climb)
    }

    /// The original line with its geometry replaced and the rest in place.
    fn first(
        &mut self,
        line: &Line<'_>,
        code: &str,
        words: &str,
        axes: &[usize; 3],
        new_feed: bool,
    ) {
        let geometry = |w: &Word| {
            axes.iter()
                .any(|a| [b"XYZ"[*a], b"IJK"[*a]].contains(&w.letter))
                || matches!(w.letter, b'R' | b'P')
                || (w.letter == b'F' && new_feed)
        };
        let mut text = Vec::new();
        let mut at = 0;
        let mut written = false;
        let has_code = line.words.iter().any(is_motion);
        for word in &line.words {
            if is_motion(word) {
                text.extend_from_slice(&line.text[at..word.range.start]);
                text.extend_from_slice(code.as_bytes());
                at = word.range.end;
            } else if geometry(word) {
                text.extend_from_slice(&line.text[at..word.range.start]);
                if !written {
                    if text.last().is_some_and(|b| !b.is_ascii_whitespace()) {
                        text.push(b' ');
                    }
                    if !has_code {
                        text.extend_from_slice(format!("{code} ").as_bytes());
                    }
                    text.extend_from_slice(words.as_bytes());
                    written = true;
                } else {
                    // One blank between words is enough where a word was taken out.
                    while text.last().is_some_and(u8::is_ascii_whitespace) {
                        text.pop();
                    }
                }
                at = word.range.end;
            }
        }
        let rest = &line.text[at..];
        if rest.first().is_some_and(|b| !b.is_ascii_whitespace()) {
            text.push(b' ');
        }
        text.extend_from_slice(rest);
        self.program.extend_from_slice(&text);
    }
}

fn is_motion(word: &Word) -> bool {
    word.letter == b'G' && matches!(word.tenths(), 0 | 10 | 20 | 30)
}

/// A decimal of at most so many places, without trailing zeros.
fn number(value: f64, decimals: i32) -> String {
    let mut text = format!("{value:.*}", decimals as usize);
    if text.contains('.') {
        text.truncate(text.trim_end_matches('0').trim_end_matches('.').len());
    }
    if text == "-0" { "0".into() } else { text }
}
