//! How far a number, a parameter or an expression goes.

/// Length of `[…]`, `#5`, `#<name>`, `##5`, `#[…]`.
pub(super) fn operand_length(text: &[u8]) -> Option<usize> {
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
pub(super) fn call_length(text: &[u8]) -> Option<usize> {
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
pub(super) fn strip_operands(mut text: &[u8]) -> Option<Vec<u8>> {
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
pub(super) fn number_length(text: &[u8]) -> usize {
    let sign = usize::from(matches!(text.first(), Some(b'+' | b'-')));
    let body = text[sign..]
        .iter()
        .take_while(|b| b.is_ascii_digit() || **b == b'.')
        .count();
    let digits = text[sign..sign + body].iter().any(u8::is_ascii_digit);
    if digits { sign + body } else { 0 }
}
