//! Which table corrects: what boots, what is on probation, what comes back.
use super::{Buffers, Motion, Server};
use core::ops::DerefMut;
use embedded_storage::nor_flash::NorFlash;
use giotto_shared::table;
use giotto_shared::wire::{MotionRefusal, Probation, Refusal};

impl<F: NorFlash, M: Motion, B: DerefMut<Target = Buffers>> Server<F, M, B> {
    /// Gives the table in `slot` to the engine.
    #[inline(never)]
    fn install(&mut self, slot: u8) -> Result<(), Refusal> {
        self.upload.abort();
        let image = self
            .store
            .load(slot, &mut self.buffers.image)
            .map_err(Refusal::Flash)?;
        table::check(image).map_err(Refusal::Table)?;
        let length = image.len();
        self.authorised(length)?;
        let image = self.buffers.image.get(..length);
        self.motion.install(image).inspect_err(|refusal| {
            if !matches!(refusal, Refusal::Motion(MotionRefusal::Busy)) {
                self.active = None;
            }
        })?;
        self.active = Some(slot);
        self.apply_bypass();
        Ok(())
    }

    /// Gives the newest confirmed table that this image reads to the engine, or takes any away.
    pub(super) fn install_last_good(&mut self) {
        self.probation = Probation::None;
        let confirmed = self.store.confirmed();
        if confirmed
            .into_iter()
            .flatten()
            .any(|slot| self.install(slot).is_ok())
        {
            return;
        }
        self.active = None;
        // Refused only while a program runs; every caller has made sure that none does.
        let _ = self.motion.install(None);
        self.apply_bypass();
    }

    /// The slot that boots.
    fn last_good(&self) -> Option<u8> {
        match self.probation {
            Probation::None => self.active,
            Probation::Fresh | Probation::FirstRun => {
                self.store.confirmed().into_iter().flatten().next()
            }
        }
    }

    /// Checks the uploaded table and programs the slot that does not boot.
    #[inline(never)]
    pub(super) fn program(&mut self) -> Result<u8, Refusal> {
        self.exchanges()?;
        let length = self.upload.end(&self.buffers.image)?;
        let image = self
            .buffers
            .image
            .get(..length)
            .ok_or(Refusal::UploadIncomplete)?;
        table::check(image).map_err(Refusal::Table)?;
        self.admitted(length)?;
        let slot = match self.last_good() {
            Some(0) => 1,
            _ => 0,
        };
        self.written = None;
        let on_probation = self.probation != Probation::None;
        let written = self.store.write(slot, length, &mut self.buffers.image);
        if on_probation {
            // Its slot is gone; the engine must not keep what can no longer be read back.
            self.install_last_good();
        }
        written.map_err(Refusal::Flash)?;
        self.written = Some(slot);
        Ok(slot)
    }

    /// Hands the written table to the engine, on probation.
    #[inline(never)]
    pub(super) fn commit(&mut self) -> Result<u8, Refusal> {
        self.exchanges()?;
        let slot = self.written.ok_or(Refusal::NothingToCommit)?;
        if let Err(refusal) = self.install(slot) {
            self.install_last_good();
            return Err(refusal);
        }
        self.written = None;
        self.probation = Probation::Fresh;
        Ok(slot)
    }

    /// Makes the table on probation the one that boots.
    #[inline(never)]
    pub(super) fn confirm(&mut self) -> Result<u8, Refusal> {
        let slot = match self.probation {
            Probation::None => None,
            Probation::Fresh | Probation::FirstRun => self.active,
        };
        let slot = slot.ok_or(Refusal::NothingToConfirm)?;
        self.upload.abort();
        let owned = self.signed_only();
        self.store
            .confirm(slot, owned, &mut self.buffers.image)
            .map_err(Refusal::Flash)?;
        self.probation = Probation::None;
        // Behind the confirmation: a table whose serial is spent and that does not boot would be lost to its owner.
        self.keep_serial()?;
        Ok(slot)
    }

    /// Ends a probation, or else makes the other confirmed table the one that boots.
    #[inline(never)]
    pub(super) fn roll_back(&mut self) -> Result<(), Refusal> {
        self.exchanges()?;
        if self.probation != Probation::None {
            self.install_last_good();
            return Ok(());
        }
        let in_use = self.active;
        let other = self
            .store
            .confirmed()
            .into_iter()
            .flatten()
            .find(|slot| Some(*slot) != in_use);
        let other = other.ok_or(Refusal::NothingToRollBack)?;
        self.upload.abort();
        // Read before it is confirmed: a table this image cannot use must not become the one that boots.
        if let Err(refusal) = self.install(other) {
            self.install_last_good();
            return Err(refusal);
        }
        let owned = self.signed_only();
        let confirmed = self.store.confirm(other, owned, &mut self.buffers.image);
        if let Err(fault) = confirmed {
            self.install_last_good();
            return Err(Refusal::Flash(fault));
        }
        self.written = None;
        Ok(())
    }
}
