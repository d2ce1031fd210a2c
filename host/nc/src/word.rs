//! Lines of RS-274 as words, without losing a byte: whatever is not rewritten is copied from the source.
//!
//! A word whose number is an expression or a parameter is a word all the same: its letter is known, its value (NaN) is not.
//! Comments are taken off before a keyword is looked for, so that `O1001 (BRACKET)` is the number of a program.
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
}

/// Tenths of a number that only the controller knows: no code has them.
pub(super) const UNKNOWN_TENTHS: i64 = i64::MIN;

impl Word {
    /// Number in tenths, as G-codes are told apart (G90.1 is 901).
    pub(super) fn tenths(&self) -> i64 {
        if self.value.is_nan() {
            UNKNOWN_TENTHS
        } else {
            (self.value * 10.0).round() as i64
        }
    }

    pub(super) fn is_motion(&self) -> bool {
        self.letter == b'G' && matches!(self.tenths(), 0 | 10 | 20 | 30)
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

/// Words that steer a program, of Fanuc, LinuxCNC and Siemens.
const FLOW: [&str; 36] = [
    "IF",
    "THEN",
    "GOTO",
    "GOTOF",
    "GOTOB",
    "GOTOC",
    "WHILE",
    "DO",
    "END",
    "ENDWHILE",
    "ELSE",
    "ELSEIF",
    "ENDIF",
    "REPEAT",
    "ENDREPEAT",
    "REPEATB",
    "UNTIL",
    "FOR",
    "ENDFOR",
    "LOOP",
    "ENDLOOP",
    "BREAK",
    "CONTINUE",
    "RETURN",
    "CASE",
    "DEFAULT",
    "PROC",
    "EXTERN",
    "EXTCALL",
    "CALL",
    "PCALL",
    "MCALL",
    "RET",
    "SUB",
    "ENDSUB",
    "SETINT",
];

impl Line<'_> {
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
    let mut reader = Reader {
        text,
        at: 0,
        words: Vec::new(),
        sort: Sort::Plain,
    };
    if reader.read().is_none() && !matches!(reader.sort, Sort::Flow(_)) {
        reader.sort = Sort::Unread;
    }
    Line {
        text,
        end,
        words: reader.words,
        sort: reader.sort,
    }
}

struct Reader<'a> {
    text: &'a [u8],
    at: usize,
    words: Vec<Word>,
    sort: Sort,
}

impl Reader<'_> {
    /// Goes to the next byte that is neither blank nor comment; `None` where a comment does not end.
    fn skip(&mut self) -> Option<()> {
        loop {
            match self.text.get(self.at) {
                // A byte order mark is three bytes before the first line.
                Some(b' ' | b'\t' | b'\r' | 0xef | 0xbb | 0xbf) => self.at += 1,
                Some(b'(') => {
                    self.at += self.text[self.at..].iter().position(|b| *b == b')')? + 1;
                }
                Some(b';') => self.at = self.text.len(),
                _ => return Some(()),
            }
        }
    }

    fn blanks(&self, mut at: usize) -> usize {
        while matches!(self.text.get(at), Some(b' ' | b'\t')) {
            at += 1;
        }
        at
    }

    fn read(&mut self) -> Option<()> {
        loop {
            self.skip()?;
            let Some(byte) = self.text.get(self.at) else {
                return Some(());
            };
            let numbered = self.words.iter().all(|w| w.letter == b'N');
            match byte {
                b'%' if self.words.is_empty() => return Some(()),
                b':' if self.words.is_empty() => self.word(b'O')?,
                b'/' if numbered && self.sort == Sort::Plain => {
                    self.sort = Sort::Optional;
                    self.at += 1;
                    // The number of the switch.
                    self.at += self.text[self.at..]
                        .iter()
                        .take_while(|b| b.is_ascii_digit())
                        .count();
                }
                b'#' if numbered => self.setting()?,
                byte if byte.is_ascii_alphabetic() => {
                    let letters = self.text[self.at..]
                        .iter()
                        .take_while(|b| b.is_ascii_alphabetic())
                        .count();
                    if letters == 2 && self.radius_of_siemens() {
                        continue;
                    }
                    if letters > 1 {
                        return self.keyword(letters);
                    }
                    self.word(byte.to_ascii_uppercase())?;
                    if self.words.last().is_some_and(takes_text) {
                        self.at = self.text.len();
                    }
                }
                _ => return None,
            }
        }
    }

    /// A letter at the present place and its value.
    fn word(&mut self, letter: u8) -> Option<()> {
        let digits = self.blanks(self.at + 1);
        let (length, value) = self.value(digits, letter == b'O')?;
        let end = if length == 0 {
            self.at + 1
        } else {
            digits + length
        };
        self.words.push(Word {
            letter,
            value,
            range: self.at..end,
        });
        self.at = end;
        // Two numbers behind one letter mean different things to different controllers.
        let next = self.text.get(self.blanks(end));
        (!next.is_some_and(|b| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+' | b'[' | b'=')))
            .then_some(())
    }

    /// `CR=12.5`: an R by another name.
    fn radius_of_siemens(&mut self) -> bool {
        let text = &self.text[self.at..];
        if !text[..2].eq_ignore_ascii_case(b"CR") {
            return false;
        }
        let equals = self.blanks(self.at + 2);
        if self.text.get(equals) != Some(&b'=') {
            return false;
        }
        let digits = self.blanks(equals + 1);
        let Some((length, value)) = self.value(digits, false).filter(|(length, _)| *length > 0)
        else {
            return false;
        };
        let range = self.at..digits + length;
        self.at = range.end;
        self.words.push(Word {
            letter: b'R',
            value,
            range,
        });
        true
    }

    /// Length and value of what may stand behind a letter.
    fn value(&self, at: usize, name: bool) -> Option<(usize, f64)> {
        let text = &self.text[at..];
        if name && text.first() == Some(&b'<') {
            let length = text.iter().position(|b| *b == b'>')? + 1;
            return Some((length, f64::NAN));
        }
        let digits = number_length(text);
        if digits > 0 {
            let value = std::str::from_utf8(&text[..digits]).ok()?.parse().ok()?;
            return Some((digits, value));
        }
        let sign = usize::from(matches!(text.first(), Some(b'+' | b'-')));
        let length = match text.get(sign) {
            Some(b'[' | b'#') => operand_length(&text[sign..])?,
            Some(b) if b.is_ascii_alphabetic() => call_length(&text[sign..])?,
            // A letter alone, as in `G28 X Y`.
            _ if sign == 0 => 0,
            _ => return None,
        };
        Some((if length == 0 { 0 } else { sign + length }, f64::NAN))
    }

    /// `#… = …`, to the end of the line or to the next setting.
    fn setting(&mut self) -> Option<()> {
        let place = operand_length(&self.text[self.at..])?;
        let equals = self.blanks(self.at + place);
        if self.text.get(equals) != Some(&b'=') {
            return None;
        }
        let comment = self.text[equals..]
            .iter()
            .position(|b| matches!(b, b'(' | b';' | b'\r'));
        let end = comment.map_or(self.text.len(), |c| equals + c);
        // Axis words behind a setting are none of ours.
        let letters = |b: &u8| b.is_ascii_alphabetic();
        let inside = strip_operands(&self.text[equals + 1..end])?;
        if inside.iter().any(letters) || self.sort != Sort::Plain {
            return None;
        }
        self.sort = Sort::Setting;
        self.at = end;
        self.skip()?;
        (self.at == self.text.len()).then_some(())
    }

    /// A run of letters: what steers a program, or what no one knows.
    fn keyword(&mut self, letters: usize) -> Option<()> {
        let run = self.text[self.at..self.at + letters].to_ascii_uppercase();
        let rest = &self.text[self.at + letters..];
        let of_o = self.words.iter().any(|w| w.letter == b'O');
        // `IF[#1EQ2]GOTO10` and `IFR1==2` begin alike.
        let glued = |word: &&&str| {
            matches!(**word, "IF" | "GOTO" | "WHILE") && run.starts_with(word.as_bytes())
        };
        let known = FLOW.iter().find(|word| run == word.as_bytes());
        let word = known.or_else(|| FLOW.iter().find(glued))?;
        self.sort = Sort::Flow(match (*word, of_o) {
            ("SUB", true) => Keyword::Sub,
            ("ENDSUB", true) => Keyword::EndSub,
            ("CALL", true) if plain_arguments(rest) => Keyword::Call,
            (word, _) => Keyword::Other(word),
        });
        None
    }
}

/// `[10] [-2.5]`: arguments that are numbers, and a comment.
fn plain_arguments(text: &[u8]) -> bool {
    let code = text
        .split(|b| matches!(b, b'(' | b';'))
        .next()
        .unwrap_or_default();
    code.iter().all(|b| {
        b.is_ascii_digit() || matches!(b, b'[' | b']' | b'.' | b'-' | b'+' | b' ' | b'\t' | b'\r')
    })
}

/// M-words that a printer's text follows.
fn takes_text(word: &Word) -> bool {
    word.letter == b'M' && matches!(word.tenths(), 230 | 280 | 320 | 1170 | 1180 | 4860)
}

/// Length of `[…]`, `#5`, `#<name>`, `##5`, `#[…]`.
fn operand_length(text: &[u8]) -> Option<usize> {
    match text.first()? {
        b'[' => {
            let mut depth = 0_usize;
            for (i, byte) in text.iter().enumerate() {
                match byte {
                    b'[' => depth += 1,
                    b']' => depth -= 1,
                    _ => {}
                }
                if depth == 0 {
                    return Some(i + 1);
                }
            }
            None
        }
        b'#' => match text.get(1)? {
            b'<' => text.iter().position(|b| *b == b'>').map(|i| i + 1),
            b'[' | b'#' => Some(1 + operand_length(&text[1..])?),
            _ => {
                let digits = text[1..].iter().take_while(|b| b.is_ascii_digit()).count();
                (digits > 0).then_some(1 + digits)
            }
        },
        _ => None,
    }
}

/// Length of `SIN[…]`, `ATAN[…]/[…]`; 0 where the letters are none of a function.
fn call_length(text: &[u8]) -> Option<usize> {
    let letters = text.iter().take_while(|b| b.is_ascii_alphabetic()).count();
    if letters < 2 || text.get(letters) != Some(&b'[') {
        return Some(0);
    }
    let mut length = letters + operand_length(&text[letters..])?;
    if text.get(length) == Some(&b'/') && text.get(length + 1) == Some(&b'[') {
        length += 1 + operand_length(&text[length + 1..])?;
    }
    Some(length)
}

/// The text without its operands.
fn strip_operands(mut text: &[u8]) -> Option<Vec<u8>> {
    let mut left = Vec::new();
    while let Some(byte) = text.first() {
        let length = match byte {
            b'[' | b'#' => operand_length(text)?,
            b if b.is_ascii_alphabetic() => match call_length(text)? {
                0 => {
                    left.push(*byte);
                    1
                }
                length => length,
            },
            b => {
                left.push(*b);
                1
            }
        };
        text = &text[length..];
    }
    Some(left)
}

/// Bytes of a decimal number: sign, digits, point.
fn number_length(text: &[u8]) -> usize {
    let sign = usize::from(matches!(text.first(), Some(b'+' | b'-')));
    let body = text[sign..]
        .iter()
        .take_while(|b| b.is_ascii_digit() || **b == b'.')
        .count();
    let digits = text[sign..sign + body].iter().any(u8::is_ascii_digit);
    if digits { sign + body } else { 0 }
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
        assert_eq!(read("G2 X1 Y1 I=AC(5)").1, Sort::Unread);
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
