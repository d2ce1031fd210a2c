//! From the bytes of a line to its words.
use super::operand::{call_length, number_length, operand_length, strip_operands};
use super::siemens::{self, Named};
use super::{Counts, Keyword, Sort, Word};

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

/// Reads one line.
pub(super) struct Reader<'a> {
    text: &'a [u8],
    at: usize,
    words: Vec<Word>,
    sort: Sort,
}

impl<'a> Reader<'a> {
    /// The words of a line, and how far it was understood.
    pub(super) fn line(text: &'a [u8]) -> (Vec<Word>, Sort) {
        let mut reader = Self {
            text,
            at: 0,
            words: Vec::new(),
            sort: Sort::Plain,
        };
        if reader.read().is_none() && !matches!(reader.sort, Sort::Flow(_)) {
            reader.sort = Sort::Unread;
        }
        (reader.words, reader.sort)
    }

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
                    if self.named() {
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
            counts: Counts::InForce,
        });
        self.at = end;
        // Two numbers behind one letter mean different things to different controllers.
        let next = self.text.get(self.blanks(end));
        (!next.is_some_and(|b| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+' | b'[' | b'=')))
            .then_some(())
    }

    /// An address or a command of Siemens at the present place.
    fn named(&mut self) -> bool {
        let Some((named, length)) = siemens::named(&self.text[self.at..]) else {
            return false;
        };
        let range = self.at..self.at + length;
        self.at = range.end;
        if let Named::Word {
            letter,
            value,
            counts,
        } = named
        {
            self.words.push(Word {
                letter,
                value,
                range,
                counts,
            });
        }
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
