//! Arcs in words that are not RS-274: known by name, counted, and left.

/// What kind of arc a line is that is not understood as words; `None`: none that is known.
pub(super) fn arc(text: &[u8]) -> Option<&'static str> {
    let line = String::from_utf8_lossy(text).to_ascii_uppercase();
    let code = line.split([';', '!']).next().unwrap_or_default();
    // Line numbers of Heidenhain (`12 C X+5`) and Fanuc's robots (`12:C P[5]`).
    let body = code
        .trim_start()
        .trim_start_matches(|c: char| c.is_ascii_digit());
    let robot = body.trim_start().strip_prefix(':').map(str::trim_start);
    let words: Vec<&str> = body.split_whitespace().collect();
    let first = words.first().copied().unwrap_or_default();
    let second = words.get(1).copied().unwrap_or_default();
    if robot.is_some_and(|b| (b.starts_with("C ") || b.starts_with("A ")) && b.contains("P[")) {
        return Some("a circular motion of a Fanuc robot");
    }
    match first {
        "CIRC" | "CIRC_REL" | "SCIRC" | "SCIRC_REL" => return Some("CIRC of KUKA"),
        "C" | "CP" | "CR" | "CT" | "CTP" | "RND" if heidenhain(&words[1..]) => {
            return Some("a circle of Heidenhain");
        }
        _ => {}
    }
    let numbered = first.starts_with('N') && second == "CIP";
    if first == "CIP" || numbered {
        return Some("CIP of Siemens");
    }
    if (first == "CT" || first.starts_with('N') && second == "CT") && body.contains('X') {
        return Some("CT of Siemens");
    }
    let motion = words
        .iter()
        .any(|w| matches!(*w, "G2" | "G3" | "G02" | "G03"));
    let named = ["=AC(", "=IC(", "AR=", "TURN="];
    (motion && named.iter().any(|name| body.contains(name)))
        .then_some("an arc with AC(), AR= or TURN= of Siemens")
}

/// `X+12.5 Y-3 DR+ R0 F500`: places carry their signs, a turn its own word.
fn heidenhain(words: &[&str]) -> bool {
    let signed = |w: &&str| {
        let mut letters = w.chars().skip_while(char::is_ascii_alphabetic);
        matches!(letters.next(), Some('+' | '-'))
    };
    !words.is_empty() && words.iter().any(signed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_by_its_name() {
        for (line, name) in [
            ("12 C X+30 Y+10 DR+ F500", Some("a circle of Heidenhain")),
            ("CR X+30 Y+10 R+10 DR-", Some("a circle of Heidenhain")),
            ("7 CT X+5 Y+5", Some("a circle of Heidenhain")),
            ("12 CC X+30 Y+20", None),
            ("12 L X+30 Y+10 R0 F500", None),
            ("CIRC {X 10, Y 5}, {X 20, Y 0}, CA 90", Some("CIRC of KUKA")),
            ("SCIRC XP1 XP2", Some("CIRC of KUKA")),
            ("LIN {X 10, Y 5}", None),
            ("  14:C P[5]", Some("a circular motion of a Fanuc robot")),
            (
                "4:C P[5]    P[6] 100mm/sec FINE",
                Some("a circular motion of a Fanuc robot"),
            ),
            ("N40 CIP X10 Y0 I1=5 J1=5", Some("CIP of Siemens")),
            ("N5 CT X10 Y5", Some("CT of Siemens")),
            (
                "G2 X10 Y0 I=AC(5) J=AC(0)",
                Some("an arc with AC(), AR= or TURN= of Siemens"),
            ),
            ("G1 X=AC(5)", None),
            ("what is this", None),
            ("", None),
        ] {
            assert_eq!(arc(line.as_bytes()), name, "{line}");
        }
    }
}
