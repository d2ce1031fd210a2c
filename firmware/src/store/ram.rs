//! NOR flash in memory: the virtual controller's, and the one that tests break.
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read,
    check_write,
};

/// Bytes programmed at once.
const WORD: usize = 4;

/// `N` bytes in erase units of `ERASE`, programmed in words of four bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RamFlash<const N: usize, const ERASE: usize> {
    bytes: [u8; N],
}

/// What the flash refuses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RamFlashError {
    /// Place or alignment.
    Range(NorFlashErrorKind),
    /// A word that is not blank was to be programmed.
    NotBlank {
        /// Its address.
        at: u32,
    },
}

impl NorFlashError for RamFlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Range(kind) => *kind,
            Self::NotBlank { .. } => NorFlashErrorKind::Other,
        }
    }
}

impl<const N: usize, const ERASE: usize> Default for RamFlash<N, ERASE> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize, const ERASE: usize> RamFlash<N, ERASE> {
    /// All erased.
    pub const fn new() -> Self {
        Self { bytes: [0xff; N] }
    }

    /// Whether the word at `at` is blank.
    pub fn is_blank(&self, at: u32) -> bool {
        self.bytes
            .iter()
            .skip(at as usize)
            .take(WORD)
            .all(|&cell| cell == 0xff)
    }

    fn cells(&mut self, offset: u32, count: usize) -> Result<&mut [u8], RamFlashError> {
        let offset = offset as usize;
        let cells = self
            .bytes
            .get_mut(offset..)
            .and_then(|cells| cells.get_mut(..count));
        cells.ok_or(RamFlashError::Range(NorFlashErrorKind::OutOfBounds))
    }

    /// The cells, to look at or to damage.
    pub const fn bytes_mut(&mut self) -> &mut [u8; N] {
        &mut self.bytes
    }
}

impl<const N: usize, const ERASE: usize> ErrorType for RamFlash<N, ERASE> {
    type Error = RamFlashError;
}

impl<const N: usize, const ERASE: usize> ReadNorFlash for RamFlash<N, ERASE> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        check_read(self, offset, bytes.len()).map_err(RamFlashError::Range)?;
        bytes.copy_from_slice(self.cells(offset, bytes.len())?);
        Ok(())
    }

    fn capacity(&self) -> usize {
        N
    }
}

impl<const N: usize, const ERASE: usize> NorFlash for RamFlash<N, ERASE> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        check_erase(self, from, to).map_err(RamFlashError::Range)?;
        self.cells(from, (to - from) as usize)?.fill(0xff);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        check_write(self, offset, bytes.len()).map_err(RamFlashError::Range)?;
        let cells = self.cells(offset, bytes.len())?;
        if let Some(word) = cells
            .chunks(WORD)
            .position(|word| word.iter().any(|&cell| cell != 0xff))
        {
            return Err(RamFlashError::NotBlank {
                at: offset + (word * WORD) as u32,
            });
        }
        cells.copy_from_slice(bytes);
        Ok(())
    }
}
