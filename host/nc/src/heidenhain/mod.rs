//! Klartext of Heidenhain: `C` about a pole and `CR` in a program of path functions.
//!
//! A corrected circle becomes `CR` and `L` blocks where the offset grows and fades, and a `C` about the same pole, or a `CR`, between
//! them; `CC` blocks stay. Block numbers count on, and so those behind a corrected circle are others; jumps go to labels and not to
//! them. A program that turns, mirrors or scales its coordinates anywhere is left: its blocks may run in either. F has no block of its
//! own there, so that it is kept to the last before a stop. Written from the manuals; no control has run the output.
mod block;
mod read;
#[cfg(test)]
mod tests;
mod write;

use super::correct::{Law, decide_actions};
use super::inverse::Inverse;
use super::mark::Mark;
use super::state::{Action, Straight};
use super::{Fate, Keep, Led, Left, Options, Report, blend};
use block::Block;
use giotto::model_file::ModelFile;
use read::{Read, Reader};
use std::io;
use write::Writer;

/// Shortest block, mm: a hundred times the last digit.
const LEAST_MM: f64 = 0.01;

/// Whether a program is Klartext: its first block is `BEGIN PGM`.
///
/// ```
/// use giotto_nc::heidenhain::is_klartext;
///
/// assert!(is_klartext(b"0 BEGIN PGM PART MM\n1 L X+0 Y+0 R0 FMAX\n"));
/// assert!(!is_klartext(b"%\nO1 (BEGIN PGM)\n"));
/// ```
pub fn is_klartext(program: &[u8]) -> bool {
    program
        .split(|b| *b == b'\n')
        .map(<[u8]>::trim_ascii)
        .find(|line| !line.is_empty())
        .and_then(Block::read)
        .is_some_and(|block| block.starts(&["BEGIN", "PGM"]))
}

/// Rewrites the circles of a Klartext program into `out`, with a mark that says so; see [`super::compensate_to`].
///
/// # Errors
/// Those of `out`.
pub(super) fn compensate_to(
    program: &[u8],
    model: &ModelFile,
    options: &Options,
    mark: Option<&Mark>,
    out: &mut dyn io::Write,
) -> io::Result<Vec<Report>> {
    // Another feed, even for a stretch, would have to be taken back in a block that is not ours.
    let options = Options {
        slow_to_stops: false,
        ..options.clone()
    };
    let lines: Vec<&[u8]> = program.split_inclusive(|b| *b == b'\n').collect();
    let blocks: Vec<Option<Block<'_>>> = lines.iter().map(|l| Block::read(text(l))).collect();
    let reads = read_all(&blocks, &options);
    // A stop at the end of a block is one more action.
    let (mut actions, mut place) = (Vec::new(), Vec::new());
    for read in &reads {
        place.push(actions.len());
        actions.push(read.action);
        actions.extend(read.stops.then_some(Action::Stop));
    }
    let law = Law {
        inverse: &Inverse::new(model, &options),
        options: &options,
        least_mm: LEAST_MM,
        tail_mm: 0.0,
    };
    let plans = decide_actions(&actions, &law);
    let mut arcs = Vec::new();
    let any = place
        .iter()
        .any(|at| matches!((&actions[*at], &plans[*at]), (Action::Arc(_), Some(Ok(_)))));
    if !any {
        out.write_all(program)?;
        let left = place.iter().enumerate().filter_map(|(i, at)| {
            let left = plans[*at].as_ref()?.as_ref().err()?;
            Some(Report {
                line: i + 1,
                fate: Fate::Left(*left),
            })
        });
        return Ok(left.collect());
    }
    let mut writer = Writer::new(&blocks, line_end(program));
    for (i, line) in lines.iter().enumerate() {
        let at = place[i];
        let fate = match (&actions[at], &plans[at], reads[i].form, &blocks[i]) {
            (Action::Arc(arc), Some(Ok(plan)), Some(form), Some(block)) => {
                let pieces = blend::pieces(arc, plan.twin.delta_mm, plan.entry, plan.exit);
                writer.circle(line, block, (arc, form), plan, &pieces, out)?;
                Some(plan.fate(arc, &pieces, Led::Not))
            }
            (_, plan, ..) => {
                let moves = actions[at] != Action::Nothing;
                writer.copied(line, blocks[i].as_ref(), moves, out)?;
                let left = plan.as_ref().and_then(|p| p.as_ref().err());
                left.map(|left| Fate::Left(*left))
            }
        };
        arcs.extend(fate.map(|fate| Report { line: i + 1, fate }));
        let begins = blocks[i]
            .as_ref()
            .is_some_and(|b| b.starts(&["BEGIN", "PGM"]));
        if begins && let Some(mark) = mark {
            writer.comment(&mark.to_string(), out)?;
        }
    }
    Ok(arcs)
}

/// What the blocks of a program do, by their line, with the feed in force, mm/s, and the stops between them.
pub(super) fn actions(program: &[u8], options: &Options) -> Vec<(usize, Action, Option<f64>)> {
    let lines = program.split_inclusive(|b| *b == b'\n');
    let blocks: Vec<Option<Block<'_>>> = lines.map(|l| Block::read(text(l))).collect();
    let mut list = Vec::new();
    for (i, read) in read_all(&blocks, options).iter().enumerate() {
        list.push((i + 1, read.action, read.feed_mm_s));
        list.extend(read.stops.then_some((i + 1, Action::Stop, None)));
    }
    list
}

/// A line without its end.
fn text(line: &[u8]) -> &[u8] {
    let line = line.strip_suffix(b"\n").unwrap_or(line);
    line.strip_suffix(b"\r").unwrap_or(line)
}

fn line_end(program: &[u8]) -> &'static str {
    match program.iter().position(|b| *b == b'\n') {
        Some(at) if at > 0 && program[at - 1] == b'\r' => "\r\n",
        _ => "\n",
    }
}

fn read_all(blocks: &[Option<Block<'_>>], options: &Options) -> Vec<Read> {
    let mut reader = Reader::new(blocked(blocks, options));
    let mut reads: Vec<Read> = blocks.iter().map(|b| reader.step(b.as_ref())).collect();
    let corners: Vec<usize> = (0..reads.len()).filter(|i| reads[*i].trims).collect();
    for corner in corners {
        let moves = |i: &usize| reads[*i].action != Action::Nothing;
        let before = (0..corner).rfind(moves);
        let after = (corner + 1..reads.len()).find(moves);
        for beside in [before, after].into_iter().flatten() {
            cut(&mut reads[beside]);
        }
    }
    reads
}

/// A motion that begins or ends before its place in the program: none of it may be taken for an entry, and a circle is another one.
fn cut(read: &mut Read) {
    match read.action {
        Action::Line(line) => {
            read.action = Action::Line(Straight {
                bare: false,
                ..line
            });
        }
        Action::Arc(_) => {
            read.action =
                Action::LostArc(Left::Dialect("a circle of Heidenhain beside RND or CHF"));
            read.form = None;
        }
        _ => {}
    }
}

/// What keeps every circle of a program from being corrected, wherever it stands.
fn blocked(blocks: &[Option<Block<'_>>], options: &Options) -> Option<Left> {
    if options.keep == Keep::Omega {
        return Some(Left::Dialect(
            "a circle of Heidenhain, of which only the feed can be kept",
        ));
    }
    // Numbered from anywhere, but by one; or not at all.
    let mut numbers = blocks
        .iter()
        .flatten()
        .filter(|b| b.number.is_some() || !b.words.is_empty());
    let first = numbers.next().and_then(|b| b.number);
    let mut next = first;
    let counted = numbers.all(|block| {
        next = next.map(|n| n + 1);
        // Parameters of a cycle go on without a number.
        block.number == next || {
            let goes_on = block.number.is_none();
            if goes_on {
                next = next.map(|n| n - 1);
            }
            goes_on
        }
    });
    if !counted {
        return Some(Left::Dialect(
            "a circle of Heidenhain between block numbers that do not count by one",
        ));
    }
    blocks.iter().enumerate().find_map(|(i, block)| {
        let block = block.as_ref()?;
        let word = |k: usize| {
            block
                .words
                .get(k)
                .map_or("", |w| w.text)
                .to_ascii_uppercase()
        };
        let cycle = word(2);
        let cycle = cycle.split('.').next().unwrap_or_default();
        let name = match word(0).as_str() {
            "BEGIN" if word(3) == "INCH" => "INCH",
            "CYCL" if matches!(cycle, "8" | "10" | "11" | "19" | "26" | "27" | "28" | "39") => {
                "a cycle that turns, mirrors or scales"
            }
            "PLANE" if word(1) != "RESET" => "PLANE",
            "TRANS" => "TRANS",
            "FUNCTION" | "POLARKIN" => "FUNCTION",
            "TOOL" if word(1) == "CALL" && matches!(word(3).as_str(), "X" | "Y") => {
                "a tool along X or Y"
            }
            // The tool's tip, feed a turn, feed of the cutting edge, the machine's own axes.
            _ if block.words.iter().any(|w| {
                let upper = w.text.to_ascii_uppercase();
                ["M128", "M136", "M109", "M110", "M114", "M144"].contains(&upper.as_str())
            }) =>
            {
                "an M-function that changes what feeds or places mean"
            }
            _ => return None,
        };
        Some(Left::OtherCoordinates(super::Because {
            line: i + 1,
            code: super::Code::Named(name),
        }))
    })
}
