//! A line as one instruction with its arguments.

/// A line without its comment and its end; marks in strings are no comments.
pub(super) fn code(line: &[u8]) -> &[u8] {
    let mut inside = false;
    let end = line.iter().position(|b| {
        inside ^= *b == b'"';
        *b == b'!' && !inside
    });
    line[..end.unwrap_or(line.len())].trim_ascii_end()
}

/// The arguments of a single instruction, blanks around and inside literals taken out.
pub(super) fn arguments(text: &str, name: &str) -> Option<Vec<String>> {
    let body = text.get(name.len()..)?.strip_suffix(';')?;
    if !body.starts_with(char::is_whitespace) || body.contains([';', '"']) {
        return None;
    }
    let (mut depth, mut list) = (0, vec![String::new()]);
    for c in body.chars().filter(|c| !c.is_whitespace()) {
        match c {
            '[' | '(' => depth += 1,
            ']' | ')' => depth -= 1,
            ',' if depth == 0 => {
                list.push(String::new());
                continue;
            }
            _ => {}
        }
        list.last_mut()?.push(c);
    }
    (depth == 0).then_some(list)
}
