//! A table onto a controller, and the proof that it is there.
use super::client::Controller;
use super::error::ControllerError;
use giotto_shared::table::{self, Header};
use giotto_shared::wire::{
    CHUNK, Chunk, Command, FlashFault, Refusal, Reply, SlotState, Status, TableInfo, crc32,
};

/// How often an upload begins anew before it is given up.
const UPLOADS: u32 = 3;

/// How far a flash has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Bytes sent of bytes in all.
    Sent(usize, usize),
    /// Programmed into the slot.
    Programmed,
    /// Read back and equal.
    ReadBack,
    /// In use, on probation.
    Committed,
    /// It is the one that boots.
    Confirmed,
}

/// A table that is on the controller for good.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flashed {
    /// Its slot.
    pub slot: u8,
    /// Its generation.
    pub generation: u32,
    /// CRC-32 of its image.
    pub crc: u32,
    /// Bytes of its image.
    pub bytes: usize,
}

/// Whether the controller corrects with a given table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Byte for byte.
    Same {
        /// Its slot.
        slot: u8,
    },
    /// The table in use is another one.
    Differs {
        /// Slot of the table in use.
        slot: u8,
        /// First byte that differs.
        offset: usize,
    },
    /// No table is in use.
    None,
}

/// What is known of the slot whose table is in use.
pub fn active_table(status: &Status) -> Option<(u8, TableInfo)> {
    let slot = status.active?;
    match status.slots.get(usize::from(slot)) {
        Some(SlotState::Table(info)) => Some((slot, *info)),
        _ => None,
    }
}

impl Controller {
    /// Writes the image to the slot not in use, reads it back, commits and confirms. Until the last step a
    /// reset brings the old table back.
    ///
    /// # Errors
    /// [`ControllerError::Table`] if the image is no table (nothing is sent then), [`ControllerError::Refused`],
    /// [`ControllerError::ReadBack`], those of the link. The old table is then in use, or returns at the next boot.
    ///
    /// ```
    /// use giotto::model_file::ModelFile;
    /// # use std::path::Path;
    /// use giotto::table_from_model::table_from_model;
    /// use giotto_link::flash::Verdict;
    /// use giotto_link::{OpenOptions, Port, open};
    /// use giotto_shared::table::{MAX_IMAGE_BYTES, encode};
    ///
    /// let model = ModelFile::parse(
    ///     "format = 2\ncampaign = \"lab\"\nmachine = \"mill\"\n\
    ///      [servo]\nkind = \"lag\"\nkv_per_s = 50.0\n\
    ///      [valid]\nradius_mm = [50.0, 150.0]\nfeed_mm_s = [20.0, 300.0]",
    ///     Path::new("model.toml"),
    /// )?;
    /// let mut image = [0; MAX_IMAGE_BYTES];
    /// let length = encode(&table_from_model(&model)?.table, &mut image)?;
    /// let image = &image[..length];
    ///
    /// let mut controller = open(&Port::Sim, &OpenOptions::default(), &mut |_| {})?;
    /// assert_eq!(controller.verify(image)?, Verdict::None);
    /// let flashed = controller.flash(image, &mut |_| {})?;
    /// assert_eq!(flashed.bytes, length);
    /// // The table is there, byte for byte, and what is no table is not sent.
    /// assert!(matches!(controller.verify(image)?, Verdict::Same { .. }));
    /// assert!(controller.flash(b"no table", &mut |_| {}).is_err());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn flash(
        &mut self,
        image: &[u8],
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Flashed, ControllerError> {
        table::decode(image)?;
        let slot = self.write(image, progress)?;
        self.read_back(slot, image)?;
        progress(Progress::ReadBack);
        self.command(Command::Commit)?;
        progress(Progress::Committed);
        self.command(Command::Confirm)?;
        progress(Progress::Confirmed);
        let crc = Header::read(image)?.crc;
        match active_table(&self.status()?) {
            Some((
                active,
                TableInfo {
                    generation: Some(generation),
                    crc: theirs,
                    ..
                },
            )) if active == slot && theirs == crc => Ok(Flashed {
                slot,
                generation,
                crc,
                bytes: image.len(),
            }),
            _ => Err(ControllerError::ReadBack { slot, offset: 0 }),
        }
    }

    /// Uploads and programs, without committing; returns the slot.
    ///
    /// # Errors
    /// [`ControllerError::Refused`], those of the link.
    pub fn write(
        &mut self,
        image: &[u8],
        progress: &mut dyn FnMut(Progress),
    ) -> Result<u8, ControllerError> {
        let mut attempt = 1;
        loop {
            match self.try_write(image, progress) {
                // Something got between the chunks of this upload: begin again.
                Err(ControllerError::Refused(
                    Refusal::NoUpload | Refusal::OutOfOrder { .. } | Refusal::UploadIncomplete,
                )) if attempt < UPLOADS => attempt += 1,
                result => return result,
            }
        }
    }

    fn try_write(
        &mut self,
        image: &[u8],
        progress: &mut dyn FnMut(Progress),
    ) -> Result<u8, ControllerError> {
        let max = self.identity().max_image_bytes;
        let length = u16::try_from(image.len())
            .ok()
            .filter(|length| *length <= max);
        let length = length.ok_or(ControllerError::Refused(Refusal::UploadTooLong { max }))?;
        self.command(Command::WriteBegin {
            length,
            crc: crc32(image),
        })?;
        self.send_pieces(image, progress)?;
        progress(Progress::Sent(image.len(), image.len()));
        match self.ask(Command::WriteEnd)? {
            Reply::Written { slot } => {
                progress(Progress::Programmed);
                Ok(slot)
            }
            _ => Err(ControllerError::WrongReply),
        }
    }

    /// The bytes of an upload that has begun. The controller takes pieces in order: what it expects next says which it
    /// has, even where the answers to those were lost.
    fn send_pieces(
        &mut self,
        image: &[u8],
        progress: &mut dyn FnMut(Progress),
    ) -> Result<(), ControllerError> {
        progress(Progress::Sent(0, image.len()));
        let pieces: Vec<&[u8]> = image.chunks(CHUNK).collect();
        let request = |index: usize| {
            let data = pieces
                .get(index)
                .and_then(|piece| Chunk::from_slice(piece).ok());
            let offset = u16::try_from(index * CHUNK).ok();
            let (offset, data) = offset.zip(data).ok_or(ControllerError::WrongReply)?;
            Ok(Command::WriteChunk { offset, data })
        };
        let mut most = 0;
        self.series(pieces.len(), &request, &mut |index, answer| {
            let done = match answer {
                Ok(Reply::Done) => index + 1,
                Ok(_) => return Err(ControllerError::WrongReply),
                Err(Refusal::OutOfOrder { expected }) => {
                    whole_pieces(usize::from(expected), image.len())
                        .ok_or(ControllerError::Refused(Refusal::OutOfOrder { expected }))?
                }
                Err(refusal) => return Err(ControllerError::Refused(refusal)),
            };
            if done > most {
                most = done;
                progress(Progress::Sent(image.len().min(done * CHUNK), image.len()));
            }
            Ok(done)
        })
    }

    /// The first `length` bytes of a slot.
    ///
    /// # Errors
    /// [`ControllerError::Refused`] and those of the link.
    pub fn read_slot(&mut self, slot: u8, length: usize) -> Result<Vec<u8>, ControllerError> {
        let mut bytes = Vec::with_capacity(length);
        let piece = |index: usize| (length - length.min(index * CHUNK)).min(CHUNK);
        let request = |index: usize| {
            let offset = u16::try_from(index * CHUNK).map_err(|_| ControllerError::WrongReply)?;
            Ok(Command::ReadBack {
                slot,
                offset,
                length: piece(index) as u8,
            })
        };
        self.series(length.div_ceil(CHUNK), &request, &mut |index, answer| {
            let Reply::Data { offset, data } = answer.map_err(ControllerError::Refused)? else {
                return Err(ControllerError::WrongReply);
            };
            if usize::from(offset) != index * CHUNK || data.len() != piece(index) {
                return Err(ControllerError::WrongReply);
            }
            // One that is ahead, or was asked for twice, waits for its turn or has had it.
            if usize::from(offset) == bytes.len() {
                bytes.extend(data);
            }
            Ok(bytes.len().div_ceil(CHUNK))
        })?;
        Ok(bytes)
    }

    fn read_back(&mut self, slot: u8, image: &[u8]) -> Result<(), ControllerError> {
        let back = self.read_slot(slot, image.len())?;
        match first_difference(&back, image) {
            None => Ok(()),
            Some(offset) => Err(ControllerError::ReadBack { slot, offset }),
        }
    }

    /// Compares the table in use with an image, byte for byte as it is in flash.
    ///
    /// # Errors
    /// Those of the link.
    pub fn verify(&mut self, image: &[u8]) -> Result<Verdict, ControllerError> {
        let Some((slot, info)) = active_table(&self.status()?) else {
            return Ok(Verdict::None);
        };
        let stored = self.read_slot(slot, usize::from(info.length))?;
        Ok(match first_difference(&stored, image) {
            None => Verdict::Same { slot },
            Some(offset) => Verdict::Differs { slot, offset },
        })
    }
}

/// How many pieces of an image end at `offset`; `None` if none does.
fn whole_pieces(offset: usize, length: usize) -> Option<usize> {
    (offset == length || offset < length && offset.is_multiple_of(CHUNK))
        .then(|| offset.div_ceil(CHUNK))
}

fn first_difference(a: &[u8], b: &[u8]) -> Option<usize> {
    let differs = a.iter().zip(b).position(|(a, b)| a != b);
    differs.or_else(|| (a.len() != b.len()).then(|| a.len().min(b.len())))
}

/// Whether a refusal means that the flash itself is at fault.
pub fn is_flash_fault(error: &ControllerError) -> Option<FlashFault> {
    match error {
        ControllerError::Refused(Refusal::Flash(fault)) => Some(*fault),
        _ => None,
    }
}
