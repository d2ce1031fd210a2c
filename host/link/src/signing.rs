//! Keys that tables are signed with (Ed25519, RFC 8032), and their files: one line, `giotto-key-1 ` and the 64 hex digits of
//! the secret seed.
use ed25519_compact::{KeyPair, Seed};
use giotto_shared::table::image::{Binding, MachineId};
use giotto_shared::table::{Header, TableError, image};
use giotto_shared::wire::{Command, replacement};
use std::io::{self, Write};
use std::path::Path;

/// What a key file begins with.
const MARK: &str = "giotto-key-1 ";

/// A secret key.
///
/// ```
/// use giotto_link::signing::SigningKey;
///
/// let folder = tempfile::tempdir()?;
/// let file = folder.path().join("key");
/// let key = SigningKey::generate();
/// key.save(&file)?;
/// assert_eq!(SigningKey::load(&file)?.public(), key.public());
/// // A key is never written over another file.
/// assert!(key.save(&file).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct SigningKey(KeyPair);

/// Why a file is no key.
#[derive(Debug, thiserror::Error)]
pub enum KeyError {
    /// It cannot be read.
    #[error("cannot be read: {0}")]
    Io(#[from] io::Error),
    /// It is something else.
    #[error("is no key: expected one line, `giotto-key-1` and 64 hex digits")]
    NotAKey,
}

/// Bytes as hex digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A machine by its hex digits.
pub fn machine_id(text: &str) -> Option<MachineId> {
    let mut machine = [0; 12];
    if text.len() != 24 || !text.is_ascii() {
        return None;
    }
    for (index, byte) in machine.iter_mut().enumerate() {
        *byte = u8::from_str_radix(&text[2 * index..2 * index + 2], 16).ok()?;
    }
    Some(machine)
}

fn seed(text: &str) -> Option<[u8; 32]> {
    let digits = text.trim_end().strip_prefix(MARK)?;
    let mut seed = [0; 32];
    if digits.len() != 64 || !digits.is_ascii() {
        return None;
    }
    for (index, byte) in seed.iter_mut().enumerate() {
        *byte = u8::from_str_radix(&digits[2 * index..2 * index + 2], 16).ok()?;
    }
    Some(seed)
}

impl SigningKey {
    /// A key that nobody else has.
    pub fn generate() -> Self {
        Self(KeyPair::from_seed(Seed::generate()))
    }

    /// Reads a key file.
    ///
    /// # Errors
    /// [`KeyError`].
    pub fn load(path: &Path) -> Result<Self, KeyError> {
        let text = std::fs::read_to_string(path)?;
        let seed = seed(&text).map(Seed::new).ok_or(KeyError::NotAKey)?;
        // A seed of zeros is refused.
        KeyPair::try_from_seed(seed)
            .map(Self)
            .map_err(|_| KeyError::NotAKey)
    }

    /// Writes a new key file, for the owner's eyes only; never over another file.
    ///
    /// # Errors
    /// Those of the file.
    pub fn save(&self, path: &Path) -> io::Result<()> {
        let mut options = std::fs::OpenOptions::new();
        options.write(true).create_new(true);
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
        let mut file = options.open(path)?;
        // Half a key signs nothing and would stand in the way of the next attempt.
        writeln!(file, "{MARK}{}", hex(&*self.0.sk.seed())).inspect_err(|_| {
            let _ = std::fs::remove_file(path);
        })
    }

    /// Its public half.
    pub fn public(&self) -> [u8; 32] {
        *self.0.pk
    }

    /// The public half in hex.
    pub fn public_hex(&self) -> String {
        hex(&self.public())
    }

    /// The image bound to one machine and one serial and signed with this key, in place of a signature it may have.
    ///
    /// # Errors
    /// Those of [`Header::check`]; [`TableError::TooLong`] if there is no room.
    pub fn sign(&self, table: &[u8], binding: &Binding) -> Result<Vec<u8>, TableError> {
        Header::check(table)?;
        let mut out = table.to_vec();
        out.resize(
            table.len() + image::BINDING_BYTES + image::SIGNATURE_BYTES,
            0,
        );
        let sign = |head: &[u8], body: &[u8]| *self.0.sk.sign([head, body].concat(), None);
        let length = image::attach_signature(&mut out, binding, sign)?;
        out.truncate(length);
        Ok(out)
    }

    /// The word that hands a controller, of whose key this is number `epoch`, to another key.
    pub fn hand_over(&self, machine: &MachineId, epoch: u32, to: &[u8; 32]) -> Command {
        let word = self.0.sk.sign(replacement(machine, epoch, to), None);
        Command::ReplaceKey {
            key: *to,
            signature: word.iter().copied().collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// RFC 8032 7.1, test 2: seed and public key.
    #[test]
    fn public_key_of_the_rfc() {
        let text =
            "giotto-key-1 4ccd089b28ff96da9db6c346ec114e0f5b8a319f35aba624da8cf6ed4fb8a6fb\n";
        let key = SigningKey(KeyPair::from_seed(Seed::new(seed(text).unwrap())));
        assert_eq!(
            key.public_hex(),
            "3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c"
        );
    }

    #[test]
    fn saved_and_loaded_and_never_over_another() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("key");
        let key = SigningKey::generate();
        key.save(&path).unwrap();
        assert_eq!(SigningKey::load(&path).unwrap().public(), key.public());
        assert_eq!(
            SigningKey::generate().save(&path).unwrap_err().kind(),
            io::ErrorKind::AlreadyExists
        );
        let zeros = format!("{MARK}{}", "0".repeat(64));
        for text in [
            "",
            "giotto-key-1",
            "giotto-key-1 00",
            "giotto-key-1 zz",
            &"é".repeat(40),
            &zeros,
        ] {
            std::fs::write(&path, text).unwrap();
            assert!(
                matches!(SigningKey::load(&path), Err(KeyError::NotAKey)),
                "{text}"
            );
        }
    }
}
