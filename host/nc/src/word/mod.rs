//! Lines of RS-274 as words, without losing a byte: whatever is not rewritten is copied from the source.
//!
//! A word whose number is an expression or a parameter is a word all the same: its letter is known, its value (NaN) is not.
//! Comments are taken off before a keyword is looked for, so that `O1001 (BRACKET)` is the number of a program.
mod operand;
mod read;
mod siemens;

pub(super) use siemens::{is_siemens, transforms};
use std::ops::Range;

/// A letter with its number.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Word {
    /// Upper-case letter.
    pub(super) letter: u8,
    /// NaN where only the controller knows it: an expression, a parameter, no number at all.
    pub(super) value: f64,
    /// Bytes of the line.
    pub(super) range: Range<usize>,
    pub(super) counts: Counts,
}

/// What the number of a place counts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Counts {
    /// As the modes in force have it.
    InForce,
    /// From the origin, in this block alone: `X=AC(5)`.
    FromOrigin,
    /// From where the block begins, in this block alone: `X=IC(5)`.
    FromStart,
}

/// Tenths of a number that only the controller knows: no code has them.
pub(super) const UNKNOWN_TENTHS: i64 = i64::MIN;
/// `CIP` of Siemens, an arc through a point: read as a G-code that no controller has.
pub(super) const CIP_TENTHS: i64 = 1_000_000;
/// `I1=`, `J1=`, `K1=`: that point, in letters that no word of RS-274 has.
pub(super) const VIA: [u8; 3] = *b"ijk";

impl Word {
    /// Number in tenths, as G-codes are told apart (G90.1 is 901).
    pub(super) fn tenths(&self) -> i64 {
        if self.value.is_nan() {
            UNKNOWN_TENTHS
        } else {
            (self.value * 10.0).round() as i64
        }
    }

    /// Whether its number counts from the origin, where `in_force` says what the modes say.
    pub(super) fn absolute(&self, in_force: bool) -> bool {
        match self.counts {
            Counts::InForce => in_force,
            Counts::FromOrigin => true,
            Counts::FromStart => false,
        }
    }

    pub(super) fn is_motion(&self) -> bool {
        self.letter == b'G' && matches!(self.tenths(), 0 | 10 | 20 | 30 | CIP_TENTHS)
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
    /// `#5 = [1 + 2]` and nothing else: a parameter is set, no axis moves.
    Setting,
    /// A keyword: the order of the lines is not the order of execution.
    Flow(Keyword),
    /// Settings of a controller, or what no one knows.
    Unread,
}

/// What a keyword does to the order of lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Keyword {
    /// `O… sub`: what follows is run when it is called.
    Sub,
    /// `O… endsub`.
    EndSub,
    /// `O… call` with constant arguments or none.
    Call,
    /// Jumps, loops, branches and the rest.
    Other(&'static str),
}

impl Line<'_> {
    /// Whether a comment acts where it stands: a message, a print, a log.
    pub(super) fn speaks(&self) -> bool {
        const ACTING: [&[u8]; 9] = [
            b"MSG",
            b"DEBUG",
            b"PRINT",
            b"LOG",
            b"PROBEOPEN",
            b"PROBECLOSE",
            b"PY",
            b"ABORT",
            b"ACTIVE",
        ];
        let inside = |at: usize| {
            let words = self.text[at + 1..].trim_ascii_start();
            ACTING.iter().any(|name| {
                words.len() >= name.len() && words[..name.len()].eq_ignore_ascii_case(name)
            })
        };
        (0..self.text.len()).any(|at| matches!(self.text[at], b'(' | b';') && inside(at))
    }

    /// The word of a letter; `None` if there is none or more than one.
    pub(super) fn word(&self, letter: u8) -> Option<&Word> {
        let mut found = self.words.iter().filter(|w| w.letter == letter);
        found.next().filter(|_| found.next().is_none())
    }

    pub(super) fn has(&self, letter: u8) -> bool {
        self.words.iter().any(|w| w.letter == letter)
    }

    pub(super) fn has_any(&self, letters: &[u8]) -> bool {
        self.words.iter().any(|w| letters.contains(&w.letter))
    }

    /// Whether a G-word with one of these numbers, in tenths, is there.
    pub(super) fn has_g(&self, tenths: &[i64]) -> bool {
        self.words
            .iter()
            .any(|w| w.letter == b'G' && tenths.contains(&w.tenths()))
    }

    /// Whether an M-word with one of these numbers, in tenths, is there.
    pub(super) fn has_m(&self, tenths: &[i64]) -> bool {
        self.words
            .iter()
            .any(|w| w.letter == b'M' && tenths.contains(&w.tenths()))
    }

    /// Name behind an O, as it is written, without blanks.
    pub(super) fn o_name(&self) -> Option<Vec<u8>> {
        let word = self.words.iter().find(|w| w.letter == b'O')?;
        let name = self.text.get(word.range.start + 1..word.range.end)?;
        let name: Vec<u8> = name
            .iter()
            .filter(|b| !b.is_ascii_whitespace())
            .map(u8::to_ascii_lowercase)
            .collect();
        // 0100 and 100 are one number.
        let digits = name.iter().all(u8::is_ascii_digit);
        let zeros = name.iter().take_while(|b| digits && **b == b'0').count();
        Some(name[zeros.min(name.len().saturating_sub(1))..].to_vec())
    }
}

/// Splits a program into lines.
pub(super) fn lines(program: &[u8]) -> impl Iterator<Item = Line<'_>> {
    program.split_inclusive(|b| *b == b'\n').map(line)
}

/// One line with its end.
pub(super) fn line(raw: &[u8]) -> Line<'_> {
    let text = raw
        .strip_suffix(b"\n")
        .map_or(raw, |t| t.strip_suffix(b"\r").unwrap_or(t));
    let end = &raw[text.len()..];
    let (words, sort) = read::Reader::line(text);
    Line {
        text,
        end,
        words,
        sort,
    }
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
        assert_eq!(read("\u{feff}G21").0, [('G', 21.0)]);
        for program_number in ["O1234", "O1234 (part)", "O1234 ; part", ":1234", "o01 (IF)"] {
            assert_eq!(read(program_number).1, Sort::Plain, "{program_number}");
        }
        assert_eq!(read("/G1 X1").1, Sort::Optional);
        assert_eq!(read("N5 /2 G1 X1").0, [('N', 5.0), ('G', 1.0), ('X', 1.0)]);
        assert_eq!(read("$H").1, Sort::Unread);
        assert_eq!(read("G1 X1 (open").1, Sort::Unread);
        assert_eq!(read("G1 X1.2.3").1, Sort::Unread);
        assert_eq!(read("G1 X1 0").1, Sort::Unread);
        assert_eq!(read("G1 X1,5").1, Sort::Unread);
        let siemens = [('G', 2.0), ('X', 1.0), ('R', -5.5), ('F', 300.0)];
        assert_eq!(read("G2 X1 CR=-5.5 F300"), (siemens.to_vec(), Sort::Plain));
        assert_eq!(read("G2 X1 cr = -5.5F300").0, siemens);
        assert_eq!(read("G2 X1 Y1 CR=").1, Sort::Unread);
        assert_eq!(read("G2 X1 Y1 CR5").1, Sort::Unread);
        assert_eq!(read("G2 X1 Y1 I=AC(5)").0[3], ('I', 5.0));
        assert_eq!(read("G2 X1 Y1 I=AC(R5)").1, Sort::Unread);
        assert_eq!(read("MSG(\"a (b\") G1 X5").0, [('G', 1.0), ('X', 5.0)]);
        assert_eq!(read("CIP X1 Y1 I1=5 J1=2").0[3], ('i', 5.0));
        assert_eq!(
            read("M117 Layer X5 of 7"),
            (vec![('M', 117.0)], Sort::Plain)
        );
    }

    #[test]
    fn a_value_that_only_the_controller_knows_is_a_word_all_the_same() {
        for text in [
            "G91 G1 X[#1] Y0",
            "G91G1X#5Y0",
            "G91 G1 X-[#<a> + sin[3]] Y0",
            "G91 G1 X##2 Y0",
            "G91 G1 X ATAN[1]/[2] Y0",
            "G91 G1 X Y0",
        ] {
            let (words, sort) = read(text);
            assert_eq!(sort, Sort::Plain, "{text}");
            let letters: String = words.iter().map(|w| w.0).collect();
            assert_eq!(letters, "GGXY", "{text}");
            assert!(words[2].1.is_nan() && words[3].1 == 0.0, "{text}");
        }
        assert_eq!(line(b"G[#1]").words[0].tenths(), UNKNOWN_TENTHS);
        for setting in [
            "#1=5",
            "#<a> = [1 + #2] (c)",
            "N5 #1 = -sin[2]",
            "#1=5 #2=6",
        ] {
            assert_eq!(read(setting).1, Sort::Setting, "{setting}");
        }
        assert_eq!(read("#1=5 G1 X2").1, Sort::Unread);
    }

    #[test]
    fn keywords_steer() {
        for (text, keyword) in [
            ("o100 sub", Keyword::Sub),
            ("O<a> SUB (b)", Keyword::Sub),
            ("o100 endsub", Keyword::EndSub),
            ("o100 call [5] [-1.5]", Keyword::Call),
            ("o100 (x) call", Keyword::Call),
            ("o100 call [#1]", Keyword::Other("CALL")),
            ("o<loop> while [#1 LT 5]", Keyword::Other("WHILE")),
            ("IF [#1 EQ 5] GOTO 10", Keyword::Other("IF")),
            ("N10 GOTO 5", Keyword::Other("GOTO")),
            ("WHILE[#1LT5]DO1", Keyword::Other("WHILE")),
            ("END1", Keyword::Other("END")),
            ("o1 elseif [1]", Keyword::Other("ELSEIF")),
        ] {
            assert_eq!(read(text).1, Sort::Flow(keyword), "{text}");
        }
        assert_eq!(line(b"o0100 sub").o_name().unwrap(), b"100");
        assert_eq!(line(b"O<Ab> call").o_name().unwrap(), b"<ab>");
    }

    #[test]
    fn lines_go_round() {
        let program = b"%\r\nG1 X1\n\nG1 (caf\xe9) \xff\nlast".as_slice();
        let back: Vec<u8> = lines(program)
            .flat_map(|l| [l.text, l.end].concat())
            .collect();
        assert_eq!(back, program);
    }
}
