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

/// The order of the lines; `None` where it cannot be told.
fn follow(lines: &[Line<'_>]) -> Option<Vec<usize>> {
    let mut walk = Walk {
        lines,
        places: Places::of(lines)?,
        order: Vec::new(),
        calls: Vec::new(),
        at: 0,
        seen_number: false,
    };
    while let Some(line) = lines.get(walk.at) {
        if walk.order.len() > MOST_VISITS * lines.len() + 1000 || walk.calls.len() > 100 {
            return None;
        }
        let goes_on = match line.sort {
            Sort::Flow(keyword) => walk.keyword(line, keyword)?,
            _ => walk.line(line)?,
        };
        if !goes_on {
            return Some(walk.order);
        }
    }
    walk.calls.is_empty().then_some(walk.order)
}

/// Lines that calls lead to.
struct Places {
    programs: HashMap<Vec<u8>, usize>,
    subs: HashMap<Vec<u8>, usize>,
    numbers: HashMap<i64, usize>,
}

impl Places {
    /// `None` where something jumps.
    fn of(lines: &[Line<'_>]) -> Option<Self> {
        let mut places = Self {
            programs: HashMap::new(),
            subs: HashMap::new(),
            numbers: HashMap::new(),
        };
        for (i, line) in lines.iter().enumerate() {
            match line.sort {
                Sort::Flow(Keyword::Sub) => _ = places.subs.insert(line.o_name()?, i),
                Sort::Flow(Keyword::Other(_)) => return None,
                Sort::Plain if line.has(b'O') => _ = places.programs.insert(line.o_name()?, i),
                _ => {}
            }
            if let Some(n) = line.word(b'N') {
                places.numbers.entry(n.tenths()).or_insert(i);
            }
        }
        Some(places)
    }
}

/// A program as it is run. Its steps say whether it goes on; `None`: nobody can tell.
struct Walk<'a> {
    lines: &'a [Line<'a>],
    places: Places,
    order: Vec<usize>,
    calls: Vec<Call>,
    at: usize,
    /// A number of a program was passed.
    seen_number: bool,
}

impl Walk<'_> {
    fn keyword(&mut self, line: &Line<'_>, keyword: Keyword) -> Option<bool> {
        match keyword {
            Keyword::Sub => {
                // A definition is passed over.
                let name = line.o_name();
                let end = self.lines[self.at..]
                    .iter()
                    .position(|l| l.sort == Sort::Flow(Keyword::EndSub) && l.o_name() == name)?;
                self.at += end + 1;
            }
            Keyword::EndSub => {
                self.order.push(self.at);
                self.at = self.calls.pop()?.back;
            }
            Keyword::Call => {
                self.order.push(self.at);
                let begin = *self.places.subs.get(&line.o_name()?)? + 1;
                self.call(begin, 0);
            }
            Keyword::Other(_) => return None,
        }
        Some(true)
    }

    /// Runs from `begin`, and `more` times again, before what stands behind the present line.
    fn call(&mut self, begin: usize, more: u32) {
        self.calls.push(Call {
            back: self.at + 1,
            begin,
            more,
        });
        self.at = begin;
    }

    fn line(&mut self, line: &Line<'_>) -> Option<bool> {
        let steering = line
            .words
            .iter()
            .filter(|w| w.letter == b'M')
            .map(|w| (w, codes::m(w.tenths(), false)))
            .find(|(_, m)| matches!(m, M::Call | M::Return | M::Ends));
        if steering.is_some() && line.sort == Sort::Optional {
            return None;
        }
        match steering {
            Some((_, M::Ends)) => {
                self.order.push(self.at);
                return Some(false);
            }
            Some((_, M::Return)) => return self.leave(line),
            Some((word, _)) => {
                self.order.push(self.at);
                let (begin, times) = target(line, word.tenths() == 970, &self.places)?;
                if times > 0 {
                    self.call(begin, times - 1);
                } else {
                    self.at += 1;
                }
                return Some(true);
            }
            None => {}
        }
        if line.has(b'O') {
            if self.seen_number && self.calls.is_empty() {
                // The next program of the file.
                return Some(false);
            }
            self.seen_number = true;
        }
        self.order.push(self.at);
        self.at += 1;
        Some(true)
    }

    /// M99.
    fn leave(&mut self, line: &Line<'_>) -> Option<bool> {
        if line.has(b'P') {
            return None;
        }
        self.order.push(self.at);
        let Some(call) = self.calls.last_mut() else {
            // The main program begins anew.
            return Some(false);
        };
        if call.more > 0 {
            call.more -= 1;
            self.at = call.begin;
        } else {
            self.at = call.back;
            self.calls.pop();
        }
        Some(true)
    }
}

/// Line that a call begins at, and how often it is run.
fn target(line: &Line<'_>, local: bool, places: &Places) -> Option<(usize, u32)> {
    let p = line
        .word(b'P')
        .filter(|p| p.value >= 0.0 && p.value.fract() == 0.0)?;
    let number = p.value as u64;
    let named = |n: u64| places.programs.get(n.to_string().as_bytes()).copied();
    let times = match line.word(b'L') {
        Some(l) if l.value >= 0.0 && l.value.fract() == 0.0 && l.value < 1e4 => l.value as u32,
        Some(_) => return None,
        None => 1,
    };
    if local {
        return places.numbers.get(&p.tenths()).map(|i| (*i, times));
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
