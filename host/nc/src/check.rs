//! A program held against the rules of the controller that it is for.
use super::arc::sub;
use super::left::Left;
use super::rapid;
use super::state::{Action, Arc, Reading, State};
use super::word::{self, Line, Sort};
use std::f32::consts::TAU;

/// Whose rules.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Controller {
    /// LinuxCNC 2.9: lines of 255 bytes, radii that agree to 0.0127 mm.
    LinuxCnc,
    /// Grbl 1.1: its codes, lines of 80 bytes, arcs in 32 bits.
    Grbl,
    /// RAPID: MoveC of 0.1 mm, 1° and 240°.
    Abb,
}

/// A line that would be refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Trouble {
    /// From 1.
    pub line: usize,
    /// What it is.
    pub what: String,
}

/// The lines of a program that a controller would refuse.
///
/// ```
/// use giotto_nc::check::{Controller, check};
///
/// assert!(check(b"G21\nG1 X10 F300\n", Controller::Grbl).is_empty());
/// // Grbl knows no cutter compensation.
/// let trouble = check(b"G21\nG41 D1\n", Controller::Grbl);
/// assert_eq!(trouble[0].line, 2);
/// ```
pub fn check(program: &[u8], controller: Controller) -> Vec<Trouble> {
    if controller == Controller::Abb {
        return rapid::check(program);
    }
    let mut state = State::new(Reading {
        followed: true,
        ..Reading::default()
    });
    let mut list = Vec::new();
    for (index, line) in word::lines(program).enumerate() {
        let action = state.step(index + 1, &line);
        let what = match controller {
            Controller::LinuxCnc => linuxcnc(&line, &action),
            Controller::Grbl => grbl(&line, &action),
            Controller::Abb => None,
        };
        list.extend(what.map(|what| Trouble {
            line: index + 1,
            what,
        }));
    }
    list
}

/// Bytes of a line of LinuxCNC, its end among them.
const LINUXCNC_LINE: usize = 255;

fn linuxcnc(line: &Line<'_>, action: &Action) -> Option<String> {
    if line.text.len() >= LINUXCNC_LINE {
        return Some(format!(
            "{} bytes in a line, {} at most",
            line.text.len(),
            LINUXCNC_LINE - 1
        ));
    }
    match action {
        Action::LostArc(left @ (Left::Geometry | Left::ThirdCentre | Left::AbsoluteCentres)) => {
            Some(left.to_string())
        }
        _ => None,
    }
}

/// Bytes of a line of Grbl without blanks and comments.
const GRBL_LINE: usize = 79;

fn grbl(line: &Line<'_>, action: &Action) -> Option<String> {
    let bytes: usize = line.words.iter().map(|w| w.range.len()).sum();
    if bytes > GRBL_LINE {
        return Some(format!("{bytes} bytes in a line, {GRBL_LINE} at most"));
    }
    match line.sort {
        Sort::Flow(_) | Sort::Setting => return Some("no keywords, no parameters".to_owned()),
        Sort::Unread if !line.text.starts_with(b"$") => {
            return Some("words that are not understood".to_owned());
        }
        _ => {}
    }
    for word in &line.words {
        let known = match word.letter {
            b'G' => matches!(
                word.tenths(),
                0 | 10
                    | 20
                    | 30
                    | 40
                    | 100
                    | 170
                    | 180
                    | 190
                    | 200
                    | 210
                    | 280
                    | 281
                    | 300
                    | 301
                    | 382
                    | 383
                    | 384
                    | 385
                    | 400
                    | 431
                    | 490
                    | 530
                    | 540
                    | 550
                    | 560
                    | 570
                    | 580
                    | 590
                    | 610
                    | 800
                    | 900
                    | 910
                    | 911
                    | 920
                    | 921
                    | 930
                    | 940
            ),
            b'M' => matches!(
                word.tenths(),
                0 | 10 | 20 | 30 | 40 | 50 | 70 | 80 | 90 | 300
            ),
            b'P' => !matches!(action, Action::Arc(_) | Action::LostArc(_)),
            letter => b"FIJKLNRSTXYZ".contains(&letter),
        };
        if !known {
            let text = String::from_utf8_lossy(&line.text[word.range.clone()]).into_owned();
            return Some(format!("{text} is none of its words"));
        }
    }
    match action {
        Action::Arc(arc) => grbl_arc(arc),
        Action::LostArc(left @ (Left::Geometry | Left::AbsoluteCentres)) => Some(left.to_string()),
        _ => None,
    }
}

/// An arc as 32 bits have it.
fn grbl_arc(arc: &Arc) -> Option<String> {
    let single = |p: [f64; 2]| p.map(|v| v as f32);
    let from = single(arc.start);
    let to = single(arc.end);
    let [i, j] = single(sub(arc.centre, arc.start));
    let target = [to[0] - from[0] - i, to[1] - from[1] - j];
    let (radius, end) = (i.hypot(j), target[0].hypot(target[1]));
    let off = (end - radius).abs();
    if off > 0.005 && (off > 0.5 || off > 0.001 * radius) {
        return Some(format!("radii that differ by {off} mm in 32 bits"));
    }
    let angle = (-i * target[1] + j * target[0]).atan2(-i * target[0] - j * target[1]);
    let full = if arc.sweep_rad < 0.0 {
        angle >= -5e-7
    } else {
        angle <= 5e-7
    };
    let turned = match (full, arc.sweep_rad < 0.0) {
        (true, true) => angle - TAU,
        (true, false) => angle + TAU,
        _ => angle,
    };
    // Turns are one by the rules of Grbl; an arc of half a turn more or less is another one.
    let meant = arc.sweep_rad as f32;
    ((turned - meant).abs() > 0.5 * TAU).then(|| {
        format!(
            "{:.3}° that come out as {:.3}° in 32 bits",
            meant.to_degrees(),
            turned.to_degrees()
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(program: &str, controller: Controller) -> Vec<usize> {
        let found = check(program.as_bytes(), controller);
        found.iter().map(|t| t.line).collect()
    }

    #[test]
    fn what_each_would_refuse() {
        let program = format!(
            "G21 G17 G90 F100\nG0 X20 Y0\nG3 X-20 I-20\nG3 X20 I21\nG2 X0 Y-20 I-20 K3\nM62 P1\nG1 X5 A3\n({})\n",
            "x".repeat(300)
        );
        assert_eq!(lines(&program, Controller::LinuxCnc), [4, 5, 8]);
        assert_eq!(lines(&program, Controller::Grbl), [4, 6, 7]);
        let flat = "G21 F100\nG0 X1000 Y0\nG3 X1000 Y0.001 I-1000000 J0\n";
        assert_eq!(lines(flat, Controller::Grbl), [3]);
        assert_eq!(lines(flat, Controller::LinuxCnc), [0; 0]);
        assert_eq!(
            lines("G21 F100\nG0 X10 Y0\nG3 I-10 P2\n", Controller::Grbl),
            [3]
        );
    }
}
