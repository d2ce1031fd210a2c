//! Messages into bytes: postcard's format by a serializer that an image has room for.
//!
//! A number of a message costs one call here; inlined, as the crate's own serializer does it, forty bytes of code. What
//! does not fit is noticed once, at the end.
use serde::ser::{self, Impossible, Serialize};

/// Bytes of a message, so far.
pub(crate) struct Writer<'a> {
    bytes: &'a mut [u8],
    length: usize,
}

/// A type that messages do not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a type that messages do not have")]
pub(crate) struct Unsupported;

impl ser::Error for Unsupported {
    fn custom<T: core::fmt::Display>(_: T) -> Self {
        Self
    }
}

type Done = Result<(), Unsupported>;

/// Writes a value to the start of `bytes`; its length, or `None` if it does not fit.
///
/// ```
/// use giotto_shared::encoding::{put, take};
///
/// let mut bytes = [0; 8];
/// let length = put(&(300_u16, true), &mut bytes).unwrap();
/// // 300 takes two bytes of seven bits each.
/// assert_eq!(bytes[..length], [0xac, 0x02, 1]);
/// let (value, rest) = take::<(u16, bool)>(&bytes[..length]).unwrap();
/// assert_eq!((value, rest.len()), ((300, true), 0));
/// ```
pub fn put<T: Serialize + ?Sized>(value: &T, bytes: &mut [u8]) -> Option<usize> {
    let mut writer = Writer::new(bytes);
    value.serialize(&mut writer).ok()?;
    writer.length()
}

impl<'a> Writer<'a> {
    pub(crate) fn new(bytes: &'a mut [u8]) -> Self {
        Self { bytes, length: 0 }
    }

    /// How many there are; `None` if they did not fit.
    pub(crate) fn length(&self) -> Option<usize> {
        (self.length <= self.bytes.len()).then_some(self.length)
    }

    #[inline(never)]
    fn byte(&mut self, byte: u8) {
        if let Some(place) = self.bytes.get_mut(self.length) {
            *place = byte;
        }
        self.length += 1;
    }

    #[inline(never)]
    fn all(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.byte(*byte));
    }

    fn counted(&mut self, bytes: &[u8]) {
        self.number(bytes.len() as u32);
        self.all(bytes);
    }

    /// Seven bits at a time, the lowest first.
    #[inline(never)]
    fn number(&mut self, mut number: u32) {
        while number > 0x7f {
            self.byte(number as u8 | 0x80);
            number >>= 7;
        }
        self.byte(number as u8);
    }

    #[inline(never)]
    fn long(&mut self, mut number: u64) {
        while number > 0x7f {
            self.byte(number as u8 | 0x80);
            number >>= 7;
        }
        self.byte(number as u8);
    }
}

/// Zigzag: the sign is the lowest bit.
const fn zigzag(number: i32) -> u32 {
    ((number << 1) ^ (number >> 31)) as u32
}

const fn long_zigzag(number: i64) -> u64 {
    ((number << 1) ^ (number >> 63)) as u64
}

/// One method of the serializer: the type, and how it is written.
macro_rules! scalars {
    ($($method:ident($type:ty) = |$writer:ident, $value:ident| $how:expr;)*) => {
        $(fn $method(self, $value: $type) -> Done {
            let $writer = self;
            $how;
            Ok(())
        })*
    };
}

impl ser::Serializer for &mut Writer<'_> {
    type Ok = ();
    type Error = Unsupported;
    type SerializeSeq = Self;
    type SerializeTuple = Self;
    type SerializeTupleStruct = Self;
    type SerializeTupleVariant = Self;
    type SerializeMap = Impossible<(), Unsupported>;
    type SerializeStruct = Self;
    type SerializeStructVariant = Self;

    scalars! {
        serialize_bool(bool) = |w, v| w.byte(u8::from(v));
        serialize_u8(u8) = |w, v| w.byte(v);
        serialize_i8(i8) = |w, v| w.byte(v as u8);
        serialize_u16(u16) = |w, v| w.number(u32::from(v));
        serialize_u32(u32) = |w, v| w.number(v);
        serialize_u64(u64) = |w, v| w.long(v);
        serialize_i16(i16) = |w, v| w.number(zigzag(i32::from(v)));
        serialize_i32(i32) = |w, v| w.number(zigzag(v));
        serialize_i64(i64) = |w, v| w.long(long_zigzag(v));
        serialize_f32(f32) = |w, v| w.all(&v.to_le_bytes());
        serialize_f64(f64) = |w, v| w.all(&v.to_le_bytes());
        serialize_char(char) = |w, v| w.counted(v.encode_utf8(&mut [0; 4]).as_bytes());
        serialize_str(&str) = |w, v| w.counted(v.as_bytes());
        serialize_bytes(&[u8]) = |w, v| w.counted(v);
    }

    fn serialize_unit_struct(self, _: &'static str) -> Done {
        Ok(())
    }

    fn serialize_none(self) -> Done {
        self.byte(0);
        Ok(())
    }

    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Done {
        self.byte(1);
        value.serialize(self)
    }

    fn serialize_unit(self) -> Done {
        Ok(())
    }

    fn serialize_unit_variant(self, _: &'static str, index: u32, _: &'static str) -> Done {
        self.number(index);
        Ok(())
    }

    fn serialize_newtype_struct<T: Serialize + ?Sized>(self, _: &'static str, value: &T) -> Done {
        value.serialize(self)
    }

    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        index: u32,
        _: &'static str,
        value: &T,
    ) -> Done {
        self.number(index);
        value.serialize(self)
    }

    fn serialize_seq(self, length: Option<usize>) -> Result<Self, Unsupported> {
        self.number(length.ok_or(Unsupported)? as u32);
        Ok(self)
    }

    fn serialize_tuple(self, _: usize) -> Result<Self, Unsupported> {
        Ok(self)
    }

    fn serialize_tuple_struct(self, _: &'static str, _: usize) -> Result<Self, Unsupported> {
        Ok(self)
    }

    fn serialize_tuple_variant(
        self,
        _: &'static str,
        index: u32,
        _: &'static str,
        _: usize,
    ) -> Result<Self, Unsupported> {
        self.number(index);
        Ok(self)
    }

    fn serialize_map(self, _: Option<usize>) -> Result<Self::SerializeMap, Unsupported> {
        Err(Unsupported)
    }

    fn serialize_struct(self, _: &'static str, _: usize) -> Result<Self, Unsupported> {
        Ok(self)
    }

    fn serialize_struct_variant(
        self,
        _: &'static str,
        index: u32,
        _: &'static str,
        _: usize,
    ) -> Result<Self, Unsupported> {
        self.number(index);
        Ok(self)
    }

    fn collect_str<T: core::fmt::Display + ?Sized>(self, _: &T) -> Done {
        Err(Unsupported)
    }

    fn is_human_readable(&self) -> bool {
        false
    }
}

/// What has parts writes them one after the other, with or without their names.
macro_rules! parts {
    ($($kind:ident::$method:ident($($name:ty)?);)*) => {
        $(impl ser::$kind for &mut Writer<'_> {
            type Ok = ();
            type Error = Unsupported;

            fn $method<T: Serialize + ?Sized>(&mut self, $(_: $name,)? value: &T) -> Done {
                value.serialize(&mut **self)
            }

            fn end(self) -> Done {
                Ok(())
            }
        })*
    };
}

parts! {
    SerializeSeq::serialize_element();
    SerializeTuple::serialize_element();
    SerializeTupleStruct::serialize_field();
    SerializeTupleVariant::serialize_field();
    SerializeStruct::serialize_field(&'static str);
    SerializeStructVariant::serialize_field(&'static str);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use serde::Serialize;
    use std::vec::Vec;

    fn written(message: &impl Serialize, room: usize) -> Option<Vec<u8>> {
        let mut bytes = std::vec![0; room];
        let mut writer = Writer::new(&mut bytes);
        message.serialize(&mut writer).unwrap();
        let length = writer.length()?;
        bytes.truncate(length);
        Some(bytes)
    }

    #[derive(Serialize)]
    enum Kind {
        Unit,
        New(u64),
        Pair(i64, f64),
        Named { a: Option<u16>, b: [i16; 2] },
    }

    proptest! {
        /// postcard itself is the oracle.
        #[test]
        fn everything_is_written_as_postcard_writes_it(
            scalars in any::<(u8, i8, u16, i16, u32, i32, u64, i64, f32, f64)>(),
            more in any::<(bool, char, Option<u32>, [u8; 3])>(),
            list in proptest::collection::vec(any::<i32>(), 0..200),
            text in "\\PC{0,20}",
        ) {
            let kinds = [
                Kind::Unit,
                Kind::New(scalars.6),
                Kind::Pair(scalars.7, scalars.9),
                Kind::Named { a: Some(scalars.2), b: [scalars.3; 2] },
                Kind::Named { a: None, b: [0; 2] },
            ];
            let message = (scalars, more, kinds, ((), 1u8), &list[..], &text[..]);
            let mut buffer = [0; 2000];
            let expected = postcard::to_slice(&message, &mut buffer).unwrap().to_vec();
            prop_assert_eq!(written(&message, expected.len()).unwrap(), &expected[..]);
            prop_assert_eq!(written(&message, expected.len() - 1), None);
        }
    }
}
