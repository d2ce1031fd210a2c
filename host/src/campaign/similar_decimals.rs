//! Fields that look like the one above them, `-12.3450,` under `-13.2075,`: two words of text that are compared with the
//! shape of that one, then put together at once, whatever the digits.

const EACH: u64 = 0x0101_0101_0101_0101;
const ALL: u128 = u128::MAX / 0xFF;
/// 10⁰ … 10⁸, exact.
const TENS: [u32; 9] = [
    1,
    10,
    100,
    1000,
    10_000,
    100_000,
    1_000_000,
    10_000_000,
    100_000_000,
];

/// Where sign, digits, point and end of a field stand.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    /// Its text with `0` for every digit.
    text: [u64; 2],
    /// Added to a byte's difference from `text`, sets the highest bit where the byte does not fit.
    limit: [u64; 2],
    /// The highest bits of its bytes.
    bytes: [u64; 2],
    /// Bit of the sign.
    sign: u64,
    /// Bits before the whole part, and those that the word of it has to spare.
    before: u32,
    spare: u32,
    /// Byte of the first decimal, and the bits of the decimals.
    decimals_at: usize,
    decimals: u32,
    /// What the digits are divided by.
    tens: f64,
    /// The same where a word is too short for all digits, else nothing.
    carry: u64,
    /// Bytes with the end of the field.
    length: usize,
}

impl Shape {
    /// The shape of a field with the `,` or line end behind it; nothing for all but plain decimals of up to seven digits
    /// before and eight behind the point.
    pub(super) fn of(field: &[u8]) -> Option<Self> {
        let mut window = [0; 16];
        window.get_mut(..field.len())?.copy_from_slice(field);
        let digits = |from: usize| {
            window[from..]
                .iter()
                .take_while(|b| b.is_ascii_digit())
                .count()
        };
        let sign = usize::from(window[0] == b'-');
        let whole = digits(sign);
        let point = sign + whole;
        if !(1..=7).contains(&whole) || window[point] != b'.' {
            return None;
        }
        let decimals = digits(point + 1);
        if !(1..=8).contains(&decimals)
            || !matches!(&field[point + 1 + decimals..], b"," | b"\n" | b"\r\n")
        {
            return None;
        }
        let range = |from: usize, n: usize| ((1_u128 << (8 * n)) - 1) << (8 * from);
        let of_digits = range(sign, whole) | range(point + 1, decimals);
        let words = |both: u128| [both as u64, (both >> 64) as u64];
        Some(Self {
            text: words(u128::from_le_bytes(window) & !of_digits | (0x30 * ALL) & of_digits),
            limit: words((0x7F * ALL) & !of_digits | (0x76 * ALL) & of_digits),
            bytes: words(
                (0x80 * ALL)
                    & if field.len() < 16 {
                        range(0, field.len())
                    } else {
                        u128::MAX
                    },
            ),
            sign: (sign as u64) << 63,
            before: 8 * sign as u32,
            spare: 64 - 8 * whole as u32,
            decimals_at: point + 1,
            decimals: 8 * decimals as u32,
            tens: f64::from(TENS[decimals]),
            carry: if whole + decimals <= 8 {
                0
            } else {
                u64::from(TENS[decimals])
            },
            length: field.len(),
        })
    }

    /// The number at `at`, and the byte behind the end of its field; nothing where it has another shape or the text ends soon.
    #[inline]
    pub(super) fn read(&self, text: &[u8], at: usize) -> Option<(f64, usize)> {
        let window: &[u8; 24] = text.get(at..)?.first_chunk()?;
        let word = |k: usize| u64::from_le_bytes(std::array::from_fn(|byte| window[k + byte]));
        let difference = [word(0) ^ self.text[0], word(8) ^ self.text[1]];
        let misfit =
            |k: usize| (difference[k].wrapping_add(self.limit[k]) | difference[k]) & self.bytes[k];
        if misfit(0) | misfit(1) != 0 {
            return None;
        }
        // The digits of both parts at the high ends of their words. No shift is of 64 bits or more: the masks say so.
        let decimals = (word(self.decimals_at & 15) ^ (0x30 * EACH)) << ((64 - self.decimals) & 63);
        let whole = difference[0] >> (self.before & 63) << (self.spare & 63);
        let digits = if self.carry == 0 {
            together(whole >> (self.decimals & 63) | decimals)
        } else {
            together(whole) * self.carry + together(decimals)
        };
        // No more than fifteen digits: exact, as the power of ten is; one rounding, by the division.
        let value = digits as i64 as f64 / self.tens;
        Some((
            f64::from_bits(value.to_bits() | self.sign),
            at + self.length,
        ))
    }
}

/// Eight digits, the first in the lowest byte, as a number: pairs, then fours, then all.
#[inline]
fn together(digits: u64) -> u64 {
    let pairs = digits.wrapping_mul(10).wrapping_add(digits >> 8);
    let even = (pairs & 0xFF_0000_00FF).wrapping_mul(0xF_4240_0000_0064);
    let odd = (pairs >> 16 & 0xFF_0000_00FF).wrapping_mul(0x2710_0000_0001);
    even.wrapping_add(odd) >> 32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_it_reads_is_what_parse_reads(
            above in "-?[0-9]{1,7}\\.[0-9]{1,8}(,|\n|\r\n)",
            text in "[-0-9.,e\n\r /:é]{0,24}",
            keep in 0..16_usize,
        ) {
            let Some(shape) = Shape::of(above.as_bytes()) else { return Ok(()) };
            let room = " ".repeat(24);
            let same: f64 = above.trim_end_matches([',', '\n', '\r']).parse().unwrap();
            let read = shape.read((above.clone() + &room).as_bytes(), 0).map(|(v, n)| (v.to_bits(), n));
            prop_assert_eq!(read, Some((same.to_bits(), above.len())));
            // The same beginning with something else behind it: a number of the shape, or refused.
            let mixed: Vec<u8> = above.bytes().take(keep).chain(text.bytes()).chain(room.bytes()).collect();
            let fits = mixed.iter().zip(above.bytes()).all(|(a, b)| {
                if b.is_ascii_digit() { a.is_ascii_digit() } else { *a == b }
            });
            let read = shape.read(&mixed, 0);
            prop_assert_eq!(read.is_some(), fits);
            if let Some((value, length)) = read {
                let written = std::str::from_utf8(&mixed[..length]).unwrap().trim_end_matches([',', '\n', '\r']);
                prop_assert_eq!(value.to_bits(), written.parse::<f64>().unwrap().to_bits());
            }
        }
    }

    #[test]
    fn only_plain_decimals_have_a_shape() {
        for text in [
            "1,",
            ".5,",
            "1.,",
            "+1.5,",
            "1.5e3,",
            "1.5 ,",
            " 1.5,",
            "1.5",
            "1.123456789,",
            "12345678.5,",
            "",
        ] {
            assert!(Shape::of(text.as_bytes()).is_none(), "{text}");
        }
        assert!(Shape::of(b"1234567.1234567\n").is_some());
    }
}
