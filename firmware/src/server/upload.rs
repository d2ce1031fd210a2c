//! A table on its way in: bytes in order, counted, checked against what was announced.
use crate::store::ImageBuffer;
use giotto_shared::table::MAX_IMAGE_BYTES;
use giotto_shared::wire::{Refusal, crc32};

/// What was announced and what has come.
#[derive(Debug)]
pub(super) struct Upload {
    /// Length and CRC announced; `None`: no upload.
    announced: Option<(usize, u32)>,
    received: usize,
}

impl Upload {
    pub(super) const fn new() -> Self {
        Self {
            announced: None,
            received: 0,
        }
    }

    pub(super) const fn begin(&mut self, length: u16, crc: u32) -> Result<(), Refusal> {
        if length as usize > MAX_IMAGE_BYTES {
            return Err(Refusal::UploadTooLong {
                max: MAX_IMAGE_BYTES as u16,
            });
        }
        self.announced = Some((length as usize, crc));
        self.received = 0;
        Ok(())
    }

    /// Takes the bytes if they continue where the last ones ended.
    pub(super) fn chunk(
        &mut self,
        offset: u16,
        data: &[u8],
        buffer: &mut ImageBuffer,
    ) -> Result<(), Refusal> {
        let (length, _) = self.announced.ok_or(Refusal::NoUpload)?;
        if usize::from(offset) != self.received {
            return Err(Refusal::OutOfOrder {
                expected: self.received as u16,
            });
        }
        let end = self.received + data.len();
        let too_long = Refusal::UploadTooLong { max: length as u16 };
        if end > length {
            return Err(too_long);
        }
        let place = buffer.get_mut(self.received..end).ok_or(too_long)?;
        for (to, from) in place.iter_mut().zip(data) {
            *to = *from;
        }
        self.received = end;
        Ok(())
    }

    /// Ends the upload, whatever its state; the length if all bytes came and are the ones announced.
    pub(super) fn end(&mut self, buffer: &ImageBuffer) -> Result<usize, Refusal> {
        let (length, crc) = self.announced.take().ok_or(Refusal::NoUpload)?;
        let image = buffer.get(..length).filter(|_| self.received == length);
        let image = image.ok_or(Refusal::UploadIncomplete)?;
        if crc32(image) != crc {
            return Err(Refusal::UploadIncomplete);
        }
        Ok(length)
    }

    /// The buffer is needed for something else.
    pub(super) const fn abort(&mut self) {
        self.announced = None;
    }
}
