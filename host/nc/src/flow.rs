//! The order in which the lines of a program are run, where subprograms of the same file are called.
use super::codes::{self, M};
use super::word::{self, Keyword, Line, Sort};
use std::collections::HashMap;

/// How the lines of a program follow each other.
#[derive(Debug, PartialEq)]
pub(super) enum Order {
    /// One behind the other.
    Straight,
    /// By calls that can be followed: indices of lines.
    Followed(Vec<usize>),
}

/// A loop without an end is given up after so many lines for each line of the program.
const MOST_VISITS: usize = 64;

/// Follows the calls of a program; straight on where there are none or where they cannot be followed.
pub(super) fn order(program: &[u8]) -> Order {
    if !mentions_calls(program) {
        return Order::Straight;
    }
    let lines: Vec<Line<'_>> = word::lines(program).collect();
    follow(&lines).map_or(Order::Straight, Order::Followed)
}

/// A quick look: M97 to M99, or an O-word with a keyword.
fn mentions_calls(program: &[u8]) -> bool {
    let upper = |i: usize| program.get(i).map(u8::to_ascii_uppercase);
    memchr::memchr2_iter(b'9', b'O', program)
        .chain(memchr::memchr_iter(b'o', program))
        .any(|i| match upper(i) {
            Some(b'9') => {
                let before = program[..i].iter().rev().find(|b| !b" 0".contains(b));
                matches!(upper(i + 1), Some(b'7'..=b'9')) && matches!(before, Some(b'M' | b'm'))
            }
            _ => {
                let end = memchr::memchr(b'\n', &program[i..]).map_or(program.len(), |n| i + n);
                let line = program[i..end].to_ascii_lowercase();
                memchr::memmem::find(&line, b"call").is_some()
            }
        })
}

/// A call that is being run.
struct Call {
    back: usize,
    begin: usize,
    more: u32,
}

fn follow(lines: &[Line<'_>]) -> Option<Vec<usize>> {
    let mut programs: HashMap<Vec<u8>, usize> = HashMap::new();
    let mut subs: HashMap<Vec<u8>, usize> = HashMap::new();
    let mut numbers: HashMap<i64, usize> = HashMap::new();
    for (i, line) in lines.iter().enumerate() {
        match line.sort {
            Sort::Flow(Keyword::Sub) => _ = subs.insert(line.o_name()?, i),
            Sort::Flow(Keyword::Other(_)) => return None,
            Sort::Plain if line.has(b'O') => _ = programs.insert(line.o_name()?, i),
            _ => {}
        }
        if let Some(n) = line.word(b'N') {
            numbers.entry(n.tenths()).or_insert(i);
        }
    }
    let mut order = Vec::new();
    let mut calls: Vec<Call> = Vec::new();
    let mut at = 0;
    let mut seen_number = false;
    while let Some(line) = lines.get(at) {
        if order.len() > MOST_VISITS * lines.len() + 1000 || calls.len() > 100 {
            return None;
        }
        match line.sort {
            Sort::Flow(Keyword::Sub) => {
                // A definition is passed over.
                let name = line.o_name();
                let end = lines[at..]
                    .iter()
                    .position(|l| l.sort == Sort::Flow(Keyword::EndSub) && l.o_name() == name)?;
                at += end + 1;
                continue;
            }
            Sort::Flow(Keyword::EndSub) => {
                order.push(at);
                at = calls.pop()?.back;
                continue;
            }
            Sort::Flow(Keyword::Call) => {
                order.push(at);
                let begin = *subs.get(&line.o_name()?)? + 1;
                calls.push(Call {
                    back: at + 1,
                    begin,
                    more: 0,
                });
                at = begin;
                continue;
            }
            _ => {}
        }
        let steering = line
            .words
            .iter()
            .filter(|w| w.letter == b'M')
            .map(|w| (w, codes::m(w.tenths(), false)))
            .find(|(_, m)| matches!(m, M::Call | M::Return | M::Ends));
        let skipped = line.sort == Sort::Optional;
        match steering {
            Some(_) if skipped => return None,
            Some((_, M::Ends)) => {
                order.push(at);
                return Some(order);
            }
            Some((_, M::Return)) => {
                if line.has(b'P') {
                    return None;
                }
                order.push(at);
                let Some(call) = calls.last_mut() else {
                    // The main program begins anew.
                    return Some(order);
                };
                if call.more > 0 {
                    call.more -= 1;
                    at = call.begin;
                } else {
                    at = call.back;
                    calls.pop();
                }
                continue;
            }
            Some((word, _)) => {
                order.push(at);
                let (begin, times) = target(line, word.tenths() == 970, &programs, &numbers)?;
                at += 1;
                if times > 0 {
                    calls.push(Call {
                        back: at,
                        begin,
                        more: times - 1,
                    });
                    at = begin;
                }
                continue;
            }
            None => {}
        }
        if line.has(b'O') {
            if seen_number && calls.is_empty() {
                // The next program of the file.
                return Some(order);
            }
            seen_number = true;
        }
        order.push(at);
        at += 1;
    }
    calls.is_empty().then_some(order)
}

/// Line that a call begins at, and how often it is run.
fn target(
    line: &Line<'_>,
    local: bool,
    programs: &HashMap<Vec<u8>, usize>,
    numbers: &HashMap<i64, usize>,
) -> Option<(usize, u32)> {
    let p = line
        .word(b'P')
        .filter(|p| p.value >= 0.0 && p.value.fract() == 0.0)?;
    let number = p.value as u64;
    let named = |n: u64| programs.get(n.to_string().as_bytes()).copied();
    let times = match line.word(b'L') {
        Some(l) if l.value >= 0.0 && l.value.fract() == 0.0 && l.value < 1e4 => l.value as u32,
        Some(_) => return None,
        None => 1,
    };
    if local {
        return numbers.get(&p.tenths()).map(|i| (*i, times));
    }
    // Fanuc: M98 P30100 runs O100 three times.
    let packed = || {
        let begin = named(number % 10_000).filter(|_| number > 9999 && !line.has(b'L'))?;
        Some((begin, u32::try_from(number / 10_000).ok()?))
    };
    named(number).map(|begin| (begin, times)).or_else(packed)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of the lines, from 1.
    fn followed(program: &str) -> Option<Vec<usize>> {
        match order(program.as_bytes()) {
            Order::Straight => None,
            Order::Followed(order) => Some(order.iter().map(|i| i + 1).collect()),
        }
    }

    #[test]
    fn calls_are_followed() {
        let fanuc = "O1\nM98 P100 L2\nG1 X1\nM30\nO100\nX2\nM99\n";
        assert_eq!(followed(fanuc).unwrap(), [1, 2, 5, 6, 7, 5, 6, 7, 3, 4]);
        let packed = "O1\nM98 P20100\nM30\nO0100\nX2\nM99\n";
        assert_eq!(followed(packed).unwrap(), [1, 2, 4, 5, 6, 4, 5, 6, 3]);
        let haas = "M97 P50\nM30\nN50 G1 X1\nM99\n";
        assert_eq!(followed(haas).unwrap(), [1, 3, 4, 2]);
        let linuxcnc = "o<a> sub\nG1 X1\no<a> endsub\no<a> call\no<A> call [5]\nM2\n";
        assert_eq!(followed(linuxcnc).unwrap(), [4, 2, 3, 5, 2, 3, 6]);
    }

    #[test]
    fn what_cannot_be_followed_is_not() {
        for program in [
            "G1 X1\nM30\n",
            "M98 P5\nM30\n",
            "M98 P#1\nM30\nO1\nM99\n",
            "/M98 P1\nM30\nO1\nM99\n",
            "M98 P1\nIF[#1EQ1]GOTO5\nM30\nO1\nM99\n",
            "O1\nM98 P1\nM30\n",
            "o<a> sub\no<a> call\no<a> endsub\no<a> call\n",
        ] {
            assert_eq!(followed(program), None, "{program}");
        }
    }
}
