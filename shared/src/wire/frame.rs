//! Frames: `COBS(payload · CRC-32) · 00`. Bytes may be lost, changed or joined anywhere; whatever arrives,
//! [`Accumulator`] finds the next whole frame after the next zero.
use crate::encoding::{Writer, crc32};
use cobs::{DecodeResult, DecoderState};
use serde::Serialize;

/// Longest payload: the largest message is a batch of set-points.
pub const MAX_PAYLOAD: usize = 208;
/// Length of the CRC.
const CRC_BYTES: usize = 4;
/// Longest content of a frame before COBS.
const MAX_CONTENT: usize = MAX_PAYLOAD + CRC_BYTES;
/// Longest frame with its COBS overhead, one byte, and the closing zero.
pub const MAX_FRAME: usize = MAX_CONTENT + 2;
const _: () = assert!(
    MAX_FRAME == cobs::max_encoding_length(MAX_CONTENT) + 1,
    "longer ones take more overhead"
);

/// A message that does not fit into [`MAX_PAYLOAD`] or the buffer. Messages are bounded by their types, so
/// this is a defect of the build; the tests encode the largest of each kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("message does not fit into a frame")]
pub struct TooLong;

/// Writes the frame of `message` to the start of `out` and returns it.
///
/// # Errors
/// [`TooLong`] if the payload exceeds [`MAX_PAYLOAD`] or the frame `out`.
pub fn encode<'a, M: Serialize>(message: &M, out: &'a mut [u8]) -> Result<&'a mut [u8], TooLong> {
    let (_, place) = out.split_first_mut().ok_or(TooLong)?;
    let most = place.len().min(MAX_PAYLOAD);
    let mut payload = Writer::new(place.get_mut(..most).ok_or(TooLong)?);
    message.serialize(&mut payload).map_err(|_| TooLong)?;
    close(payload.length().ok_or(TooLong)?, out)
}

/// Makes a frame of a payload that begins at the second byte of `out`: CRC, COBS in its place, zero.
#[inline(never)]
fn close(length: usize, out: &mut [u8]) -> Result<&mut [u8], TooLong> {
    let crc = crc32(out.get(1..=length).ok_or(TooLong)?).to_le_bytes();
    let end = length + 1 + CRC_BYTES;
    *out.get_mut(length + 1..)
        .and_then(<[u8]>::first_chunk_mut)
        .ok_or(TooLong)? = crc;
    let frame = out.get_mut(..=end).ok_or(TooLong)?;
    // Each zero becomes the distance to the next one; the first byte stands for one before them all. None is further than
    // 254 away.
    let mut distance = 1;
    for (at, byte) in frame.iter_mut().enumerate().rev() {
        if at == end {
            *byte = 0;
            continue;
        }
        if at == 0 || *byte == 0 {
            *byte = distance;
            distance = 0;
        }
        distance += 1;
    }
    Ok(frame)
}

/// What was thrown away since the start; wrapping.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FrameCounts {
    /// Frames whose CRC did not hold.
    pub crc_errors: u32,
    /// Frames that were not COBS or too short for a CRC.
    pub malformed: u32,
    /// Frames longer than [`MAX_FRAME`].
    pub overlong: u32,
}

/// Collects bytes into frames.
///
/// ```
/// use giotto_shared::wire::{Accumulator, Command, MAX_FRAME, Request, encode, take};
///
/// let request = Request { session: 7, seq: 1, command: Command::Hello };
/// let mut buffer = [0; MAX_FRAME];
/// let frame = encode(&request, &mut buffer)?;
/// // Part of another frame comes first: it is counted, and the whole frame behind it is found.
/// let mut accumulator = Accumulator::new();
/// let mut found = None;
/// for byte in [0x55, 0x00].iter().chain(frame.iter()) {
///     if let Some(payload) = accumulator.push(*byte) {
///         found = take::<Request>(payload).map(|(request, _)| request);
///     }
/// }
/// assert_eq!(found, Some(request));
/// assert_eq!(accumulator.counts().malformed, 1);
/// # Ok::<(), giotto_shared::wire::frame::TooLong>(())
/// ```
#[derive(Clone, Debug)]
pub struct Accumulator {
    bytes: [u8; MAX_FRAME],
    length: usize,
    /// Inside a frame that is already too long: nothing is kept before the next zero.
    discarding: bool,
    counts: FrameCounts,
}

impl Default for Accumulator {
    fn default() -> Self {
        Self::new()
    }
}

impl Accumulator {
    /// Nothing collected yet.
    pub const fn new() -> Self {
        let counts = FrameCounts {
            crc_errors: 0,
            malformed: 0,
            overlong: 0,
        };
        Self {
            bytes: [0; MAX_FRAME],
            length: 0,
            discarding: false,
            counts,
        }
    }

    /// What was thrown away.
    pub const fn counts(&self) -> FrameCounts {
        self.counts
    }

    /// Takes one byte; returns the payload of a frame if the byte completed a good one. Zeros between
    /// frames are no error: a sender may open with one to cut off what came before.
    pub fn push(&mut self, byte: u8) -> Option<&[u8]> {
        if byte != 0 {
            match self.bytes.get_mut(self.length) {
                Some(place) if !self.discarding => {
                    *place = byte;
                    self.length += 1;
                }
                _ => self.discarding = true,
            }
            return None;
        }
        let length = core::mem::take(&mut self.length);
        if core::mem::take(&mut self.discarding) {
            self.counts.overlong = self.counts.overlong.wrapping_add(1);
            return None;
        }
        if length == 0 {
            return None;
        }
        let Some(end) = self.unframe(length) else {
            self.counts.malformed = self.counts.malformed.wrapping_add(1);
            return None;
        };
        let (payload, crc) = self.bytes.get(..end)?.split_last_chunk::<CRC_BYTES>()?;
        if crc32(payload) != u32::from_le_bytes(*crc) {
            self.counts.crc_errors = self.counts.crc_errors.wrapping_add(1);
            return None;
        }
        Some(payload)
    }

    /// Undoes COBS in place; the length of the content, if there is one with room for a CRC. Byte by byte, because
    /// the decoder of whole slices can panic as far as a compiler can see.
    fn unframe(&mut self, length: usize) -> Option<usize> {
        let mut decoder = DecoderState::Idle;
        let mut end = 0;
        for at in 0..length {
            if let DecodeResult::DataContinue(byte) = decoder.feed(*self.bytes.get(at)?).ok()? {
                *self.bytes.get_mut(end)? = byte;
                end += 1;
            }
        }
        let whole = matches!(decoder.feed(0), Ok(DecodeResult::DataComplete));
        (whole && end >= CRC_BYTES).then_some(end)
    }
}

#[cfg(test)]
mod tests;
