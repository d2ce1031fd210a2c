//! RAPID, where a module is plain: every instruction on its own line, targets and speeds as literals or CONST.
//!
//! `MoveC via,to,speed,zone,tool\WObj:=frame;` is an arc from where the robot stands. One that lies in the XY plane
//! of its frame, with one orientation throughout, is corrected as an arc of G-code is and becomes several; every
//! other line is copied byte by byte. What decides at run time (IF, FOR, calls, VAR and PERS targets) is not
//! guessed at: the arcs behind it stay as they were. Written from the manuals; no robot has run the output.
mod data;
mod instruction;
mod read;
#[cfg(test)]
mod tests;

use super::blend::{self, Piece};
use super::check::Trouble;
use super::correct::{Law, Plan, decide_actions};
use super::mark::{self, Mark};
use super::state::{Action, Arc};
use super::{Compensated, Fate, Led, Options, Report, inverse::Inverse};
use giotto::model_file::ModelFile;
use read::{Motion, Reader};
use std::io;

/// Robots refuse arcs whose points are closer, mm.
const LEAST_MM: f64 = 0.1;
/// Robots refuse a via point that is seen from the start within 1° of the end: four times that is turned, and a little
/// more for the digits of the targets.
const LEAST_TURN_RAD: f64 = 4.1 * std::f64::consts::PI / 180.0;
/// Robots refuse arcs that turn farther in one instruction.
const MOST_TURN_RAD: f64 = 239.0 * std::f64::consts::PI / 180.0;

/// Whether a program is RAPID: a module or a procedure, behind the head of a backup or not.
///
/// ```
/// use giotto_nc::rapid::is_rapid;
///
/// assert!(is_rapid(b"MODULE part\n  PROC main()\n  ENDPROC\nENDMODULE\n"));
/// assert!(!is_rapid(b"G21\nG1 X10 F300\n"));
/// ```
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

/// Rewrites the arcs of a module into `out`, with a mark that says so; see [`super::compensate_to`].
///
/// # Errors
/// Those of `out`.
pub fn compensate_to(
    program: &[u8],
    model: &ModelFile,
    options: &Options,
    mark: Option<&Mark>,
    out: &mut dyn io::Write,
) -> io::Result<Vec<Report>> {
    let result = compensate(program, model, options);
    let corrected = result
        .arcs
        .iter()
        .any(|a| matches!(a.fate, Fate::Corrected { .. }));
    let at = mark::place(&result.program);
    match mark.filter(|_| corrected) {
        Some(mark) => {
            out.write_all(&result.program[..at])?;
            out.write_all(format!("! {mark}{}", line_end(program)).as_bytes())?;
            out.write_all(&result.program[at..])?;
        }
        None => out.write_all(&result.program)?,
    }
    Ok(result.arcs)
}

fn line_end(program: &[u8]) -> &'static str {
    match program.iter().position(|b| *b == b'\n') {
        Some(at) if at > 0 && program[at - 1] == b'\r' => "\r\n",
        _ => "\n",
    }
}

/// The instructions that a robot would refuse: MoveC with points closer than 0.1 mm, seen within 1° from the start, or
/// round by more than 240°.
pub(super) fn check(program: &[u8]) -> Vec<Trouble> {
    let mut reader = Reader::default();
    let mut list = Vec::new();
    for (index, line) in program.split_inclusive(|b| *b == b'\n').enumerate() {
        let points = reader.points(line);
        reader.step(line);
        let Some([start, via, end]) = points else {
            continue;
        };
        let to = |p: [f64; 3]| [0, 1, 2].map(|i| p[i] - start[i]);
        let (a, b) = (to(via), to(end));
        let size = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let dot: f64 = (0..3).map(|i| a[i] * b[i]).sum();
        let seen = (dot / (size(a) * size(b)))
            .clamp(-1.0, 1.0)
            .acos()
            .to_degrees();
        let what = match (size(a), size(b)) {
            (v, e) if v.min(e) < LEAST_MM => {
                Some(format!("points {:.3} mm from its start", v.min(e)))
            }
            _ if seen < 1.0 => Some(format!("a via point that is seen {seen:.2}° from its end")),
            _ => None,
        };
        list.extend(what.map(|what| Trouble {
            line: index + 1,
            what: format!("MoveC with {what}"),
        }));
    }
    list
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
    let law = Law {
        inverse: &Inverse::new(model, options),
        options,
        least_mm: LEAST_MM,
        tail_mm: 0.0,
    };
    let plans = decide_actions(&actions, &law);
    let mut out = Compensated {
        program: Vec::new(),
        arcs: Vec::new(),
    };
    let end = line_end(program);
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
                Some(plan.fate(arc, &pieces, Led::Not))
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

/// What the lines of a module do, by their number, with the stops between them.
pub(super) fn actions(program: &[u8]) -> Vec<(usize, Action)> {
    let mut reader = Reader::default();
    let mut list = Vec::new();
    for (index, line) in program.split_inclusive(|b| *b == b'\n').enumerate() {
        let read = reader.step(line);
        list.push((index + 1, read.action));
        list.extend(read.stops.then_some((index + 1, Action::Stop)));
    }
    list
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
    let indent = line.iter().take_while(|b| b.is_ascii_whitespace()).count();
    let mut text = Vec::new();
    let mut from = start;
    for (k, piece) in pieces.iter().enumerate() {
        let last = k + 1 == pieces.len();
        let stretch = Stretch {
            from,
            piece,
            motion,
            speed: match plan.twin.feed_factor * piece.speed {
                1.0 => motion.speed.clone(),
                factor => format!(
                    "[{},{}]",
                    number(arc.feed_mm_s * factor),
                    motion.other_speeds
                ),
            },
            // The end of the arc, if it is where it was, as it was written.
            to: if last && piece.end == arc.end {
                motion.to.clone()
            } else {
                motion.target(piece.end)
            },
            zone: if last { &motion.zone } else { motion.passing() },
        };
        let codes = stretch.codes(plan.twin.delta_mm);
        let count = codes.len();
        for (c, code) in codes.into_iter().enumerate() {
            text.extend_from_slice(&line[..indent]);
            text.extend_from_slice(code.as_bytes());
            if last && c + 1 == count {
                // A comment and the end of the line stay.
                text.extend_from_slice(&line[motion.rest..]);
            } else {
                text.extend_from_slice(end.as_bytes());
            }
        }
        from = piece.end;
    }
    text
}

impl Motion {
    fn target(&self, [x, y]: [f64; 2]) -> String {
        format!(
            "[[{},{},{}],{}]",
            number(x),
            number(y),
            self.height,
            self.pose
        )
    }

    /// The zone of what is passed on the way.
    fn passing(&self) -> &str {
        if self.zone.eq_ignore_ascii_case("fine") {
            "z0"
        } else {
            &self.zone
        }
    }
}

/// A piece of an arc as it is to be written.
struct Stretch<'a> {
    from: [f64; 2],
    piece: &'a Piece,
    motion: &'a Motion,
    speed: String,
    to: String,
    zone: &'a str,
}

impl Stretch<'_> {
    /// Its instructions.
    fn codes(&self, delta_mm: f64) -> Vec<String> {
        let Self {
            from,
            piece,
            motion,
            speed,
            to,
            zone,
        } = self;
        let (with, passing) = (&motion.tool, motion.passing());
        let Some(centre) = piece.centre else {
            return vec![format!("MoveL {to},{speed},{zone},{with};")];
        };
        let at = |angle: f64| motion.target(turned(*from, piece, centre, angle));
        let turn_rad = turn(*from, piece);
        let mut codes = Vec::new();
        if turn_rad < LEAST_TURN_RAD {
            let chords = chords(piece, turn_rad, delta_mm);
            for k in 1..chords {
                let place = at(turn_rad * f64::from(k) / f64::from(chords));
                codes.push(format!("MoveL {place},{speed},{passing},{with};"));
            }
            codes.push(format!("MoveL {to},{speed},{zone},{with};"));
            return codes;
        }
        // One instruction goes round no more than 240°.
        let halves = if turn_rad > MOST_TURN_RAD { 2 } else { 1 };
        let step = 0.5 * turn_rad / f64::from(halves);
        for half in 0..halves {
            let via = at(step * f64::from(2 * half + 1));
            let (end, zone) = if half + 1 == halves {
                (to.clone(), *zone)
            } else {
                (at(step * f64::from(2 * half + 2)), passing)
            };
            codes.push(format!("MoveC {via},{end},{speed},{zone},{with};"));
        }
        codes
    }
}

/// Angle that an arc turns from `from`, rad.
fn turn(from: [f64; 2], piece: &Piece) -> f64 {
    let Some(centre) = piece.centre else {
        return 0.0;
    };
    let [a, b] = [from, piece.end].map(|p| [p[0] - centre[0], p[1] - centre[1]]);
    let sense = if piece.ccw { 1.0 } else { -1.0 };
    (sense * (b[1].atan2(b[0]) - a[1].atan2(a[0]))).rem_euclid(std::f64::consts::TAU)
}

/// The point of an arc behind so much of a turn.
fn turned(from: [f64; 2], piece: &Piece, centre: [f64; 2], angle_rad: f64) -> [f64; 2] {
    let a = [from[0] - centre[0], from[1] - centre[1]];
    let sense = if piece.ccw { 1.0 } else { -1.0 };
    let (sin, cos) = (sense * angle_rad).sin_cos();
    [
        centre[0] + a[0] * cos - a[1] * sin,
        centre[1] + a[0] * sin + a[1] * cos,
    ]
}

/// Lines that take the place of an arc too flat for MoveC, so that they leave it by 1 % of the correction at most.
fn chords(piece: &Piece, turn_rad: f64, delta_mm: f64) -> u32 {
    let bulge_mm = piece.length_mm * turn_rad / 8.0;
    let least = (bulge_mm / (0.01 * delta_mm.abs()).max(5e-4)).sqrt().ceil();
    // Robots refuse points that are closer.
    least.min((piece.length_mm / LEAST_MM).floor()).max(1.0) as u32
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
