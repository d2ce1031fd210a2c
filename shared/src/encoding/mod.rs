//! Values as bytes, for tables and messages alike: postcard's format in code that an image has room for, and the CRC-32 that
//! both carry.
mod crc;
mod reader;
mod writer;

pub use crc::{Crc32, crc32};
pub use reader::take;
pub(crate) use writer::Writer;
pub use writer::put;
