//! Time by grant, for the emulator (feature `stepped`): ticks pass only as the host asks for them, so that a host that is
//! busy elsewhere delays the controller and never changes what it does.
//!
//! ```text
//! host        ff · sequence · ticks · 00     so many ticks may pass
//! controller  ff · sequence · ticks · 00     they have, and everything that came of them is sent
//! ```
//!
//! `ff` begins no frame of the protocol: those are shorter than 254 bytes. A grant with the sequence of the last one is
//! a repetition: it is answered and grants nothing. Until the first grant time runs freely.
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};
use cortex_m::peripheral::SYST;
use embedded_io::{ErrorType, Read, ReadReady, Write};
use giotto_firmware::server::link::write_whole;

/// First byte of a grant and of its answer.
const MARK: u8 = 0xff;
/// Time runs freely.
const FREE: u32 = u32::MAX;
/// Looks at the link for the grant behind a request to reset.
const LAST_LOOKS: u32 = 1_000_000;

/// Ticks that may still pass.
static LEFT: AtomicU32 = AtomicU32::new(FREE);

/// Asked by the timer interrupt: whether a tick may pass.
pub fn may_pass() -> bool {
    let left = LEFT.load(Relaxed);
    if left == FREE {
        return true;
    }
    LEFT.store(left.saturating_sub(1), Relaxed);
    left > 0
}

/// Where in a frame the next byte from the host is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    /// At its start.
    Start,
    /// In a frame of the protocol.
    Inside,
    /// In a grant, after so many of its bytes.
    Grant(usize),
}

/// The host's link, grants taken out, and the timer that they are for.
pub struct Stepped<L> {
    link: L,
    syst: SYST,
    /// Called at the first grant: what counts time on its own has to stop.
    begin: fn(),
    place: Place,
    /// Sequence and ticks of the grant that is coming in.
    grant: [u8; 2],
    /// A whole grant that nothing was done about.
    asked: Option<[u8; 2]>,
    /// Sequence of the last grant; 0: there was none.
    given: u8,
    /// The grant to be answered.
    owed: Option<[u8; 2]>,
    /// All has been served since its last tick.
    served: bool,
}

impl<L> Stepped<L> {
    /// Time runs freely until the first grant.
    pub const fn new(link: L, syst: SYST, begin: fn()) -> Self {
        Self {
            link,
            syst,
            begin,
            place: Place::Start,
            grant: [0; 2],
            asked: None,
            given: 0,
            owed: None,
            served: false,
        }
    }

    /// Whether the byte is the protocol's.
    fn keep(&mut self, byte: u8) -> bool {
        match (self.place, byte) {
            (Place::Grant(count), 0) => {
                self.place = Place::Start;
                if count == self.grant.len() {
                    self.asked = Some(self.grant);
                }
                false
            }
            (Place::Grant(count), _) => {
                if let Some(place) = self.grant.get_mut(count) {
                    *place = byte;
                }
                self.place = Place::Grant(count.saturating_add(1));
                false
            }
            (_, 0) => {
                self.place = Place::Start;
                true
            }
            (Place::Start, MARK) => {
                self.place = Place::Grant(0);
                false
            }
            _ => {
                self.place = Place::Inside;
                true
            }
        }
    }
}

impl<L: Read + ReadReady + Write> Stepped<L> {
    /// After each round of the background: begins what was granted, answers once it has passed.
    pub fn round(&mut self) {
        if let Some([sequence, ticks]) = self.asked.take() {
            if sequence != self.given {
                if self.given == 0 {
                    (self.begin)();
                }
                self.given = sequence;
                self.syst.clear_current();
                LEFT.store(u32::from(ticks), Relaxed);
                self.syst.enable_counter();
            }
            (self.owed, self.served) = (Some([sequence, ticks]), false);
            return;
        }
        let Some(owed) = self.owed.filter(|_| LEFT.load(Relaxed) == 0) else {
            return;
        };
        self.syst.disable_counter();
        if self.link.read_ready().unwrap_or(false) || !self.served {
            self.served = true;
            return;
        }
        self.answer(owed);
    }

    fn answer(&mut self, [sequence, ticks]: [u8; 2]) {
        self.owed = None;
        // The host asks again for what did not get through.
        let _ = write_whole(&mut self.link, &[MARK, sequence, ticks, 0]);
    }

    /// Whether the core may sleep until an interrupt. To be asked with interrupts masked.
    pub fn may_sleep(&mut self) -> bool {
        let due = self.owed.is_some() && LEFT.load(Relaxed) == 0;
        !due && self.asked.is_none() && !self.link.read_ready().unwrap_or(false)
    }

    /// Before a reset: the host waits for an answer to the grant behind its request.
    pub fn close(&mut self) {
        if self.given == 0 {
            return;
        }
        let mut byte = [0];
        for _ in 0..LAST_LOOKS {
            if let Some(asked) = self.asked.take().or(self.owed) {
                return self.answer(asked);
            }
            if self.link.read_ready().unwrap_or(false) && self.link.read(&mut byte).is_ok() {
                self.keep(byte[0]);
            }
        }
    }
}

impl<L: ErrorType> ErrorType for Stepped<L> {
    type Error = L::Error;
}

impl<L: ReadReady> ReadReady for Stepped<L> {
    fn read_ready(&mut self) -> Result<bool, L::Error> {
        self.link.read_ready()
    }
}

impl<L: Read> Read for Stepped<L> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, L::Error> {
        let count = self.link.read(buffer)?;
        let mut kept = 0;
        for at in 0..count {
            let byte = buffer.get(at).copied().unwrap_or(0);
            if self.keep(byte)
                && let Some(place) = buffer.get_mut(kept)
            {
                *place = byte;
                kept += 1;
            }
        }
        Ok(kept)
    }
}

impl<L: Write> Write for Stepped<L> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, L::Error> {
        self.link.write(bytes)
    }

    fn flush(&mut self) -> Result<(), L::Error> {
        self.link.flush()
    }
}
