//! Lines of RS-274 as words, without losing a byte: whatever is not rewritten is copied from the source.
use std::ops::Range;

/// A letter with its number.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Word {
    /// Upper-case letter.
    pub(super) letter: u8,
    pub(super) value: f64,
    /// Bytes of the line.
    pub(super) range: Range<usize>,
}

impl Word {
    /// Number in tenths, as G-codes are told apart (G90.1 is 901).
    pub(super) fn tenths(&self) -> i64 {
        (self.value * 10.0).round() as i64
    }
}

/// One line.
#[derive(Clone, Debug)]
pub(super) struct Line<'a> {
    /// The line without its end.
    pub(super) text: &'a [u8],
    /// `\n`, `\r\n`, or nothing on the last line.
    pub(super) end: &'a [u8],
    pub(super) words: Vec<Word>,
    pub(super) sort: Sort,
}

/// How far a line was understood.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sort {
    /// Words and comments.
    Plain,
    /// A block that the controller may skip (`/`).
    Optional,
    /// O-words: the order of the lines is not the order of execution.
    Flow,
    /// Parameters, expressions, settings, or what no one knows.
    Unread,
}

impl Line<'_> {
    /// The word of a letter; `None` if there is none or more than one.
    pub(super) fn word(&self, letter: u8) -> Option<&Word> {
        let mut found = self.words.iter().filter(|w| w.letter == letter);
        found.next().filter(|_| found.next().is_none())
    }

    pub(super) fn has(&self, letter: u8) -> bool {
        self.words.iter().any(|w| w.letter == letter)
    }
}

/// Splits a program into lines.
pub(super) fn lines(program: &[u8]) -> Vec<Line<'_>> {
    program.split_inclusive(|b| *b == b'\n').map(line).collect()
}

fn line(raw: &[u8]) -> Line<'_> {
    let text = raw
        .strip_suffix(b"\n")
        .map_or(raw, |t| t.strip_suffix(b"\r").unwrap_or(t));
    let end = &raw[text.len()..];
    let (words, sort) = words(text);
    Line {
        text,
        end,
        words,
        sort,
    }
}

fn words(text: &[u8]) -> (Vec<Word>, Sort) {
    let mut words = Vec::new();
    let mut sort = Sort::Plain;
    let mut at = 0;
    let skip_blanks = |mut at: usize| {
        while matches!(text.get(at), Some(b' ' | b'\t')) {
            at += 1;
        }
        at
    };
    loop {
        at = skip_blanks(at);
        match text.get(at) {
            None | Some(b';') => break,
            Some(b'%') if words.is_empty() => break,
            Some(b'/') if words.is_empty() && sort == Sort::Plain => {
                sort = Sort::Optional;
                at += 1;
            }
            Some(b'(') => match text[at..].iter().position(|b| *b == b')') {
                Some(length) => at += length + 1,
                None => return (words, Sort::Unread),
            },
            Some(letter) if letter.is_ascii_alphabetic() => {
                let letter = letter.to_ascii_uppercase();
                let digits = skip_blanks(at + 1);
                let length = number_length(&text[digits..]);
                let number = std::str::from_utf8(&text[digits..digits + length])
                    .ok()
                    .and_then(|n| n.parse().ok());
                // An O-word with nothing else is a program number; with a keyword it steers the program.
                let Some(value) = number else {
                    return (
                        words,
                        if letter == b'O' {
                            Sort::Flow
                        } else {
                            Sort::Unread
                        },
                    );
                };
                if letter == b'O' && text[digits + length..].iter().any(u8::is_ascii_alphabetic) {
                    return (words, Sort::Flow);
                }
                words.push(Word {
                    letter,
                    value,
                    range: at..digits + length,
                });
                at = digits + length;
            }
            Some(_) => return (words, Sort::Unread),
        }
    }
    (words, sort)
}

/// Bytes of a decimal number: sign, digits, point.
fn number_length(text: &[u8]) -> usize {
    let sign = usize::from(matches!(text.first(), Some(b'+' | b'-')));
    let body = text[sign..]
        .iter()
        .take_while(|b| b.is_ascii_digit() || **b == b'.')
        .count();
    if body == 0 { 0 } else { sign + body }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> (Vec<(char, f64)>, Sort) {
        let l = line(text.as_bytes());
        (
            l.words
                .iter()
                .map(|w| (char::from(w.letter), w.value))
                .collect(),
            l.sort,
        )
    }

    #[test]
    fn words_are_read_as_both_controllers_write_them() {
        assert_eq!(
            read("N10 g3X-1.5 Y+.25(a G1 inside)I5.J 0 ; X9"),
            (
                vec![
                    ('N', 10.0),
                    ('G', 3.0),
                    ('X', -1.5),
                    ('Y', 0.25),
                    ('I', 5.0),
                    ('J', 0.0)
                ],
                Sort::Plain
            )
        );
        assert_eq!(read("%"), (vec![], Sort::Plain));
        assert_eq!(
            read("O1234 (part)").1,
            Sort::Flow,
            "a comment may hide a keyword: taken as flow"
        );
        assert_eq!(read("O1234").1, Sort::Plain);
        assert_eq!(read("/G1 X1").1, Sort::Optional);
        assert_eq!(read("G1 X[1+2]").1, Sort::Unread);
        assert_eq!(read("#1=5").1, Sort::Unread);
        assert_eq!(read("$H").1, Sort::Unread);
        assert_eq!(read("o<loop> while [#1 LT 5]").1, Sort::Flow);
        assert_eq!(read("G1 X1 (open").1, Sort::Unread);
        assert_eq!(read("G1 X1.2.3").1, Sort::Unread);
        assert_eq!(read("G1 X1 0").1, Sort::Unread);
    }

    #[test]
    fn lines_go_round() {
        let program = b"%\r\nG1 X1\n\nG1 (caf\xe9) \xff\nlast".as_slice();
        let back: Vec<u8> = lines(program)
            .iter()
            .flat_map(|l| [l.text, l.end].concat())
            .collect();
        assert_eq!(back, program);
    }
}
