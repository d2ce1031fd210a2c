//! RAPID, where a module is plain: every instruction on its own line, targets and speeds as literals or CONST.
//!
//! `MoveC via,to,speed,zone,tool\WObj:=frame;` is an arc from where the robot stands. One that lies in the XY plane
//! of its frame, with one orientation throughout, is corrected as an arc of G-code is and becomes several; every
//! other line is copied byte by byte. What decides at run time (IF, FOR, calls, VAR and PERS targets) is not
//! guessed at: the arcs behind it stay as they were. Written from the manuals; no robot has run the output.
mod read;
#[cfg(test)]
mod tests;

use super::blend::{self, Piece};
use super::correct::{Plan, decide};
use super::state::{Action, Arc};
use super::word::{Line, Sort};
use super::{Compensated, Fate, Options, Report, inverse::Inverse};
use giotto::model_file::ModelFile;
use read::{Motion, Reader};

/// Robots refuse arcs whose points are closer, mm.
const LEAST_MM: f64 = 0.1;

/// Whether a program is RAPID: a module or a procedure, behind the head of a backup or not.
pub fn is_rapid(program: &[u8]) -> bool {
    let mut words = program
        .split(|b| *b == b'\n')
        .map(|line| line.trim_ascii())
        .filter(|line| !line.is_empty() && !line.starts_with(b"!"))
        .skip_while(|line| {
            [b"%%%".as_slice(), b"VERSION:", b"LANGUAGE:"]
                .iter()
                .any(|head| line.starts_with(head))
        })
        .map(|line| {
            line.split(|b| !b.is_ascii_alphanumeric())
                .next()
                .unwrap_or_default()
                .to_ascii_uppercase()
        });
    words
        .next()
        .is_some_and(|word| [b"MODULE".as_slice(), b"PROC", b"LOCAL"].contains(&word.as_slice()))
}

/// Rewrites the arcs of a module.
pub fn compensate(program: &[u8], model: &ModelFile, options: &Options) -> Compensated {
    let lines: Vec<&[u8]> = program.split_inclusive(|b| *b == b'\n').collect();
    let mut reader = Reader::default();
    // What each line does; a stop at its end is one more action.
    let (mut actions, mut motions, mut place) = (Vec::new(), Vec::new(), Vec::new());
    for (i, line) in lines.iter().enumerate() {
        let read = reader.step(line);
        place.push(actions.len());
        actions.push(read.action);
        motions.push((i, read.motion));
        if read.stops {
            actions.push(Action::Other);
            motions.push((i, None));
        }
    }
    let nothing = Line {
        text: b"",
        end: b"",
        words: Vec::new(),
        sort: Sort::Plain,
    };
    let plans = decide(
        &vec![nothing; actions.len()],
        &actions,
        &Inverse::new(model, options),
        options,
        LEAST_MM,
    );
    let mut out = Compensated {
        program: Vec::new(),
        arcs: Vec::new(),
    };
    let end = lines
        .iter()
        .find_map(|l| l.ends_with(b"\r\n").then_some("\r\n"))
        .unwrap_or("\n");
    // Where the last rewritten arc ended, if the next one goes on from there.
    let mut from: Option<[f64; 2]> = None;
    for (i, line) in lines.iter().enumerate() {
        let at = place[i];
        let fate = match (&actions[at], &plans[at], &motions[at].1) {
            (Action::Arc(arc), Some(Ok(plan)), Some(motion)) => {
                let pieces = blend::pieces(arc, plan.twin.delta_mm, plan.entry, plan.exit);
                let text = blocks(
                    arc,
                    plan,
                    &pieces,
                    motion,
                    from.unwrap_or(arc.start),
                    line,
                    end,
                );
                out.program.extend_from_slice(&text);
                from = pieces.last().map(|p| p.end);
                let (radius_mm, feed_mm_s) = (arc.radius_mm, arc.feed_mm_s);
                let delta_mm = plan.twin.delta_mm;
                Some(Fate::Corrected {
                    radius_mm,
                    feed_mm_s,
                    delta_mm,
                    blocks: pieces.len(),
                    joint_share: plan.joint_share(),
                })
            }
            (action, plan, _) => {
                out.program.extend_from_slice(line);
                if *action != Action::Nothing {
                    from = None;
                }
                plan.as_ref()
                    .and_then(|p| p.as_ref().err())
                    .map(|left| Fate::Left(*left))
            }
        };
        out.arcs
            .extend(fate.map(|fate| Report { line: i + 1, fate }));
    }
    out
}

/// What the lines of a module do, with the stops between them.
#[cfg(test)]
pub(super) fn actions(program: &[u8]) -> Vec<Action> {
    let mut reader = Reader::default();
    let read = program
        .split_inclusive(|b| *b == b'\n')
        .map(|line| reader.step(line));
    read.flat_map(|read| std::iter::once(read.action).chain(read.stops.then_some(Action::Other)))
        .collect()
}

/// The instructions that take the place of an arc.
fn blocks(
    arc: &Arc,
    plan: &Plan,
    pieces: &[Piece],
    motion: &Motion,
    start: [f64; 2],
    line: &[u8],
    end: &str,
) -> Vec<u8> {
    let indent = line
        .iter()
        .take_while(|b| b.is_ascii_whitespace())
        .count()
        .min(line.len());
    let target = |[x, y]: [f64; 2]| {
        format!(
            "[[{},{},{}],{}]",
            number(x),
            number(y),
            motion.height,
            motion.pose
        )
    };
    let speed = match plan.twin.feed_factor {
        1.0 => motion.speed.clone(),
        factor => format!(
            "[{},{}]",
            number(arc.feed_mm_s * factor),
            motion.other_speeds
        ),
    };
    let passing = if motion.zone.eq_ignore_ascii_case("fine") {
        "z0"
    } else {
        &motion.zone
    };
    let mut text = Vec::new();
    let mut from = start;
    for (k, piece) in pieces.iter().enumerate() {
        let last = k + 1 == pieces.len();
        // The end of the arc, if it is where it was, as it was written.
        let to = if last && piece.end == arc.end {
            motion.to.clone()
        } else {
            target(piece.end)
        };
        let zone = if last { motion.zone.as_str() } else { passing };
        text.extend_from_slice(&line[..indent]);
        let with = &motion.tool;
        let code = match piece.centre {
            Some(centre) => {
                format!(
                    "MoveC {},{to},{speed},{zone},{with};",
                    target(middle(from, piece, centre))
                )
            }
            None => format!("MoveL {to},{speed},{zone},{with};"),
        };
        text.extend_from_slice(code.as_bytes());
        if last {
            // A comment and the end of the line stay.
            text.extend_from_slice(&line[motion.rest..]);
        } else {
            text.extend_from_slice(end.as_bytes());
        }
        from = piece.end;
    }
    text
}

/// The point halfway along an arc.
fn middle(from: [f64; 2], piece: &Piece, centre: [f64; 2]) -> [f64; 2] {
    let [a, b] = [from, piece.end].map(|p| [p[0] - centre[0], p[1] - centre[1]]);
    let sense = if piece.ccw { 1.0 } else { -1.0 };
    let turned = (sense * (b[1].atan2(b[0]) - a[1].atan2(a[0]))).rem_euclid(std::f64::consts::TAU);
    let (sin, cos) = (sense * 0.5 * turned).sin_cos();
    [
        centre[0] + a[0] * cos - a[1] * sin,
        centre[1] + a[0] * sin + a[1] * cos,
    ]
}

/// A hundredth of a micrometre, without trailing zeros.
fn number(value: f64) -> String {
    let text = format!("{value:.5}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".into()
    } else {
        text.into()
    }
}
