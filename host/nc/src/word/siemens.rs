//! What Siemens writes otherwise than RS-274: named addresses, an arc through a point, commands in words.
use super::operand::number_length;
use super::{CIP_TENTHS, Counts, VIA};

/// Something with a name, and its length in bytes.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Named {
    /// A word of a letter.
    Word {
        letter: u8,
        value: f64,
        counts: Counts,
    },
    /// A command that moves nothing and changes nothing that arcs need.
    Nothing,
}

impl Named {
    /// A tool by its name: which offsets it brings only the control knows.
    const TOOL: Self = Self::Word {
        letter: b'T',
        value: f64::NAN,
        counts: Counts::InForce,
    };
}

/// Commands without arguments that move nothing: look-ahead, jerk, compressors of short lines, feed under cutter compensation.
const NOTHING: [&str; 22] = [
    "STOPRE",
    "FFWON",
    "FFWOF",
    "SOFT",
    "SOFTA",
    "BRISK",
    "BRISKA",
    "DRIVE",
    "DRIVEA",
    "COMPON",
    "COMPOF",
    "COMPCURV",
    "COMPCAD",
    "COMPSURF",
    "FNORM",
    "CFC",
    "CFIN",
    "CFTCP",
    "UPATH",
    "SPATH",
    "FIFOCTRL",
    "STARTFIFO",
];
/// Commands with arguments that move nothing: messages, drawings of the blank, tolerances.
const NOTHING_WITH_ARGUMENTS: [&str; 5] =
    ["MSG", "WORKPIECE", "GROUP_BEGIN", "GROUP_END", "CYCLE832"];

/// What stands at the begin of `text`, with its length; `None` where it is nothing of Siemens, or not known.
pub(super) fn named(text: &[u8]) -> Option<(Named, usize)> {
    let name = text
        .iter()
        .take_while(|b| b.is_ascii_alphanumeric() || **b == b'_')
        .count();
    // `X12.5`, which nearly all words are.
    let letters = text.iter().take_while(|b| b.is_ascii_alphabetic()).count();
    if letters < 2 && text.get(name + blanks(&text[name..])) != Some(&b'=') {
        return None;
    }
    let upper = text[..name].to_ascii_uppercase();
    let is = |list: &[&str]| list.iter().any(|known| upper == known.as_bytes());
    if upper == b"CIP" {
        let word = Named::Word {
            letter: b'G',
            value: CIP_TENTHS as f64 / 10.0,
            counts: Counts::InForce,
        };
        return Some((word, name));
    }
    if is(&NOTHING) {
        return Some((Named::Nothing, name));
    }
    if is(&NOTHING_WITH_ARGUMENTS) {
        let length = name + blanks(&text[name..]);
        return Some((Named::Nothing, length + arguments(&text[length..])?));
    }
    let letter = match &upper[..] {
        b"CR" => b'R',
        b"I1" => VIA[0],
        b"J1" => VIA[1],
        b"K1" => VIA[2],
        [letter @ (b'T' | b'X' | b'Y' | b'Z' | b'I' | b'J' | b'K')] => *letter,
        _ => return None,
    };
    let equals = name + blanks(&text[name..]);
    if text.get(equals) != Some(&b'=') {
        return None;
    }
    let at = equals + 1 + blanks(&text[equals + 1..]);
    if letter == b'T' {
        return tool(&text[at..]).map(|length| (Named::TOOL, at + length));
    }
    let (value, counts, length) = number(&text[at..])?;
    if letter == b'R' && counts != Counts::InForce {
        return None;
    }
    let word = Named::Word {
        letter,
        value,
        counts,
    };
    Some((word, at + length))
}

/// Length of the name of a tool, with its quotes.
fn tool(text: &[u8]) -> Option<usize> {
    let name = text.strip_prefix(b"\"")?;
    Some(2 + name.iter().position(|b| *b == b'"')?)
}

/// `5`, `AC(5)` or `IC(-5)`.
fn number(text: &[u8]) -> Option<(f64, Counts, usize)> {
    let plain = |text: &[u8]| {
        let length = number_length(text);
        let value: f64 = std::str::from_utf8(&text[..length]).ok()?.parse().ok()?;
        (length > 0 && value.is_finite()).then_some((value, length))
    };
    let head = text.get(..2).map(<[u8]>::to_ascii_uppercase);
    let counts = match head.as_deref().unwrap_or_default() {
        b"AC" => Counts::FromOrigin,
        b"IC" => Counts::FromStart,
        _ => {
            let (value, length) = plain(text)?;
            return Some((value, Counts::InForce, length));
        }
    };
    let open = 2 + blanks(&text[2..]);
    if text.get(open) != Some(&b'(') {
        return None;
    }
    let at = open + 1 + blanks(&text[open + 1..]);
    let (value, length) = plain(&text[at..])?;
    let close = at + length + blanks(&text[at + length..]);
    (text.get(close) == Some(&b')')).then_some((value, counts, close + 1))
}

fn blanks(text: &[u8]) -> usize {
    text.iter()
        .take_while(|b| matches!(b, b' ' | b'\t'))
        .count()
}

/// Length of `("a (b) ; c", 5)`.
fn arguments(text: &[u8]) -> Option<usize> {
    let (mut depth, mut quoted) = (0_usize, false);
    for (at, byte) in text.iter().enumerate() {
        match byte {
            b'"' => quoted = !quoted,
            b'(' if !quoted => depth += 1,
            b')' if !quoted => depth = depth.checked_sub(1)?,
            _ if depth == 0 => return None,
            _ => {}
        }
        if depth == 0 && !quoted {
            return Some(at + 1);
        }
    }
    None
}

/// Commands behind which a number of a place is not one of the path: frames that turn, mirror or scale, planes in space,
/// transformations, diameters.
const TRANSFORMS: [&str; 20] = [
    "SCALE", "ASCALE", "MIRROR", "AMIRROR", "ROT", "AROT", "ROTS", "AROTS", "CROTS", "CYCLE800",
    "TRANSMIT", "TRACYL", "TRAANG", "TRAORI", "TRACON", "DIAMON", "DIAM90", "DIAMCHAN", "TOFRAME",
    "TOROT",
];

/// The first command of a line that changes what numbers mean from there on.
pub(in super::super) fn transforms(text: &[u8]) -> Option<&'static str> {
    let upper = text.to_ascii_uppercase();
    let code = upper.split(|b| *b == b';').next().unwrap_or_default();
    let names = code.split(|b| !(b.is_ascii_alphanumeric() || *b == b'_'));
    names
        .filter(|name| !name.is_empty())
        .find_map(|name| TRANSFORMS.into_iter().find(|t| t.as_bytes() == name))
}

/// Words that only programs of Siemens have.
const MARKS: [&[u8]; 10] = [
    b"=AC(", b"=IC(", b"CR=", b"AR=", b"TURN=", b"MSG(", b"CYCLE8", b"_MPF", b"_SPF", b"SUPA",
];

/// Whether a program is written for a control of Siemens: one of these words outside a comment of RS-274.
pub(in super::super) fn is_siemens(program: &[u8]) -> bool {
    MARKS.iter().any(|mark| {
        memchr::memmem::find_iter(program, mark).any(|at| {
            let line = program[..at].rsplit(|b| *b == b'\n').next();
            !line.is_some_and(|before| before.iter().any(|b| matches!(b, b'(' | b';')))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_with_a_name() {
        let word = |letter, value, counts| {
            Some(Named::Word {
                letter,
                value,
                counts,
            })
        };
        for (text, expected) in [
            ("I=AC(5) J", word(b'I', 5.0, Counts::FromOrigin)),
            ("x = ic( -2.5 )", word(b'X', -2.5, Counts::FromStart)),
            ("X=5", word(b'X', 5.0, Counts::InForce)),
            ("CR=-12.5F3", word(b'R', -12.5, Counts::InForce)),
            ("K1=7", word(b'k', 7.0, Counts::InForce)),
            ("CIP X5", word(b'G', 1e5, Counts::InForce)),
            ("MSG(\"a (b\") X", Some(Named::Nothing)),
            ("STOPRE", Some(Named::Nothing)),
            ("X=R5", None),
            ("X=AC(R1)", None),
            ("A=DC(90)", None),
            ("CR=AC(5)", None),
            ("CR5", None),
            ("I2=5", None),
            ("MSG(\"a", None),
            ("X12.5=3", None),
            ("TRANS X5", None),
        ] {
            assert_eq!(named(text.as_bytes()).map(|n| n.0), expected, "{text}");
        }
    }

    #[test]
    fn commands_that_transform() {
        assert_eq!(transforms(b"N10 scale X2 Y2"), Some("SCALE"));
        assert_eq!(transforms(b"CYCLE800(1,\"\",0)"), Some("CYCLE800"));
        assert_eq!(transforms(b"TRANS X5 ; no ROT"), None);
        assert_eq!(transforms(b"AROTX"), None);
    }

    #[test]
    fn programs_of_siemens_are_known_by_their_words() {
        assert!(is_siemens(b"G71\nG2 X10 Y0 I=AC(5) J=AC(0)\n"));
        assert!(is_siemens(b"%_N_PART_MPF\nG1 X5\n"));
        assert!(!is_siemens(b"O1 (PLATE CR=5 MSG()\nG71 P1 Q2\n"));
    }
}
