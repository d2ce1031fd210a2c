//! A link that breaks bytes on purpose: flip, drop, duplicate, delay, truncate, split, join, burst. Seeded.
use giotto::controller::link::Link;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::VecDeque;
use std::io;
use std::time::Duration;

/// A way to break a piece of the stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Fault {
    /// One bit changed.
    Flip,
    /// One byte lost.
    Drop,
    /// The piece twice.
    Duplicate,
    /// The piece after the next one.
    Delay,
    /// The end of the piece lost.
    Truncate,
    /// A zero in the middle: two frames of one.
    Split,
    /// The closing zero lost: one frame of two.
    Join,
    /// A run of noise in front.
    Burst,
}

impl Fault {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Flip,
        Self::Drop,
        Self::Duplicate,
        Self::Delay,
        Self::Truncate,
        Self::Split,
        Self::Join,
        Self::Burst,
    ];
}

/// What breaks pieces of one direction.
#[derive(Debug)]
struct Breaker {
    random: ChaCha8Rng,
    share: f64,
    delayed: Vec<u8>,
    pieces: u64,
    broken: u64,
}

impl Breaker {
    fn new(seed: u64, share: f64) -> Self {
        Self { random: ChaCha8Rng::seed_from_u64(seed), share, delayed: Vec::new(), pieces: 0, broken: 0 }
    }

    /// A place in the piece.
    fn place(&mut self, piece: &[u8]) -> usize {
        self.random.random_range(0..piece.len().max(1))
    }

    fn pass(&mut self, piece: &[u8]) -> Vec<u8> {
        self.pieces += 1;
        let mut out = piece.to_vec();
        let held = std::mem::take(&mut self.delayed);
        if !piece.is_empty() && self.random.random_bool(self.share) {
            self.broken += 1;
            let at = self.place(piece);
            match Fault::ALL[self.random.random_range(0..Fault::ALL.len())] {
                Fault::Flip => out[at] ^= 1 << self.random.random_range(0..8),
                Fault::Drop => drop(out.remove(at)),
                Fault::Duplicate => out.extend_from_slice(piece),
                Fault::Delay => self.delayed = std::mem::take(&mut out),
                Fault::Truncate => out.truncate(at),
                Fault::Split => out.insert(at, 0),
                Fault::Join => out.retain(|byte| *byte != 0),
                Fault::Burst => {
                    let mut noise = vec![0; self.random.random_range(1..400)];
                    self.random.fill_bytes(&mut noise);
                    noise.append(&mut out);
                    out = noise;
                }
            }
        }
        out.extend(held);
        out
    }
}

/// A link with faults in both directions.
pub struct FaultyLink<L> {
    inner: L,
    to_controller: Breaker,
    to_host: Breaker,
    pending: VecDeque<u8>,
}

impl<L: Link> FaultyLink<L> {
    /// Breaks `share` of the pieces that pass, each way.
    pub fn new(inner: L, seed: u64, share: f64) -> Self {
        let (to_controller, to_host) = (Breaker::new(seed, share), Breaker::new(!seed, share));
        Self { inner, to_controller, to_host, pending: VecDeque::new() }
    }

    /// Pieces that passed, and those that were broken.
    pub fn counts(&self) -> (u64, u64) {
        let [a, b] = [&self.to_controller, &self.to_host];
        (a.pieces + b.pieces, a.broken + b.broken)
    }
}

impl<L: Link> Link for FaultyLink<L> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let broken = self.to_controller.pass(bytes);
        self.inner.send(&broken)
    }

    fn receive(&mut self, buffer: &mut [u8], until: Duration) -> io::Result<usize> {
        while self.pending.is_empty() {
            let mut piece = [0; 4096];
            let count = self.inner.receive(&mut piece, until)?;
            if count == 0 {
                return Ok(0);
            }
            let broken = self.to_host.pass(&piece[..count]);
            self.pending.extend(broken);
        }
        let count = buffer.len().min(self.pending.len());
        for (to, from) in buffer.iter_mut().zip(self.pending.drain(..count)) {
            *to = from;
        }
        Ok(count)
    }

    fn now(&self) -> Duration {
        self.inner.now()
    }
}
