//! Decimals as instruments write them, `-179.3250`: sign, digits, at most one mark. Everything else (exponents, more than
//! fifteen digits, names of infinities) is left to `fast_float2`; the value is the same, the nearest double, either way.

/// 10⁰ … 10¹⁵, exact.
const TENS: [f64; 16] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
];

/// The number that `bytes` begin with, and how many bytes it takes; nothing where there is none. `mark` divides the
/// whole from the fraction.
#[inline]
pub(super) fn parse(bytes: &[u8], mark: u8) -> Option<(f64, usize)> {
    let negative = bytes.first() == Some(&b'-');
    let start = usize::from(negative);
    let (mut digits, mut at) = (0u64, start);
    while let Some(digit) = bytes
        .get(at)
        .map(|b| b.wrapping_sub(b'0'))
        .filter(|d| *d < 10)
    {
        digits = digits.wrapping_mul(10).wrapping_add(u64::from(digit));
        at += 1;
    }
    let mut count = at - start;
    let mut fraction = 0;
    if bytes.get(at) == Some(&mark) {
        at += 1;
        let from = at;
        while let Some(digit) = bytes
            .get(at)
            .map(|b| b.wrapping_sub(b'0'))
            .filter(|d| *d < 10)
        {
            digits = digits.wrapping_mul(10).wrapping_add(u64::from(digit));
            at += 1;
        }
        fraction = at - from;
        count += fraction;
    }
    // Fifteen digits are an exact integer and the power of ten is exact: one rounding, by the division.
    if !(1..=15).contains(&count) || matches!(bytes.get(at), Some(b'e' | b'E')) {
        return long(bytes, mark);
    }
    let value = digits as f64 / TENS[fraction];
    Some((if negative { -value } else { value }, at))
}

/// The same without haste.
#[cold]
fn long(bytes: &[u8], mark: u8) -> Option<(f64, usize)> {
    if mark == b'.' {
        return fast_float2::parse_partial::<f64, _>(bytes)
            .ok()
            .filter(|(_, used)| *used > 0);
    }
    let mut text = [0; 48];
    let used = bytes.len().min(text.len());
    for (to, from) in text.iter_mut().zip(bytes) {
        *to = match *from {
            b if b == mark => b'.',
            // A point is no part of a number that has a mark of its own.
            b'.' => b' ',
            b => b,
        };
    }
    fast_float2::parse_partial::<f64, _>(&text[..used])
        .ok()
        .filter(|(_, used)| *used > 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn is_what_fast_float_reads(text in "-?[0-9]{0,20}(\\.[0-9]{0,12})?([eE][-+]?[0-9]{1,2})?[,; x]?") {
            let known = fast_float2::parse_partial::<f64, _>(text.as_bytes()).ok();
            let found = parse(text.as_bytes(), b'.');
            prop_assert_eq!(found.map(|(v, n)| (v.to_bits(), n)), known.map(|(v, n)| (v.to_bits(), n)), "{}", text);
            let with_comma = text.replace(',', ";").replace('.', ",");
            prop_assert_eq!(parse(with_comma.as_bytes(), b','), found, "{}", with_comma);
        }
    }

    #[test]
    fn no_number_is_none() {
        for text in ["", "-", ".", "abc", " 1", "-x", ",5"] {
            assert_eq!(parse(text.as_bytes(), b'.'), None, "{text}");
        }
        assert_eq!(parse(b"inf", b'.').unwrap().0, f64::INFINITY);
        assert_eq!(parse(b"-179.3250,", b'.'), Some((-179.325, 9)));
        assert_eq!(parse(b"0,25;", b','), Some((0.25, 4)));
        assert!(parse(b"-0.0", b'.').unwrap().0.is_sign_negative());
    }
}
