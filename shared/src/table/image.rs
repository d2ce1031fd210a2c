//! The bytes of a table, in a file, on the wire and in flash. All numbers little endian.
//!
//! ```text
//! offset  size  what
//!      0     4  magic 47 49 4F 54 ("GIOT")          ┐
//!      4     2  format version, 3                   │ fixed for all versions, so that a newer table
//!      6     2  flags: 1 = signed, 2 = bound       │ is told from a broken one
//!      8     4  length n of the whole image, bytes  │
//!     12     4  CRC-32 of bytes 0..12 and 16..n     ┘
//!     16     4  schema hash: CRC-32 of `schema.txt`
//!     20     b  body, postcard of `Table` (`schema.txt` names every field and discriminant)
//!   20+b    16  machine [u8; 12], serial u32, if the flag "bound" is set
//!   n-64    64  Ed25519 signature of bytes 4..8 and 16..n-64, if the flag "signed" is set
//! ```
//!
//! What binds a table to one machine and one serial stands behind the body and in front of the signature, which covers it. Tables
//! that were signed before tables were bound are read, and no controller with a key takes them.
//!
//! The CRC is ISO-HDLC (the one of Ethernet and zip). The order of checks is magic, length, CRC, version,
//! flags, schema, body, numbers: a flipped bit is called a flipped bit, not a newer version.
use super::validate::no_arm;
use super::{Arm, Limits, MAX_TERMS, MAX_ZONES, Table, TableError, Zone};
use crate::encoding::{Crc32, crc32, take};
use crate::term::Term;

/// First four bytes of a table.
pub const MAGIC: [u8; 4] = *b"GIOT";
/// Format written by this build; format 2, which knew no arms, is read as well. Format 1 knew X and Y of one plane only: whether its terms meant this
/// machine's X and Y its bytes do not say.
pub const FORMAT_VERSION: u16 = 3;
/// Format whose tables have no arm, and the hash of its schema.
const WITHOUT_ARM: (u16, u32) = (2, 0xd668_0447);
/// Flag bit 0: a signature follows the body.
pub const FLAG_SIGNED: u16 = 1;
/// Flag bit 1: machine and serial stand in front of the signature.
pub const FLAG_BOUND: u16 = 2;
/// Length of machine and serial.
pub const BINDING_BYTES: usize = 16;
/// Length of the header.
pub const HEADER_BYTES: usize = 20;
/// Length of a signature.
pub const SIGNATURE_BYTES: usize = 64;
/// Changes when the body's meaning does.
pub const SCHEMA_HASH: u32 = crc32(include_bytes!("schema.txt"));

/// Longest body: every string, vector and option full, every term the longest (tag, actuator, four numbers).
const MAX_BODY_BYTES: usize = {
    let term = 1 + 1 + 4 * 4;
    let zone = (1 + 24) + 8 + 8 + 1 + 8 + (1 + MAX_TERMS * term);
    let arm = (1 + (1 + (7 + 3 + 4) * 4 + 1)) + (1 + 12);
    (1 + 32) + (1 + MAX_ZONES * zone) + 8 + arm
};
/// Longest image.
pub const MAX_IMAGE_BYTES: usize = HEADER_BYTES + MAX_BODY_BYTES + BINDING_BYTES + SIGNATURE_BYTES;

/// Bytes behind the body by the flags; `None` for flags that do not exist. What is bound is signed.
const fn trailer(flags: u16) -> Option<usize> {
    const BOTH: u16 = FLAG_SIGNED | FLAG_BOUND;
    match flags {
        0 => Some(0),
        FLAG_SIGNED => Some(SIGNATURE_BYTES),
        BOTH => Some(BINDING_BYTES + SIGNATURE_BYTES),
        _ => None,
    }
}

/// Who a machine's controller is: no two have the same.
pub type MachineId = [u8; 12];

/// The one machine that a signed table is for, and where it stands among those that its owner has signed for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Binding {
    /// The machine.
    pub machine: MachineId,
    /// Rises from table to table.
    pub serial: u32,
}

/// The header of an image whose length and CRC hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Format version.
    pub version: u16,
    /// Flags.
    pub flags: u16,
    /// Length of the image in bytes.
    pub length: usize,
    /// CRC-32 of the image.
    pub crc: u32,
}

fn word<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..)?.first_chunk().copied()
}

/// CRC-32 of an image without its own CRC field.
fn crc_of(image: &[u8]) -> u32 {
    let head = Crc32::new().with(image.get(..12).unwrap_or(&[]));
    head.with(image.get(16..).unwrap_or(&[])).value()
}

impl Header {
    /// Reads the fixed part and checks that the announced length is possible.
    ///
    /// # Errors
    /// [`TableError::NotATable`], [`TableError::Truncated`], [`TableError::TooLong`].
    pub fn read(bytes: &[u8]) -> Result<Self, TableError> {
        let need = HEADER_BYTES as u32;
        if !bytes.starts_with(&MAGIC) {
            return Err(TableError::NotATable);
        }
        let fields = (
            word(bytes, 4),
            word(bytes, 6),
            word(bytes, 8),
            word(bytes, 12),
        );
        let (Some(version), Some(flags), Some(length), Some(crc)) = fields else {
            return Err(TableError::Truncated {
                have: bytes.len() as u32,
                need,
            });
        };
        let length = u32::from_le_bytes(length);
        let max = MAX_IMAGE_BYTES as u32;
        if length > max {
            return Err(TableError::TooLong { length, max });
        }
        if length < need {
            return Err(TableError::Truncated { have: length, need });
        }
        Ok(Self {
            version: u16::from_le_bytes(version),
            flags: u16::from_le_bytes(flags),
            length: length as usize,
            crc: u32::from_le_bytes(crc),
        })
    }

    /// Reads the header of the image at the start of `bytes` and checks its CRC; what follows the image is
    /// not looked at.
    ///
    /// # Errors
    /// Those of [`Header::read`], [`TableError::BadCrc`].
    pub fn check(bytes: &[u8]) -> Result<Self, TableError> {
        let header = Self::read(bytes)?;
        let have = bytes.len() as u32;
        let image = bytes.get(..header.length).ok_or(TableError::Truncated {
            have,
            need: header.length as u32,
        })?;
        let computed = crc_of(image);
        if computed != header.crc {
            return Err(TableError::BadCrc {
                stored: header.crc,
                computed,
            });
        }
        Ok(header)
    }
}

/// Reads and validates the table whose image is all of `bytes`. Whether a signature is *right* is the
/// business of whoever holds the key ([`signed_parts`]).
///
/// # Errors
/// The first failed check, in the order of the module's text.
pub fn decode(bytes: &[u8]) -> Result<Table, TableError> {
    let mut table = Table::empty();
    decode_into(bytes, &mut table).map(|()| table)
}

/// As [`decode`], into a table that is already there. On an error `table` is not to be used.
///
/// # Errors
/// As [`decode`].
pub fn decode_into(bytes: &[u8], table: &mut Table) -> Result<(), TableError> {
    table.zones.clear();
    let head = read(bytes, &mut |zone| {
        table.zones.push(zone).map_err(|_| TableError::Malformed)
    })?;
    (table.machine, table.limits, table.arm) = head;
    Ok(())
}

/// As [`decode`], without keeping anything: a controller has no room for two tables.
///
/// # Errors
/// As [`decode`].
pub fn check(bytes: &[u8]) -> Result<(), TableError> {
    let mut zones = 0;
    read(bytes, &mut |_| {
        zones += 1;
        if zones > MAX_ZONES {
            Err(TableError::Malformed)
        } else {
            Ok(())
        }
    })
    .map(drop)
}

/// Whether this build reads tables of a format.
pub const fn reads(version: u16) -> bool {
    version == FORMAT_VERSION || version == WITHOUT_ARM.0
}

/// The body of an image whose header holds, and whether it may have an arm.
fn body(bytes: &[u8]) -> Result<(&[u8], bool), TableError> {
    let header = Header::check(bytes)?;
    if bytes.len() > header.length {
        return Err(TableError::TooLong {
            length: bytes.len() as u32,
            max: header.length as u32,
        });
    }
    match header.version {
        version if reads(version) => {}
        0 => return Err(TableError::UnknownVersion { version: 0 }),
        version if version < FORMAT_VERSION => {
            return Err(TableError::OlderVersion {
                version,
                supported: FORMAT_VERSION,
            });
        }
        version => {
            return Err(TableError::NewerVersion {
                version,
                supported: FORMAT_VERSION,
            });
        }
    }
    let trailer = trailer(header.flags).ok_or(TableError::UnknownFlags {
        flags: header.flags,
    })?;
    let found = word(bytes, 16).map_or(0, u32::from_le_bytes);
    let with_arm = header.version == FORMAT_VERSION;
    let expected = if with_arm { SCHEMA_HASH } else { WITHOUT_ARM.1 };
    if found != expected {
        return Err(TableError::SchemaMismatch { found, expected });
    }
    let end = header.length.checked_sub(trailer);
    end.and_then(|end| bytes.get(HEADER_BYTES..end))
        .map(|body| (body, with_arm))
        .ok_or(TableError::Malformed)
}

/// What a table has beside its zones.
type Head = (heapless::String<32>, Limits, Option<Arm>);

/// Reads an image zone by zone. Postcard writes a struct as its fields in order and a vector as its length (LEB128)
/// and its elements; the tests compare with the whole.
fn read(
    bytes: &[u8],
    keep: &mut dyn FnMut(Zone) -> Result<(), TableError>,
) -> Result<Head, TableError> {
    let (body, with_arm) = body(bytes)?;
    let (machine, rest) = take(body).ok_or(TableError::Malformed)?;
    let (count, mut rest) = take::<u32>(rest).ok_or(TableError::Malformed)?;
    if count == 0 {
        return Err(TableError::NoZones);
    }
    let mut of_arm = None;
    for index in 0..count {
        let (zone, after) = take::<Zone>(rest).ok_or(TableError::Malformed)?;
        zone.validate(index as usize)?;
        if of_arm.is_none() && zone.terms.iter().any(Term::is_of_arm) {
            of_arm = Some(index as u8);
        }
        keep(zone)?;
        rest = after;
    }
    let (limits, mut rest) = take::<Limits>(rest).ok_or(TableError::Malformed)?;
    let mut arm = None;
    if with_arm {
        (arm, rest) = take::<Option<Arm>>(rest).ok_or(TableError::Malformed)?;
    }
    if !rest.is_empty() {
        return Err(TableError::Malformed);
    }
    limits.validate()?;
    match &arm {
        Some(arm) => arm.validate()?,
        // The first zone with one is named.
        None => no_arm(of_arm)?,
    }
    Ok((machine, limits, arm))
}

/// Writes the unsigned image of `table` to the start of `out` and returns its length.
///
/// # Errors
/// Those of [`Table::validate`]; [`TableError::TooLong`] if `out` is shorter than the image.
///
/// ```
/// use giotto_shared::Actuator;
/// use giotto_shared::model::{Cumulants, Element};
/// use giotto_shared::table::{decode, encode, Limits, Table, TableError, Terms, Travel, Zone, MAX_IMAGE_BYTES};
/// use giotto_shared::term::Term;
///
/// let mut table = Table::empty();
/// table.limits = Limits { offset_m: 1e-3, slew_m_s: 0.01 };
/// let backlash = Term::Backlash { actuator: Actuator::Y, step_m: 8e-6 };
/// table.zones.push(Zone {
///     place_m: None,
///     radius_m: [0.05, 0.3],
///     feed_m_s: [0.02, 0.7],
///     travel: Travel::Both,
///     cumulants: Element::Lag { kv_per_s: 50.0_f32 }.cumulants(),
///     terms: [backlash].into_iter().collect(),
/// }).unwrap();
///
/// let mut image = [0; MAX_IMAGE_BYTES];
/// let length = encode(&table, &mut image)?;
/// assert_eq!(decode(&image[..length])?, table);
/// // One flipped bit is noticed before anything is believed.
/// image[length - 1] ^= 1;
/// assert!(matches!(decode(&image[..length]), Err(TableError::BadCrc { .. })));
/// # Ok::<(), TableError>(())
/// ```
pub fn encode(table: &Table, out: &mut [u8]) -> Result<usize, TableError> {
    table.validate()?;
    let max = out.len() as u32;
    let too_long = TableError::TooLong {
        length: MAX_IMAGE_BYTES as u32,
        max,
    };
    let body = out.get_mut(HEADER_BYTES..).ok_or(too_long)?;
    let body = postcard::to_slice(table, body).map_err(|_| too_long)?.len();
    let length = HEADER_BYTES + body;
    let image = out.get_mut(..length).ok_or(too_long)?;
    write_header(image, 0);
    Ok(length)
}

/// Fills the header of an image whose body (and signature) is in place.
fn write_header(image: &mut [u8], flags: u16) {
    let length = image.len() as u32;
    if let Some(header) = image.first_chunk_mut::<HEADER_BYTES>() {
        header[..4].copy_from_slice(&MAGIC);
        header[4..6].copy_from_slice(&FORMAT_VERSION.to_le_bytes());
        header[6..8].copy_from_slice(&flags.to_le_bytes());
        header[8..12].copy_from_slice(&length.to_le_bytes());
        header[16..20].copy_from_slice(&SCHEMA_HASH.to_le_bytes());
    }
    let crc = crc_of(image);
    if let Some(field) = image.get_mut(12..16) {
        field.copy_from_slice(&crc.to_le_bytes());
    }
}

/// What an Ed25519 signature covers: version and flags, then schema hash and body; with the signature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Signed<'a> {
    /// Bytes 4..8.
    pub head: &'a [u8],
    /// Bytes 16 to the end of the body.
    pub body: &'a [u8],
    /// The signature.
    pub signature: &'a [u8; SIGNATURE_BYTES],
}

/// The parts of a signed image, `None` if it is unsigned or too short.
pub fn signed_parts(image: &[u8]) -> Option<Signed<'_>> {
    let header = Header::read(image).ok()?;
    if header.flags & FLAG_SIGNED == 0 {
        return None;
    }
    let image = image.get(..header.length)?;
    let (rest, signature) = image.split_last_chunk::<SIGNATURE_BYTES>()?;
    Some(Signed {
        head: rest.get(4..8)?,
        body: rest.get(16..)?,
        signature,
    })
}

/// Machine and serial of a signed image, `None` if it has none.
pub fn binding(image: &[u8]) -> Option<Binding> {
    let header = Header::read(image).ok()?;
    if header.flags & FLAG_BOUND == 0 {
        return None;
    }
    let end = header.length.checked_sub(SIGNATURE_BYTES)?;
    let bytes = image.get(end.checked_sub(BINDING_BYTES)?..end)?;
    let (machine, serial) = bytes.split_first_chunk()?;
    Some(Binding {
        machine: *machine,
        serial: u32::from_le_bytes(*serial.first_chunk()?),
    })
}

/// The image without binding and signature: its header says neither, its CRC is not set.
fn bare(image: &[u8]) -> Result<usize, TableError> {
    let header = Header::read(image)?;
    let flags = header.flags;
    let trailer = trailer(flags).ok_or(TableError::UnknownFlags { flags })?;
    header
        .length
        .checked_sub(trailer)
        .ok_or(TableError::Malformed)
}

/// Binds and signs the image at the start of `out`, in place of a signature it may have: `sign` is given head and body as in
/// [`Signed`] and returns the signature. The new length is returned.
///
/// # Errors
/// [`TableError::TooLong`] if `out` has no room for binding and signature; those of [`Header::read`];
/// [`TableError::UnknownFlags`].
pub fn attach_signature(
    out: &mut [u8],
    binding: &Binding,
    sign: impl FnOnce(&[u8], &[u8]) -> [u8; SIGNATURE_BYTES],
) -> Result<usize, TableError> {
    let (length, max) = (bare(out)?, out.len() as u32);
    let signed = length + BINDING_BYTES + SIGNATURE_BYTES;
    let image = out.get_mut(..signed).ok_or(TableError::TooLong {
        length: signed as u32,
        max,
    })?;
    write_header(image, FLAG_SIGNED | FLAG_BOUND);
    let (rest, signature) = image.split_at_mut(length + BINDING_BYTES);
    if let Some(place) = rest.get_mut(length..) {
        place[..12].copy_from_slice(&binding.machine);
        place[12..].copy_from_slice(&binding.serial.to_le_bytes());
    }
    *signature.first_chunk_mut().ok_or(TableError::Malformed)? =
        sign(rest.get(4..8).unwrap_or(&[]), rest.get(16..).unwrap_or(&[]));
    write_header(image, FLAG_SIGNED | FLAG_BOUND);
    Ok(signed)
}

#[cfg(test)]
mod tests;
