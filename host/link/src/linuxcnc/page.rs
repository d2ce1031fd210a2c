//! The page of the component, read and written as the file that it is.
use crate::error::ControllerError;
use giotto_corrector::handover::{self, MAGIC, MAX_PATH, PAGE_PATH, SEEN, VERSION};
use giotto_shared::table::MAX_IMAGE_BYTES;
use std::ffi::OsString;
use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::mem::offset_of;
use std::os::unix::ffi::OsStringExt;
use std::os::unix::fs::FileExt;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// So long an offer may wait to be taken: while an earlier one is being exchanged.
const TAKEN_WITHIN: Duration = Duration::from_secs(2);
/// A tick that has not moved for so long stands still: a busy computer holds threads up that are not real-time.
const STILL: Duration = Duration::from_secs(1);

type Shared = handover::Page;

/// What a tick has left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Words {
    pub(super) tick: u32,
    pub(super) state: u32,
    pub(super) raw_nm: [i32; 3],
    pub(super) corrected_nm: [i32; 3],
    pub(super) offset_cuts: u32,
    pub(super) slew_cuts: u32,
    pub(super) resets: u32,
}

/// An open page; no other giotto has it.
#[derive(Debug)]
pub(super) struct Page {
    file: File,
}

/// The page went away.
pub(super) fn gone(error: &io::Error) -> ControllerError {
    ControllerError::Lost {
        port: "linuxcnc".to_owned(),
        reason: error.to_string(),
    }
}

fn no(reason: String) -> ControllerError {
    ControllerError::NoComponent { reason }
}

/// The reader was slower than the page remembers.
fn late() -> io::Error {
    io::Error::other("this computer was too busy: samples were overwritten before they were read")
}

impl Page {
    /// To read alone, beside whoever has it.
    pub(super) fn watch() -> Result<Self, ControllerError> {
        let file = File::open(PAGE_PATH).map_err(|error| no(format!("{PAGE_PATH}: {error}")))?;
        Self::checked(file)
    }

    /// For this program alone.
    pub(super) fn open() -> Result<Self, ControllerError> {
        let file = OpenOptions::new().read(true).write(true).open(PAGE_PATH);
        let file = file.map_err(|error| no(format!("{PAGE_PATH}: {error}")))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(ControllerError::InUse {
                    port: "linuxcnc".to_owned(),
                });
            }
            Err(TryLockError::Error(error)) => return Err(no(format!("{PAGE_PATH}: {error}"))),
        }
        Self::checked(file)
    }

    /// The page of this release.
    fn checked(file: File) -> Result<Self, ControllerError> {
        let page = Self { file };
        let word = |at| {
            page.word(at)
                .map_err(|error| no(format!("{PAGE_PATH}: {error}")))
        };
        let (magic, version) = (
            word(offset_of!(Shared, magic))?,
            word(offset_of!(Shared, version))?,
        );
        if magic != MAGIC || version != VERSION {
            return Err(no(format!(
                "{PAGE_PATH} is that of another release: use the giotto and the component of the same one"
            )));
        }
        Ok(page)
    }

    /// Time between two ticks, ns.
    ///
    /// # Errors
    /// [`ControllerError::NoComponent`] while LinuxCNC's threads stand still.
    pub(super) fn period_ns(&self) -> Result<u32, ControllerError> {
        let begun = Instant::now();
        let first = self.words().map_err(|error| gone(&error))?.tick;
        while begun.elapsed() < STILL {
            if self.words().map_err(|error| gone(&error))?.tick != first {
                return self
                    .word(offset_of!(Shared, period_ns))
                    .map_err(|error| gone(&error));
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        Err(no(
            "it is loaded, and its ticks stand still (`addf giotto.update servo-thread`, or a LinuxCNC that crashed)".to_owned(),
        ))
    }

    fn bytes<const N: usize>(&self, at: usize) -> io::Result<[u8; N]> {
        let mut bytes = [0; N];
        self.file.read_exact_at(&mut bytes, at as u64)?;
        Ok(bytes)
    }

    fn word(&self, at: usize) -> io::Result<u32> {
        self.bytes(at).map(u32::from_le_bytes)
    }

    fn byte(&self, at: usize) -> io::Result<u8> {
        self.bytes::<1>(at).map(|[byte]| byte)
    }

    fn put(&self, at: usize, bytes: &[u8]) -> io::Result<()> {
        self.file.write_all_at(bytes, at as u64)
    }

    /// The words of one tick: read again if a tick came between.
    pub(super) fn words(&self) -> io::Result<Words> {
        loop {
            let ended = self.word(offset_of!(Shared, ended))?;
            let place = |at: usize| -> io::Result<[i32; 3]> {
                let bytes: [u8; 12] = self.bytes(at)?;
                let mut nm = [0; 3];
                for (nm, four) in nm.iter_mut().zip(bytes.as_chunks::<4>().0) {
                    *nm = i32::from_le_bytes(*four);
                }
                Ok(nm)
            };
            let words = Words {
                tick: ended,
                state: self.word(offset_of!(Shared, state))?,
                raw_nm: place(offset_of!(Shared, raw_nm))?,
                corrected_nm: place(offset_of!(Shared, corrected_nm))?,
                offset_cuts: self.word(offset_of!(Shared, offset_cuts))?,
                slew_cuts: self.word(offset_of!(Shared, slew_cuts))?,
                resets: self.word(offset_of!(Shared, resets))?,
            };
            if self.word(offset_of!(Shared, begun))? == ended {
                return Ok(words);
            }
        }
    }

    /// Set-points and feedback of the ticks from `first` to the last one written, nm.
    ///
    /// # Errors
    /// Some of them are overwritten already.
    pub(super) fn seen(&self, first: u32) -> io::Result<Vec<[[i32; 3]; 2]>> {
        const ENTRY: usize = size_of::<handover::Seen>();
        let ended = self.word(offset_of!(Shared, ended))?;
        let count = ended.wrapping_sub(first).wrapping_add(1) as usize;
        if count > SEEN {
            return Err(late());
        }
        if count == 0 {
            return Ok(Vec::new());
        }
        let mut seen = Vec::with_capacity(count);
        for k in 0..count {
            let entry = first.wrapping_add(k as u32) as usize & (SEEN - 1);
            let bytes: [u8; ENTRY] = self.bytes(offset_of!(Shared, seen) + entry * ENTRY)?;
            let mut nm = [[0; 3]; 2];
            for (nm, four) in nm
                .as_flattened_mut()
                .iter_mut()
                .zip(bytes.as_chunks::<4>().0)
            {
                *nm = i32::from_le_bytes(*four);
            }
            seen.push(nm);
        }
        // The component went on meanwhile: has it come round to what was read?
        let begun = self.word(offset_of!(Shared, begun))?;
        if begun.wrapping_sub(first) as usize >= SEEN {
            return Err(late());
        }
        Ok(seen)
    }

    /// Process that runs the component.
    pub(super) fn process(&self) -> io::Result<u32> {
        self.word(offset_of!(Shared, process))
    }

    /// CRC of the table in use; 0: none.
    pub(super) fn crc(&self) -> io::Result<u32> {
        self.word(offset_of!(Shared, crc))
    }

    /// The table that was offered last, or loaded.
    pub(super) fn image(&self) -> io::Result<Vec<u8>> {
        let length = self.word(offset_of!(Shared, length))? as usize;
        let mut image = vec![0; length.min(MAX_IMAGE_BYTES)];
        self.file
            .read_exact_at(&mut image, offset_of!(Shared, image) as u64)?;
        Ok(image)
    }

    /// The file of the table that was named at load.
    pub(super) fn path(&self) -> io::Result<Option<PathBuf>> {
        let bytes: [u8; MAX_PATH] = self.bytes(offset_of!(Shared, path))?;
        let name: Vec<u8> = bytes.into_iter().take_while(|byte| *byte != 0).collect();
        Ok((!name.is_empty()).then(|| PathBuf::from(OsString::from_vec(name))))
    }

    /// Whether the correction is switched off from here.
    pub(super) fn bypassed(&self) -> io::Result<bool> {
        Ok(self.byte(offset_of!(Shared, bypass))? != 0)
    }

    /// Switches the correction off or on.
    pub(super) fn bypass(&self, on: bool) -> io::Result<()> {
        self.put(offset_of!(Shared, bypass), &[u8::from(on)])
    }

    /// Raises the pin that says stop.
    pub(super) fn stop(&self) -> io::Result<()> {
        let at = offset_of!(Shared, stop);
        let count = self.byte(at)?;
        self.put(at, &[count.wrapping_add(1)])
    }

    /// Offers a table, none if it is empty, and waits until it has been looked at; what became of it: a
    /// [`verdict`](handover::verdict), or `None` if nobody looked.
    pub(super) fn offer(&self, image: &[u8]) -> io::Result<Option<u32>> {
        let at = offset_of!(Shared, offered);
        let offer = self.byte(at)?;
        if !self.taken(offer)? {
            return Ok(None);
        }
        self.put(offset_of!(Shared, image), image)?;
        self.put(
            offset_of!(Shared, length),
            &(image.len() as u32).to_le_bytes(),
        )?;
        let offer = offer.wrapping_add(1);
        self.put(at, &[offer])?;
        if self.taken(offer)? {
            self.word(offset_of!(Shared, verdict)).map(Some)
        } else {
            Ok(None)
        }
    }

    /// Waits until an offer has been looked at.
    fn taken(&self, offer: u8) -> io::Result<bool> {
        let begun = Instant::now();
        loop {
            if self.word(offset_of!(Shared, taken))? == u32::from(offer) {
                return Ok(true);
            }
            if begun.elapsed() > TAKEN_WITHIN {
                return Ok(false);
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}
