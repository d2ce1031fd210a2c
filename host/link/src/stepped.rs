//! Time by grant: the link of an emulator whose ticks pass only while someone here waits for an answer, as those of the
//! virtual controller do. However busy this computer is, the controller does the same.
//!
//! A grant is `ff · sequence · ticks · 00` between the frames of the protocol; the controller answers in kind once so many
//! ticks have passed and all that came of them is sent. One that is not answered for a while is repeated under its
//! sequence, and grants nothing a second time.
use super::link::Link;
use std::collections::VecDeque;
use std::io;
use std::time::Duration;

/// First byte of a grant; no frame of the protocol begins so.
const MARK: u8 = 0xff;
/// Ticks granted at once, at most: what a controller sends in them has room on any line.
const MOST: u64 = 16;
/// By this computer's clock: an unanswered grant is repeated, and in the end the emulator is given up.
const REPEAT_AFTER: Duration = Duration::from_secs(1);
const GIVE_UP_AFTER: Duration = Duration::from_secs(60);

/// A link to an emulator that passes ticks as it is told.
pub struct SteppedLink<L> {
    inner: L,
    tick: Duration,
    ticks: u64,
    /// Of the last grant.
    sequence: u8,
    /// Ticks of the next one: few after a request, more the longer nothing comes.
    next: u64,
    pending: VecDeque<u8>,
    /// What has come of the frame under way, if it may be an answer to a grant.
    answer: Option<Vec<u8>>,
}

impl<L: Link> SteppedLink<L> {
    /// Time stands still from now on. `tick` is the controller's.
    ///
    /// # Errors
    /// Those of the link; [`io::ErrorKind::TimedOut`] if the controller does not answer a grant.
    pub fn begin(inner: L, tick: Duration) -> io::Result<Self> {
        let mut link = Self {
            inner,
            tick,
            ticks: 0,
            sequence: 0,
            next: 1,
            pending: VecDeque::new(),
            answer: Some(Vec::new()),
        };
        link.grant(1)?;
        Ok(link)
    }

    /// Lets so many ticks pass, at most 254; what came of them waits in `pending`.
    fn grant(&mut self, ticks: u64) -> io::Result<()> {
        // 1 to 254: neither none nor the end of a frame.
        self.sequence = self.sequence % 254 + 1;
        let grant = [0, MARK, self.sequence, ticks as u8, 0];
        let give_up_at = self.inner.now() + GIVE_UP_AFTER;
        while self.inner.now() < give_up_at {
            self.inner.send(&grant)?;
            let until = self.inner.now() + REPEAT_AFTER;
            while self.inner.now() < until {
                let mut bytes = [0; 4096];
                let count = self.inner.receive(&mut bytes, until)?;
                let mut answered = false;
                for &byte in &bytes[..count] {
                    answered |= self.take(byte);
                }
                if answered {
                    self.ticks += ticks;
                    return Ok(());
                }
            }
        }
        let words = "the emulator does not say that its ticks have passed";
        Err(io::Error::new(io::ErrorKind::TimedOut, words))
    }

    /// Puts a byte of the controller where it belongs; whether it ends the answer to the last grant.
    fn take(&mut self, byte: u8) -> bool {
        let Some(answer) = &mut self.answer else {
            self.pending.push_back(byte);
            if byte == 0 {
                self.answer = Some(Vec::new());
            }
            return false;
        };
        if answer.is_empty() && byte != MARK {
            self.pending.push_back(byte);
            if byte != 0 {
                self.answer = None;
            }
            return false;
        }
        answer.push(byte);
        if byte != 0 {
            return false;
        }
        let answered = answer.get(1) == Some(&self.sequence);
        answer.clear();
        answered
    }
}

impl<L: Link> Link for SteppedLink<L> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.next = 1;
        self.inner.send(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], until: Duration) -> io::Result<usize> {
        while self.pending.is_empty() {
            let left = until.saturating_sub(self.now()).as_nanos();
            if left == 0 {
                return Ok(0);
            }
            let most = left.div_ceil(self.tick.as_nanos().max(1));
            let ticks = self.next.min(u64::try_from(most).unwrap_or(MOST));
            self.grant(ticks)?;
            if self.pending.is_empty() {
                self.next = (self.next * 2).min(MOST);
            }
        }
        let count = buffer.len().min(self.pending.len());
        for (to, from) in buffer.iter_mut().zip(self.pending.drain(..count)) {
            *to = from;
        }
        Ok(count)
    }

    fn now(&self) -> Duration {
        // 49 days of milliseconds.
        self.tick * u32::try_from(self.ticks).unwrap_or(u32::MAX)
    }
}
