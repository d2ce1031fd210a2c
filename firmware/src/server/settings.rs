//! The machine's limits: in use, stored, asked for.
use super::{Buffers, Motion, Server};
use crate::engine::Config;
use core::ops::DerefMut;
use embedded_storage::nor_flash::NorFlash;
use giotto_shared::wire::{ClockSource, MachineConfig, Refusal, Reply, What};

impl<F: NorFlash, M: Motion, B: DerefMut<Target = Buffers>> Server<F, M, B> {
    /// At boot: what is stored, if it is usable; the image's own limits otherwise.
    pub(super) fn load_config(&mut self) {
        if let Some(stored) = self.store.config(&self.board.limits())
            && self.use_config(&stored).is_ok()
        {
            self.config_stored = true;
        }
    }

    fn use_config(&mut self, said: &MachineConfig) -> Result<(), Refusal> {
        let config = Config::robot(self.board.tick_hz)
            .with(said)
            .map_err(Refusal::Config)?;
        // Refused here, so that no path is ever too fast for the outputs.
        (self.board.bears)(said).map_err(Refusal::Config)?;
        self.motion.configure(&config).map_err(Refusal::Motion)?;
        self.config = *said;
        Ok(())
    }

    #[inline(never)]
    pub(super) fn config(&self) -> Reply {
        Reply::Config {
            config: self.config,
            stored: self.config_stored,
        }
    }

    #[inline(never)]
    pub(super) fn configure(&mut self, said: &MachineConfig) -> Result<(), Refusal> {
        self.idle()?;
        self.use_config(said)?;
        self.config_stored = false;
        self.apply_bypass();
        self.note(What::Configured { saved: false });
        Ok(())
    }

    #[inline(never)]
    pub(super) fn save_config(&mut self) -> Result<(), Refusal> {
        self.idle()?;
        if !self.store.keeps_config() {
            return Err(Refusal::NoConfigStore);
        }
        self.upload.abort();
        self.store
            .keep_config(&self.config)
            .map_err(Refusal::Flash)?;
        self.config_stored = true;
        self.note(What::Configured { saved: true });
        Ok(())
    }

    /// Feed and correction would be wrong by a per cent or two, and nobody has said that this is good enough.
    pub(super) fn clock_forbids(&self) -> bool {
        self.board.clock == ClockSource::Internal && !self.config.internal_clock
    }
}
