//! How much flash and RAM an image takes, from the program headers of its ELF file (32 bit, little endian).
use std::path::Path;

/// Bytes of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// In flash: code, constants and the initial values of variables.
    pub text: u32,
    /// In RAM before the stack: variables.
    pub variables: u32,
}

/// RAM of all boards lies here and above.
const RAM_BASE: u32 = 0x2000_0000;

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk().copied().map(u32::from_le_bytes)
}

fn half(bytes: &[u8], at: usize) -> Option<usize> {
    bytes.get(at..)?.first_chunk().copied().map(|two| usize::from(u16::from_le_bytes(two)))
}

/// Adds up the loadable segments; `None`: not such a file.
fn size_of(bytes: &[u8]) -> Option<Size> {
    if !bytes.starts_with(b"\x7fELF\x01\x01") {
        return None;
    }
    let (table, entry, count) = (word(bytes, 28)? as usize, half(bytes, 42)?, half(bytes, 44)?);
    let mut size = Size { text: 0, variables: 0 };
    for index in 0..count {
        let header = bytes.get(table + index * entry..)?;
        let (kind, virtual_address) = (word(header, 0)?, word(header, 8)?);
        let (in_file, in_memory) = (word(header, 16)?, word(header, 20)?);
        if kind != 1 {
            continue;
        }
        size.text += in_file;
        if virtual_address >= RAM_BASE {
            size.variables += in_memory;
        }
    }
    Some(size)
}

/// Reads an image's size.
///
/// # Errors
/// Those of the file; `InvalidData` if it is no such image.
pub fn size(path: &Path) -> std::io::Result<Size> {
    let bytes = std::fs::read(path)?;
    size_of(&bytes)
        .ok_or_else(|| std::io::Error::new(std::io::ErrorKind::InvalidData, "not a 32-bit ELF image"))
}
