//! The comment that says that a program is corrected, so that nobody corrects it twice.
use std::fmt;
use std::io;

/// What a program was corrected with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mark {
    /// Version of this crate's tool.
    pub version: String,
    /// Beginning of the SHA-256 of the model file, hexadecimal.
    pub model: String,
    /// Options, in words without brackets.
    pub options: String,
}

/// How every mark begins, behind the sign of a comment.
const BEGIN: &str = "giotto compensate ";

impl fmt::Display for Mark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            version,
            model,
            options,
        } = self;
        write!(f, "{BEGIN}{version} model {model} {options}")
    }
}

/// The line, from 1, and the words of the mark of a corrected program.
pub fn marked(program: &[u8]) -> Option<(usize, String)> {
    let at = memchr::memmem::find_iter(program, BEGIN.as_bytes()).find(|at| {
        // A comment, and not a text that speaks of one.
        let line = program[..*at]
            .rsplit(|b| *b == b'\n')
            .next()
            .unwrap_or_default();
        // Behind the number of a block of Klartext.
        let digits = line.iter().take_while(|b| b.is_ascii_digit()).count();
        matches!(line[digits..].trim_ascii(), b"(" | b";" | b"!")
    })?;
    let line = 1 + memchr::memchr_iter(b'\n', &program[..at]).count();
    let words = program[at..]
        .split(|b| matches!(b, b'\n' | b'\r' | b')'))
        .next()
        .unwrap_or_default();
    Some((line, String::from_utf8_lossy(words).into_owned()))
}

/// Copies a program and puts the mark where it belongs, once anything is corrected.
pub(super) struct Marking<'a> {
    program: &'a [u8],
    /// The mark with its line end, and the byte that it goes before.
    mark: Option<(Vec<u8>, usize)>,
    /// Bytes of the program that are copied as they are, not written yet.
    from: usize,
    to: usize,
}

impl<'a> Marking<'a> {
    pub(super) fn new(program: &'a [u8], mark: Option<&Mark>, open: &str, close: &str) -> Self {
        let end = match memchr::memchr(b'\n', program) {
            Some(at) if at > 0 && program[at - 1] == b'\r' => "\r\n",
            _ => "\n",
        };
        Self {
            program,
            mark: mark.map(|m| {
                (
                    format!("{open}{m}{close}{end}").into_bytes(),
                    place(program),
                )
            }),
            from: 0,
            to: 0,
        }
    }

    /// The next line, of so many bytes, as it was or with another text.
    pub(super) fn line(
        &mut self,
        length: usize,
        text: Option<&[u8]>,
        out: &mut dyn io::Write,
    ) -> io::Result<()> {
        if let Some(text) = text {
            if let Some((mark, at)) = self.mark.take() {
                let at = at.min(self.to);
                out.write_all(&self.program[..at])?;
                out.write_all(&mark)?;
                self.from = at;
            }
            out.write_all(&self.program[self.from..self.to])?;
            out.write_all(text)?;
            self.from = self.to + length;
        }
        self.to += length;
        Ok(())
    }

    pub(super) fn finish(self, out: &mut dyn io::Write) -> io::Result<()> {
        out.write_all(&self.program[self.from..self.to])
    }
}

/// Byte of the first line that a comment may go before: behind `%`, the number of the program and a module's head.
pub(super) fn place(program: &[u8]) -> usize {
    let mut at = 0;
    let mut head = false;
    for line in program.split_inclusive(|b| *b == b'\n').take(20) {
        let text = line.trim_ascii();
        let upper = text.to_ascii_uppercase();
        let starts = |word: &str| upper.starts_with(word.as_bytes());
        let module = starts("MODULE") || starts("%%%");
        let number = !module
            && (starts("%")
                || matches!(upper.first(), Some(b'O' | b':'))
                    && upper.get(1).is_some_and(u8::is_ascii_digit));
        head |= module;
        let of_head = head && (starts("VERSION") || starts("LANGUAGE"));
        if !(text.is_empty() || module || number || of_head) || !line.ends_with(b"\n") {
            break;
        }
        at += line.len();
        if starts("MODULE") || number && !starts("%") {
            break;
        }
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mark() -> Mark {
        Mark {
            version: "1.2.3".into(),
            model: "0123abcd".into(),
            options: "keep feed".into(),
        }
    }

    fn copied(program: &str, text: Option<&str>) -> String {
        let mut out = Vec::new();
        let mark = mark();
        let mut copy = Marking::new(program.as_bytes(), Some(&mark), "(", ")");
        let count = program.split_inclusive('\n').count();
        for (i, line) in program.split_inclusive('\n').enumerate() {
            let text = text.filter(|_| i + 1 == count).map(str::as_bytes);
            copy.line(line.len(), text, &mut out).unwrap();
        }
        copy.finish(&mut out).unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn the_mark_goes_behind_the_number_of_the_program() {
        let words = "(giotto compensate 1.2.3 model 0123abcd keep feed)";
        for (head, end) in [
            ("", "\n"),
            ("%\n", "\n"),
            ("%\r\nO1001 (BRACKET)\r\n", "\r\n"),
            ("\n%\n:5\n", "\n"),
            ("%%%\n VERSION:1\n LANGUAGE:ENGLISH\n%%%\nMODULE a\n", "\n"),
        ] {
            let program = format!("{head}G1 X1{end}G2 X5");
            let out = copied(&program, Some("G2 X6"));
            assert_eq!(out, format!("{head}{words}{end}G1 X1{end}G2 X6"));
            let lines = head.lines().count();
            assert_eq!(
                marked(out.as_bytes()),
                Some((lines + 1, words.trim_matches(['(', ')']).to_owned()))
            );
            // Nothing corrected: nothing said.
            assert_eq!(copied(&program, None), program);
            assert_eq!(marked(program.as_bytes()), None);
        }
    }

    #[test]
    fn words_about_marks_are_no_mark() {
        assert_eq!(marked(b"G1 X1 (not by giotto compensate 1)\n"), None);
        assert!(marked(b"G21\n ;giotto compensate 1\n").is_some());
    }
}
