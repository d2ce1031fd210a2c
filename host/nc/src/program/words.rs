//! Words that a controller here can run: what would be another motion is named with its place.
use super::super::word::{CIP_TENTHS, Line, Sort, Word};
use super::{Segment, Trouble, at};

/// What is not a plain number.
const NOT_PLAIN: &str = "parameters, expressions or settings; expected words with plain numbers";

/// Every word is one whose meaning is kept.
pub(super) fn check(line: &Line<'_>, tool_loaded: bool) -> Result<(), Trouble> {
    match line.sort {
        Sort::Plain => {}
        Sort::Optional => {
            let what = "an optional block: remove it, or the slash before it";
            return Err((1, what.to_owned()));
        }
        Sort::Flow(_) => {
            let what = "O-words: the order of lines would not be that of execution";
            return Err((1, what.to_owned()));
        }
        Sort::Unread | Sort::Setting => {
            let behind = line.words.last().map_or(0, |word| word.range.end);
            let blanks = line.text[behind..]
                .iter()
                .take_while(|byte| byte.is_ascii_whitespace())
                .count();
            return Err((behind + blanks + 1, NOT_PLAIN.to_owned()));
        }
    }
    line.words
        .iter()
        .try_for_each(|word| runs(word, tool_loaded))
}

/// A single word.
fn runs(word: &Word, tool_loaded: bool) -> Result<(), Trouble> {
    if word.value.is_nan() {
        return Err(at(word, NOT_PLAIN));
    }
    match word.letter {
        b'G' => match word.tenths() {
            CIP_TENTHS => Err(at(word, "CIP cannot be run on a controller")),
            0 | 10 | 20 | 30 | 40 | 170 | 180 | 190 | 200 | 210 | 400 | 490 | 540 | 610 | 611
            | 640 | 800 | 900 | 901 | 910 | 911 | 930 | 940 | 970 => Ok(()),
            _ => Err(at(
                word,
                format!("G{} cannot be run on a controller", word.value),
            )),
        },
        b'M' => match word.tenths() {
            0 | 10 | 600 => Err(at(
                word,
                format!(
                    "M{} waits for a person, which a controller cannot",
                    word.value
                ),
            )),
            60 if tool_loaded => Ok(()),
            60 => Err(at(word, "M6 changes a tool, which a controller cannot")),
            // End, spindle, coolant.
            20 | 300 | 30 | 40 | 50 | 70 | 80 | 90 => Ok(()),
            _ => Err(at(
                word,
                format!("M{} cannot be run on a controller", word.value),
            )),
        },
        b'A' | b'B' | b'C' | b'U' | b'V' | b'W' => Err(at(word, "another axis than X, Y and Z")),
        b'N' | b'O' | b'X' | b'Y' | b'Z' | b'I' | b'J' | b'K' | b'R' | b'P' | b'F' | b'S'
        | b'T' => Ok(()),
        letter => Err(at(
            word,
            format!("a word {} that means nothing here", char::from(letter)),
        )),
    }
}

/// G4 P, seconds.
pub(super) fn dwell(line: &Line<'_>) -> Result<Segment, Trouble> {
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
