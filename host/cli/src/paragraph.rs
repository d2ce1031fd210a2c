//! Sentences at the width of the terminal.
use super::grid::width;

/// Wraps `text` at the width of the terminal; its lines are set in by `indent`, those that follow by two more. Commands and
/// paths are never broken: a word that does not fit stands on a line of its own.
pub fn wrapped(text: &str, indent: usize) -> String {
    at(text, indent, width())
}

/// Words as a sentence: a capital first, a full stop last.
pub fn sentence(words: &str) -> String {
    let mut letters = words.chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    format!("{}.", first.chain(letters).collect::<String>())
}

fn at(text: &str, indent: usize, width: usize) -> String {
    let mut lines: Vec<String> = Vec::new();
    let mut line = " ".repeat(indent);
    let mut empty = true;
    for word in text.split(' ').filter(|word| !word.is_empty()) {
        let length = line.chars().count() + word.chars().count();
        if !empty && length >= width {
            lines.push(std::mem::replace(&mut line, " ".repeat(indent + 2)));
            empty = true;
        }
        if !empty {
            line.push(' ');
        }
        line.push_str(word);
        empty = false;
    }
    lines.push(line);
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_fit_and_no_word_is_lost() {
        let text = "X travels 54.2 µm/m less than Y: raise the scale of X by 54.2 µm/m, or lower that of Y";
        for width in [24, 40, 60, 200] {
            let out = at(text, 2, width);
            assert!(out.lines().all(|l| l.chars().count() <= width), "{out}");
            let words = |t: &str| t.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
            assert_eq!(words(&out), words(text));
        }
        assert_eq!(
            at("a very-long-path/that/does/not/fit b", 0, 12)
                .lines()
                .count(),
            3
        );
        assert_eq!(at("", 2, 40), "  ");
    }
}
