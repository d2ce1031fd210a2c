//! Who may give this controller tables: whoever has the key, once one is provisioned. Off until then.
//!
//! The key is kept in flash, more than once; a controller whose key is lost trusts no table at all. A table is taken if it is signed
//! with the key, for this machine, and its serial is above all that were confirmed before: an old one cannot be played again.
//! Signature and machine are checked again each time a table is taken from flash, so that those from before the provisioning are
//! refused as well; the serial is not, so that one may go back to the table in the other slot.
//!
//! The key is replaced by its owner alone, who signs the new one for this machine and this once.
use super::{Buffers, Motion, Server};
use crate::store::{Owner, PublicKey, StoredKey};
use core::ops::DerefMut;
use embedded_storage::nor_flash::NorFlash;
use giotto_shared::table::TableError;
use giotto_shared::table::image::{MachineId, binding};
use giotto_shared::wire::{Chunk, KeyInfo, KeyState, Refusal};

/// Whether these parts, one after the other, are signed with this key.
#[cfg(feature = "signed")]
#[inline(never)]
fn verify(key: &PublicKey, parts: [&[u8]; 2], signature: &[u8; 64]) -> bool {
    use ed25519_compact::{PublicKey, Signature};
    let key = PublicKey::new(*key);
    let Ok(mut verification) = key.verify_incremental(&Signature::new(*signature)) else {
        return false;
    };
    parts.iter().for_each(|part| verification.absorb(part));
    verification.verify().is_ok()
}

/// An image without signatures built in must not act as if no key had been provisioned.
#[cfg(not(feature = "signed"))]
const fn verify(_: &PublicKey, _: [&[u8]; 2], _: &[u8; 64]) -> bool {
    false
}

/// Whether an image is by the owner of this key, for this machine.
fn check(image: &[u8], key: &PublicKey, machine: &MachineId) -> Result<u32, TableError> {
    use giotto_shared::table::image::signed_parts;
    let signed = signed_parts(image).ok_or(TableError::Unsigned)?;
    let bound = binding(image).ok_or(TableError::Unbound)?;
    if !verify(key, [signed.head, signed.body], signed.signature) {
        return Err(TableError::BadSignature);
    }
    if bound.machine == *machine {
        Ok(bound.serial)
    } else {
        Err(TableError::OtherMachine)
    }
}

impl<F: NorFlash, M: Motion, B: DerefMut<Target = Buffers>> Server<F, M, B> {
    /// Whether the first `length` bytes of the image buffer may be used: its serial, if it has to have one.
    pub(super) fn authorised(&self, length: usize) -> Result<Option<u32>, Refusal> {
        let image = self.buffers.image.get(..length).unwrap_or(&[]);
        match &self.key {
            StoredKey::None => Ok(None),
            StoredKey::Lost => Err(Refusal::KeyLost),
            StoredKey::Key(owner) => check(image, &owner.key, &self.board.machine)
                .map(Some)
                .map_err(Refusal::Table),
        }
    }

    /// The same for a table that comes from outside: it is newer than all before.
    pub(super) fn admitted(&self, length: usize) -> Result<(), Refusal> {
        let serial = self.authorised(length)?;
        let (Some(serial), StoredKey::Key(owner)) = (serial, &self.key) else {
            return Ok(());
        };
        let last = owner.serial;
        if serial > last {
            Ok(())
        } else {
            Err(Refusal::Table(TableError::OldSerial { serial, last }))
        }
    }

    /// Whether only signed tables are accepted.
    pub(super) const fn signed_only(&self) -> bool {
        !matches!(self.key, StoredKey::None)
    }

    /// The answer to whose tables are taken.
    #[inline(never)]
    pub(super) const fn key_info(&self) -> KeyInfo {
        let nobody = KeyInfo {
            state: KeyState::None,
            key: [0; 32],
            epoch: 0,
            serial: 0,
        };
        match self.key {
            StoredKey::None => nobody,
            StoredKey::Lost => KeyInfo {
                state: KeyState::Lost,
                ..nobody
            },
            StoredKey::Key(Owner { epoch, serial, key }) => KeyInfo {
                state: KeyState::Kept,
                key,
                epoch,
                serial,
            },
        }
    }

    /// Serial and validity of the table in a slot under this key, through the image buffer.
    fn serial_in(&mut self, slot: u8, key: &PublicKey) -> Option<u32> {
        self.upload.abort();
        let image = self.store.load(slot, &mut self.buffers.image).ok()?;
        check(image, key, &self.board.machine).ok()
    }

    /// Sees to it that the serials of the confirmed tables are behind us: at boot, since power may fail between a confirmation and
    /// this; and after each confirmation.
    #[inline(never)]
    pub(super) fn keep_serial(&mut self) -> Result<(), Refusal> {
        let StoredKey::Key(mut owner) = self.key else {
            return Ok(());
        };
        let last = owner.serial;
        for slot in self.store.confirmed().into_iter().flatten() {
            self.upload.abort();
            // What a signature costs is spent on those alone that would change something.
            let image = self.store.load(slot, &mut self.buffers.image);
            let above = |image: &[u8]| binding(image).is_some_and(|b| b.serial > owner.serial);
            if !image.is_ok_and(above) {
                continue;
            }
            if let Some(serial) = self.serial_in(slot, &owner.key) {
                owner.serial = serial;
            }
        }
        if owner.serial == last {
            return Ok(());
        }
        self.keep(&owner)
    }

    /// Keeps an owner, and goes by what the flash then says.
    fn keep(&mut self, owner: &Owner) -> Result<(), Refusal> {
        let kept = self.store.keep_owner(owner).map_err(Refusal::Flash);
        self.key = self.store.key();
        kept
    }

    /// Keeps the first key, or the one that was lost, which a table here proves. The table in use stays only if it is signed
    /// with it.
    #[inline(never)]
    pub(super) fn provision(&mut self, key: &PublicKey) -> Result<(), Refusal> {
        if !cfg!(feature = "signed") {
            return Err(Refusal::NoSignatures);
        }
        self.idle()?;
        let mut owner = Owner {
            epoch: 1,
            serial: 0,
            key: *key,
        };
        match &self.key {
            StoredKey::Key(known) if known.key == *key => return Ok(()),
            StoredKey::Key(_) => return Err(Refusal::KeyProvisioned),
            StoredKey::None => {}
            StoredKey::Lost => {
                let mut serials = [None; 2];
                for (slot, serial) in (0..2).zip(&mut serials) {
                    if self.store.owned(slot) {
                        *serial = self.serial_in(slot, key);
                    }
                }
                let [one, other] = serials;
                owner.serial = one.max(other).ok_or(Refusal::NotTheOwner)?;
            }
        }
        let kept = self.keep(&owner);
        self.changed_hands();
        kept
    }

    /// Another key, by word of the owner of the present one.
    #[inline(never)]
    pub(super) fn replace_key(&mut self, key: &PublicKey, word: &Chunk) -> Result<(), Refusal> {
        if !cfg!(feature = "signed") {
            return Err(Refusal::NoSignatures);
        }
        self.idle()?;
        let StoredKey::Key(present) = self.key else {
            let lost = self.key == StoredKey::Lost;
            return Err(if lost {
                Refusal::KeyLost
            } else {
                Refusal::NoKey
            });
        };
        let statement = giotto_shared::wire::replacement(&self.board.machine, present.epoch, key);
        let signed = <&[u8; 64]>::try_from(&**word)
            .is_ok_and(|signature| verify(&present.key, [&statement, &[]], signature));
        if !signed {
            return Err(Refusal::NotTheOwner);
        }
        let kept = self.keep(&Owner {
            epoch: present.epoch.wrapping_add(1),
            serial: present.serial,
            key: *key,
        });
        self.changed_hands();
        kept
    }

    /// What was taken under another key, or under none, is looked at anew.
    fn changed_hands(&mut self) {
        self.written = None;
        self.install_last_good();
    }
}
