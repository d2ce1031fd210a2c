//! Who may give this controller tables: whoever has the key, once one is provisioned. Off until then.
//!
//! The key is kept in flash, more than once, and is never replaced; a flash whose key cannot be read trusts no table at all. Tables are
//! checked before they are programmed and again each time one is taken from flash, so that those from before the
//! provisioning are refused as well.
use super::{Buffers, Motion, Server};
use crate::store::StoredKey;
use core::ops::DerefMut;
use embedded_storage::nor_flash::NorFlash;
use giotto_shared::table::TableError;
use giotto_shared::wire::Refusal;

/// Whether an image may be used under this key.
#[cfg(feature = "signed")]
#[inline(never)]
fn check(image: &[u8], key: &StoredKey) -> Result<(), TableError> {
    use ed25519_compact::{PublicKey, Signature};
    use giotto_shared::table::image::signed_parts;
    let key = match key {
        StoredKey::None => return Ok(()),
        StoredKey::Unreadable => return Err(TableError::BadSignature),
        StoredKey::Key(key) => PublicKey::new(*key),
    };
    let signed = signed_parts(image).ok_or(TableError::Unsigned)?;
    let bad = |_| TableError::BadSignature;
    let mut verification = key
        .verify_incremental(&Signature::new(*signed.signature))
        .map_err(bad)?;
    verification.absorb(signed.head);
    verification.absorb(signed.body);
    verification.verify().map_err(bad)
}

/// An image without signatures built in must not act as if no key had been provisioned.
#[cfg(not(feature = "signed"))]
fn check(_: &[u8], key: &StoredKey) -> Result<(), TableError> {
    if *key == StoredKey::None {
        Ok(())
    } else {
        Err(TableError::BadSignature)
    }
}

impl<F: NorFlash, M: Motion, B: DerefMut<Target = Buffers>> Server<F, M, B> {
    /// Whether the first `length` bytes of the image buffer may be used.
    pub(super) fn authorised(&self, length: usize) -> Result<(), Refusal> {
        let image = self.buffers.image.get(..length).unwrap_or(&[]);
        check(image, &self.key).map_err(Refusal::Table)
    }

    /// Whether only signed tables are accepted.
    pub(super) const fn signed_only(&self) -> bool {
        !matches!(self.key, StoredKey::None)
    }

    /// Keeps the key. The table in use stays only if it is signed with it.
    #[cfg(feature = "signed")]
    #[inline(never)]
    pub(super) fn provision(&mut self, key: [u8; 32]) -> Result<(), Refusal> {
        self.idle()?;
        match self.key {
            StoredKey::Key(known) if known == key => return Ok(()),
            StoredKey::None => {}
            StoredKey::Key(_) | StoredKey::Unreadable => return Err(Refusal::KeyProvisioned),
        }
        let kept = self.store.keep_key(&key).map_err(Refusal::Flash);
        self.key = self.store.key();
        kept?;
        self.written = None;
        self.install_last_good();
        Ok(())
    }

    /// Refused.
    #[cfg(not(feature = "signed"))]
    #[allow(
        clippy::unused_self,
        clippy::needless_pass_by_ref_mut,
        reason = "as where signatures are built in"
    )]
    pub(super) const fn provision(&mut self, _: [u8; 32]) -> Result<(), Refusal> {
        Err(Refusal::NoSignatures)
    }
}
