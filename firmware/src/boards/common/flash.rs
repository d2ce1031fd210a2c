//! What the flash drivers of the boards share: their error.
use embedded_storage::nor_flash::{NorFlashError, NorFlashErrorKind};

/// Why a flash operation failed.
#[allow(dead_code, reason = "the STM32's is the library's")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashError {
    /// Place or alignment.
    Range(NorFlashErrorKind),
    /// The flash controller reports an error or does not answer.
    #[allow(dead_code, reason = "not every board has a controller that can")]
    Controller,
    /// What was erased or programmed does not read back so.
    #[allow(dead_code, reason = "not every board looks")]
    ReadBack,
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Range(kind) => *kind,
            Self::Controller | Self::ReadBack => NorFlashErrorKind::Other,
        }
    }
}
