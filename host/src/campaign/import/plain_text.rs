//! What spreadsheets write otherwise, brought into the shape that rows are read in: lines that end by a carriage return alone,
//! and thousands that are grouped (`"1,234.5678"`, `1'234.5678`, `1 234,5678` with a blank that breaks no line).

/// The text with line feeds and without groups; nothing where it is plain as it stands.
pub(super) fn of(bytes: &[u8]) -> Option<Vec<u8>> {
    let returns = memchr::memchr(b'\n', bytes).is_none() && memchr::memchr(b'\r', bytes).is_some();
    let mut out = Vec::new();
    let mut copied = 0;
    let mut at = 0;
    while let Some(comma) = memchr::memchr(b',', &bytes[at..]).map(|p| at + p) {
        match grouped(bytes, comma) {
            Some([start, end]) => {
                out.extend_from_slice(&bytes[copied..start]);
                out.extend(bytes[start..end].iter().filter(|&&b| b != b','));
                (copied, at) = (end, end);
            }
            None => at = comma + 1,
        }
    }
    let marked = MARKS
        .iter()
        .any(|mark| memchr::memmem::find(bytes, mark).is_some());
    if out.is_empty() && !returns && !marked {
        return None;
    }
    out.extend_from_slice(&bytes[copied..]);
    let mut changed = copied > 0 || returns;
    for mark in MARKS {
        changed |= take_out(mark, &mut out);
    }
    if returns {
        out.iter_mut()
            .filter(|b| **b == b'\r')
            .for_each(|b| *b = b'\n');
    }
    changed.then_some(out)
}

/// Marks that group thousands and nothing else: apostrophes, and blanks that break no line, in UTF-8 and in Latin-1.
const MARKS: [&[u8]; 5] = [
    "\u{a0}".as_bytes(),
    "\u{202f}".as_bytes(),
    "\u{2019}".as_bytes(),
    b"\xa0",
    b"'",
];

/// Takes a mark out of all numbers in which it stands between a digit and three more; whether there was one.
fn take_out(mark: &[u8], text: &mut Vec<u8>) -> bool {
    let digit = |at: usize| text.get(at).is_some_and(u8::is_ascii_digit);
    let groups = memchr::memmem::find_iter(text, mark).filter(|&at| {
        let behind = at + mark.len();
        at > 0 && digit(at - 1) && (0..3).all(|k| digit(behind + k)) && !digit(behind + 3)
    });
    let groups: Vec<usize> = groups.collect();
    let mut plain = Vec::with_capacity(text.len());
    let mut copied = 0;
    for at in &groups {
        plain.extend_from_slice(&text[copied..*at]);
        copied = at + mark.len();
    }
    plain.extend_from_slice(&text[copied..]);
    *text = plain;
    !groups.is_empty()
}

/// Where the grouped number begins and ends whose first comma is at `comma`: a field of its own, between quotes, tabs or
/// semicolons, with three digits to a group and a decimal point behind them. Without the point it may be a decimal comma.
fn grouped(bytes: &[u8], comma: usize) -> Option<[usize; 2]> {
    let digits = |from: usize| {
        let rest = bytes.get(from..).unwrap_or_default();
        rest.iter().take_while(|b| b.is_ascii_digit()).count()
    };
    let lead = bytes[..comma]
        .iter()
        .rev()
        .take(4)
        .take_while(|b| b.is_ascii_digit())
        .count();
    if !(1..=3).contains(&lead) {
        return None;
    }
    let start = comma - lead;
    let mut at = comma;
    while bytes.get(at) == Some(&b',') {
        if digits(at + 1) != 3 {
            return None;
        }
        at += 4;
    }
    if bytes.get(at) != Some(&b'.') {
        return None;
    }
    let end = at + 1 + digits(at + 1);
    let before = bytes[..start].iter().rev().find(|b| !b" -+".contains(b));
    let alone = |edge: Option<&u8>| matches!(edge, Some(b'"' | b'\t' | b';'));
    // The last field of a line ends with it, the first begins with it; one edge has to tell that commas divide no columns here.
    let line_end = |edge: Option<&u8>| matches!(edge, None | Some(b'\n' | b'\r'));
    let after = bytes.get(end);
    let whole = (alone(before) && (alone(after) || line_end(after)))
        || (line_end(before) && alone(after) && after != Some(&b'"'));
    whole.then_some([start, end])
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail where it stands")]
mod tests {
    fn of(text: &str) -> Option<String> {
        super::of(text.as_bytes()).map(|bytes| String::from_utf8(bytes).unwrap())
    }

    #[test]
    fn groups_and_carriage_returns_go() {
        for (text, plain) in [
            ("x\r1.5\r2.5\r", "x\n1.5\n2.5\n"),
            (
                "\"0.1\",\"1,234.50\",\"-12.0\"\n",
                "\"0.1\",\"1234.50\",\"-12.0\"\n",
            ),
            ("\"-1,234,567.5\"\n", "\"-1234567.5\"\n"),
            ("0.1\t-1,234.5\t2,000.\n", "0.1\t-1234.5\t2000.\n"),
            ("1,234.5;3,210.25\r\n", "1234.5;3210.25\r\n"),
            ("0.5;-1'234.5;2'345'678.25\n", "0.5;-1234.5;2345678.25\n"),
            ("1\u{202f}234,5;2\u{a0}345\n", "1234,5;2345\n"),
        ] {
            assert_eq!(of(text).as_deref(), Some(plain), "{text}");
        }
    }

    #[test]
    fn what_may_mean_something_else_stays() {
        for text in [
            // Two columns.
            "1,234.5\n",
            "0.1,1,234.5\n",
            // Decimal commas.
            "0,1;1,234;3,210\n",
            "\"1,234\"\n",
            // No groups of three.
            "\"1,23.4\"",
            "\"12345,678.9\"",
            "a line\r\nand another\r\n",
            // A stamp, a quoted name, a unit behind a blank.
            "1,2,'08.11.2022 16:17:28.353,P\n",
            "'234' 12\u{a0}mm\n",
            ",,,.;",
            "",
        ] {
            assert_eq!(of(text), None, "{text}");
        }
    }
}
