//! Who has to be alive for the watchdog to be fed: the background and the tick, both.
use core::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// Raised by each tick, lowered by the background when it feeds the watchdog. A tick that no longer comes starves the watchdog
/// as surely as a background that hangs.
#[derive(Debug, Default)]
pub struct Alive(AtomicBool);

impl Alive {
    /// Before the first tick.
    pub const fn new() -> Self {
        Self(AtomicBool::new(false))
    }

    /// In each tick.
    #[inline]
    pub fn ticked(&self) {
        self.0.store(true, Relaxed);
    }

    /// In each round of the background: feeds the watchdog if there has been a tick since it was fed last.
    pub fn feed(&self, feed: impl FnOnce()) {
        if self.0.swap(false, Relaxed) {
            feed();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::Cell;

    #[test]
    fn neither_tick_nor_background_alone_feed_the_watchdog() {
        let (alive, fed) = (Alive::new(), Cell::new(0));
        let round = || alive.feed(|| fed.set(fed.get() + 1));
        for _ in 0..1000 {
            round();
        }
        assert_eq!(fed.get(), 0, "a background without a tick");
        for _ in 0..1000 {
            alive.ticked();
        }
        assert_eq!(fed.get(), 0, "ticks without a background");
        for _ in 0..10 {
            alive.ticked();
            round();
            round();
        }
        assert_eq!(fed.get(), 10);
    }
}
