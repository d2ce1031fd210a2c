//! The page of words shared with the program that serves the protocol: a file in memory.
use crate::hal;
use core::ffi::{CStr, c_char, c_int};
use core::sync::atomic::Ordering::{Relaxed, Release};
use giotto_corrector::handover::{MAGIC, MAX_PATH, Page, VERSION, crc};

/// [`PAGE_PATH`](giotto_corrector::handover::PAGE_PATH) as C reads it.
pub(crate) const PATH: &CStr = c"/dev/shm/giotto-linuxcnc";

const READ_ONLY: c_int = 0;
/// Read and write, create, not through a link, closed with the process.
const CREATE: c_int = 0o2 | 0o100 | 0o200 | 0o400_000 | 0o2_000_000;
const OWNER_ONLY: c_int = 0o600;
const READ_AND_WRITE: c_int = 1 | 2;
const SHARED: c_int = 1;

/// Maps a new page, all zero.
pub(crate) fn create() -> Option<*mut Page> {
    // SAFETY: calls of the C library with checked results; a file that this process has just made has the size of a page.
    unsafe {
        // One left over from a LinuxCNC that crashed.
        hal::unlink(PATH.as_ptr());
        let file = hal::open(PATH.as_ptr(), CREATE, OWNER_ONLY);
        if file < 0 {
            return None;
        }
        let size = size_of::<Page>();
        let page = if hal::ftruncate(file, size as i64) == 0 {
            hal::mmap(core::ptr::null_mut(), size, READ_AND_WRITE, SHARED, file, 0)
        } else {
            usize::MAX as *mut _
        };
        hal::close(file);
        (page as usize != usize::MAX).then_some(page.cast())
    }
}

/// Takes the page away.
pub(crate) fn remove(page: *mut Page) {
    // SAFETY: mapped by `create`, no longer in use.
    unsafe {
        hal::munmap(page.cast(), size_of::<Page>());
        hal::unlink(PATH.as_ptr());
    }
}

/// Reads a file of at most as many bytes as there is room for; how many they were.
pub(crate) fn read(path: &CStr, buffer: &mut [u8]) -> Option<usize> {
    // SAFETY: calls of the C library with checked results, into what is left of the buffer.
    unsafe {
        let file = hal::open(path.as_ptr(), READ_ONLY);
        if file < 0 {
            return None;
        }
        let mut length = 0;
        while let Some(room) = buffer.get_mut(length..).filter(|room| !room.is_empty()) {
            let count = hal::read(file, room.as_mut_ptr().cast(), room.len());
            match usize::try_from(count) {
                Ok(count) if count > 0 => length += count.min(room.len()),
                _ => break,
            }
        }
        hal::close(file);
        Some(length)
    }
}

/// Fills in what does not change, and the table that was loaded.
pub(crate) fn describe(page: &Page, joints: usize, path: Option<&CStr>, image: &[u8]) {
    page.version.store(VERSION, Relaxed);
    page.joints.store(joints as u32, Relaxed);
    // SAFETY: takes nothing, cannot fail.
    page.process.store(unsafe { hal::getpid() } as u32, Relaxed);
    for (byte, of) in page.image.iter().zip(image) {
        byte.store(*of, Relaxed);
    }
    page.length.store(image.len() as u32, Relaxed);
    page.crc.store(crc(image), Relaxed);
    let path = path.map_or(&[][..], CStr::to_bytes);
    for (byte, of) in page.path.iter().take(MAX_PATH - 1).zip(path) {
        byte.store(*of, Relaxed);
    }
    page.magic.store(MAGIC, Release);
}

/// A name of a pin, in a buffer of its own.
pub(crate) struct Name([u8; 48]);

impl Name {
    /// `giotto.JOINT.end`.
    pub(crate) fn of_joint(joint: usize, end: &str) -> Self {
        let mut name = Self([0; 48]);
        let digit = [b'0' + (joint % 10) as u8];
        let parts = b"giotto."
            .iter()
            .chain(&digit)
            .chain(b".")
            .chain(end.as_bytes());
        // The last byte stays 0.
        for (to, from) in name.0.iter_mut().take(47).zip(parts) {
            *to = *from;
        }
        name
    }

    pub(crate) fn as_ptr(&self) -> *const c_char {
        self.0.as_ptr().cast()
    }
}
