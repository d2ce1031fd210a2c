//! Words that the real-time component and the program beside it share: a file in memory, mapped by the one, read and
//! written by the other. Nothing waits for anything.
//!
//! ```text
//! Page
//!   magic, version          written once by the component, the magic last
//!   status                  written by the component each tick, between `begun` and `ended`: a reader that finds them
//!                           equal, `ended` read first and `begun` last, has the words of one tick
//!   seen                    written by the component before `ended`: set-points and feedback of the last ticks, by tick
//!   taken, verdict          written by the component when it has looked at an offer
//!   offered, length, image  written by the program; `offered` last, one byte that counts. Not written again until `taken`
//!                           is equal to it: nobody reads a table that is being written. If it happened, its CRC would not hold
//!   bypass, stop            written by the program, one byte each
//! ```
use crate::corrector::{Corrector, Counters, Input, Output};
use crate::law::LawError;
use crate::marks;
use crate::settings::JOINTS;
use core::sync::atomic::Ordering::Relaxed;
use core::sync::atomic::{AtomicI32, AtomicU8, AtomicU32};
use giotto_shared::table::MAX_IMAGE_BYTES;

/// Says that a page is one.
pub const MAGIC: u32 = u32::from_le_bytes(*b"giot");
/// Layout of the page.
pub const VERSION: u32 = 2;
/// Longest path of a table, bytes.
pub const MAX_PATH: usize = 1024;
/// Where the page is.
pub const PAGE_PATH: &str = "/dev/shm/giotto-linuxcnc";

/// Ticks kept in [`Page::seen`], a power of two: a reader may be as late as that.
pub const SEEN: usize = 8192;

const _: () = assert!(SEEN.is_power_of_two());

/// What one tick had, by slide, machine coordinates, nm.
#[repr(C)]
#[derive(Debug)]
pub struct Seen {
    /// Set-points as they came.
    pub commanded_nm: [AtomicI32; 3],
    /// Feedback as it came.
    pub measured_nm: [AtomicI32; 3],
}

/// Bits of [`Page::state`].
pub mod state {
    /// The pin is on.
    pub const ENABLE: u32 = 1;
    /// A correction acts.
    pub const ACTIVE: u32 = 2;
    /// Wanted and not possible.
    pub const FAULT: u32 = 4;
    /// A set-point has changed within the latency.
    pub const MOVING: u32 = 8;
    /// The drives are on.
    pub const MACHINE_ON: u32 = 16;
    /// A table is in use.
    pub const TABLE: u32 = 32;
    /// Coordinated motion.
    pub const COORDINATED: u32 = 64;
}

/// What became of an offer.
pub mod verdict {
    /// The table is in use.
    pub const GOOD: u32 = 0;
    /// Its bytes or numbers are wrong.
    pub const TABLE: u32 = 1;
    /// Its terms cannot be undone together.
    pub const TERMS: u32 = 2;
}

/// The shared words.
#[repr(C)]
#[derive(Debug)]
pub struct Page {
    /// [`MAGIC`] once all else is there.
    pub magic: AtomicU32,
    /// [`VERSION`].
    pub version: AtomicU32,
    /// Joints.
    pub joints: AtomicU32,
    /// Period of the tick, ns.
    pub period_ns: AtomicU32,
    /// Process that runs the component.
    pub process: AtomicU32,
    /// Number of the tick whose words are being written.
    pub begun: AtomicU32,
    /// Bits of [`state`].
    pub state: AtomicU32,
    /// Latency in force, ns.
    pub latency_ns: AtomicU32,
    /// Set-points of the slides as they came, machine coordinates, nm.
    pub raw_nm: [AtomicI32; 3],
    /// As they went out.
    pub corrected_nm: [AtomicI32; 3],
    /// As in [`Counters`].
    pub offset_cuts: AtomicU32,
    /// As in [`Counters`].
    pub slew_cuts: AtomicU32,
    /// As in [`Counters`].
    pub resets: AtomicU32,
    /// Number of the tick whose words have been written.
    pub ended: AtomicU32,
    /// The last offer that was looked at.
    pub taken: AtomicU32,
    /// What became of it: [`verdict`].
    pub verdict: AtomicU32,
    /// CRC that ends the image in use; 0: none.
    pub crc: AtomicU32,
    /// Counts offers, a byte that wraps.
    pub offered: AtomicU8,
    /// The correction is switched off by the program.
    pub bypass: AtomicU8,
    /// Counts requests to stop, a byte that wraps.
    pub stop: AtomicU8,
    /// Nothing.
    pub spare: AtomicU8,
    /// Bytes of the image; 0: no table.
    pub length: AtomicU32,
    /// The image.
    pub image: [AtomicU8; MAX_IMAGE_BYTES],
    /// Path of the table that was given at load; ends with 0.
    pub path: [AtomicU8; MAX_PATH],
    /// The last ticks: that of tick t at t mod [`SEEN`].
    pub seen: [Seen; SEEN],
}

/// Saturates; a place farther than 2.1 m is shown as that.
fn nm(metres: f64) -> i32 {
    (metres * 1e9) as i32
}

/// What the component keeps beside the page.
#[derive(Debug)]
pub struct Taker {
    image: [u8; MAX_IMAGE_BYTES],
    stop: u8,
    last: [f64; JOINTS],
    still: u32,
}

impl Default for Taker {
    fn default() -> Self {
        Self::new()
    }
}

impl Taker {
    /// Has taken nothing yet.
    pub const fn new() -> Self {
        Self {
            image: [0; MAX_IMAGE_BYTES],
            stop: 0,
            last: [0.0; JOINTS],
            still: 0,
        }
    }

    /// Takes over what the program has offered, if it has. Bounded: at most one table a tick.
    ///
    /// Returns whether the program asks to stop.
    pub fn take(&mut self, page: &Page, corrector: &mut Corrector) -> bool {
        corrector.set_bypass(page.bypass.load(Relaxed) != 0);
        marks::take(&page.offered, &page.taken, || {
            let takes = corrector.takes_table();
            if takes {
                let verdict = self.look(page, corrector);
                page.verdict.store(verdict, Relaxed);
            }
            takes
        });
        let stop = page.stop.load(Relaxed);
        let asked = stop != self.stop;
        self.stop = stop;
        asked
    }

    fn look(&mut self, page: &Page, corrector: &mut Corrector) -> u32 {
        let length = page.length.load(Relaxed) as usize;
        for (byte, word) in self.image.iter_mut().zip(&page.image).take(length) {
            *byte = word.load(Relaxed);
        }
        let Some(image) = self.image.get(..length) else {
            return verdict::TABLE;
        };
        if image.is_empty() {
            corrector.unload();
            page.crc.store(0, Relaxed);
            return verdict::GOOD;
        }
        match corrector.load(image) {
            Ok(()) => {
                page.crc.store(crc(image), Relaxed);
                verdict::GOOD
            }
            Err(LawError::Term(..)) => verdict::TERMS,
            Err(LawError::Table(_) | LawError::Busy) => verdict::TABLE,
        }
    }

    /// Publishes a tick.
    pub fn publish(&mut self, page: &Page, corrector: &Corrector, input: &Input, output: &Output) {
        let counters: &Counters = corrector.counters();
        let same = self.last == input.command;
        self.still = if same {
            self.still.saturating_add(1)
        } else {
            0
        };
        self.last = input.command;
        let latency_s = output.latency_s;
        let period_s = f64::from(page.period_ns.load(Relaxed)) * 1e-9;
        let moving = f64::from(self.still) * period_s <= latency_s;
        let bits = [
            (input.enable, state::ENABLE),
            (output.active, state::ACTIVE),
            (output.fault, state::FAULT),
            (moving, state::MOVING),
            (input.machine_on, state::MACHINE_ON),
            (corrector.has_table(), state::TABLE),
            (input.coordinated, state::COORDINATED),
        ];
        let state = bits
            .iter()
            .fold(0, |all, (on, bit)| if *on { all | bit } else { all });
        let raw = corrector.slides_m(input);
        let went = corrector.slides_m(&Input {
            command: output.command,
            ..*input
        });
        let measured = corrector.slides_m(&Input {
            command: input.feedback,
            ..*input
        });
        marks::write(&page.begun, &page.ended, counters.ticks, || {
            page.state.store(state, Relaxed);
            page.latency_ns.store((latency_s * 1e9) as u32, Relaxed);
            for ((to, from), metres) in page
                .raw_nm
                .iter()
                .zip(&page.corrected_nm)
                .zip(raw.iter().zip(went))
            {
                to.store(nm(*metres.0), Relaxed);
                from.store(nm(metres.1), Relaxed);
            }
            if let Some(seen) = page.seen.get(counters.ticks as usize & (SEEN - 1)) {
                let of = |to: &[AtomicI32; 3], from: [f64; 3]| {
                    for (to, metres) in to.iter().zip(from) {
                        to.store(nm(metres), Relaxed);
                    }
                };
                of(&seen.commanded_nm, raw);
                of(&seen.measured_nm, measured);
            }
            page.offset_cuts.store(counters.offset_cuts, Relaxed);
            page.slew_cuts.store(counters.slew_cuts, Relaxed);
            page.resets.store(counters.resets, Relaxed);
        });
    }
}

/// The CRC that an image carries, as a name for it.
pub fn crc(image: &[u8]) -> u32 {
    giotto_shared::table::image::Header::check(image).map_or(0, |header| header.crc)
}
