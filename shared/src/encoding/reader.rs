//! Bytes into messages and tables: postcard's format by a deserializer that an image has room for.
//!
//! As in [`writer`](super::writer) a number costs one call. Where bytes run out or are none of the format, zeros are read and
//! that is remembered; it is said once, at the end.
use serde::de::{self, Deserialize, DeserializeSeed, IntoDeserializer, Visitor};

/// Reads a value from the start of `bytes`; with what is behind it, or `None` if it is not there whole.
pub fn take<'de, T: Deserialize<'de>>(bytes: &'de [u8]) -> Option<(T, &'de [u8])> {
    let mut reader = Reader {
        rest: bytes,
        failed: false,
    };
    let value = T::deserialize(&mut reader);
    if reader.failed {
        None
    } else {
        value.ok().map(|value| (value, reader.rest))
    }
}

struct Reader<'de> {
    rest: &'de [u8],
    failed: bool,
}

/// A value that its type does not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a value that its type does not have")]
struct Unknown;

impl de::Error for Unknown {
    fn custom<T: core::fmt::Display>(_: T) -> Self {
        Self
    }

    fn invalid_type(_: de::Unexpected<'_>, _: &dyn de::Expected) -> Self {
        Self
    }

    fn invalid_value(_: de::Unexpected<'_>, _: &dyn de::Expected) -> Self {
        Self
    }

    fn invalid_length(_: usize, _: &dyn de::Expected) -> Self {
        Self
    }
}

impl<'de> Reader<'de> {
    #[inline(never)]
    fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.rest.split_first() else {
            self.failed = true;
            return 0;
        };
        self.rest = rest;
        *first
    }

    #[inline(never)]
    fn all(&mut self, count: usize) -> &'de [u8] {
        let Some((some, rest)) = self.rest.split_at_checked(count) else {
            self.failed = true;
            return &[];
        };
        self.rest = rest;
        some
    }

    fn array<const N: usize>(&mut self) -> [u8; N] {
        self.all(N).first_chunk().copied().unwrap_or([0; N])
    }

    /// Seven bits at a time, the lowest first, `bits` in all.
    #[inline(never)]
    fn long(&mut self, bits: u32) -> u64 {
        let (mut number, mut shift) = (0, 0);
        loop {
            let byte = self.byte();
            let part = u64::from(byte & 0x7f);
            number |= part << shift;
            let left = bits.saturating_sub(shift);
            // The last byte may not have more bits than the number.
            self.failed |= left < 7 && part >> left != 0;
            if byte < 0x80 {
                return number;
            }
            shift += 7;
            if shift >= bits {
                self.failed = true;
                return 0;
            }
        }
    }

    #[inline(never)]
    fn number(&mut self) -> u32 {
        self.long(32) as u32
    }

    #[inline(never)]
    fn single(&mut self) -> f32 {
        f32::from_le_bytes(self.array())
    }

    fn text(&mut self) -> &'de str {
        let count = self.number() as usize;
        let bytes = self.all(count);
        core::str::from_utf8(bytes).unwrap_or_else(|_| {
            self.failed = true;
            ""
        })
    }

    /// 0 or 1.
    fn flag(&mut self) -> bool {
        let byte = self.byte();
        self.failed |= byte > 1;
        byte != 0
    }
}

const fn unzigzag(number: u32) -> i32 {
    (number >> 1) as i32 ^ -((number & 1) as i32)
}

const fn long_unzigzag(number: u64) -> i64 {
    (number >> 1) as i64 ^ -((number & 1) as i64)
}

/// One method of the deserializer: what is read, and what the visitor is told.
macro_rules! scalars {
    ($($method:ident, $visit:ident = |$reader:ident| $how:expr;)*) => {
        $(fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Unknown> {
            let $reader = self;
            visitor.$visit($how)
        })*
    };
}

impl<'de> de::Deserializer<'de> for &mut Reader<'de> {
    type Error = Unknown;

    scalars! {
        deserialize_bool, visit_bool = |r| r.flag();
        deserialize_u8, visit_u8 = |r| r.byte();
        deserialize_i8, visit_i8 = |r| r.byte() as i8;
        deserialize_u16, visit_u16 = |r| r.long(16) as u16;
        deserialize_u32, visit_u32 = |r| r.number();
        deserialize_u64, visit_u64 = |r| r.long(64);
        deserialize_i16, visit_i16 = |r| unzigzag(r.long(16) as u32) as i16;
        deserialize_i32, visit_i32 = |r| unzigzag(r.number());
        deserialize_i64, visit_i64 = |r| long_unzigzag(r.long(64));
        deserialize_f32, visit_f32 = |r| r.single();
        deserialize_f64, visit_f64 = |r| f64::from_le_bytes(r.array());
        deserialize_str, visit_borrowed_str = |r| r.text();
        deserialize_string, visit_borrowed_str = |r| r.text();
    }

    fn deserialize_bytes<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Unknown> {
        let count = self.number() as usize;
        visitor.visit_borrowed_bytes(self.all(count))
    }

    fn deserialize_byte_buf<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Unknown> {
        self.deserialize_bytes(visitor)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Unknown> {
        if self.flag() {
            visitor.visit_some(self)
        } else {
            visitor.visit_none()
        }
    }

    fn deserialize_unit<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Unknown> {
        visitor.visit_unit()
    }

    fn deserialize_unit_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, Unknown> {
        visitor.visit_unit()
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, Unknown> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Unknown> {
        let left = self.number();
        visitor.visit_seq(Elements { reader: self, left })
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, _: usize, visitor: V) -> Result<V::Value, Unknown> {
        visitor.visit_seq(Fields(self))
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: usize,
        visitor: V,
    ) -> Result<V::Value, Unknown> {
        visitor.visit_seq(Fields(self))
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Unknown> {
        visitor.visit_seq(Fields(self))
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Unknown> {
        visitor.visit_enum(self)
    }

    serde::forward_to_deserialize_any! { char map identifier ignored_any }

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Unknown> {
        Err(Unknown)
    }

    fn is_human_readable(&self) -> bool {
        false
    }
}

impl<'de> de::EnumAccess<'de> for &mut Reader<'de> {
    type Error = Unknown;
    type Variant = Self;

    fn variant_seed<V: DeserializeSeed<'de>>(self, seed: V) -> Result<(V::Value, Self), Unknown> {
        let index: de::value::U32Deserializer<Unknown> = self.number().into_deserializer();
        Ok((seed.deserialize(index)?, self))
    }
}

impl<'de> de::VariantAccess<'de> for &mut Reader<'de> {
    type Error = Unknown;

    fn unit_variant(self) -> Result<(), Unknown> {
        Ok(())
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, Unknown> {
        seed.deserialize(self)
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, visitor: V) -> Result<V::Value, Unknown> {
        visitor.visit_seq(Fields(self))
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Unknown> {
        visitor.visit_seq(Fields(self))
    }
}

/// As many as are asked for: whoever reads a struct or an array asks for no more.
struct Fields<'a, 'de>(&'a mut Reader<'de>);

impl<'de> de::SeqAccess<'de> for Fields<'_, 'de> {
    type Error = Unknown;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, Unknown> {
        seed.deserialize(&mut *self.0).map(Some)
    }
}

/// As many as were announced, or until bytes run out.
struct Elements<'a, 'de> {
    reader: &'a mut Reader<'de>,
    left: u32,
}

impl<'de> de::SeqAccess<'de> for Elements<'_, 'de> {
    type Error = Unknown;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, Unknown> {
        if self.left == 0 || self.reader.failed {
            return Ok(None);
        }
        self.left -= 1;
        seed.deserialize(&mut *self.reader).map(Some)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::{Limits, Zone};
    use crate::wire::{FromController, Request};
    use proptest::prelude::*;
    use serde::{Deserialize, Serialize};

    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    enum Kind {
        Unit,
        New(u64),
        Pair(i64, f64),
        Named { a: Option<u16>, b: [i16; 2] },
    }

    type Everything = (
        (u8, i8, u16, i16, u32, i32, u64, i64, f32, f64),
        (
            bool,
            Option<u32>,
            [u8; 3],
            heapless::Vec<i32, 40>,
            heapless::String<40>,
        ),
        [Kind; 5],
    );

    /// The same as postcard itself, value and rest, and the same refused.
    fn agrees<T: for<'de> Deserialize<'de> + Serialize>(bytes: &[u8]) {
        let (ours, theirs) = (take::<T>(bytes), postcard::take_from_bytes::<T>(bytes).ok());
        let written = |value: &Option<(T, &[u8])>| {
            value.as_ref().map(|(value, rest)| {
                let mut buffer = [0; 4000];
                // Compared as bytes: NaN is not itself.
                (
                    postcard::to_slice(value, &mut buffer).unwrap().to_vec(),
                    rest.len(),
                )
            })
        };
        assert_eq!(written(&ours), written(&theirs), "{bytes:02x?}");
    }

    proptest! {
        #[test]
        fn what_was_written_is_read(
            scalars in any::<(u8, i8, u16, i16, u32, i32, u64, i64, f32, f64)>(),
            more in any::<(bool, Option<u32>, [u8; 3])>(),
            list in proptest::collection::vec(any::<i32>(), 0..40),
            text in "[a-z]{0,40}",
            cut in 0usize..300,
        ) {
            let (list, text) = (heapless::Vec::from_slice(&list).unwrap(), text.as_str().try_into().unwrap());
            let kinds = [
                Kind::Unit,
                Kind::New(scalars.6),
                Kind::Pair(scalars.7, scalars.9),
                Kind::Named { a: Some(scalars.2), b: [scalars.3; 2] },
                Kind::Named { a: None, b: [0; 2] },
            ];
            let message: Everything = (scalars, (more.0, more.1, more.2, list, text), kinds);
            let mut buffer = [0; 1000];
            let bytes = postcard::to_slice(&message, &mut buffer).unwrap();
            let (read, rest) = take::<Everything>(bytes).unwrap();
            prop_assert!(rest.is_empty());
            let mut again = [0; 1000];
            prop_assert_eq!(&*bytes, postcard::to_slice(&read, &mut again).unwrap());
            agrees::<Everything>(&bytes[..cut.min(bytes.len())]);
        }

        #[test]
        fn whatever_postcard_reads_or_refuses_so_does_this(
            bytes in proptest::collection::vec(prop_oneof![0u8..20, any::<u8>()], 0..120)
        ) {
            agrees::<Everything>(&bytes);
            agrees::<Request>(&bytes);
            agrees::<FromController>(&bytes);
            agrees::<Zone>(&bytes);
            agrees::<Limits>(&bytes);
            agrees::<u16>(&bytes);
            agrees::<i32>(&bytes);
            agrees::<u64>(&bytes);
            agrees::<heapless::String<32>>(&bytes);
        }
    }
}
