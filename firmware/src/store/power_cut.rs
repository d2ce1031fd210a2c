//! A flash whose power fails after so many bytes and erasures, and stays away until the next boot.
use super::ram::{RamFlash, RamFlashError};
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_write,
};

/// What the operation under way leaves behind when the power goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tear {
    /// The byte or erase unit as it was.
    Untouched,
    /// Some of its bits changed.
    Partly,
    /// Only the first half of the erase unit blank; a byte: as `Partly`, other bits.
    FirstHalf,
    /// Only the second half of the erase unit blank; a byte: complete, the next one partly.
    SecondHalf,
}

impl Tear {
    /// All ways to tear.
    pub const ALL: [Self; 4] = [
        Self::Untouched,
        Self::Partly,
        Self::FirstHalf,
        Self::SecondHalf,
    ];

    /// Bits that a torn byte has already programmed.
    const fn mask(self) -> u8 {
        match self {
            Self::Untouched => 0x00,
            Self::Partly => 0x5a,
            Self::FirstHalf => 0xf0,
            Self::SecondHalf => 0xff,
        }
    }
}

/// Flash on a supply that fails.
#[derive(Clone, Debug)]
pub struct PowerCut<const N: usize, const ERASE: usize> {
    flash: RamFlash<N, ERASE>,
    /// Bytes and erase units until the cut; `None`: never.
    left: Option<u32>,
    tear: Tear,
    /// Bytes and erase units so far.
    done: u32,
}

/// Why an operation failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PowerCutError {
    /// There is no power.
    Off,
    /// The flash itself refused.
    Flash(RamFlashError),
}

impl NorFlashError for PowerCutError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Off => NorFlashErrorKind::Other,
            Self::Flash(error) => error.kind(),
        }
    }
}

impl<const N: usize, const ERASE: usize> PowerCut<N, ERASE> {
    /// A flash with these cells whose power fails during the `after`th step (1: the first), torn so.
    pub const fn new(flash: RamFlash<N, ERASE>, after: Option<u32>, tear: Tear) -> Self {
        Self {
            flash,
            left: after,
            tear,
            done: 0,
        }
    }

    /// Bytes programmed and units erased so far.
    pub const fn steps(&self) -> u32 {
        self.done
    }

    /// Whether the power has failed.
    pub fn is_off(&self) -> bool {
        self.left == Some(0)
    }

    /// The cells, as the next boot finds them.
    pub fn into_cells(self) -> RamFlash<N, ERASE> {
        self.flash
    }

    /// Counts one step; `true`: this is the one during which the power fails.
    fn step(&mut self) -> Result<bool, PowerCutError> {
        match &mut self.left {
            Some(0) => Err(PowerCutError::Off),
            Some(left) => {
                *left -= 1;
                self.done += 1;
                Ok(*left == 0)
            }
            None => {
                self.done += 1;
                Ok(false)
            }
        }
    }

    fn cell(&mut self, at: u32) -> Option<&mut u8> {
        self.flash.bytes_mut().get_mut(at as usize)
    }

    fn tear_unit(&mut self, from: u32) {
        let half = ERASE as u32 / 2;
        let (blank, noise) = match self.tear {
            Tear::Untouched => return,
            Tear::Partly => (0..0, 0..ERASE as u32),
            Tear::FirstHalf => (0..half, 0..0),
            Tear::SecondHalf => (half..ERASE as u32, 0..0),
        };
        for at in blank {
            self.cell(from + at)
                .into_iter()
                .for_each(|cell| *cell = 0xff);
        }
        for at in noise {
            let mask = (at.wrapping_mul(0x9e37_79b9) >> 13) as u8;
            self.cell(from + at)
                .into_iter()
                .for_each(|cell| *cell |= mask);
        }
    }
}

impl<const N: usize, const ERASE: usize> ErrorType for PowerCut<N, ERASE> {
    type Error = PowerCutError;
}

impl<const N: usize, const ERASE: usize> ReadNorFlash for PowerCut<N, ERASE> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        if self.is_off() {
            return Err(PowerCutError::Off);
        }
        self.flash.read(offset, bytes).map_err(PowerCutError::Flash)
    }

    fn capacity(&self) -> usize {
        N
    }
}

impl<const N: usize, const ERASE: usize> NorFlash for PowerCut<N, ERASE> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        let range = |kind| PowerCutError::Flash(RamFlashError::Range(kind));
        check_erase(self, from, to).map_err(range)?;
        for unit in (from..to).step_by(ERASE) {
            if self.step()? {
                self.tear_unit(unit);
                return Err(PowerCutError::Off);
            }
            self.flash
                .erase(unit, unit + ERASE as u32)
                .map_err(PowerCutError::Flash)?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        let range = |kind| PowerCutError::Flash(RamFlashError::Range(kind));
        check_write(self, offset, bytes.len()).map_err(range)?;
        for (at, &byte) in (offset..).zip(bytes) {
            let fails = self.step()?;
            let programmed = if fails {
                byte | !self.tear.mask()
            } else {
                byte
            };
            if at % 4 == 0 && !self.flash.is_blank(at) {
                return Err(PowerCutError::Flash(RamFlashError::NotBlank { at }));
            }
            *self.cell(at).ok_or(range(NorFlashErrorKind::OutOfBounds))? = programmed;
            if fails {
                return Err(PowerCutError::Off);
            }
        }
        Ok(())
    }
}
