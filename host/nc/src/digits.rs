//! Decimals as programs write them.

/// Appends a decimal of at most so many places (up to 9), without trailing zeros.
pub(super) fn push_number(out: &mut Vec<u8>, value: f64, decimals: usize) {
    const POWERS: [u64; 10] = [
        1,
        10,
        100,
        1_000,
        10_000,
        100_000,
        1_000_000,
        10_000_000,
        100_000_000,
        1_000_000_000,
    ];
    let decimals = decimals.min(9);
    let power = POWERS[decimals];
    let scaled = (value.abs() * power as f64).round();
    if scaled.is_nan() || scaled >= 1e15 {
        // Too many digits for the short way.
        let text = format!("{value:.decimals$}");
        out.extend_from_slice(text.as_bytes());
        return;
    }
    let scaled = scaled as u64;
    if value < 0.0 && scaled > 0 {
        out.push(b'-');
    }
    push_integer(out, scaled / power);
    let (mut rest, mut places) = (scaled % power, decimals);
    if rest == 0 {
        return;
    }
    while rest % 10 == 0 {
        (rest, places) = (rest / 10, places - 1);
    }
    out.push(b'.');
    for place in (0..places).rev() {
        out.push(b'0' + (rest / POWERS[place] % 10) as u8);
    }
}

fn push_integer(out: &mut Vec<u8>, mut value: u64) {
    let mut digits = [0_u8; 20];
    let mut at = digits.len();
    loop {
        at -= 1;
        digits[at] = b'0' + (value % 10) as u8;
        value /= 10;
        if value == 0 {
            break;
        }
    }
    out.extend_from_slice(&digits[at..]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn text(value: f64, decimals: usize) -> String {
        let mut out = Vec::new();
        push_number(&mut out, value, decimals);
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn zeros_and_signs() {
        for (value, expected) in [
            (0.0, "0"),
            (-0.0, "0"),
            (-4e-7, "0"),
            (1.5, "1.5"),
            (-0.05, "-0.05"),
            (100.0, "100"),
            (12.345678, "12.345678"),
            (-1e3, "-1000"),
        ] {
            assert_eq!(text(value, 6), expected);
        }
    }

    proptest! {
        /// The long way, with the formatting of the standard library.
        #[test]
        fn as_the_standard_library(value in -1e6_f64..1e6, decimals in 0_usize..8) {
            let own: f64 = text(value, decimals).parse().unwrap();
            let theirs: f64 = format!("{value:.decimals$}").parse().unwrap();
            // Halves may go either way.
            prop_assert!((own - theirs).abs() <= 1.01 * 10f64.powi(-(decimals as i32)) && (own - value).abs() <= 0.5001 * 10f64.powi(-(decimals as i32)) + 1e-9);
        }
    }
}
