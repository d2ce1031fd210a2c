//! A block of a Klartext program as its words.

/// A block without its number and its comment.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Block<'a> {
    /// Its number; older posts leave it to the control.
    pub(super) number: Option<u64>,
    /// Byte behind the number and the blanks that follow it.
    pub(super) begin: usize,
    /// Byte behind the last word.
    pub(super) end: usize,
    /// Words, in upper case.
    pub(super) words: Vec<Word<'a>>,
}

/// A word and where it stands in the line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Word<'a> {
    pub(super) text: &'a str,
    pub(super) begin: usize,
}

/// What a word of a path function says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Said {
    /// `X+12.5`: 0 to 2 for X to Z; `IX+5` is incremental.
    Place {
        axis: usize,
        value: f64,
        incremental: bool,
    },
    /// `R+20` of a circle.
    Radius(f64),
    /// `R0`, `RL`, `RR`.
    Compensation(bool),
    /// `DR+`: counter-clockwise.
    Turn { ccw: bool },
    /// `F500`, mm/min.
    Feed(f64),
    /// `FMAX`: this block alone.
    Rapid,
    /// `M8`, in tenths.
    M(i64),
    /// A rotary or a parallel axis, a parameter, or what is not known.
    Other,
}

impl<'a> Block<'a> {
    /// The words of a line without its end; `None` for text that is not UTF-8.
    pub(super) fn read(line: &'a [u8]) -> Option<Self> {
        let text = std::str::from_utf8(line).ok()?;
        let code = text.split(';').next().unwrap_or_default();
        let blank = |c: char| c == ' ' || c == '\t';
        let start = code.len() - code.trim_start_matches(blank).len();
        let digits = code[start..].bytes().take_while(u8::is_ascii_digit).count();
        let behind = &code[start + digits..];
        let numbered = digits > 0 && (behind.is_empty() || behind.starts_with(blank));
        let number = code[start..start + digits]
            .parse()
            .ok()
            .filter(|_| numbered);
        let begin = if numbered {
            code.len() - behind.trim_start_matches(blank).len()
        } else {
            start
        };
        let mut words = Vec::new();
        let mut at = begin;
        for part in code[begin..].split(blank) {
            if !part.is_empty() {
                words.push(Word {
                    text: part,
                    begin: at,
                });
            }
            at += part.len() + 1;
        }
        let end = words.last().map_or(begin, |w| w.begin + w.text.len());
        Some(Self {
            number,
            begin,
            end,
            words,
        })
    }

    /// The first words, for comparison.
    pub(super) fn starts(&self, names: &[&str]) -> bool {
        names.len() <= self.words.len()
            && names
                .iter()
                .zip(&self.words)
                .all(|(name, word)| word.text.eq_ignore_ascii_case(name))
    }
}

/// What a word of a path function says.
pub(super) fn said(word: &str) -> Said {
    let upper = word.to_ascii_uppercase();
    match upper.as_str() {
        "R0" => return Said::Compensation(false),
        "RL" | "RR" => return Said::Compensation(true),
        "DR+" => return Said::Turn { ccw: true },
        "DR-" => return Said::Turn { ccw: false },
        "FMAX" => return Said::Rapid,
        _ => {}
    }
    let (incremental, rest) = match upper.strip_prefix('I') {
        Some(rest) => (true, rest),
        None => (false, upper.as_str()),
    };
    let axis = ["X", "Y", "Z"]
        .iter()
        .position(|name| rest.starts_with(name));
    if let Some(axis) = axis {
        // A place carries its sign or is a plain number.
        return number(&rest[1..]).map_or(Said::Other, |value| Said::Place {
            axis,
            value,
            incremental,
        });
    }
    if incremental {
        return Said::Other;
    }
    let of = |letter: char| upper.strip_prefix(letter).and_then(number);
    if let Some(radius) = of('R').filter(|_| upper[1..].starts_with(['+', '-'])) {
        Said::Radius(radius)
    } else if let Some(feed) = of('F').filter(|f| *f > 0.0) {
        Said::Feed(feed)
    } else if let Some(code) = of('M').filter(|m| *m >= 0.0) {
        Said::M((code * 10.0).round() as i64)
    } else {
        Said::Other
    }
}

/// Digits with a sign and a point, and nothing else.
pub(super) fn number(text: &str) -> Option<f64> {
    let plain = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.');
    (text.contains(|c: char| c.is_ascii_digit()) && text.chars().all(plain))
        .then(|| text.parse().ok())
        .flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_its_number_and_its_words() {
        let block = Block::read(b" 12  L X+10 R0 FMAX ; a").unwrap();
        assert_eq!(block.number, Some(12));
        let words: Vec<&str> = block.words.iter().map(|w| w.text).collect();
        assert_eq!(words, ["L", "X+10", "R0", "FMAX"]);
        assert_eq!((block.begin, block.end), (5, 19));
        assert!(block.starts(&["l", "x+10"]) && !block.starts(&["L", "Y"]));
        assert_eq!(Block::read(b"L X+1").unwrap().number, None);
        assert_eq!(Block::read(b"12").unwrap().number, Some(12));
        assert!(Block::read(b"3 ; only a comment").unwrap().words.is_empty());
    }

    #[test]
    fn words_of_a_path_function() {
        let place = |axis, value, incremental| Said::Place {
            axis,
            value,
            incremental,
        };
        for (word, expected) in [
            ("X+12.5", place(0, 12.5, false)),
            ("iz-3", place(2, -3.0, true)),
            ("Y7", place(1, 7.0, false)),
            ("X+Q5", Said::Other),
            ("X", Said::Other),
            ("A+90", Said::Other),
            ("PA+90", Said::Other),
            ("R+20", Said::Radius(20.0)),
            ("R-20.5", Said::Radius(-20.5)),
            ("R20", Said::Other),
            ("R0", Said::Compensation(false)),
            ("RR", Said::Compensation(true)),
            ("DR-", Said::Turn { ccw: false }),
            ("F500", Said::Feed(500.0)),
            ("FQ1", Said::Other),
            ("FAUTO", Said::Other),
            ("FZ0.1", Said::Other),
            ("M8", Said::M(80)),
            ("X+1.2.3", Said::Other),
        ] {
            assert_eq!(said(word), expected, "{word}");
        }
    }
}
