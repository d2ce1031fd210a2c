//! What an image holds: sizes, functions and who calls whom, read from its ELF file (32 bit, little endian).
use object::{Object, ObjectSegment, ObjectSymbol, SymbolKind};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{Error, ErrorKind, Result};
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
const RAM_BASE: u64 = 0x2000_0000;

/// A function of an image.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Function {
    end: u32,
    /// All its names: the linker may have folded equal functions into one.
    names: Vec<String>,
}

/// An image, read.
#[derive(Clone, Debug)]
pub struct Image {
    /// Its size.
    pub size: Size,
    functions: BTreeMap<u32, Function>,
    /// Addresses where code (`true`) or data begins.
    marks: BTreeMap<u32, bool>,
    segments: Vec<(u32, Vec<u8>)>,
}

/// What a function can reach.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Reach {
    /// Names of all functions reached by direct calls and jumps, the start among them.
    pub functions: BTreeSet<String>,
    /// Functions among them that call through a pointer: where that leads is not known.
    pub indirect: BTreeSet<String>,
}

impl Image {
    /// Reads an image.
    ///
    /// # Errors
    /// Those of the file; `InvalidData` if it is no ELF image.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path)?;
        let invalid = |error| {
            Error::new(
                ErrorKind::InvalidData,
                format!("not a 32-bit ELF image: {error}"),
            )
        };
        let file = object::File::parse(&*bytes).map_err(invalid)?;
        let mut image = Self {
            size: Size {
                text: 0,
                variables: 0,
            },
            functions: BTreeMap::new(),
            marks: BTreeMap::new(),
            segments: Vec::new(),
        };
        for segment in file.segments() {
            let data = segment.data().map_err(invalid)?;
            image.size.text += data.len() as u32;
            if segment.address() >= RAM_BASE {
                image.size.variables += segment.size() as u32;
            }
            image
                .segments
                .push((segment.address() as u32, data.to_vec()));
        }
        for symbol in file.symbols() {
            let (Ok(name), address) = (symbol.name(), symbol.address() as u32 & !1) else {
                continue;
            };
            match name.as_bytes() {
                [b'$', b't', ..] => drop(image.marks.insert(address, true)),
                [b'$', b'd', ..] => drop(image.marks.insert(address, false)),
                _ if symbol.kind() == SymbolKind::Text && symbol.size() > 0 => {
                    let end = address + symbol.size() as u32;
                    let function = Function {
                        end,
                        names: Vec::new(),
                    };
                    let function = image.functions.entry(address).or_insert(function);
                    function
                        .names
                        .push(format!("{:#}", rustc_demangle::demangle(name)));
                }
                _ => {}
            }
        }
        Ok(image)
    }

    /// Names of the functions for which `wanted` holds.
    pub fn functions(&self, wanted: impl Fn(&str) -> bool) -> Vec<&str> {
        let names = self.functions.values().flat_map(|function| &function.names);
        names
            .map(String::as_str)
            .filter(|name| wanted(name))
            .collect()
    }

    /// Everything that the function of this name can reach; `None`: there is no such function.
    pub fn reach(&self, name: &str) -> Option<Reach> {
        let is_start = |function: &Function| function.names.iter().any(|one| one == name);
        let start = *self
            .functions
            .iter()
            .find(|(_, function)| is_start(function))?
            .0;
        let mut reach = Reach::default();
        let mut seen = BTreeSet::from([start]);
        let mut open = vec![start];
        while let Some(address) = open.pop() {
            let Some(function) = self.functions.get(&address) else {
                continue;
            };
            reach.functions.extend(function.names.iter().cloned());
            let (targets, indirect) = self.jumps(address, function.end);
            if indirect {
                reach.indirect.extend(function.names.iter().cloned());
            }
            for target in targets {
                // A jump into the middle of a function is a jump into that function.
                let Some((&entry, _)) = self.functions.range(..=target).next_back() else {
                    continue;
                };
                if seen.insert(entry) {
                    open.push(entry);
                }
            }
        }
        Some(reach)
    }

    fn half(&self, address: u32) -> Option<u32> {
        let (base, bytes) = self.segments.iter().rev().find(|(base, bytes)| {
            address
                .checked_sub(*base)
                .is_some_and(|offset| (offset as usize) < bytes.len())
        })?;
        let pair = bytes.get((address - base) as usize..)?.first_chunk()?;
        Some(u32::from(u16::from_le_bytes(*pair)))
    }

    /// Whether instructions, not constants, are at this address.
    fn is_code(&self, address: u32) -> bool {
        self.marks
            .range(..=address)
            .next_back()
            .is_none_or(|(_, code)| *code)
    }

    /// Targets of the calls and jumps that leave `start..end`, and whether a call goes through a pointer.
    fn jumps(&self, start: u32, end: u32) -> (Vec<u32>, bool) {
        let (mut targets, mut indirect, mut at) = (Vec::new(), false, start);
        while at < end {
            let Some(first) = self.half(at) else { break };
            let wide = first >= 0xe800;
            if self.is_code(at) {
                let second = if wide {
                    self.half(at + 2).unwrap_or(0)
                } else {
                    0
                };
                match jump(at, first, second) {
                    Some(Jump::To(target)) if !(start..end).contains(&target) => {
                        targets.push(target)
                    }
                    Some(Jump::Through) => indirect = true,
                    _ => {}
                }
            }
            at += if wide && self.is_code(at) { 4 } else { 2 };
        }
        (targets, indirect)
    }
}

/// A branch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Jump {
    To(u32),
    /// BLX, or BX to something else than the return address.
    Through,
}

/// Sign extends the lowest `bits` bits.
const fn signed(value: u32, bits: u32) -> u32 {
    ((value << (32 - bits)) as i32 >> (32 - bits)) as u32
}

/// The branch encoded by one or two halfwords (ARM DDI0403 A7.7.12, A7.7.18).
fn jump(at: u32, first: u32, second: u32) -> Option<Jump> {
    let to = |offset: u32| Some(Jump::To(at.wrapping_add(4).wrapping_add(offset)));
    let (s, j1, j2) = (first >> 10 & 1, second >> 13 & 1, second >> 11 & 1);
    match first {
        0xd000..=0xddff => to(signed(first & 0xff, 8) << 1),
        0xe000..=0xe7ff => to(signed(first & 0x7ff, 11) << 1),
        // BX LR is a return.
        0x4700..=0x47ff if first != 0x4770 => Some(Jump::Through),
        // BL and B, 24 bits.
        0xf000..=0xf7ff if matches!(second & 0xd000, 0xd000 | 0x9000) => {
            let (i1, i2) = (1 ^ j1 ^ s, 1 ^ j2 ^ s);
            let offset = s << 23 | i1 << 22 | i2 << 21 | (first & 0x3ff) << 11 | second & 0x7ff;
            to(signed(offset, 24) << 1)
        }
        // B on a condition, 20 bits.
        0xf000..=0xf7ff if second & 0xd000 == 0x8000 && first >> 7 & 7 != 7 => {
            let offset = s << 19 | j2 << 18 | j1 << 17 | (first & 0x3f) << 11 | second & 0x7ff;
            to(signed(offset, 20) << 1)
        }
        _ => None,
    }
}

/// Reads an image's size.
///
/// # Errors
/// As [`Image::read`].
pub fn size(path: &Path) -> Result<Size> {
    Image::read(path).map(|image| image.size)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Encodings from an assembler.
    #[test]
    fn branches() {
        let to = |target| Some(Jump::To(target));
        assert_eq!(jump(0x1000, 0xe7fe, 0), to(0x1000)); // b .
        assert_eq!(jump(0x1000, 0xd1fc, 0), to(0x0ffc)); // bne .-4
        assert_eq!(jump(0x1000, 0xf7ff, 0xfffe), to(0x1000)); // bl .
        assert_eq!(jump(0x1000, 0xf000, 0xf87e), to(0x1100)); // bl .+0x100
        assert_eq!(jump(0x1000, 0xf7ff, 0xbffe), to(0x1000)); // b.w .
        assert_eq!(jump(0x1000, 0xf43f, 0xaffe), to(0x1000)); // beq.w .
        assert_eq!(jump(0x1000, 0x4770, 0), None); // bx lr
        assert_eq!(jump(0x1000, 0x4798, 0), Some(Jump::Through)); // blx r3
        assert_eq!(jump(0x1000, 0xf3bf, 0x8f5f), None); // dmb
    }
}
