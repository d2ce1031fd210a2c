//! Whether the host is still there. A run outlives its host by one segment at most: if nothing was heard for a while,
//! the segment in hand finishes and nothing else starts.
use giotto_shared::wire::{MotionState, SUPERVISE_MS};

/// When the host was heard, and how long it may be silent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Supervision {
    tick_hz: u32,
    /// Ticks of silence allowed; 0: any.
    allowed: u32,
    heard_at: u32,
    /// The silence under way has been dealt with.
    dead: bool,
    losses: u32,
}

impl Supervision {
    pub(super) const fn new(tick_hz: u32) -> Self {
        let mut new = Self {
            tick_hz,
            allowed: 0,
            heard_at: 0,
            dead: false,
            losses: 0,
        };
        new.set(SUPERVISE_MS);
        new
    }

    pub(super) const fn set(&mut self, after_ms: u16) {
        self.allowed = (self.tick_hz as u64 * after_ms as u64 / 1000) as u32;
    }

    pub(super) const fn losses(&self) -> u32 {
        self.losses
    }

    /// A request came at this tick.
    pub(super) const fn heard(&mut self, tick: u32) {
        self.heard_at = tick;
        self.dead = false;
    }

    /// Whether the host has been silent for too long, and that has not been dealt with.
    #[inline]
    pub(super) const fn silent(&self, now: u32) -> bool {
        !self.dead && self.allowed > 0 && now.wrapping_sub(self.heard_at) >= self.allowed
    }

    /// Whether the link has died, now that the host has been silent: only what runs can be left alone.
    pub(super) const fn dead(&mut self, state: MotionState) -> bool {
        if !matches!(state, MotionState::Running) {
            return false;
        }
        self.dead = true;
        self.losses = self.losses.wrapping_add(1);
        true
    }
}
