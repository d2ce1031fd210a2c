//! Words that one side writes while the other reads: those of one tick, or none.
//!
//! The writer says which tick's words follow, writes them, and says that they are there. A reader that finds both numbers equal, the second
//! one read first, has the words of that tick alone. The fences make it so on a core that reorders: without them the words may be
//! seen before the number that announces them. `tests/marks.rs` tries every order that the memory model allows.
use core::sync::atomic::Ordering::{self, Acquire, Relaxed, Release};
use core::sync::atomic::{AtomicU8, AtomicU32};

/// A number that both sides see: an atomic of the machine, or one of a model.
pub trait Mark {
    /// Reads it.
    fn load(&self, order: Ordering) -> u32;
    /// Writes it, as many bits as it has.
    fn store(&self, value: u32, order: Ordering);
    /// A fence between it and its neighbours.
    fn fence(order: Ordering);
}

impl Mark for AtomicU32 {
    fn load(&self, order: Ordering) -> u32 {
        self.load(order)
    }

    fn store(&self, value: u32, order: Ordering) {
        self.store(value, order);
    }

    fn fence(order: Ordering) {
        core::sync::atomic::fence(order);
    }
}

impl Mark for AtomicU8 {
    fn load(&self, order: Ordering) -> u32 {
        u32::from(self.load(order))
    }

    fn store(&self, value: u32, order: Ordering) {
        self.store(value as u8, order);
    }

    fn fence(order: Ordering) {
        core::sync::atomic::fence(order);
    }
}

/// Writes the words of a tick.
#[inline]
pub fn write<M: Mark>(begun: &M, ended: &M, tick: u32, words: impl FnOnce()) {
    begun.store(tick, Relaxed);
    M::fence(Release);
    words();
    ended.store(tick, Release);
}

/// The words of a tick and its number; `None`: a tick came between.
#[inline]
pub fn read<M: Mark, T>(begun: &M, ended: &M, words: impl FnOnce() -> T) -> Option<(u32, T)> {
    let tick = ended.load(Acquire);
    let words = words();
    M::fence(Acquire);
    (begun.load(Relaxed) == tick).then_some((tick, words))
}

/// Looks at an offer if there is one that was not looked at: what was written before it was made is seen, and whoever sees
/// that it was taken may write again.
#[inline]
pub fn take<M: Mark, N: Mark>(offered: &M, taken: &N, look: impl FnOnce() -> bool) {
    let offer = offered.load(Acquire);
    if offer != taken.load(Relaxed) && look() {
        taken.store(offer, Release);
    }
}
